//! Valid documents and command lines with values changed to what is huge, negative, no number or of
//! another kind.

use petcomp::scene::Draws;
use serde_json::Value;

/// Which choices were made, told by a number: a pure function of door and draw.
pub(crate) struct Chance {
    draws: Draws<'static>,
    made: u64,
}

impl Chance {
    pub(crate) fn new(door: &str, draw: u64) -> Self {
        // The door's name is the seed, so that doors do not share their draws.
        let seed = door.bytes().fold(7_u64, |sum, byte| {
            sum.wrapping_mul(31).wrapping_add(byte.into())
        });
        Self {
            draws: Draws::new(seed, draw),
            made: 0,
        }
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.made += 1;
        self.draws.below(&self.made.to_string(), n)
    }

    pub(crate) fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }
}

/// What a number or a word is changed to, as it stands in a file.
pub(crate) const AWKWARD: &[&str] = &[
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "0.5",
    "1000",
    "255",
    "256",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "1000000000000",
    "9007199254740991",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "1e-300",
    "1e-20",
    "1e38",
    "1e39",
    "1e300",
    "-1e300",
    "1e308",
    "1e999",
    "nan",
    "-nan",
    "inf",
    "-inf",
    "NaN",
    "null",
    "true",
    "\"\"",
    "\"x\"",
    "\"../../x\"",
    "\"/dev/zero\"",
    "\"\\u0000\"",
    "\"1e308\"",
    "[]",
    "{}",
    "[0, 9007199254740991]",
    "[1e308, -1e308]",
    "[-1e308, 1e308]",
    "[nan, nan]",
    "[1, 2, 3, 4, 5]",
    "[[[[[[[[1]]]]]]]]",
];

/// A place in a document that is to hold a text which no writer of documents would write.
const MARK: &str = "@mark@";

/// A document with one to three of its values changed, as `written` puts it down.
pub(crate) fn document(
    valid: &Value,
    chance: &mut Chance,
    written: impl Fn(&Value) -> String,
) -> String {
    let mut value = valid.clone();
    let mut words = Vec::new();
    for _ in 0..=chance.below(3) {
        // What is to become such a text already is left alone: changed again it could not be found.
        let is_free = |at: &String| {
            !value
                .pointer(at)
                .and_then(Value::as_str)
                .is_some_and(|text| text.starts_with(MARK))
        };
        let all: Vec<String> = places(&value).into_iter().filter(is_free).collect();
        if all.is_empty() {
            break;
        }
        let place = chance.pick(&all).clone();
        change(&mut value, &place, chance, &mut words);
    }
    words
        .iter()
        .enumerate()
        .fold(written(&value), |text, (i, word)| {
            text.replace(&format!("\"{MARK}{i}{MARK}\""), word)
        })
}

/// Pointers to every value of a document; of the numbers in long lists only the first ones.
fn places(value: &Value) -> Vec<String> {
    const SAME: usize = 6;
    let mut found = Vec::new();
    let mut open = vec![(String::new(), value)];
    while let Some((at, value)) = open.pop() {
        match value {
            Value::Array(list) => {
                open.extend(
                    list.iter()
                        .take(SAME)
                        .enumerate()
                        .map(|(i, v)| (format!("{at}/{i}"), v)),
                );
            }
            Value::Object(map) => {
                let escaped = |key: &String| key.replace('~', "~0").replace('/', "~1");
                open.extend(
                    map.iter()
                        .map(|(key, v)| (format!("{at}/{}", escaped(key)), v)),
                );
            }
            _ => {}
        }
        found.push(at);
    }
    found
}

fn change(document: &mut Value, place: &str, chance: &mut Chance, words: &mut Vec<&'static str>) {
    let kind = chance.below(10);
    let Some(value) = document.pointer_mut(place) else {
        return;
    };
    match (kind, &mut *value) {
        (0, Value::Array(list)) => {
            let copies = list
                .first()
                .cloned()
                .map_or(0, |_| *chance.pick(&[2, 1_000, 20_000]));
            let first = list.first().cloned().unwrap_or_default();
            // Not a document of a gigabyte.
            let copies = if first.to_string().len() > 1_000 {
                copies.min(50)
            } else {
                copies
            };
            list.extend(std::iter::repeat_n(first, copies));
        }
        (1, Value::Array(list)) => drop(list.pop()),
        (0, Value::Object(map)) => {
            map.insert("unheard_of".into(), 1.into());
        }
        (1 | 2, Value::Object(map)) => {
            let keys: Vec<String> = map.keys().cloned().collect();
            if !keys.is_empty() {
                map.remove(chance.pick(&keys));
            }
        }
        (3, value) => {
            for _ in 0..*chance.pick(&[3, 70, 200]) {
                *value = Value::Array(vec![value.take()]);
            }
        }
        (4, Value::String(text)) => *text = text.repeat(*chance.pick(&[2, 100, 10_000])),
        // Small numbers near what stands there are more often possible, and go deeper.
        (5 | 6, Value::Number(number)) => {
            let factor = *chance.pick(&[
                -1.0, 0.0, 1e-6, 1e-3, 0.1, 0.9, 1.1, 2.0, 10.0, 1e3, 1e6, 1e9,
            ]);
            let near = number.as_f64().unwrap_or_default() * factor;
            *value = if number.is_f64() {
                near.into()
            } else {
                (near as i64).into()
            };
        }
        (_, value) => {
            *value = format!("{MARK}{}{MARK}", words.len()).into();
            words.push(*chance.pick(AWKWARD));
        }
    }
}

/// A text with one to three of its words changed, doubled or taken away; words are what stands
/// between separators.
pub(crate) fn text(valid: &str, chance: &mut Chance) -> String {
    let mut text = valid.to_owned();
    for _ in 0..=chance.below(3) {
        let words: Vec<(usize, &str)> = words(&text);
        if words.is_empty() {
            break;
        }
        let &(start, word) = chance.pick(&words);
        let end = start + word.len();
        let new = match chance.below(8) {
            0 => String::new(),
            1 => word.repeat(*chance.pick(&[2, 1_000])),
            2 => format!("{word}\n{word}"),
            _ => chance.pick(AWKWARD).trim_matches('"').to_owned(),
        };
        text.replace_range(start..end, &new);
    }
    text
}

/// The words of a text and where they begin.
fn words(text: &str) -> Vec<(usize, &str)> {
    let parts = text.split(|c: char| c.is_whitespace() || ",;:[]{}\"".contains(c));
    let place = |part: &str| part.as_ptr() as usize - text.as_ptr() as usize;
    parts
        .filter(|part| !part.is_empty())
        .map(|part| (place(part), part))
        .collect()
}

pub(crate) fn json(value: &Value) -> String {
    value.to_string()
}

pub(crate) fn toml(value: &Value) -> String {
    // TOML has no null: what is not there.
    toml::to_string(&without_nulls(value)).unwrap_or_default()
}

fn without_nulls(value: &Value) -> Value {
    match value {
        Value::Object(map) => {
            let kept = map.iter().filter(|(_, v)| !v.is_null());
            Value::Object(
                kept.map(|(key, v)| (key.clone(), without_nulls(v)))
                    .collect(),
            )
        }
        Value::Array(list) => Value::Array(
            list.iter()
                .filter(|v| !v.is_null())
                .map(without_nulls)
                .collect(),
        ),
        other => other.clone(),
    }
}

#[test]
fn changes_are_told_by_their_number_and_differ() {
    let valid = serde_json::json!({ "a": [1, 2.5, { "b": "text" }], "c": true });
    let changed = |draw| document(&valid, &mut Chance::new("door", draw), json);
    let all: std::collections::BTreeSet<String> = (0..300).map(changed).collect();
    assert!(
        all.len() > 200 && changed(17) == changed(17),
        "{}",
        all.len()
    );
    // A text made of a whole list may hold one.
    assert!(all.iter().filter(|text| text.contains(MARK)).count() < 10);
    assert!(
        all.iter().any(|text| text.contains("18446744073709551616"))
            && all.iter().any(|t| t.contains("nan"))
    );
    let texts: std::collections::BTreeSet<String> = (0..100)
        .map(|draw| text("0 0.5 0.5 0.1 0.1\n", &mut Chance::new("door", draw)))
        .collect();
    assert!(texts.len() > 70);
}
