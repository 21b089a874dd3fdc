//! Writes values into TOML text, whose comments and order stay.

use glam::DVec3;
use nephroid::glam;
use toml_edit::{Item, TableLike, Value};

/// Significant digits of numbers in the file.
const DIGITS: i32 = 9;

/// Writes the keys of a table that changed.
pub struct Writer<'a> {
    pub owner: String,
    pub table: &'a mut dyn TableLike,
    pub notes: &'a mut Vec<String>,
}

impl Writer<'_> {
    pub fn number(&mut self, key: &str, before: f64, now: f64) {
        if before != now && self.may_set(key) {
            set(self.table, key, rounded(now).into());
        }
    }

    pub fn triple(&mut self, key: &str, before: DVec3, now: DVec3) {
        if before != now && self.may_set(key) {
            set(self.table, key, triple(now));
        }
    }

    /// A key that keyframes have is not in the table.
    fn may_set(&mut self, key: &str) -> bool {
        let keyframes = self
            .table
            .get("keyframes")
            .and_then(Item::as_value)
            .and_then(Value::as_array);
        let in_values = keyframes.is_some_and(|list| {
            list.iter().any(|frame| {
                frame
                    .as_inline_table()
                    .is_some_and(|frame| frame.contains_key(key))
            })
        });
        let tables = self
            .table
            .get("keyframes")
            .and_then(Item::as_array_of_tables);
        let in_tables = tables.is_some_and(|list| list.iter().any(|frame| frame.contains_key(key)));
        if in_values || in_tables {
            self.notes.push(format!(
                "{key} of {} is not saved: it has keyframes",
                self.owner
            ));
        }
        !in_values && !in_tables
    }
}

/// Sets a key; the spaces and the comment around an old value stay.
pub fn set(table: &mut dyn TableLike, key: &str, mut value: Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
}

pub fn triple(v: DVec3) -> Value {
    Value::Array(v.to_array().map(rounded).into_iter().collect())
}

/// To a number of significant digits: angles and rotated edges are not longer than what was typed.
pub fn rounded(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return 0.0;
    }
    let scale = 10f64.powi(DIGITS - 1 - x.abs().log10().floor() as i32);
    let rounded = (x * scale).round() / scale;
    if rounded.is_finite() { rounded } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_short() {
        assert_eq!(rounded(0.1 + 0.2), 0.3);
        assert_eq!(rounded(-123456.789), -123456.789);
        assert_eq!(rounded(0.0), 0.0);
    }
}
