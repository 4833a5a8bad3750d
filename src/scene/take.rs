//! How much of a list a recipe uses.

use serde::{Deserialize, Serialize};

/// All of a list, or its first entries; in files `"all"` or a number above 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "TakeInFile", into = "TakeInFile")]
pub enum Take {
    /// All of it.
    #[default]
    All,
    /// This many from the start, or all if there are fewer; at least one.
    First(usize),
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected \"all\" or a number above 0")]
enum TakeInFile {
    Word(String),
    Number(usize),
}

impl TryFrom<TakeInFile> for Take {
    type Error = String;

    fn try_from(written: TakeInFile) -> Result<Self, String> {
        match written {
            TakeInFile::Word(word) if word == "all" => Ok(Self::All),
            TakeInFile::Word(word) => {
                Err(format!("\"{word}\", expected \"all\" or a number above 0"))
            }
            TakeInFile::Number(0) => Err("0, expected \"all\" or a number above 0".into()),
            TakeInFile::Number(n) => Ok(Self::First(n)),
        }
    }
}

impl From<Take> for TakeInFile {
    fn from(limit: Take) -> Self {
        match limit {
            Take::All => Self::Word("all".into()),
            Take::First(n) => Self::Number(n),
        }
    }
}

impl Take {
    /// The part of a list that is used; empty only for an empty list.
    pub fn slice_of<T>(self, list: &[T]) -> &[T] {
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
            (Take::All.slice_of(&list), Take::First(2).slice_of(&list)),
            (&list[..], &list[..2])
        );
        assert_eq!(
            (
                Take::First(9).slice_of(&list),
                Take::First(0).slice_of(&list)
            ),
            (&list[..], &list[..1])
        );
        assert!(Take::First(1).slice_of(&list[..0]).is_empty());
    }

    #[test]
    fn a_file_says_all_or_a_number() {
        let read = |text: &str| serde_json::from_str::<Take>(text);
        assert_eq!(
            (read("\"all\"").unwrap(), read("3").unwrap()),
            (Take::All, Take::First(3))
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
            serde_json::to_string(&[Take::All, Take::First(2)]).unwrap(),
            "[\"all\",2]"
        );
    }
}
