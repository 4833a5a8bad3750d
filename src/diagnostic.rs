//! What a stage noticed that a person should know: one form for all of them, as in compilers.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A note, a warning or an error about an input or a result, with a code that scripts can rely on.
///
/// Messages may change between versions; codes do not. `docs/diagnostics.md` lists them all.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Diagnostic {
    /// The kind of problem.
    pub code: Code,
    /// How much it matters.
    pub severity: Severity,
    /// One line, lower case, without a full stop: what was found and what to do.
    pub message: String,
}

/// How much a [`Diagnostic`] matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Good to know; the result is as good as it can be.
    Note,
    /// The result may be wrong: a person should look at it.
    Warning,
    /// The result is wrong or cannot be used.
    Error,
}

impl Diagnostic {
    /// A [`Severity::Note`].
    pub fn note(code: Code, message: impl fmt::Display) -> Self {
        Self::new(code, Severity::Note, message)
    }

    /// A [`Severity::Warning`].
    pub fn warning(code: Code, message: impl fmt::Display) -> Self {
        Self::new(code, Severity::Warning, message)
    }

    /// A [`Severity::Error`].
    pub fn error(code: Code, message: impl fmt::Display) -> Self {
        Self::new(code, Severity::Error, message)
    }

    /// One with the given severity.
    pub fn new(code: Code, severity: Severity, message: impl fmt::Display) -> Self {
        let message = message.to_string();
        Self {
            code,
            severity,
            message,
        }
    }

    /// Whether a person should look at what it concerns.
    pub fn needs_review(&self) -> bool {
        self.severity > Severity::Note
    }
}

/// The message alone, to follow the name of a file.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Declares [`Code`] as a table: its name in Rust, its name in files, its meaning.
macro_rules! codes {
    ($($variant:ident $name:literal $meaning:literal)*) => {
        /// The kind of a [`Diagnostic`]: `stage.what_is_odd`.
        #[non_exhaustive]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Code {
            $(#[doc = $meaning] #[serde(rename = $name)] $variant,)*
        }

        impl Code {
            /// All of them, by stage.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// As written in files and messages.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// What it means, one line.
            pub const fn meaning(self) -> &'static str {
                match self { $(Self::$variant => $meaning,)* }
            }
        }
    };
}

codes! {
    // Camera.
    CornersReordered "camera.corners_reordered" "The corners crossed each other and were reordered"
    CornersReversed "camera.corners_reversed" "The corners were anticlockwise and were reversed"
    SmallQuad "camera.small_quad" "The rectangle is small in the image"
    CornerOutside "camera.corner_outside" "A corner is far outside the image"
    SmallMarkerSpan "camera.small_marker_span" "The markers cover only a small part of the surface"
    GrazingView "camera.grazing_view" "The optical axis is almost parallel to the surface"
    FocalUnbounded "camera.focal_unbounded" "The corners show no perspective, so the focal length is unknown"
    FramingUnknown "camera.framing_unknown" "It is unknown whether the image was cropped"
    OffCenter "camera.off_center" "The principal point is off the image centre"
    FocalPriorConflict "camera.focal_prior_conflict" "The corners contradict the expected focal length"
    HeightUncertain "camera.height_uncertain" "Points above the surface are projected with large uncertainty"
    PoorFit "camera.poor_fit" "No camera fits the corners within their noise"
    SidesSwapped "camera.sides_swapped" "Width and height of the surface appear to be swapped"
    PoseAmbiguous "camera.pose_ambiguous" "Another pose fits almost as well"
    OutlierPhoto "camera.outlier_photo" "A photo contradicts the others and was excluded, or all contradict each other and were solved separately"
    // Asset.
    SizeMismatch "asset.size_mismatch" "The given size and the outline have different aspect ratios"
    ScreenSizeMismatch "asset.screen_size_mismatch" "The screen does not match the given size"
    ScreenSidesAmbiguous "asset.screen_sides_ambiguous" "Width and height of the screen may be swapped"
    Concave "asset.concave" "The object fills little of its convex hull, which labels use as its outline (`labels.outline`)"
    Uncoded "asset.uncoded" "A warning written by a petcomp version without codes"
    // Matte.
    LeftOut "matte.left_out" "Something next to the object was left out"
    TwoObjects "matte.two_objects" "The object may be two objects"
    Truncated "matte.truncated" "The object touches a border of the photo"
    GreyScreen "matte.grey_screen" "The background has no colour to key"
    ScreenEdgeSeen "matte.screen_edge_seen" "The cut-out looks like the whole screen"
    UnstableOutline "matte.unstable_outline" "Searches at other pyramid depths find a different outline"
    WeakEdges "matte.weak_edges" "Little of the outline follows edges in the photo"
    ThresholdSensitive "matte.threshold_sensitive" "The outline changes with the edge threshold"
    Blurred "matte.blurred" "The edges of the object are blurred"
    Noisy "matte.noisy" "The object stands out from the noise only at a much lower resolution"
    ScreenLikeParts "matte.screen_like_parts" "Parts of the object look like the screen"
    BoxBeyondOutline "matte.box_beyond_outline" "The hull extends beyond the outline"
    Specks "matte.specks" "There are specks on the screen"
    SmallObject "matte.small_object" "The object is only a few pixels wide"
    ClippedScreen "matte.clipped_screen" "The screen is overexposed"
    UnevenScreen "matte.uneven_screen" "Some of the screen is much brighter or darker than the lighting fitted to the rest"
    ResidualMatte "matte.residual_matte" "The key does not remove all of the screen"
    ScreenHue "matte.screen_hue" "Part of the object has the hue of the screen"
    KeyedAway "matte.keyed_away" "Part of the object looks like bare screen"
    TintUncertain "matte.tint_uncertain" "The tint of the plastic is uncertain, or may be paint"
    ClippedObject "matte.clipped_object" "Part of the object is overexposed"
    Moved "matte.moved" "The object moved between two photos and was aligned"
    SimilarScreens "matte.similar_screens" "The screens are too similar in a channel"
    MatteExposureDrift "matte.exposure_drift" "Photos on different screens differ in exposure or colour"
    // Capture.
    MissingFrames "capture.missing_frames" "Some stripe frames have no photo"
    ExposureDrift "capture.exposure_drift" "A photo differs from the others in exposure or colour"
    ClippedWhite "capture.clipped_white" "Part of the white frame is overexposed"
    Banding "capture.banding" "The display is uneven around the object"
    ColorByAngle "capture.color_by_angle" "The colour of the display changes from one side to the other"
    CameraMoved "capture.camera_moved" "The camera moved between two photos"
    ObjectMoved "capture.object_moved" "The object moved or the light changed between two photos"
    ThicknessUnknown "capture.thickness_unknown" "The thickness of the object is unknown"
    // Dataset.
    UnreadableFile "dataset.unreadable_file" "A file is missing or cannot be read"
    BadDataYaml "dataset.bad_data_yaml" "data.yaml lacks a key or has an invalid value"
    NoImages "dataset.no_images" "A part of the dataset has no images"
    SmallImage "dataset.small_image" "An image is smaller than trainers accept"
    DuplicateImage "dataset.duplicate_image" "Two images are byte-identical"
    Leak "dataset.leak" "A validation image looks like a training image"
    MissingLabel "dataset.missing_label" "An image has no label file"
    OrphanLabel "dataset.orphan_label" "A label file has no image"
    BadLabelRow "dataset.bad_label_row" "Trainers cannot read a row of a label file"
    DuplicateLabelRow "dataset.duplicate_label_row" "A label file contains a row twice"
    BadJournalLine "dataset.bad_journal_line" "A line of index.jsonl is corrupt"
    ChangedFile "dataset.changed_file" "A file differs from what was written"
    UnlistedImage "dataset.unlisted_image" "An image is not in index.jsonl"
    UnsupportedObject "dataset.unsupported_object" "An object has no support"
    ClassWithoutLabels "dataset.class_without_labels" "A class has no labels in one part"
    RareClass "dataset.rare_class" "A class has few labels"
    TinyBoxes "dataset.tiny_boxes" "Some boxes are very small"
}

impl Code {
    /// Whether it concerns the colour and the transmittance inside the outline, not the outline itself.
    pub const fn is_about_color(self) -> bool {
        matches!(
            self,
            Self::GreyScreen
                | Self::UnevenScreen
                | Self::ScreenHue
                | Self::KeyedAway
                | Self::TintUncertain
                | Self::ClippedObject
                | Self::MatteExposureDrift
        )
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_differ_and_say_their_stage() {
        let names: BTreeSet<_> = Code::ALL.iter().map(|code| code.name()).collect();
        assert_eq!(names.len(), Code::ALL.len());
        assert!(names.iter().all(|name| name.contains('.')));
    }

    #[test]
    fn a_file_holds_code_severity_and_message() {
        let diagnostic = Diagnostic::warning(Code::GrazingView, "tilted by 85 degrees");
        let written = serde_json::to_string(&diagnostic).unwrap();
        assert_eq!(
            written,
            r#"{"code":"camera.grazing_view","severity":"warning","message":"tilted by 85 degrees"}"#
        );
        let read: Diagnostic = serde_json::from_str(&written).unwrap();
        assert_eq!(read, diagnostic);
    }
}
