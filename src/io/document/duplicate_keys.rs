//! Checks for what no document may contain: duplicate keys, numbers that are not finite, and
//! excessive nesting.

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::collections::HashSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Parses a JSON document and rejects duplicate keys in an object (most readers silently keep the
/// last one) and nesting deeper than `max_depth` levels.
pub(super) fn check_json(text: &str, max_depth: u64) -> serde_json::Result<()> {
    let mut document = serde_json::Deserializer::from_str(text);
    KeyCheck {
        levels: max_depth,
        max_depth,
    }
    .deserialize(&mut document)
}

/// The message about a document that is nested too deeply.
fn too_deep(max_depth: u64) -> String {
    format!(
        "nested deeper than {max_depth} levels (Limits::document_depth; --limit document_depth=N)"
    )
}

/// A value that may be nested by this many more levels.
#[derive(Clone, Copy)]
struct KeyCheck {
    levels: u64,
    max_depth: u64,
}

impl KeyCheck {
    fn deeper<E: Error>(self) -> Result<Self, E> {
        let levels = self
            .levels
            .checked_sub(1)
            .ok_or_else(|| E::custom(too_deep(self.max_depth)))?;
        Ok(Self { levels, ..self })
    }
}

impl<'de> DeserializeSeed<'de> for KeyCheck {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        value.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for KeyCheck {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("JSON")
    }
    fn visit_bool<E: Error>(self, _: bool) -> Result<(), E> {
        Ok(())
    }
    fn visit_i64<E: Error>(self, _: i64) -> Result<(), E> {
        Ok(())
    }
    fn visit_u64<E: Error>(self, _: u64) -> Result<(), E> {
        Ok(())
    }
    fn visit_f64<E: Error>(self, _: f64) -> Result<(), E> {
        Ok(())
    }
    fn visit_str<E: Error>(self, _: &str) -> Result<(), E> {
        Ok(())
    }
    fn visit_unit<E: Error>(self) -> Result<(), E> {
        Ok(())
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        let inside = self.deeper()?;
        while list.next_element_seed(inside)?.is_some() {}
        Ok(())
    }
    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<(), A::Error> {
        let (inside, mut keys) = (self.deeper()?, HashSet::new());
        while let Some(key) = object.next_key::<String>()? {
            object.next_value_seed(inside)?;
            if let Some(twice) = keys.replace(key) {
                return Err(A::Error::custom(format!("duplicate key \"{twice}\"")));
            }
        }
        Ok(())
    }
}

/// Finds what a TOML document contains that JSON cannot express, and where: a number that is
/// infinite or NaN; or nesting deeper than `max_depth` levels.
pub(super) fn find_invalid_toml(
    document: &Spanned<DeTable<'_>>,
    max_depth: u64,
) -> Option<(String, Range<usize>)> {
    find_in_table(
        document.get_ref(),
        document.span(),
        max_depth.checked_sub(1),
        max_depth,
    )
}

/// `levels` more may be nested in it; none if it is too deep itself.
fn find_in_value(
    value: &DeValue<'_>,
    span: Range<usize>,
    levels: Option<u64>,
    max_depth: u64,
) -> Option<(String, Range<usize>)> {
    let deeper = levels.and_then(|n| n.checked_sub(1));
    match value {
        DeValue::Float(number) => Some((finite_problem(number.as_str())?, span)),
        DeValue::Array(_) if deeper.is_none() => Some((too_deep(max_depth), span)),
        DeValue::Array(list) => list
            .iter()
            .find_map(|v| find_in_value(v.get_ref(), v.span(), deeper, max_depth)),
        DeValue::Table(table) => find_in_table(table, span, deeper, max_depth),
        _ => None,
    }
}

/// The message about a number that is not finite.
fn finite_problem(number: &str) -> Option<String> {
    let is_finite = number.replace('_', "").parse().is_ok_and(f64::is_finite);
    (!is_finite).then(|| format!("{number}, expected a finite number"))
}

fn find_in_table(
    table: &DeTable<'_>,
    span: Range<usize>,
    levels: Option<u64>,
    max_depth: u64,
) -> Option<(String, Range<usize>)> {
    if levels.is_none() {
        return Some((too_deep(max_depth), span));
    }
    table
        .values()
        .find_map(|value| find_in_value(value.get_ref(), value.span(), levels, max_depth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_twice_is_named_with_its_line() {
        let e = check_json("{\"a\": [{\"b\": 1,\n \"b\": 2}]}", 9).unwrap_err();
        assert!(
            e.to_string().contains("duplicate key \"b\"") && e.line() == 2,
            "{e}"
        );
        assert!(check_json(r#"{"a": {"b": 1.5, "c": null}, "b": [true, "a", -1]}"#, 9).is_ok());
    }

    fn found(text: &str, max_depth: u64) -> Option<String> {
        find_invalid_toml(&DeTable::parse(text).unwrap(), max_depth).map(|(what, _)| what)
    }

    #[test]
    fn numbers_that_are_none_are_found() {
        let number =
            |text| found(text, 9).map(|what| what.replace(", expected a finite number", ""));
        assert_eq!(
            number("a = 1.5\nb = [1, { c = -inf }]").as_deref(),
            Some("-inf")
        );
        assert_eq!(number("[a.b]\nc = nan").as_deref(), Some("nan"));
        assert_eq!(number("a = 1e999").as_deref(), Some("1e999"));
        assert_eq!(number("a = 1_000.5\nb = \"inf\"\ninf = 3"), None);
    }

    #[test]
    fn levels_are_counted_alike_in_json_and_toml() {
        for (json, toml) in [
            ("{\"a\": [[1]]}", "a = [[1]]"),
            ("{\"a\": {\"b\": [1]}}", "[a]\nb = [1]"),
        ] {
            assert!(
                check_json(json, 3).is_ok() && found(toml, 3).is_none(),
                "{toml}"
            );
            let expected =
                "nested deeper than 2 levels (Limits::document_depth; --limit document_depth=N)";
            assert!(
                check_json(json, 2)
                    .unwrap_err()
                    .to_string()
                    .starts_with(expected)
            );
            assert_eq!(found(toml, 2).as_deref(), Some(expected));
        }
    }
}
