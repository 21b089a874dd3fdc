pub mod cells;
pub mod pairs;
