//! When an object is obstructed: one of two rules.

use crate::bounds::Bounds;
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// When an object is obstructed.
///
/// In files it is one of two keys, `overlap_iou` or `min_visible`; both at once are an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RuleInFile", into = "RuleInFile")]
pub enum ObstructionRule {
    /// Another object covers it, however little of it that hides: the paper's rule.
    Overlap {
        /// Outlines are a pair if their intersection over union is above this, 0 to 1.
        overlap_iou: f64,
    },
    /// Others cover more than a share of it.
    Visibility {
        /// Minimum share of its outline that no other object covers, see-through or not, 0 to 1; an
        /// object seen edge-on has the share 0.
        min_visible: f64,
    },
}

/// The keys of a rule; a file has one or none.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct RuleInFile {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) overlap_iou: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) min_visible: Option<f64>,
}

impl Default for ObstructionRule {
    /// Any overlap.
    fn default() -> Self {
        Self::Overlap { overlap_iou: 0.0 }
    }
}

impl ObstructionRule {
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) for a share outside 0 to 1.
    pub(crate) fn check(self) -> Result<()> {
        let share = Bounds::new(0.0, 1.0, "a share");
        match self {
            Self::Overlap { overlap_iou } => share.check("overlap_iou", overlap_iou),
            Self::Visibility { min_visible } => share.check("min_visible", min_visible),
        }
    }

    /// Intersection over union above which outlines are a pair. For visibility any overlap makes a
    /// pair: what covers an object is recorded even if it hides too little to obstruct the object.
    pub(crate) fn pair_iou(self) -> f64 {
        match self {
            Self::Overlap { overlap_iou } => overlap_iou,
            Self::Visibility { .. } => 0.0,
        }
    }

    /// Whether a share of the object decides.
    pub(crate) fn asks_for_share(self) -> bool {
        matches!(self, Self::Visibility { .. })
    }

    /// Whether an object with this uncovered share is obstructed; none if overlaps decide.
    pub(crate) fn is_obstructed(self, uncovered_fraction: f64) -> Option<bool> {
        match self {
            Self::Overlap { .. } => None,
            Self::Visibility { min_visible } => Some(uncovered_fraction < min_visible),
        }
    }
}

impl TryFrom<RuleInFile> for ObstructionRule {
    type Error = String;

    fn try_from(written: RuleInFile) -> std::result::Result<Self, String> {
        match (written.overlap_iou, written.min_visible) {
            (None, None) => Ok(Self::default()),
            (Some(overlap_iou), None) => Ok(Self::Overlap { overlap_iou }),
            (None, Some(min_visible)) => Ok(Self::Visibility { min_visible }),
            (Some(_), Some(_)) => {
                Err("both overlap_iou and min_visible are given, expected one of them".into())
            }
        }
    }
}

impl From<ObstructionRule> for RuleInFile {
    fn from(rule: ObstructionRule) -> Self {
        let (overlap_iou, min_visible) = match rule {
            ObstructionRule::Overlap { overlap_iou } => (Some(overlap_iou), None),
            ObstructionRule::Visibility { min_visible } => (None, Some(min_visible)),
        };
        Self {
            overlap_iou,
            min_visible,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::LabelOptions;

    #[test]
    fn exactly_the_least_share_is_not_obstructed() {
        for percent in 1..=100 {
            let min_visible = format!("{percent}e-2").parse().unwrap();
            let rule = ObstructionRule::Visibility { min_visible };
            let share = f64::from(percent) / 100.0;
            assert_eq!(rule.is_obstructed(share), Some(false), "{rule:?}");
            assert_eq!(
                rule.is_obstructed(share.next_down()),
                Some(true),
                "{rule:?}"
            );
        }
        assert_eq!(ObstructionRule::default().is_obstructed(0.0), None);
    }

    #[test]
    fn options_are_told_by_the_key_of_their_rule_alone() {
        let told = |options: &LabelOptions| serde_json::to_string(options).unwrap();
        let default = r#"{"amodal":"mask","alpha_threshold":0.1,"overlap_iou":0.0}"#;
        assert_eq!(told(&LabelOptions::default()), default);
        let by_visibility = r#"{"amodal":"mask","alpha_threshold":0.1,"min_visible":0.97}"#;
        let read: LabelOptions = serde_json::from_str(by_visibility).unwrap();
        assert_eq!(told(&read), by_visibility);
        let wrong = [
            r#"{"overlap_iou":0.0,"min_visible":0.97}"#,
            r#"{"min_seen":0.97}"#,
        ];
        for text in wrong {
            assert!(
                serde_json::from_str::<LabelOptions>(text).is_err(),
                "{text}"
            );
        }
    }
}
