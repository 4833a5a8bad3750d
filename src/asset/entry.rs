//! A photo and what is known about its object.

use super::body::KnownBody;
use super::capture_entry::CaptureEntry;
use super::manifest::{Asset, Manifest, PhotoRecord, check_class, check_name};
use super::role::Role;
use super::scale::Scale;
use super::screen_source::ScreenSource;
use super::{DEFAULT_MASS, DEFAULT_THICKNESS};
use crate::bounds::{MASS, THICKNESS};
use crate::error::{Error, Result};
use crate::matte::MatteMethod;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A photo of an object and what is known that cannot be seen in it: an entry of a
/// [`List`](super::List).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhotoEntry {
    /// The photo. In a list: relative to it; `.jpg` and `.jpeg` are one, and so are capitals and
    /// small letters.
    pub file: PathBuf,
    /// Name of the object: letters and digits of any language, `_`, `-` and `.`.
    pub asset: String,
    /// Purpose of the object in pictures: `object`, or `distractor` for what only hides others.
    /// Default: `object`.
    #[serde(default, skip_serializing_if = "Role::is_object")]
    pub role: Role,
    /// Name of its class. For a distractor, which is not labelled, an optional word for people.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub class: String,
    /// Pixels of the photo for a metre, at half the object's height.
    #[serde(
        default,
        alias = "px_per_meter",
        skip_serializing_if = "Option::is_none"
    )]
    pub px_per_metre: Option<f64>,
    /// Or: length of the object, the longer side of the smallest rectangle around it, metres, 0.005 to 5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// And its width, metres: then both fix the scale, and contradict an outline of other
    /// proportions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
    /// Or: width and height of the whole screen, metres, all of which is seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screen_size: Option<[f64; 2]>,
    /// Its corners, from the top left clockwise, pixels. Default: found automatically.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screen_corners: Option<[[f64; 2]; 4]>,
    /// Or: side of the black square of a printed marker on the screen, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker_size: Option<f64>,
    /// Or: `file` is one of several photos on a luminous display, which gives the scale.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub captured: Option<CaptureEntry>,
    /// What it was photographed on: `auto`, a colour `R,G,B` or a photo of the empty screen.
    /// Default: `auto`.
    #[serde(default)]
    pub screen: ScreenSource,
    /// How its matte is made: `physical`, `key`, or `outline` for opaque objects. Default:
    /// that of the list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matte: Option<MatteMethod>,
    /// Thickness of the body that falls, metres. Default: that of another photo of the asset in the
    /// list, or else in the folder, or else 0.005.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f64>,
    /// Mass, kilograms. Default: in the same way, or else 0.025.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
}

impl PhotoEntry {
    /// A photo of an object, without thickness and mass.
    pub fn new(
        file: impl Into<PathBuf>,
        asset: impl Into<String>,
        class: impl Into<String>,
        scale: Scale,
    ) -> Self {
        let mut entry = Self {
            file: file.into(),
            asset: asset.into(),
            role: Role::Object,
            class: class.into(),
            px_per_metre: None,
            length: None,
            width: None,
            screen_size: None,
            screen_corners: None,
            marker_size: None,
            captured: None,
            screen: ScreenSource::Auto,
            matte: None,
            thickness: None,
            mass: None,
        };
        entry.set_scale(scale);
        entry
    }

    fn set_scale(&mut self, scale: Scale) {
        match scale {
            Scale::PxPerMetre(scale) => self.px_per_metre = Some(scale),
            Scale::Length(length) => self.length = Some(length),
            Scale::Size([length, width]) => {
                (self.length, self.width) = (Some(length), Some(width));
            }
            Scale::Screen(size, corners) => {
                (self.screen_size, self.screen_corners) = (Some(size), corners);
            }
            Scale::Marker(side) => self.marker_size = Some(side),
            Scale::Display => self.captured = Some(CaptureEntry::default()),
        }
    }

    /// The one thing that gives the scale.
    ///
    /// # Errors
    /// [`Error::Value`] where nothing gives it, or more than one thing.
    pub fn scale(&self) -> Result<Scale> {
        self.check_companions()?;
        let names = "length, px_per_metre, screen_size, marker_size or captured";
        match self.scales().into_iter().flatten().collect::<Vec<_>>()[..] {
            [scale] => Ok(scale),
            [] => Err(Error::value("length", format!("missing, expected {names}"))),
            _ => Err(Error::value(
                "length",
                format!("one of several scales, expected only one of {names}"),
            )),
        }
    }

    /// Fails on a field that is meaningless without another one.
    fn check_companions(&self) -> Result<()> {
        if self.screen_corners.is_some() {
            require_beside("screen_corners", "screen_size", &self.screen_size)?;
        }
        if self.width.is_some() {
            require_beside("width", "length", &self.length)?;
        }
        Ok(())
    }

    fn scales(&self) -> [Option<Scale>; 5] {
        [
            self.object_scale(),
            self.px_per_metre.map(Scale::PxPerMetre),
            self.screen_size
                .map(|size| Scale::Screen(size, self.screen_corners)),
            self.marker_size.map(Scale::Marker),
            self.captured.is_some().then_some(Scale::Display),
        ]
    }

    /// The scale by what the object itself measures.
    fn object_scale(&self) -> Option<Scale> {
        let length = self.length?;
        Some(match self.width {
            Some(width) => Scale::Size([length, width]),
            None => Scale::Length(length),
        })
    }

    /// Checks all values, role and class against what the folder has.
    ///
    /// # Errors
    /// [`Error::Value`] for the first value that cannot be right.
    #[doc(hidden)]
    pub fn check(&self, manifest: &Manifest) -> Result<()> {
        let scale = self.scale()?;
        check_name(&self.asset).map_err(|e| match e {
            Error::Value { what, .. } => Error::value("asset", what),
            other => other,
        })?;
        self.check_class(manifest)?;
        manifest.check_known(&self.asset, self.role, &self.class)?;
        scale.check()?;
        self.check_capture()?;
        THICKNESS.check("thickness", self.thickness())?;
        MASS.check("mass", self.mass())
    }

    /// What is measured on a display has no other matte and no other screen.
    fn check_capture(&self) -> Result<()> {
        let Some(captured) = &self.captured else {
            return Ok(());
        };
        if self.screen != ScreenSource::Auto {
            let what = format!(
                "\"{}\" with captured, whose empty display belongs in captured.empty",
                self.screen
            );
            return Err(Error::value("screen", what));
        }
        match self.matte {
            Some(matte) => {
                let what = format!("\"{matte}\" with captured, whose matte is measured");
                Err(Error::value("matte", what))
            }
            None => captured.check(),
        }
    }

    /// An object needs a class that the folder has; a distractor needs none.
    fn check_class(&self, manifest: &Manifest) -> Result<()> {
        if self.role.is_object() && self.class.is_empty() {
            let what = "missing, expected its name, or role = \"distractor\"";
            return Err(Error::value("class", what));
        }
        if self.role.is_object() {
            check_class(&self.class)?;
        }
        manifest.check_class_of(self.role, &self.class)
    }

    /// Name of the class that its object is labelled as; none of a distractor.
    pub(super) fn label_class(&self) -> Option<&str> {
        self.role.is_object().then_some(&self.class)
    }

    /// Thickness of the body that falls, metres.
    pub(super) fn thickness(&self) -> f64 {
        self.thickness.unwrap_or(DEFAULT_THICKNESS)
    }

    fn mass(&self) -> f64 {
        self.mass.unwrap_or(DEFAULT_MASS)
    }

    pub(super) fn known_body(&self) -> KnownBody {
        KnownBody {
            thickness: self.thickness,
            mass: self.mass,
        }
    }

    /// The same with what it does not tell of its object's body.
    pub(super) fn with_body(self, known: KnownBody) -> Self {
        let KnownBody { thickness, mass } = self.known_body().or(known);
        Self {
            thickness,
            mass,
            ..self
        }
    }

    /// The object of this entry with one cut-out.
    pub(super) fn asset_with(&self, photo: PhotoRecord) -> Asset<PhotoRecord> {
        Asset {
            name: self.asset.clone(),
            role: self.role,
            class: self.class.clone(),
            thickness: self.thickness(),
            mass: self.mass(),
            photos: vec![photo],
        }
    }

    /// The pictures that its cut-out is made of.
    pub(super) fn pictures(&self) -> impl Iterator<Item = &Path> {
        let captured = self.captured.iter().flat_map(CaptureEntry::pictures);
        let own = std::iter::once(self.file.as_path());
        own.chain(captured).chain(self.screen.photo())
    }

    /// Where its cut-out goes, relative to the folder.
    pub(super) fn cut_out_file(&self) -> String {
        format!("{}/{}.exr", self.asset, file_stem(&self.file))
    }

    /// Name of the photo's file.
    pub(super) fn source(&self) -> String {
        let name = self.file.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }
}

/// Fails unless a field that another one needs has a value.
fn require_beside<T>(given: &str, name: &str, value: &Option<T>) -> Result<()> {
    match value {
        Some(_) => Ok(()),
        None => Err(Error::value(
            name,
            format!("missing, required with {given}"),
        )),
    }
}

/// The photo's name without ending, safe as a name anywhere.
fn file_stem(photo: &Path) -> String {
    let stem = photo.file_stem().unwrap_or_default().to_string_lossy();
    stem.chars().map(safe_character).collect()
}

fn safe_character(c: char) -> char {
    if c.is_alphanumeric() || c == '-' {
        c
    } else {
        '_'
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(line: &str) -> std::result::Result<Scale, String> {
        let text = format!("file = \"a.png\"\nasset = \"a\"\nclass = \"c\"\n{line}");
        let entry: PhotoEntry = toml::from_str(&text).map_err(|e| e.to_string())?;
        let scale = entry.scale().map_err(|e| e.to_string())?;
        assert_eq!(PhotoEntry::new("a.png", "a", "c", scale), entry);
        Ok(scale)
    }

    #[test]
    fn one_thing_gives_the_scale() {
        assert_eq!(
            scale("screen_size = [0.6, 0.4]"),
            Ok(Scale::Screen([0.6, 0.4], None))
        );
        assert_eq!(scale("marker_size = 0.05"), Ok(Scale::Marker(0.05)));
        let corners = [[1.0, 1.0], [9.0, 1.0], [9.0, 6.0], [1.0, 6.0]];
        let reported = scale(&format!(
            "screen_size = [0.6, 0.4]\nscreen_corners = {corners:?}"
        ));
        assert_eq!(reported, Ok(Scale::Screen([0.6, 0.4], Some(corners))));
        let missing =
            "length: missing, expected length, px_per_metre, screen_size, marker_size or captured";
        assert_eq!(scale("").unwrap_err(), missing);
        assert!(
            scale("length = 0.2\nmarker_size = 0.05")
                .unwrap_err()
                .contains("expected only one of length")
        );
        let alone = scale(&format!("length = 0.2\nscreen_corners = {corners:?}")).unwrap_err();
        assert_eq!(alone, "screen_size: missing, required with screen_corners");
    }
}
