//! What a document may not hold, whoever reads it: a key twice, and numbers that are none.

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::collections::HashSet;
use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// Takes a JSON document in and refuses an object with a key twice: most readers keep the last of them in silence.
pub(super) fn unique_keys(text: &str) -> serde_json::Result<()> {
    let mut document = serde_json::Deserializer::from_str(text);
    Unique.deserialize(&mut document)
}

#[derive(Clone, Copy)]
struct Unique;

impl<'de> DeserializeSeed<'de> for Unique {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        value.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Unique {
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
        while list.next_element_seed(self)?.is_some() {}
        Ok(())
    }
    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<(), A::Error> {
        let mut keys = HashSet::new();
        while let Some(key) = object.next_key::<String>()? {
            object.next_value_seed(self)?;
            if !keys.insert(key.clone()) {
                return Err(A::Error::custom(format!("key \"{key}\" twice")));
            }
        }
        Ok(())
    }
}

/// Where a TOML document has a number that is infinite or none at all, and which; JSON has no such numbers.
pub(super) fn endless_number(text: &str) -> Option<(String, Range<usize>)> {
    let document = DeTable::parse(text).ok()?;
    document.get_ref().values().find_map(|value| endless(value.get_ref(), value.span()))
}

fn endless(value: &DeValue<'_>, span: Range<usize>) -> Option<(String, Range<usize>)> {
    match value {
        DeValue::Float(number) => {
            let finite = number.as_str().replace('_', "").parse().is_ok_and(f64::is_finite);
            (!finite).then(|| (number.as_str().to_owned(), span))
        }
        DeValue::Array(list) => list.iter().find_map(|value| endless(value.get_ref(), value.span())),
        DeValue::Table(table) => table.values().find_map(|value| endless(value.get_ref(), value.span())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_twice_is_named_with_its_line() {
        let e = unique_keys("{\"a\": [{\"b\": 1,\n \"b\": 2}]}").unwrap_err();
        assert!(e.to_string().contains("key \"b\" twice") && e.line() == 2, "{e}");
        assert!(unique_keys(r#"{"a": {"b": 1.5, "c": null}, "b": [true, "a", -1]}"#).is_ok());
    }

    #[test]
    fn numbers_that_are_none_are_found() {
        let found = |text| endless_number(text).map(|(number, _)| number);
        assert_eq!(found("a = 1.5\nb = [1, { c = -inf }]").as_deref(), Some("-inf"));
        assert_eq!(found("[a.b]\nc = nan").as_deref(), Some("nan"));
        assert_eq!(found("a = 1e999").as_deref(), Some("1e999"));
        assert_eq!(found("a = 1_000.5\nb = \"inf\"\ninf = 3"), None);
    }
}
