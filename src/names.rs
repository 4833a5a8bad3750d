//! Values with names, looked up in one table in both directions.

/// The value with a name; none if there is none.
pub(crate) fn by_name<T: Copy>(all: &[(&'static str, T)], name: &str) -> Option<T> {
    let known = all.iter().find(|(known, _)| *known == name);
    known.map(|&(_, value)| value)
}

/// The name of a value; empty if the table lacks it.
pub(crate) fn name_of<T: PartialEq>(all: &[(&'static str, T)], value: &T) -> &'static str {
    let named = all.iter().find(|(_, known)| known == value);
    named.map_or("", |(name, _)| name)
}
