//! The table `[labels]` in files: one rule, of which each variant has a key of its own.

use crate::dataset::{Coco, Format, LabelConfig, Layers, Mot, Obstructed, Voc, WebDataset, Yolo};
use crate::label::{AmodalBox, LabelOptions, OutlineKind, RuleInFile};
use serde::{Deserialize, Serialize};

/// A [`LabelConfig`] with the keys of a file.
#[derive(Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct LabelTable {
    obstructed: Obstructed,
    #[serde(skip_serializing_if = "Option::is_none")]
    overlap_iou: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    min_visible: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_truncation: Option<f64>,
    alpha_threshold: f32,
    amodal: AmodalBox,
    #[serde(skip_serializing_if = "OutlineKind::is_hull")]
    outline: OutlineKind,
    simplify: f64,
    formats: Vec<Format>,
    yolo: Yolo,
    coco: Coco,
    voc: Voc,
    #[serde(skip_serializing_if = "has_no_settings")]
    mot: Mot,
    webdataset: WebDataset,
    layers: Layers,
}

/// Values that are the default are not written: datasets made before stay the same.
fn has_no_settings(mot: &Mot) -> bool {
    *mot == Mot::default()
}

impl Default for LabelTable {
    /// Without a rule: a file that gives the key of one does not give the other.
    fn default() -> Self {
        Self {
            overlap_iou: None,
            min_visible: None,
            ..LabelConfig::default().into()
        }
    }
}

impl From<LabelConfig> for LabelTable {
    fn from(config: LabelConfig) -> Self {
        let LabelOptions {
            amodal,
            outline,
            alpha_threshold,
            max_truncation,
            obstruction,
        } = config.options;
        let rule = RuleInFile::from(obstruction);
        Self {
            obstructed: config.obstructed,
            overlap_iou: rule.overlap_iou,
            min_visible: rule.min_visible,
            max_truncation,
            alpha_threshold,
            amodal,
            outline,
            simplify: config.simplify,
            formats: config.formats,
            yolo: config.yolo,
            coco: config.coco,
            voc: config.voc,
            mot: config.mot,
            webdataset: config.webdataset,
            layers: config.layers,
        }
    }
}

impl TryFrom<LabelTable> for LabelConfig {
    type Error = String;

    fn try_from(table: LabelTable) -> Result<Self, String> {
        let rule = RuleInFile {
            overlap_iou: table.overlap_iou,
            min_visible: table.min_visible,
        };
        Ok(Self {
            obstructed: table.obstructed,
            options: LabelOptions {
                amodal: table.amodal,
                outline: table.outline,
                alpha_threshold: table.alpha_threshold,
                max_truncation: table.max_truncation,
                obstruction: rule.try_into()?,
            },
            simplify: table.simplify,
            formats: table.formats,
            yolo: table.yolo,
            coco: table.coco,
            voc: table.voc,
            mot: table.mot,
            webdataset: table.webdataset,
            layers: table.layers,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::DatasetConfig;
    use crate::io;
    use crate::label::ObstructionRule;

    fn written(config: &LabelConfig) -> String {
        toml::to_string(config).unwrap()
    }

    #[test]
    fn a_table_without_a_rule_is_written_as_before_there_were_two() {
        let config: LabelConfig = toml::from_str("").unwrap();
        assert_eq!(config, LabelConfig::default());
        let begin = "obstructed = \"drop\"\noverlap_iou = 0.0\nalpha_threshold = 0.1\namodal = ";
        assert!(written(&config).starts_with(begin), "{}", written(&config));
        assert!(!written(&config).contains("min_visible"));
    }

    #[test]
    fn a_least_visible_share_is_written_without_an_overlap() {
        let config: LabelConfig = toml::from_str("min_visible = 0.97").unwrap();
        let rule = ObstructionRule::Visibility { min_visible: 0.97 };
        assert_eq!(
            (config.options.obstruction, config.check().is_ok()),
            (rule, true)
        );
        assert!(!written(&config).contains("overlap_iou"));
        assert_eq!(
            toml::from_str::<LabelConfig>(&written(&config)).unwrap(),
            config
        );
    }

    fn error_of(labels: &str, overrides: &[io::Override]) -> String {
        let recipe = format!("[labels]\n{labels}\n");
        let read = DatasetConfig::parse(&recipe, "recipe.toml".as_ref(), overrides);
        read.unwrap_err().to_string()
    }

    #[test]
    fn both_rules_at_once_are_refused_by_name_even_at_the_default() {
        let both = "labels: both overlap_iou and min_visible are given, expected one of them";
        let told = error_of("overlap_iou = 0\nmin_visible = 0.97", &[]);
        assert!(told.contains(both), "{told}");
        let override_ = "labels.min_visible=0.97".parse().unwrap();
        let told = error_of("overlap_iou = 0.1", &[override_]);
        assert!(told.contains(both), "{told}");
    }

    #[test]
    fn a_misspelt_rule_is_answered_with_the_right_one() {
        let told = error_of("min_visibel = 0.97", &[]);
        assert!(told.contains("did you mean \"min_visible\"?"), "{told}");
    }
}
