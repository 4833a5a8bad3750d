//! How much of a list a recipe uses.

use serde::{Deserialize, Serialize};

/// All of a list, or the first so many; in files `"all"` or a number above 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "LimitInFile", into = "LimitInFile")]
pub enum Limit {
    /// All of it.
    #[default]
    All,
    /// The first so many, or all where there are fewer; at least one.
    First(usize),
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"all\" or a number above 0")]
enum LimitInFile {
    Word(String),
    Number(usize),
}

impl TryFrom<LimitInFile> for Limit {
    type Error = String;

    fn try_from(written: LimitInFile) -> Result<Self, String> {
        match written {
            LimitInFile::Word(word) if word == "all" => Ok(Self::All),
            LimitInFile::Word(word) => {
                Err(format!("\"{word}\", expected \"all\" or a number above 0"))
            }
            LimitInFile::Number(0) => Err("0, expected \"all\" or a number above 0".into()),
            LimitInFile::Number(n) => Ok(Self::First(n)),
        }
    }
}

impl From<Limit> for LimitInFile {
    fn from(limit: Limit) -> Self {
        match limit {
            Limit::All => Self::Word("all".into()),
            Limit::First(n) => Self::Number(n),
        }
    }
}

impl Limit {
    /// The part of a list that is used; nothing only of an empty list.
    pub fn of<T>(self, list: &[T]) -> &[T] {
        match self {
            Self::All => list,
            Self::First(n) => &list[..n.max(1).min(list.len())],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_the_start_of_a_list() {
        let list = [1, 2, 3];
        assert_eq!(
            (Limit::All.of(&list), Limit::First(2).of(&list)),
            (&list[..], &list[..2])
        );
        assert_eq!(
            (Limit::First(9).of(&list), Limit::First(0).of(&list)),
            (&list[..], &list[..1])
        );
        assert!(Limit::First(1).of(&list[..0]).is_empty());
    }

    #[test]
    fn a_file_says_all_or_a_number() {
        let read = |text: &str| serde_json::from_str::<Limit>(text);
        assert_eq!(
            (read("\"all\"").unwrap(), read("3").unwrap()),
            (Limit::All, Limit::First(3))
        );
        for wrong in ["0", "\"some\"", "-1"] {
            assert!(
                read(wrong)
                    .unwrap_err()
                    .to_string()
                    .contains("expected \"all\" or a number above 0")
            );
        }
        assert_eq!(
            serde_json::to_string(&[Limit::All, Limit::First(2)]).unwrap(),
            "[\"all\",2]"
        );
    }
}
