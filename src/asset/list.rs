//! A list of photos, as a person or a spreadsheet writes it.

use super::folder::{AddPhoto, Scale, cut_out_file};
use super::screen_source::ScreenSource;
use super::{DEFAULT_MASS, DEFAULT_THICKNESS, Manifest, spreadsheet};
use crate::error::{Error, Result};
use crate::io;
use crate::matte::CutOutOptions;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A list of photos: `photos.toml`, or `photos.csv` with the fields of [`ListedPhoto`] for columns, as spreadsheets
/// write it: between commas, semicolons or tabs, with decimal points or commas.
///
/// ```toml
/// [[photos]]
/// file = "IMG_0001.jpg"       # relative to the list
/// asset = "bottle_01"
/// class = "cap"
/// length = 0.265              # metres by a tape measure, and width where it is known; or: px_per_metre = 1966.7
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct List {
    /// Names of the classes in order: a label's number is the place in this list. Default: those of the photos, in the
    /// order in which they appear.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<String>,
    /// How the objects are cut out.
    #[serde(default)]
    pub cut_out: CutOutOptions,
    /// The photos.
    pub photos: Vec<ListedPhoto>,
}

/// A photo of a [`List`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedPhoto {
    /// The photo, relative to the list; `.jpg` and `.jpeg` are one, and so are capitals and small letters.
    pub file: String,
    /// Name of the object.
    pub asset: String,
    /// Name of its class.
    pub class: String,
    /// Pixels of the photo for a metre, at half the object's height.
    #[serde(default, alias = "px_per_meter", skip_serializing_if = "Option::is_none")]
    pub px_per_metre: Option<f64>,
    /// Or: length of the object along its longest side, metres, 0.005 to 5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// And its width, metres: then both fix the scale, and contradict an outline of other proportions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
    /// What it was photographed on: `auto`, a colour `R,G,B` or a photo of the empty screen. Default: `auto`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screen: Option<String>,
    /// Thickness, metres. Default: 0.005.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thickness: Option<f64>,
    /// Mass, kilograms. Default: 0.025.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
}

impl List {
    /// Reads a list: CSV where the file is called so, else TOML.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read or understood, with its line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            return io::read_toml(path);
        }
        let rows = spreadsheet::rows(&io::read_bytes(path)?).map_err(|e| e.in_file(path))?;
        let photo = |row: spreadsheet::Row| io::from_table(row.cells).map_err(|e| spreadsheet::in_line(e, row.line));
        let photos: Result<Vec<ListedPhoto>> = rows.into_iter().map(photo).collect();
        Ok(Self { photos: photos.map_err(|e| e.in_file(path))?, ..Self::default() })
    }

    /// The photos with all that is known of them, checked against the folder's manifest.
    pub(super) fn adds(&self, manifest: &mut Manifest, at: &Path) -> Result<Vec<AddPhoto>> {
        self.cut_out.check().map_err(|e| e.within("cut_out"))?;
        manifest.learn(&self.classes, self.photos.iter().map(|photo| photo.class.as_str()))?;
        if self.photos.is_empty() {
            return Err(Error::value("photos", "empty, expected at least one"));
        }
        let adds = self.photos.iter().enumerate().map(|(i, photo)| {
            let add = photo.add(&self.cut_out, at).and_then(|add| add.check(manifest).map(|()| add));
            add.map_err(|e| e.within(&format!("photos[{i}]")))
        });
        let adds: Vec<AddPhoto> = adds.collect::<Result<_>>()?;
        self.check_files(&adds)?;
        Ok(adds)
    }

    /// No two photos become the same file.
    fn check_files(&self, adds: &[AddPhoto]) -> Result<()> {
        let mut seen = std::collections::BTreeMap::new();
        for (i, (photo, add)) in self.photos.iter().zip(adds).enumerate() {
            if let Some(first) = seen.insert(cut_out_file(Path::new(&photo.file), add), i) {
                let what = format!("\"{}\", would become the same cut-out as photos[{first}]", photo.file);
                return Err(Error::value(format!("photos[{i}].file"), what));
            }
        }
        Ok(())
    }
}

impl ListedPhoto {
    fn add(&self, options: &CutOutOptions, at: &Path) -> Result<AddPhoto> {
        let scale = match (self.px_per_metre, self.length, self.width) {
            (Some(scale), None, None) => Scale::PxPerMetre(scale),
            (None, Some(length), None) => Scale::Length(length),
            (None, Some(length), Some(width)) => Scale::Size([length, width]),
            (None, None, _) => return Err(Error::value("length", "missing, expected it, or px_per_metre")),
            (Some(_), _, _) => return Err(Error::value("length", "expected either it or px_per_metre, not both")),
        };
        let screen = match self.screen.as_deref().unwrap_or("auto").parse()? {
            ScreenSource::Photo(path) => ScreenSource::Photo(at.join(path)),
            told => told,
        };
        Ok(AddPhoto {
            asset: self.asset.clone(),
            class: self.class.clone(),
            scale,
            thickness: self.thickness.unwrap_or(DEFAULT_THICKNESS),
            mass: self.mass.unwrap_or(DEFAULT_MASS),
            screen,
            options: options.clone(),
            classes: Vec::new(),
        })
    }
}
