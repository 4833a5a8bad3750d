//! What happens to obstructed objects.

use crate::dataset::Extent;
use crate::dataset::folder::known_classes;
use crate::error::{Error, Result};
use crate::geom::BBox;
use crate::label::{Labels, ObjectLabel};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Name of the class of [`Obstructed::Class`].
pub(crate) const OBSTRUCTED: &str = "obstructed";

/// What happens to the labels of obstructed objects, those that are not
/// [topmost](ObjectLabel::is_topmost).
///
/// Objects that are [too truncated](ObjectLabel::is_too_truncated) have no label, obstructed or
/// not; under `ignore` they are labelled as objects to be ignored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Obstructed {
    /// They get none, for a detector of what can be picked, as in the paper. A trainer treats them
    /// as background.
    #[default]
    Drop,
    /// They are labelled like the others.
    Keep,
    /// They are labelled as objects to be ignored in formats that support it (COCO `iscrowd`,
    /// Pascal VOC `difficult`): detecting them is neither right nor wrong. YOLO does not; there
    /// they get no label.
    Ignore,
    /// They are labelled as a class of their own, the last: `obstructed`.
    Class,
}

/// An object that gets a label.
#[derive(Clone, Copy, Debug)]
pub struct LabelledObject<'a> {
    /// The object.
    pub object: &'a ObjectLabel,
    /// Class that it is labelled as.
    pub class: u32,
    /// Whether detecting it is neither right nor wrong.
    pub ignored: bool,
}

impl Obstructed {
    /// The classes of the labels, given those of the objects.
    ///
    /// # Errors
    /// A class of the objects that has the name of the class that would be added.
    pub fn classes(self, classes: &[String]) -> Result<Vec<String>> {
        let mut classes = classes.to_vec();
        if self == Self::Class {
            check_is_free(&classes)?;
            classes.push(OBSTRUCTED.into());
        }
        Ok(classes)
    }

    /// The objects that get a label, given `class_count` classes of labels: none without a box in
    /// any of `extents`.
    pub fn labelled<'a>(
        self,
        labels: &'a Labels,
        class_count: usize,
        extents: &[Extent],
    ) -> Vec<LabelledObject<'a>> {
        labels
            .objects
            .iter()
            .filter(|object| extents.iter().any(|extent| extent.has_box(object)))
            .filter_map(|object| self.label(object, class_count))
            .collect()
    }

    fn label(self, object: &ObjectLabel, class_count: usize) -> Option<LabelledObject<'_>> {
        let plain = LabelledObject {
            object,
            class: object.class,
            ignored: false,
        };
        let ignored = LabelledObject {
            ignored: true,
            ..plain
        };
        match self {
            Self::Ignore if object.is_too_truncated() => Some(ignored),
            _ if object.is_too_truncated() => None,
            _ if object.is_topmost() => Some(plain),
            Self::Drop => None,
            Self::Keep => Some(plain),
            Self::Ignore => Some(ignored),
            Self::Class => Some(LabelledObject {
                class: class_count.saturating_sub(1) as u32,
                ..plain
            }),
        }
    }
}

/// How a dataset labels its objects: for readers of its records, in which objects have their own
/// classes and every box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Labelling {
    obstructed: Obstructed,
    class_count: usize,
    extent: Extent,
}

/// Labels every object as its record has it.
impl Default for Labelling {
    fn default() -> Self {
        Self {
            obstructed: Obstructed::Keep,
            class_count: 0,
            extent: Extent::default(),
        }
    }
}

impl Labelling {
    /// As recorded in the identity of a dataset.
    pub(crate) fn of_identity(identity: &Value) -> Self {
        let obstructed = serde_json::from_value(identity["obstructed"].clone());
        Self {
            obstructed: obstructed.unwrap_or(Obstructed::Keep),
            class_count: known_classes(identity).len(),
            extent: extent_of(identity),
        }
    }

    /// Class and box that an object is labelled with; none if it has no label, is to be ignored or
    /// has no such box.
    pub(crate) fn label_of(self, object: &ObjectLabel) -> Option<(u32, BBox)> {
        let label = self.obstructed.label(object, self.class_count)?;
        let (bbox, _) = self.extent.of(object);
        (!label.ignored && !bbox.is_empty()).then_some((label.class, bbox))
    }
}

/// What the boxes of a dataset are around, as `LabelConfig::extent` for a recipe: those of YOLO,
/// else of its first format with boxes.
fn extent_of(identity: &Value) -> Extent {
    let writers = identity["writers"].as_array().into_iter().flatten();
    let formats = writers.filter_map(Value::as_object).flatten();
    let boxes = formats.filter_map(|(name, own)| Some((name, own.get("boxes")?)));
    let chosen = boxes.min_by_key(|(name, _)| name.as_str() != "yolo");
    chosen
        .and_then(|(_, extent)| Extent::deserialize(extent).ok())
        .unwrap_or_default()
}

/// Fails if the assets have a class with the name that is added.
fn check_is_free(classes: &[String]) -> Result<()> {
    if classes.iter().all(|name| name != OBSTRUCTED) {
        return Ok(());
    }
    let what =
        format!("\"class\" adds a class \"{OBSTRUCTED}\", but the assets have one of that name");
    Err(Error::value("labels.obstructed", what))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::Truncation;
    use crate::pixel::ObjectId;
    use serde_json::json;

    fn pair() -> Labels {
        let amodal_box = BBox {
            x0: 1.0,
            y0: 1.0,
            x1: 3.0,
            y1: 3.0,
        };
        let below = ObjectLabel {
            id: ObjectId(1),
            class: 1,
            covered_by: vec![ObjectId(2)],
            amodal_box,
            ..ObjectLabel::default()
        };
        let above = ObjectLabel {
            id: ObjectId(2),
            class: 0,
            amodal_box,
            visible_box: amodal_box,
            ..ObjectLabel::default()
        };
        Labels {
            image: [8, 8],
            objects: vec![below, above],
            ..Labels::default()
        }
    }

    /// Id, class and whether ignored, of each label.
    fn told(policy: Obstructed) -> Vec<(u32, u32, bool)> {
        let labels = pair();
        let classes = policy.classes(&["cap", "none"].map(String::from)).unwrap();
        policy
            .labelled(&labels, classes.len(), &[Extent::Amodal])
            .iter()
            .map(|l| (l.object.id.0, l.class, l.ignored))
            .collect()
    }

    #[test]
    fn each_policy_changes_the_obstructed_object_alone() {
        assert_eq!(told(Obstructed::Drop), [(2, 0, false)]);
        assert_eq!(told(Obstructed::Keep), [(1, 1, false), (2, 0, false)]);
        assert_eq!(told(Obstructed::Ignore), [(1, 1, true), (2, 0, false)]);
        assert_eq!(told(Obstructed::Class), [(1, 2, false), (2, 0, false)]);
    }

    #[test]
    fn what_is_cut_off_too_much_has_no_label_or_one_to_be_ignored() {
        let mut labels = pair();
        labels.objects[1].truncation = Some(Truncation {
            above_max: true,
            ..Truncation::default()
        });
        let told = |policy: Obstructed| {
            let labelled = policy.labelled(&labels, 2, &[Extent::Amodal]);
            let told = labelled.iter().map(|l| (l.object.id.0, l.ignored));
            told.collect::<Vec<_>>()
        };
        assert_eq!(told(Obstructed::Drop), []);
        assert_eq!(told(Obstructed::Keep), [(1, false)]);
        assert_eq!(told(Obstructed::Class), [(1, false)]);
        assert_eq!(told(Obstructed::Ignore), [(1, true), (2, true)]);
    }

    #[test]
    fn what_has_no_box_in_any_format_has_no_label() {
        let labels = pair();
        let ids = |extents: &[Extent]| {
            let labelled = Obstructed::Keep.labelled(&labels, 2, extents);
            labelled.iter().map(|l| l.object.id.0).collect::<Vec<_>>()
        };
        assert_eq!(ids(&[Extent::Visible]), [2]);
        assert_eq!(ids(&[Extent::Visible, Extent::Amodal]), [1, 2]);
    }

    #[test]
    fn the_boxes_of_a_dataset_are_those_of_yolo_before_others() {
        let coco = json!({ "coco": { "boxes": "visible" } });
        let yolo = json!({ "yolo": { "boxes": "amodal" } });
        let extent = |writers: [&Value; 2]| extent_of(&json!({ "writers": writers }));
        assert_eq!(extent([&json!({ "pictures": {} }), &coco]), Extent::Visible);
        assert_eq!(extent([&coco, &yolo]), Extent::Amodal);
        assert_eq!(extent_of(&Value::Null), Extent::Amodal);
    }

    #[test]
    fn a_class_that_is_there_already_is_not_added() {
        let classes = [OBSTRUCTED.to_owned()];
        assert!(Obstructed::Class.classes(&classes).is_err());
        assert_eq!(Obstructed::Keep.classes(&classes).unwrap(), classes);
    }
}
