//! The manifest of an asset folder: what is in it, as TOML.

use super::body::KnownBody;
use super::review::Verdict;
use super::role::Role;
use super::{DEFAULT_THICKNESS, MANIFEST};
use crate::bounds::{Bounds, HALF_THICKNESS, MASS, OBJECT, PX_PER_METRE, THICKNESS, WIDTH};
use crate::diagnostic::{Code, Diagnostic};
use crate::error::{Error, Result};
use crate::io::{self, Checksum};
use crate::matte::MatteMethod;
use crate::pixel::LinearRgb;
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeSet;
use std::path::Path;

/// What is in an asset folder, without the pictures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Names of the classes; a label's number is the place in this list. Default: those of the
    /// assets, in their order.
    #[serde(default)]
    pub classes: Vec<String>,
    /// The assets, by name.
    #[serde(default)]
    pub assets: Vec<Asset<PhotoRecord>>,
}

/// One object, which may have been photographed several times: of [`PhotoRecord`]s in a manifest,
/// of [`Photo`](super::Photo)s in a library.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Asset<P> {
    /// Its name: letters and digits of any language, `_`, `-` and `.`.
    pub name: String,
    /// Purpose in pictures. Default: `object`.
    #[serde(default, skip_serializing_if = "Role::is_object")]
    pub role: Role,
    /// Name of its class; for a distractor an optional word for people, which is in no list of
    /// classes.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub class: String,
    /// Thickness of the body that falls, metres.
    pub thickness: f64,
    /// Mass, kilograms.
    pub mass: f64,
    /// Its photos, by file name; at least one.
    pub photos: Vec<P>,
}

/// One cut-out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhotoRecord {
    /// The cut-out, relative to the folder.
    pub file: String,
    /// CRC-32 of that file; missing in older manifests, and then any file is accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crc32: Option<u32>,
    /// Name of the photo that it was cut from.
    pub source: String,
    /// CRC-32 of that photo; missing in older manifests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_crc32: Option<u32>,
    /// CRC-32 of everything that it was made from: version of the program, options, entry of the list, bytes
    /// of the files that it names; missing in older manifests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inputs_crc32: Option<u32>,
    /// Pixels of the cut-out per metre.
    pub px_per_metre: f64,
    /// Width and height of the whole cut-out, metres.
    pub size_m: [f64; 2],
    /// Length and width of the object's tight outline, however it is turned, metres.
    pub object_m: [f64; 2],
    /// Standard error of these, metres: of the outline, and of the scale where a screen or marker
    /// gives it; with how far a stated length and width are from them; as large as the length where
    /// a stated size gives the scale though a part is missing.
    #[serde(default)]
    pub error_m: f64,
    /// Length and width of the convex hull, which older manifests hold; ignored.
    #[serde(default, rename = "hull_m", skip_serializing)]
    pub(super) _hull_m: IgnoredKey,
    /// Colour of the screen, scene-linear.
    pub screen: LinearRgb,
    /// Where the matte came from.
    pub matte: MatteMethod,
    /// Mean matte that the key left on the screen, where it should be 0.
    pub residue: f64,
    /// How uneven the screen was: 1 minus darkest over brightest.
    #[serde(default)]
    pub unevenness: f64,
    /// Confidence in the outline, 0 to 1; 1 where a person has reviewed it.
    #[serde(default = "full_confidence", alias = "confidence")]
    pub outline_confidence: f64,
    /// Confidence in colour and transmittance, 0 to 1; missing where it was not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color_confidence: Option<f64>,
    /// What was measured on a luminous display; missing where the cut-out is of one photo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub captured: Option<CaptureRecord>,
    /// The object reached a border of the photo: part of it is missing.
    #[serde(default)]
    pub truncated: bool,
    /// Convex hull in pixels of the cut-out, clockwise as seen.
    pub outline_px: Vec<[f64; 2]>,
    /// Why a person should review this cut-out; empty where there is no reason.
    #[serde(
        default,
        alias = "doubts",
        deserialize_with = "coded_or_plain",
        skip_serializing_if = "Vec::is_empty"
    )]
    pub diagnostics: Vec<Diagnostic>,
}

/// How well an object was measured on a luminous display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureRecord {
    /// Number of photos.
    pub photos: usize,
    /// Mean standard error of the transmittance of the line of sight, 0 to 1.
    pub transmittance_sigma: f64,
    /// How lines of sight are bent, relative to the folder: EXR, displacement on the display in
    /// metres. Missing without stripes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flow: Option<String>,
    /// Height of the object's middle over the display, metres.
    pub height: f64,
    /// Mean share of the light that is scattered where the object is see-through, 0 to 1; 0 without
    /// stripes.
    #[serde(default)]
    pub haze: f64,
}

impl CaptureRecord {
    /// What was measured and how well, one line.
    pub fn summary(&self) -> String {
        let refraction = match self.flow {
            Some(_) => format!("refraction measured, haze {:.0} %", 100.0 * self.haze),
            None => "refraction not measured".into(),
        };
        format!(
            "captured: {} photos, transmittance to {:.3}, {refraction}",
            self.photos, self.transmittance_sigma
        )
    }

    fn check(&self) -> Result<()> {
        CONFIDENCE.check("transmittance_sigma", self.transmittance_sigma)?;
        CONFIDENCE.check("haze", self.haze)?;
        HALF_THICKNESS.check("height", self.height)?;
        let flow = self.flow.as_ref();
        flow.map_or(Ok(()), |flow| io::below("flow", flow).map(drop))
    }
}

/// Reads diagnostics, and the plain texts (`doubts`) that earlier versions wrote in their place.
fn coded_or_plain<'de, D: Deserializer<'de>>(
    input: D,
) -> std::result::Result<Vec<Diagnostic>, D::Error> {
    let entries = Vec::<CodedOrPlain>::deserialize(input)?;
    Ok(entries.into_iter().map(Diagnostic::from).collect())
}

/// A diagnostic of a manifest, or the text that earlier versions wrote in its place.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "a table of code, severity and message, or a string"
)]
enum CodedOrPlain {
    Coded(Diagnostic),
    Plain(String),
}

impl From<CodedOrPlain> for Diagnostic {
    fn from(entry: CodedOrPlain) -> Self {
        match entry {
            CodedOrPlain::Coded(diagnostic) => diagnostic,
            CodedOrPlain::Plain(text) => Self::warning(Code::Uncoded, text),
        }
    }
}

impl<P> Asset<P> {
    /// Name of the class that it is labelled as; none of a distractor.
    pub(super) fn label_class(&self) -> Option<&str> {
        self.role.is_object().then_some(&self.class)
    }

    /// The same object with its photos in another form.
    pub(super) fn with_photos<Q>(self, photos: Vec<Q>) -> Asset<Q> {
        Asset {
            name: self.name,
            role: self.role,
            class: self.class,
            thickness: self.thickness,
            mass: self.mass,
            photos,
        }
    }
}

fn full_confidence() -> f64 {
    1.0
}

/// A key that may be there and means nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct IgnoredKey;

impl<'de> Deserialize<'de> for IgnoredKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        IgnoredAny::deserialize(deserializer).map(|_| Self)
    }
}

impl Manifest {
    /// Reads and checks the manifest of a folder.
    ///
    /// # Errors
    /// [`Error::File`] where there is none; [`Error::Field`] for a value that cannot be right.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self> {
        let path = folder.as_ref().join(MANIFEST);
        let mut manifest: Self = io::read_toml(&path)?;
        if manifest.classes.is_empty() {
            let Self { classes, assets } = &mut manifest;
            append_new(classes, assets.iter().filter_map(Asset::label_class));
        }
        manifest.check().map_err(|e| e.in_file(&path))?;
        Ok(manifest)
    }

    /// Writes the manifest of a folder, whole or not at all; assets by name, photos by file.
    ///
    /// # Errors
    /// [`Error::Field`] for a value that cannot be right, [`Error::File`] where it cannot be
    /// written.
    pub fn write(&mut self, folder: impl AsRef<Path>) -> Result<()> {
        let path = folder.as_ref().join(MANIFEST);
        self.assets.sort_by(|a, b| a.name.cmp(&b.name));
        for asset in &mut self.assets {
            asset.photos.sort_by(|a, b| a.file.cmp(&b.file));
        }
        self.check().map_err(|e| e.in_file(&path))?;
        io::write_toml(path, self)
    }

    /// Adds a photo to an asset, which is created if missing; a photo of the same file is
    /// replaced, with a line in the log where that was another one.
    ///
    /// # Errors
    /// [`Error::Value`] (`class`) when the asset is known as something else.
    pub fn insert(&mut self, asset: Asset<PhotoRecord>) -> Result<()> {
        let mut known = self.assets.iter_mut();
        match known.find(|known| known.name == asset.name) {
            Some(known) => known.merge(asset),
            None => {
                self.assets.push(asset);
                Ok(())
            }
        }
    }

    /// Fails where the folder has an asset as something else.
    pub(super) fn check_known(&self, name: &str, role: Role, class: &str) -> Result<()> {
        let known = self.assets.iter().find(|known| known.name == name);
        let checked = known.map_or(Ok(()), |known| known.check_same(role, class));
        checked.map_err(|e| match e {
            Error::Value { at, what } => Error::value(at, format!("{what} in {MANIFEST}; {ANEW}")),
            other => other,
        })
    }

    /// Takes a cut-out out, and with its last one the asset. Returns whether it was there.
    pub(super) fn remove(&mut self, file: &str) -> bool {
        let was_there = self.has(file);
        for asset in &mut self.assets {
            asset.photos.retain(|photo| photo.file != file);
        }
        self.assets.retain(|asset| !asset.photos.is_empty());
        was_there
    }

    /// It has a cut-out in this file.
    pub(super) fn has(&self, file: &str) -> bool {
        self.record(file).is_some()
    }

    /// The record of the cut-out in this file.
    pub(super) fn record(&self, file: &str) -> Option<&PhotoRecord> {
        let mut photos = self.assets.iter().flat_map(|asset| &asset.photos);
        photos.find(|photo| photo.file == file)
    }

    /// The file of a cut-out has the checksum that it records; where it records none any file does.
    pub(super) fn is_file_of(&self, folder: &Path, file: &str) -> bool {
        let record = self.record(file);
        record.and_then(|photo| photo.crc32).is_none_or(|crc32| {
            let found = Checksum::from_file(folder.join(file));
            found.is_ok_and(|found| found.crc32 == crc32)
        })
    }

    /// Takes classes into the list: those that are declared, in that order, or else those in use,
    /// behind the ones that are there, in the order in which they appear. No existing class
    /// changes its number.
    ///
    /// # Errors
    /// [`Error::Value`] (`classes`) for declared ones that do not begin with the existing ones.
    pub(super) fn add_classes<'a>(
        &mut self,
        declared: &[String],
        in_use: impl Iterator<Item = &'a str>,
    ) -> Result<()> {
        if declared.is_empty() {
            append_new(&mut self.classes, in_use);
            return Ok(());
        }
        check_unique("classes", declared.iter().map(String::as_str))?;
        check_each(declared, "classes", |class| check_class(class))?;
        self.check_order(declared)?;
        self.classes = declared.to_vec();
        Ok(())
    }

    /// Fails where declared classes do not begin with the existing ones.
    fn check_order(&self, declared: &[String]) -> Result<()> {
        if declared.starts_with(&self.classes) {
            return Ok(());
        }
        let what = unexpected_order(&declared.join(", "), &self.classes.join(", "));
        Err(Error::value("classes", what))
    }

    /// What the folder knows of the body of an asset. The default thickness stands for one that
    /// nobody told.
    pub(super) fn known_body(&self, name: &str) -> KnownBody {
        let known = self.assets.iter().find(|asset| asset.name == name);
        known.map_or_else(KnownBody::default, |asset| KnownBody {
            thickness: Some(asset.thickness).filter(|told| *told != DEFAULT_THICKNESS),
            mass: Some(asset.mass),
        })
    }

    /// Place of a class in the list.
    ///
    /// # Errors
    /// [`Error::Value`] (`class`) with the names that are known.
    pub fn class(&self, name: &str) -> Result<u32> {
        class_number(&self.classes, name).ok_or_else(|| {
            let known = self.classes.join(", ");
            Error::value("class", format!("\"{name}\", expected one of {known}"))
        })
    }

    /// Fails on a class of objects that is not in the list; that of a distractor is in none.
    pub(super) fn check_class_of(&self, role: Role, class: &str) -> Result<()> {
        match role {
            Role::Object => self.class(class).map(drop),
            Role::Distractor if class.is_empty() => Ok(()),
            Role::Distractor => check_class(class.trim()),
        }
    }

    fn check(&self) -> Result<()> {
        if self.classes.is_empty() && self.assets.iter().any(|asset| asset.role.is_object()) {
            return Err(Error::value("classes", "empty, expected at least one"));
        }
        // Earlier versions took spaces around names.
        check_unique("classes", self.classes.iter().map(|class| class.trim()))?;
        check_each(&self.classes, "classes", |class| check_class(class.trim()))?;
        let names = self.assets.iter().map(|asset| asset.name.as_str());
        check_unique("assets", names)?;
        check_each(&self.assets, "assets", |asset| {
            asset.check()?;
            self.check_class_of(asset.role, &asset.class)
        })
    }
}

impl Asset<PhotoRecord> {
    /// Takes in the photos and the body of the same asset.
    fn merge(&mut self, asset: Self) -> Result<()> {
        self.check_same(asset.role, &asset.class)?;
        (self.thickness, self.mass) = (asset.thickness, asset.mass);
        for photo in asset.photos {
            self.put(photo);
        }
        Ok(())
    }

    /// Adds a photo in place of the one of the same file.
    fn put(&mut self, photo: PhotoRecord) {
        let mut others = self.photos.iter();
        if let Some(old) = others.find(|old| old.is_of_another_photo(&photo)) {
            log::warn!(
                "{}: replaces the cut-out of another photo, or of an earlier version of {}; give another object \
                 another asset name",
                old.file,
                old.source
            );
        }
        self.photos.retain(|old| old.file != photo.file);
        self.photos.push(photo);
    }

    /// Fails for another role or class than its own.
    fn check_same(&self, role: Role, class: &str) -> Result<()> {
        let Self { name, .. } = self;
        if self.role != role {
            let what = format!("{role}, but asset \"{name}\" is {}", self.role);
            return Err(Error::value("role", what));
        }
        if self.class != class {
            let what = format!("\"{class}\", but asset \"{name}\" is \"{}\"", self.class);
            return Err(Error::value("class", what));
        }
        Ok(())
    }

    fn check(&self) -> Result<()> {
        check_name(&self.name)?;
        THICKNESS.check("thickness", self.thickness)?;
        MASS.check("mass", self.mass)?;
        if self.photos.is_empty() {
            return Err(Error::value("photos", "empty, expected at least one"));
        }
        let files = self.photos.iter().map(|photo| photo.file.as_str());
        check_unique("photos", files)?;
        check_each(&self.photos, "photos", PhotoRecord::check)
    }
}

fn unexpected_order(declared: &str, known: &str) -> String {
    format!("{declared}; expected those of the folder first: {known}; {ANEW}")
}

/// What to do where a folder has what is no longer meant.
const ANEW: &str = "delete the folder to rebuild it";

/// Checks every item of a list; errors name its place: `photos[2]`.
pub(super) fn check_each<T>(
    items: &[T],
    name: &str,
    check: impl Fn(&T) -> Result<()>,
) -> Result<()> {
    items
        .iter()
        .enumerate()
        .try_for_each(|(i, item)| check(item).map_err(|e| e.within(&format!("{name}[{i}]"))))
}

/// Place of a class in a list of names.
pub(super) fn class_number(classes: &[String], name: &str) -> Option<u32> {
    let place = classes.iter().position(|class| class == name)?;
    u32::try_from(place).ok()
}

fn append_new<'a>(classes: &mut Vec<String>, in_use: impl Iterator<Item = &'a str>) {
    for class in in_use {
        if !classes.iter().any(|known| known == class) {
            classes.push(class.to_owned());
        }
    }
}

impl PhotoRecord {
    /// The files that a library reads for it, relative to the folder.
    #[doc(hidden)]
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let captured = self.captured.as_ref();
        let flow = captured.and_then(|captured| captured.flow.as_deref());
        std::iter::once(self.file.as_str()).chain(flow)
    }

    /// A cut-out of full confidence, with nothing else known: all of it is the object.
    pub fn new(
        file: impl Into<String>,
        px_per_metre: f64,
        size_m: [f64; 2],
        outline_px: Vec<[f64; 2]>,
    ) -> Self {
        Self {
            file: file.into(),
            crc32: None,
            source: String::new(),
            source_crc32: None,
            inputs_crc32: None,
            px_per_metre,
            size_m,
            object_m: size_m,
            error_m: 0.0,
            _hull_m: IgnoredKey,
            screen: LinearRgb::BLACK,
            matte: MatteMethod::Physical,
            residue: 0.0,
            unevenness: 0.0,
            outline_confidence: full_confidence(),
            color_confidence: None,
            captured: None,
            truncated: false,
            outline_px,
            diagnostics: Vec::new(),
        }
    }

    /// The same after a person's verdict: what was accepted is in question no more.
    pub(super) fn reviewed(self, verdict: Option<Verdict>) -> Self {
        match verdict {
            Some(Verdict::Accepted) => Self {
                outline_confidence: full_confidence(),
                diagnostics: Vec::new(),
                ..self
            },
            _ => self,
        }
    }

    /// The same file was cut from other bytes.
    fn is_of_another_photo(&self, new: &Self) -> bool {
        let sources = self.source_crc32.zip(new.source_crc32);
        self.file == new.file && sources.is_some_and(|(old, new)| old != new)
    }

    /// Whether a person should review this cut-out.
    pub fn needs_review(&self) -> bool {
        self.diagnostics.iter().any(Diagnostic::needs_review)
    }

    /// Width and height of the cut-out, pixels.
    pub(super) fn size_px(&self) -> [f64; 2] {
        self.size_m.map(|side| side * self.px_per_metre)
    }

    pub(super) fn check(&self) -> Result<()> {
        io::below("", &self.file)?;
        PX_PER_METRE.check("px_per_metre", self.px_per_metre)?;
        self.size_m
            .into_iter()
            .try_for_each(|side| CUT_OUT_SIDE.check("size_m", side))?;
        OBJECT.check("object_m[0]", self.object_m[0])?;
        WIDTH.check("object_m[1]", self.object_m[1])?;
        CONFIDENCE.check("outline_confidence", self.outline_confidence)?;
        if let Some(confidence) = self.color_confidence {
            CONFIDENCE.check("color_confidence", confidence)?;
        }
        if let Some(captured) = &self.captured {
            captured.check().map_err(|e| e.within("captured"))?;
        }
        self.check_outline()
    }

    fn check_outline(&self) -> Result<()> {
        if self.outline_px.len() < 3 {
            let what = format!("{} points, expected at least 3", self.outline_px.len());
            return Err(Error::value("outline_px", what));
        }
        let size = self.size_px();
        match self.outline_px.iter().position(|p| !is_near(*p, size)) {
            Some(i) => {
                let ([x, y], [w, h]) = (self.outline_px[i], size);
                let what = format!("({x}, {y}), expected a point inside {w:.0} x {h:.0} pixels");
                Err(Error::value(format!("outline_px[{i}]"), what))
            }
            None => Ok(()),
        }
    }
}

/// A point is inside a picture of this size, or a pixel outside at most.
fn is_near([x, y]: [f64; 2], [w, h]: [f64; 2]) -> bool {
    (-1.0..=w + 1.0).contains(&x) && (-1.0..=h + 1.0).contains(&y)
}

const CONFIDENCE: Bounds = Bounds::new(0.0, 1.0, "a share");

/// Side of a whole cut-out, metres: the object's, and the margin around it.
const CUT_OUT_SIDE: Bounds = Bounds::metres(1e-4, 20.0, "objects are 5 mm to 5 m long");

/// A name that is safe as the name of a folder beside the manifest: letters and digits of any
/// language.
pub(super) fn check_name(name: &str) -> Result<()> {
    if let Some(file) = file_beside(name) {
        let what = format!("\"{name}\", which is the name of the {file}");
        return Err(Error::value("name", what));
    }
    if is_name(name) {
        return Ok(());
    }
    let start = printable_start(name);
    let what = format!("\"{start}\", expected letters, digits, _, - and . (not first)");
    Err(Error::value("name", what))
}

/// What else has this name in the folder, in any case, as some file systems see it.
fn file_beside(name: &str) -> Option<&'static str> {
    let name = name.to_ascii_lowercase();
    if name == MANIFEST {
        return Some("manifest");
    }
    let page = name.strip_prefix("contact_sheet")?.strip_suffix(".png")?;
    let is_number = |page: &str| page.bytes().all(|digit| digit.is_ascii_digit());
    let is_page = page.is_empty() || page.strip_prefix('_').is_some_and(is_number);
    is_page.then_some("contact sheet")
}

fn is_name(name: &str) -> bool {
    let is_short = !name.is_empty() && name.len() <= MAX_NAME_BYTES;
    is_short && name.chars().all(is_name_character) && !name.starts_with('.')
}

fn is_name_character(c: char) -> bool {
    c.is_alphanumeric() || "_-.".contains(c)
}

/// File systems allow 255 bytes with what is put behind.
const MAX_NAME_BYTES: usize = 120;

/// A name that stands on a line of its own in every format of labels, and is no other one by spaces
/// that nobody sees.
pub(super) fn check_class(name: &str) -> Result<()> {
    if is_class_name(name) {
        return Ok(());
    }
    let start = printable_start(name);
    let what =
        format!("\"{start}\", expected a name on one line without leading or trailing spaces");
    Err(Error::value("class", what))
}

/// Whether a name is one that `check_class` accepts.
pub fn is_class_name(name: &str) -> bool {
    let is_short = !name.is_empty() && name.len() <= MAX_NAME_BYTES;
    is_short && name.trim() == name && !name.chars().any(char::is_control)
}

/// The beginning of a name, on one line.
fn printable_start(name: &str) -> String {
    name.chars()
        .take(MAX_NAME_BYTES)
        .flat_map(char::escape_debug)
        .collect()
}

fn check_unique<'a>(at: &str, names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut seen = BTreeSet::new();
    for (i, name) in names.enumerate() {
        if !seen.insert(name) {
            let what = format!("\"{name}\" is listed twice");
            return Err(Error::value(format!("{at}[{i}]"), what));
        }
    }
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{CONTACT_SHEET, contact_sheet_page};
    use super::*;

    pub(in super::super) fn photo(file: &str) -> PhotoRecord {
        let outline_px = vec![[1.0, 1.0], [39.0, 1.0], [39.0, 19.0]];
        PhotoRecord {
            source: "IMG_1.jpg".into(),
            object_m: [0.35, 0.15],
            error_m: 0.001,
            screen: LinearRgb::new(0.1, 0.5, 0.1),
            residue: 0.01,
            unevenness: 0.1,
            outline_confidence: 0.9,
            color_confidence: Some(0.8),
            ..PhotoRecord::new(file, 100.0, [0.4, 0.2], outline_px)
        }
    }

    fn asset(name: &str, class: &str) -> Asset<PhotoRecord> {
        let photos = vec![photo(&format!("{name}/1.exr"))];
        Asset {
            name: name.into(),
            role: Role::Object,
            class: class.into(),
            thickness: 0.005,
            mass: 0.02,
            photos,
        }
    }

    fn two() -> Manifest {
        let classes = ["cap", "label", "none"].map(String::from).into();
        Manifest {
            classes,
            assets: vec![asset("b", "cap"), asset("a", "none")],
        }
    }

    #[test]
    fn a_manifest_reads_back_as_it_was_written_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let mut manifest = two();
        manifest.write(folder.path()).unwrap();
        let back = Manifest::read(folder.path()).unwrap();
        assert_eq!(back, manifest);
        assert_eq!(
            back.assets
                .iter()
                .map(|a| a.name.as_str())
                .collect::<Vec<_>>(),
            ["a", "b"]
        );
    }

    #[test]
    fn the_confidence_of_older_manifests_is_that_of_the_outline() {
        let folder = tempfile::tempdir().unwrap();
        two().write(folder.path()).unwrap();
        let path = folder.path().join(MANIFEST);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(
            text.contains("outline_confidence = 0.9\ncolor_confidence = 0.8\n"),
            "{text}"
        );
        let older = text.replace(
            "outline_confidence = 0.9\ncolor_confidence = 0.8\n",
            "confidence = 0.7\n",
        );
        std::fs::write(&path, older).unwrap();
        let read = Manifest::read(folder.path()).unwrap();
        let photos: Vec<_> = read.assets.iter().flat_map(|asset| &asset.photos).collect();
        assert!(
            photos
                .iter()
                .all(|p| (p.outline_confidence, p.color_confidence) == (0.7, None)),
            "{photos:?}"
        );
        std::fs::write(
            &path,
            text.replace("color_confidence = 0.8", "color_confidence = 1.5"),
        )
        .unwrap();
        let reported = Manifest::read(folder.path()).unwrap_err().to_string();
        assert!(
            reported.contains("assets[0].photos[0].color_confidence: 1.5, expected 0 to 1"),
            "{reported}"
        );
    }

    #[test]
    fn the_hull_of_older_manifests_is_read_and_dropped() {
        let folder = tempfile::tempdir().unwrap();
        let mut manifest = two();
        manifest.write(folder.path()).unwrap();
        let path = folder.path().join(MANIFEST);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(!text.contains("hull_m"), "{text}");
        let older = text.replace(
            "error_m = ",
            "hull_m = [\n    0.35,\n    0.15,\n]\nerror_m = ",
        );
        assert_ne!(older, text);
        std::fs::write(&path, older).unwrap();
        assert_eq!(Manifest::read(folder.path()).unwrap(), manifest);
    }

    #[test]
    fn classes_are_those_declared_or_those_met_and_keep_their_numbers() {
        let learned = |known: &[&str], declared: &[&str], met: &[&str]| {
            let own = |names: &[&str]| {
                names
                    .iter()
                    .map(|name| (*name).to_owned())
                    .collect::<Vec<_>>()
            };
            let mut manifest = Manifest {
                classes: own(known),
                ..Manifest::default()
            };
            manifest
                .add_classes(&own(declared), met.iter().copied())
                .map(|()| manifest.classes)
                .map_err(|e| e.to_string())
        };
        assert_eq!(
            learned(&[], &[], &["can", "bag", "can"]).unwrap(),
            ["can", "bag"]
        );
        assert_eq!(
            learned(&["bag"], &[], &["can", "bag"]).unwrap(),
            ["bag", "can"]
        );
        assert_eq!(
            learned(&["bag"], &["bag", "can", "jar"], &["can"]).unwrap(),
            ["bag", "can", "jar"]
        );
        let reported = learned(&["bag"], &["can", "bag"], &[]).unwrap_err();
        assert_eq!(
            reported,
            "classes: can, bag; expected those of the folder first: bag; \
             delete the folder to rebuild it"
        );
        assert!(
            learned(&[], &["can", " cup"], &[]).unwrap_err().contains(
                "\" cup\", expected a name on one line without leading or trailing spaces"
            )
        );
        assert!(
            learned(&[], &["can", "can"], &[])
                .unwrap_err()
                .contains("is listed twice")
        );
    }

    fn with_ring() -> Manifest {
        let ring = Asset {
            role: Role::Distractor,
            ..asset("ring", "")
        };
        let mut manifest = two();
        manifest.assets.push(ring);
        manifest
    }

    #[test]
    fn a_distractor_needs_no_class_and_adds_none() {
        let folder = tempfile::tempdir().unwrap();
        with_ring().write(folder.path()).unwrap();
        let path = folder.path().join(MANIFEST);
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text.matches("role = ").count(), 1, "{text}");
        let mut undeclared = with_ring();
        undeclared.assets[2].class = "rubbish".into();
        undeclared.classes.clear();
        std::fs::write(&path, toml::to_string(&undeclared).unwrap()).unwrap();
        assert_eq!(
            Manifest::read(folder.path()).unwrap().classes,
            ["cap", "none"]
        );
        undeclared.assets.retain(|asset| !asset.role.is_object());
        undeclared.write(folder.path()).unwrap();
    }

    #[test]
    fn an_object_does_not_become_a_distractor_by_another_photo() {
        let mut manifest = with_ring();
        let told = manifest
            .insert(asset("ring", "cap"))
            .unwrap_err()
            .to_string();
        assert_eq!(told, "role: object, but asset \"ring\" is distractor");
    }

    #[test]
    fn an_asset_is_not_named_like_a_file_beside_it() {
        let first = Path::new(CONTACT_SHEET);
        for page in [0, 1, 11] {
            let file = contact_sheet_page(first, page);
            let name = file.to_str().unwrap();
            for name in [name.to_owned(), name.to_uppercase()] {
                let told = check_name(&name).unwrap_err().to_string();
                assert!(
                    told.ends_with("which is the name of the contact sheet"),
                    "{told}"
                );
            }
        }
        let told = check_name("Assets.toml").unwrap_err().to_string();
        assert!(
            told.ends_with("which is the name of the manifest"),
            "{told}"
        );
        for name in [
            "contact_sheet",
            "contact_sheet_a.png",
            "my_contact_sheet.png",
        ] {
            assert!(check_name(name).is_ok(), "{name}");
        }
    }

    #[test]
    fn names_of_any_language_are_names_and_paths_are_none() {
        for name in ["Flasche_gr\u{fc}n", "\u{74f6}-1", "a.b"] {
            assert!(check_name(name).is_ok(), "{name}");
        }
        for name in ["", ".a", "a/b", "a b", "a\n", &"a".repeat(121)] {
            let told = check_name(name).unwrap_err().to_string();
            assert!(
                told.ends_with("expected letters, digits, _, - and . (not first)"),
                "{told}"
            );
        }
        assert!(check_class("see-through bottle").is_ok());
        for class in ["", " ", " cup", "cup ", "a\nb", "\u{1b}[31m"] {
            assert!(
                check_class(class)
                    .unwrap_err()
                    .to_string()
                    .contains("expected a name on one line")
            );
        }
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let message = |spoil: fn(&mut Manifest)| {
            let mut manifest = two();
            spoil(&mut manifest);
            manifest.check().unwrap_err().to_string()
        };
        let printed = message(|m| m.assets[1].class = "cpa".into());
        assert_eq!(
            printed,
            "assets[1].class: \"cpa\", expected one of cap, label, none"
        );
        assert_eq!(
            message(|m| m.assets[1].name = "b".into()),
            "assets[1]: \"b\" is listed twice"
        );
        let printed = message(|m| m.assets[0].photos[0].px_per_metre = f64::NAN);
        assert_eq!(
            printed,
            "assets[0].photos[0].px_per_metre: NaN, expected 1 to 1e7 (pixels for a metre)"
        );
        let printed = message(|m| m.assets[0].photos[0].px_per_metre = 1e308);
        assert_eq!(
            printed,
            "assets[0].photos[0].px_per_metre: 1e308, expected 1 to 1e7 (pixels for a metre)"
        );
        let printed = message(|m| m.assets[0].photos[0].object_m[0] = 229.0);
        let expected =
            "229, expected 0.005 to 5 m (objects are 5 mm to 5 m long); is it in millimetres?";
        assert_eq!(
            printed,
            format!("assets[0].photos[0].object_m[0]: {expected}")
        );
        assert!(
            message(|m| m.assets[0].photos[0].file = "../x.exr".into())
                .contains("expected a path below")
        );
        assert!(
            message(|m| m.assets[0].photos[0].outline_px[2] = [50.0, 2.0])
                .contains("outline_px[2]")
        );
        assert!(message(|m| m.assets[0].photos.clear()).starts_with("assets[0].photos: empty"));
    }

    #[test]
    fn an_unknown_key_is_refused_with_a_suggestion() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(MANIFEST), "classses = [\"a\"]\n").unwrap();
        let printed = Manifest::read(folder.path()).unwrap_err().to_string();
        assert!(printed.contains("did you mean \"classes\""), "{printed}");
    }

    #[test]
    fn inserting_again_replaces() {
        let mut manifest = two();
        let mut again = asset("a", "none");
        again.photos[0].px_per_metre = 120.0;
        manifest.insert(again).unwrap();
        assert_eq!(manifest.assets.len(), 2);
        assert_eq!(manifest.assets[1].photos.len(), 1);
        assert_eq!(manifest.assets[1].photos[0].px_per_metre, 120.0);
        assert!(manifest.insert(asset("a", "cap")).is_err());
    }

    #[test]
    fn another_photo_of_the_same_name_is_known_by_its_bytes() {
        let of = |file: &str, source_crc32| PhotoRecord {
            source_crc32,
            ..photo(file)
        };
        let old = of("a/1.exr", Some(7));
        assert!(old.is_of_another_photo(&of("a/1.exr", Some(8))));
        for same in [
            ("a/1.exr", Some(7)),
            ("a/2.exr", Some(8)),
            ("a/1.exr", None),
        ] {
            assert!(!old.is_of_another_photo(&of(same.0, same.1)), "{same:?}");
        }
        let written = toml::to_string(&old).unwrap();
        assert_eq!(toml::from_str::<PhotoRecord>(&written).unwrap(), old);
        let older = written.replace("source_crc32 = 7\n", "");
        let read: PhotoRecord = toml::from_str(&older).unwrap();
        assert_eq!(read, of("a/1.exr", None));
    }

    #[test]
    fn diagnostics_keep_their_codes_and_texts_of_earlier_versions_become_warnings() {
        let mut record = photo("a.exr");
        record.diagnostics = vec![
            Diagnostic::warning(Code::Truncated, "the object reaches the left border"),
            Diagnostic::note(Code::Moved, "photo 2 was aligned"),
        ];
        let written = toml::to_string(&record).unwrap();
        assert!(written.contains("matte.truncated"), "{written}");
        assert_eq!(toml::from_str::<PhotoRecord>(&written).unwrap(), record);
        let earlier = toml::to_string(&photo("a.exr")).unwrap()
            + "doubts = [\"two objects\", \"the outline is unsure\"]\n";
        let read: PhotoRecord = toml::from_str(&earlier).unwrap();
        let messages: Vec<&str> = read.diagnostics.iter().map(|d| &*d.message).collect();
        assert_eq!(messages, ["two objects", "the outline is unsure"]);
        assert!(read.needs_review() && read.diagnostics.iter().all(|d| d.code == Code::Uncoded));
        let wrong = earlier.replace("\"two objects\"", "7");
        let error = toml::from_str::<PhotoRecord>(&wrong).unwrap_err();
        assert!(error.to_string().contains("or a string"), "{error}");
    }
}
