//! Label files: the corners of a surface in a photo, as a person labelled them (`NAME.label.json`).

use crate::color::Albedo;
use crate::geom::{Point2, Vector2};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

/// The corners of a flat rectangle of known size in a photo, and what is known about the camera
/// that took it.
///
/// In files an unknown key is an error, except where it starts with `_`: those are comments. Values
/// are as a person wrote them; [`camera::solve`](crate::camera::solve) checks them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self", deny_unknown_fields)]
pub struct Label {
    /// What kind of file this is.
    pub format: LabelFormat,
    /// Version of the format: 1.
    #[serde(deserialize_with = "version_one")]
    pub version: u32,
    /// The photo.
    pub image: LabelImage,
    /// Where pixel (0, 0) is. Default: `corner`.
    #[serde(default)]
    pub pixel_origin: PixelOrigin,
    /// The rectangle.
    pub surface: LabelSurface,
    /// What is known about the camera.
    #[serde(default)]
    pub camera: LabelCamera,
    /// Further points of the same photo.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<LabelPoint>,
    /// Printed markers on the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub markers: Option<MarkerMap>,
}

/// The one word of [`Label::format`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LabelFormat {
    /// `plane-label`.
    #[default]
    #[serde(rename = "plane-label")]
    PlaneLabel,
}

/// The photo of a label.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelImage {
    /// Name of the picture file, relative to the label.
    pub file: String,
    /// Width of the upright picture, pixels.
    pub width: u32,
    /// Height of the upright picture, pixels.
    pub height: u32,
    /// A part was cut away, so that the principal point need not be the picture's centre; `false`
    /// says that the picture is whole. Default: what the photo's EXIF data say. See
    /// [`Label::framing`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cropped: Option<bool>,
    /// Where it was cut out, if that is known; it then does not count as cropped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
}

/// Which part of its camera's full picture a picture is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Framing {
    /// All of it, or a known part, or one of known principal point: the label or its photo's EXIF
    /// data say so.
    Whole,
    /// Not known: EXIF data were removed, or state another size.
    #[default]
    Unknown,
    /// An unknown part.
    Cropped,
}

/// Where a picture was cut out of a larger one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crop {
    /// Top-left corner in the larger picture, pixels.
    pub offset_px: [f64; 2],
    /// Width of the larger picture, pixels.
    pub width: u32,
    /// Height of the larger picture, pixels.
    pub height: u32,
}

/// Where the origin of pixel coordinates is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PixelOrigin {
    /// The top-left corner of the top-left pixel (ours).
    #[default]
    Corner,
    /// The centre of the top-left pixel (OpenCV).
    Center,
}

/// The rectangle of a label.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelSurface {
    /// Its name; photos of one surface share it.
    pub id: String,
    /// Length of the sides from the first to the second corner, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_m: Option<f64>,
    /// Length of the other sides, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Standard deviation of both lengths, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dimension_sigma_m: Option<f64>,
    /// Top left, top right, bottom right, bottom left, pixels. May be missing where there are
    /// markers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corners_px: Option<[[f64; 2]; 4]>,
    /// Standard deviation of a corner's coordinates, pixels. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corner_sigma_px: Option<f64>,
    /// Who found the corners: `manual`, a program's name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Share of the light that the surface reflects: 0.04 for black plastic, 0.2 for mid grey, 0.8
    /// for white paper; or its colour, which also gives that of the light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub albedo: Option<Albedo>,
    /// The walls on all its sides, where it has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall: Option<LabelWall>,
}

/// The walls of a labelled rectangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LabelWall {
    /// Height of the rim over the rectangle, metres; 0 is a table without walls. Default: a lip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// How far they lean outwards, degrees from upright. Default: 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_deg: Option<f64>,
}

/// What is known about the camera of a label.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LabelCamera {
    /// Its name; photos that share name, shape and stated focal length share a lens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Focal length, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_px: Option<f64>,
    /// 35 mm equivalent focal length, millimetres, as in EXIF data.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_35mm: Option<f64>,
    /// Relative standard deviation of the focal length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_sigma: Option<f64>,
    /// The focal length is exact. Default: false.
    pub focal_fixed: bool,
    /// Principal point, pixels. Default: the picture's centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub principal_point_px: Option<[f64; 2]>,
    /// Standard deviation of the principal point's coordinates, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub principal_point_sigma_px: Option<f64>,
    /// OpenCV's first radial distortion coefficient.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k1: Option<f64>,
    /// Height of the lens above the surface, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Standard deviation of that height, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_sigma_m: Option<f64>,
}

/// A point of known position on or above the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelPoint {
    /// Where it is, metres.
    pub xyz_m: [f64; 3],
    /// Where it is seen, pixels.
    pub px: [f64; 2],
    /// Standard deviation of its pixel coordinates. Default: the corners'.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_px: Option<f64>,
    /// What it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Printed markers and where they lie on the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerMap {
    /// Dictionary of the markers: `tag36h11`, `DICT_4X4_50`.
    pub family: String,
    /// Whose marker pictures were printed. Default: `apriltag`.
    #[serde(default)]
    pub artwork: Artwork,
    /// Side of a marker's black square, metres.
    pub size_m: f64,
    /// Centre of each marker by its number, metres.
    pub map: std::collections::BTreeMap<u32, [f64; 3]>,
}

/// Whose marker pictures were printed; OpenCV turns AprilTags by 180 degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Artwork {
    /// The official pictures.
    #[default]
    Apriltag,
    /// `generateImageMarker`.
    Opencv,
}

impl Label {
    /// A label of a rectangle of `size` metres, seen at `corners_px` (from the top left, clockwise)
    /// in a picture of `image` pixels; nothing else is known.
    pub fn new(image: [u32; 2], corners_px: [[f64; 2]; 4], size: [f64; 2]) -> Self {
        let ([width, height], [width_m, height_m]) = (image, size.map(Some));
        Self {
            format: LabelFormat::PlaneLabel,
            version: 1,
            image: LabelImage {
                width,
                height,
                ..LabelImage::default()
            },
            pixel_origin: PixelOrigin::Corner,
            surface: LabelSurface {
                width_m,
                height_m,
                corners_px: Some(corners_px),
                ..LabelSurface::default()
            },
            camera: LabelCamera::default(),
            points: Vec::new(),
            markers: None,
        }
    }

    /// Width and height of the picture, pixels.
    pub fn image_size(&self) -> [u32; 2] {
        self.image.size()
    }

    /// Width and height of the picture that the camera took, pixels.
    pub(crate) fn taken_size(&self) -> [u32; 2] {
        self.image
            .crop
            .map_or(self.image_size(), |crop| [crop.width, crop.height])
    }

    /// The centre of the picture that the camera took, in this one's pixels.
    pub(crate) fn taken_center(&self) -> Point2<f64> {
        let center = self.taken_size().map(|side| f64::from(side) / 2.0);
        let offset_px = self.image.crop.map_or([0.0; 2], |crop| crop.offset_px);
        Point2::from(center) - Vector2::from(offset_px)
    }

    /// Which part of its camera's full picture this one is.
    pub fn framing(&self) -> Framing {
        let camera = &self.camera;
        let states_principal_point =
            camera.principal_point_px.is_some() || camera.principal_point_sigma_px.is_some();
        match self.image.cropped {
            _ if self.image.crop.is_some() => Framing::Whole,
            Some(true) => Framing::Cropped,
            None if !states_principal_point => Framing::Unknown,
            _ => Framing::Whole,
        }
    }

    /// A labelled pixel position in our convention.
    pub(crate) fn pixel(&self, px: [f64; 2]) -> Point2<f64> {
        Point2::from(px) + self.pixel_origin.offset_px()
    }

    /// A pixel position in our convention, as the label would state it.
    pub(crate) fn labelled_px(&self, px: Point2<f64>) -> [f64; 2] {
        (px - self.pixel_origin.offset_px()).into()
    }
}

impl LabelPoint {
    /// Whether it was found as the corner of a printed marker, according to its note.
    pub fn is_marker_corner(&self) -> bool {
        let note = self.note.as_deref().unwrap_or_default();
        let number = note.strip_prefix("marker ");
        number.is_some_and(|number| number.parse::<u32>().is_ok())
    }
}

impl LabelImage {
    /// Width and height, pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }
}

impl LabelSurface {
    /// The length of a side is stated.
    pub(crate) fn has_side(&self) -> bool {
        self.width_m.is_some() || self.height_m.is_some()
    }

    pub(crate) fn set_size(&mut self, size: [f64; 2]) {
        [self.width_m, self.height_m] = size.map(Some);
    }
}

impl LabelCamera {
    /// Drops what EXIF data say of the focal length, where that is what the label goes by.
    pub(super) fn forget_equivalent(&mut self) {
        if self.focal_px.is_none() {
            (self.focal_35mm, self.focal_sigma) = (None, None);
            self.focal_fixed = false;
        }
    }
}

impl PixelOrigin {
    /// What has to be added to a position to bring it into our convention.
    fn offset_px(self) -> Vector2<f64> {
        match self {
            Self::Corner => Vector2::zeros(),
            Self::Center => Vector2::repeat(0.5),
        }
    }
}

impl<'de> Deserialize<'de> for Label {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = without_empty_corners(without_comments(Value::deserialize(deserializer)?));
        if let Some(missing) = missing_keys(&value) {
            return Err(D::Error::custom(missing));
        }
        let mut track = serde_path_to_error::Track::new();
        let tracked = serde_path_to_error::Deserializer::new(value, &mut track);
        Self::deserialize(tracked)
            .map_err(|e| D::Error::custom(located_message(e.to_string(), &track.path())))
    }
}

/// A message behind its place; one about a key names the key itself, and the reader of the file
/// adds the closest known one.
fn located_message(what: String, at: &serde_path_to_error::Path) -> String {
    if what.contains(" field `") {
        what
    } else {
        format!("{at}: {what}")
    }
}

impl Serialize for Label {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

/// Without corners that were left to be filled in and were not.
fn without_empty_corners(mut value: Value) -> Value {
    let surface = value.get_mut("surface").and_then(Value::as_object_mut);
    if let Some(surface) = surface
        && surface.get("corners_px").is_some_and(are_empty_corners)
    {
        surface.remove("corners_px");
    }
    value
}

/// Pairs of `null`.
fn are_empty_corners(corners: &Value) -> bool {
    let mut numbers = corners
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_array)
        .flatten()
        .peekable();
    numbers.peek().is_some() && numbers.all(Value::is_null)
}

/// Keys that every label has, as pointers.
const NEEDED_KEYS: [&str; 6] = [
    "/format",
    "/version",
    "/image/file",
    "/image/width",
    "/image/height",
    "/surface/id",
];

/// All keys that a label lacks, where it lacks any that every one has.
fn missing_keys(value: &Value) -> Option<String> {
    let mut missing: Vec<String> = NEEDED_KEYS
        .into_iter()
        .filter(|key| is_missing(value, key))
        .map(|key| key[1..].replace('/', "."))
        .collect();
    if missing.is_empty() || !value.is_object() {
        return None;
    }
    let lacking = KEY_ALTERNATIVES
        .into_iter()
        .filter(|(keys, _)| keys.iter().all(|key| is_missing(value, key)));
    missing.extend(lacking.map(|(_, named)| named.to_owned()));
    Some(missing_message(&missing))
}

fn missing_message(keys: &[String]) -> String {
    let key = if keys.len() == 1 { "key" } else { "keys" };
    let names = keys.join(", ");
    format!("missing {key} {names}; `petcomp camera init PHOTO --size WxH` writes them")
}

/// Keys of which a label has at least one, as pointers, and what to say where it has none.
const KEY_ALTERNATIVES: [(&[&str], &str); 2] = [
    (
        &["/surface/corners_px", "/markers", "/points"],
        "surface.corners_px (or markers)",
    ),
    (
        &["/surface/width_m", "/surface/height_m"],
        "surface.width_m (or surface.height_m)",
    ),
];

fn is_missing(value: &Value, key: &str) -> bool {
    value.pointer(key).is_none_or(Value::is_null)
}

pub(super) fn version_one<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    match u32::deserialize(deserializer)? {
        1 => Ok(1),
        other => Err(D::Error::custom(format!("{other}, expected 1"))),
    }
}

/// Without the keys that start with `_`.
fn without_comments(value: Value) -> Value {
    match value {
        Value::Object(map) => map
            .into_iter()
            .filter(|(key, _)| !key.starts_with('_'))
            .map(|(key, v)| (key, without_comments(v)))
            .collect(),
        Value::Array(items) => items.into_iter().map(without_comments).collect(),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRAY: &str = r#"{
        "format": "plane-label", "version": 1, "_by": "hand",
        "image": { "file": "bg_0001.jpg", "width": 4000, "height": 3000, "cropped": false },
        "pixel_origin": "center",
        "surface": {
            "id": "tray", "width_m": 0.600, "height_m": 0.400, "dimension_sigma_m": 0.002, "_made_of": "steel",
            "corners_px": [[612.3, 402.8], [3391.0, 398.1], [3502.4, 2610.7], [498.9, 2622.2]],
            "corner_sigma_px": 1.0, "source": "manual"
        },
        "camera": {
            "id": "phone-1", "focal_px": null, "focal_35mm": 26, "focal_sigma": 0.05, "focal_fixed": false,
            "principal_point_px": null, "principal_point_sigma_px": null, "k1": null,
            "height_m": 1.12, "height_sigma_m": 0.03
        },
        "points": [{ "xyz_m": [0.30, 0.20, 0.08], "px": [3433.0, 371.5], "sigma_px": 1.0, "note": "rim" }],
        "markers": { "family": "tag36h11", "artwork": "apriltag", "size_m": 0.06,
                     "map": { "0": [-0.27, 0.17, 0], "1": [0.27, 0.17, 0] } }
    }"#;

    fn message(text: &str) -> String {
        serde_json::from_str::<Label>(text).unwrap_err().to_string()
    }

    #[test]
    fn the_full_label_reads_and_round_trips() {
        let label: Label = serde_json::from_str(TRAY).unwrap();
        assert_eq!(label.camera.focal_35mm, Some(26.0));
        assert_eq!(label.markers.as_ref().unwrap().map[&1], [0.27, 0.17, 0.0]);
        let text = serde_json::to_string(&label).unwrap();
        assert_eq!(serde_json::from_str::<Label>(&text).unwrap(), label);
    }

    #[test]
    fn an_unknown_key_is_an_error_that_names_it_and_a_comment_is_not() {
        let typo = TRAY.replace("\"focal_sigma\"", "\"focal_sgima\"");
        assert!(message(&typo).contains("focal_sgima"), "{}", message(&typo));
    }

    #[test]
    fn all_missing_keys_are_named_at_once() {
        let none = message("{}");
        for key in [
            "format",
            "version",
            "image.file",
            "image.width",
            "image.height",
            "surface.id",
            "surface.corners_px",
        ] {
            assert!(none.contains(key), "{none}");
        }
        assert!(
            none.contains("surface.width_m (or surface.height_m)"),
            "{none}"
        );
        let two = message(
            &TRAY
                .replace("\"id\": \"tray\",", "")
                .replace("\"file\": \"bg_0001.jpg\", ", ""),
        );
        assert!(
            two.starts_with("missing keys image.file, surface.id; "),
            "{two}"
        );
    }

    #[test]
    fn a_missing_or_wrong_field_is_named() {
        assert!(
            message(&TRAY.replace("\"id\": \"tray\",", "")).starts_with("missing key surface.id; ")
        );
        assert_eq!(
            message(&TRAY.replace("\"version\": 1", "\"version\": 2")),
            "version: 2, expected 1"
        );
        assert!(message(&TRAY.replace("plane-label", "plain-label")).contains("plane-label"));
        let three = message(&TRAY.replace(", [498.9, 2622.2]]", "]"));
        assert!(
            three.contains("surface.corners_px: invalid length 3"),
            "{three}"
        );
    }

    #[test]
    fn pixel_centres_become_pixel_corners() {
        let label: Label = serde_json::from_str(TRAY).unwrap();
        assert_eq!(label.pixel([0.0, 10.0]), Point2::new(0.5, 10.5));
    }
}
