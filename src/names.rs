//! Values with names, looked up in one table in both directions.

use crate::error::{Error, Result};

/// The value with a name.
///
/// # Errors
/// [`Error::Value`] at `at` for a name that the table lacks.
pub(crate) fn by_name<T: Copy>(at: &str, all: &[(&'static str, T)], name: &str) -> Result<T> {
    let named = all.iter().find(|(known, _)| *known == name);
    named.map(|&(_, value)| value).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|&(known, _)| known).collect();
        let names = names.join(", ");
        Error::value(at, format!("\"{name}\", expected one of {names}"))
    })
}

/// The name of a value; empty if the table lacks it.
pub(crate) fn name_of<T: PartialEq>(all: &[(&'static str, T)], value: &T) -> &'static str {
    let named = all.iter().find(|(_, known)| known == value);
    named.map_or("", |(name, _)| name)
}
