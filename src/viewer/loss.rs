//! What a script takes away from the window, for tests.

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    Surface,
    Device,
}
