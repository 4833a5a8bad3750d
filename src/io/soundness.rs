//! What a document may not hold, whoever reads it: a key twice, numbers that are none, and nesting without end.

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::collections::HashSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Takes a JSON document in and refuses an object with a key twice (most readers keep the last of them in silence) and
/// what is nested deeper than so many levels.
pub(super) fn sound_json(text: &str, deepest: u64) -> serde_json::Result<()> {
    let mut document = serde_json::Deserializer::from_str(text);
    Sound {
        levels: deepest,
        deepest,
    }
    .deserialize(&mut document)
}

/// What is wrong with a document that is nested too deeply.
fn too_deep(deepest: u64) -> String {
    format!(
        "nested deeper than {deepest} levels (Limits::document_depth; --limit document_depth=N)"
    )
}

/// A value that may be nested by so many levels more.
#[derive(Clone, Copy)]
struct Sound {
    levels: u64,
    deepest: u64,
}

impl Sound {
    fn deeper<E: Error>(self) -> Result<Self, E> {
        let levels = self
            .levels
            .checked_sub(1)
            .ok_or_else(|| E::custom(too_deep(self.deepest)))?;
        Ok(Self { levels, ..self })
    }
}

impl<'de> DeserializeSeed<'de> for Sound {
    type Value = ();
    fn deserialize<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        value.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Sound {
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
            if !keys.insert(key.clone()) {
                return Err(A::Error::custom(format!("key \"{key}\" twice")));
            }
        }
        Ok(())
    }
}

/// What a TOML document holds that JSON cannot say, and where: a number that is infinite or none at all; or nesting deeper
/// than so many levels.
pub(super) fn unsound_toml(
    document: &Spanned<DeTable<'_>>,
    deepest: u64,
) -> Option<(String, Range<usize>)> {
    unsound_table(
        document.get_ref(),
        document.span(),
        deepest.checked_sub(1),
        deepest,
    )
}

/// `levels` more may be nested in it; none where it is too deep itself.
fn unsound(
    value: &DeValue<'_>,
    span: Range<usize>,
    levels: Option<u64>,
    deepest: u64,
) -> Option<(String, Range<usize>)> {
    let deeper = || levels.and_then(|n| n.checked_sub(1));
    match value {
        DeValue::Float(number) => {
            let finite = number
                .as_str()
                .replace('_', "")
                .parse()
                .is_ok_and(f64::is_finite);
            (!finite).then(|| {
                (
                    format!("{}, expected a finite number", number.as_str()),
                    span,
                )
            })
        }
        DeValue::Array(_) if deeper().is_none() => Some((too_deep(deepest), span)),
        DeValue::Array(list) => list
            .iter()
            .find_map(|v| unsound(v.get_ref(), v.span(), deeper(), deepest)),
        DeValue::Table(table) => unsound_table(table, span, deeper(), deepest),
        _ => None,
    }
}

fn unsound_table(
    table: &DeTable<'_>,
    span: Range<usize>,
    levels: Option<u64>,
    deepest: u64,
) -> Option<(String, Range<usize>)> {
    if levels.is_none() {
        return Some((too_deep(deepest), span));
    }
    table
        .values()
        .find_map(|value| unsound(value.get_ref(), value.span(), levels, deepest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_twice_is_named_with_its_line() {
        let e = sound_json("{\"a\": [{\"b\": 1,\n \"b\": 2}]}", 9).unwrap_err();
        assert!(
            e.to_string().contains("key \"b\" twice") && e.line() == 2,
            "{e}"
        );
        assert!(sound_json(r#"{"a": {"b": 1.5, "c": null}, "b": [true, "a", -1]}"#, 9).is_ok());
    }

    fn found(text: &str, deepest: u64) -> Option<String> {
        unsound_toml(&DeTable::parse(text).unwrap(), deepest).map(|(what, _)| what)
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
                sound_json(json, 3).is_ok() && found(toml, 3).is_none(),
                "{toml}"
            );
            let told =
                "nested deeper than 2 levels (Limits::document_depth; --limit document_depth=N)";
            assert!(
                sound_json(json, 2)
                    .unwrap_err()
                    .to_string()
                    .starts_with(told)
            );
            assert_eq!(found(toml, 2).as_deref(), Some(told));
        }
    }
}
