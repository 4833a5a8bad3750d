//! One setting for how much work goes into everything that is approximate.

use serde::{Deserialize, Serialize};

/// How much work every approximate stage does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quality {
    /// For previews: right in which objects there are and where, rough in shadows and edges.
    Draft,
    /// For training pictures: every stage's default.
    #[default]
    Normal,
    /// For comparisons: as close to each stage's definition as possible, at tens of times the work.
    Reference,
}

impl Quality {
    /// All of them, the quickest first.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Normal, Self::Reference];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Normal => "normal",
            Self::Reference => "reference",
        }
    }

    /// Selects one of three values, given for draft, normal and reference.
    pub(crate) fn of<T>(self, [draft, normal, reference]: [T; 3]) -> T {
        match self {
            Self::Draft => draft,
            Self::Normal => normal,
            Self::Reference => reference,
        }
    }
}
