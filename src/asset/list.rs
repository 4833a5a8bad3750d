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
/// length = 0.265              # metres by a tape measure, and width where it is known
/// # or: px_per_metre = 1966.7, screen_size = [0.60, 0.40], marker_size = 0.05
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
    #[serde(
        default,
        alias = "px_per_meter",
        skip_serializing_if = "Option::is_none"
    )]
    pub px_per_metre: Option<f64>,
    /// Or: length of the object along its longest side, metres, 0.005 to 5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// And its width, metres: then both fix the scale, and contradict an outline of other proportions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
    /// Or: width and height of the whole screen, metres, all of which is seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screen_size: Option<[f64; 2]>,
    /// Its corners, from the top left clockwise, pixels. Default: they are found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screen_corners: Option<[[f64; 2]; 4]>,
    /// Or: side of the black square of a printed marker on the screen, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker_size: Option<f64>,
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
        if !path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("csv"))
        {
            return io::read_toml(path);
        }
        let rows = spreadsheet::rows(&io::read_bytes(path)?).map_err(|e| e.in_file(path))?;
        let photo = |row: spreadsheet::Row| {
            io::from_table(row.cells).map_err(|e| spreadsheet::in_line(e, row.line))
        };
        let photos: Result<Vec<ListedPhoto>> = rows.into_iter().map(photo).collect();
        Ok(Self {
            photos: photos.map_err(|e| e.in_file(path))?,
            ..Self::default()
        })
    }

    /// The photos with all that is known of them, checked against the folder's manifest.
    pub(super) fn adds(&self, manifest: &mut Manifest, at: &Path) -> Result<Vec<AddPhoto>> {
        self.cut_out.check().map_err(|e| e.within("cut_out"))?;
        manifest.learn(
            &self.classes,
            self.photos.iter().map(|photo| photo.class.as_str()),
        )?;
        if self.photos.is_empty() {
            return Err(Error::value("photos", "empty, expected at least one"));
        }
        let adds = self.photos.iter().enumerate().map(|(i, photo)| {
            let add = photo
                .add(&self.cut_out, at)
                .and_then(|add| add.check(manifest).map(|()| add));
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
                let what = format!(
                    "\"{}\", would become the same cut-out as photos[{first}]",
                    photo.file
                );
                return Err(Error::value(format!("photos[{i}].file"), what));
            }
        }
        Ok(())
    }
}

impl ListedPhoto {
    fn add(&self, options: &CutOutOptions, at: &Path) -> Result<AddPhoto> {
        let screen = match self.screen.as_deref().unwrap_or("auto").parse()? {
            ScreenSource::Photo(path) => ScreenSource::Photo(at.join(path)),
            told => told,
        };
        Ok(AddPhoto {
            asset: self.asset.clone(),
            class: self.class.clone(),
            scale: self.scale()?,
            thickness: self.thickness.unwrap_or(DEFAULT_THICKNESS),
            mass: self.mass.unwrap_or(DEFAULT_MASS),
            screen,
            options: options.clone(),
            classes: Vec::new(),
        })
    }

    /// The one thing that is told of the scale.
    fn scale(&self) -> Result<Scale> {
        if self.screen_corners.is_some() && self.screen_size.is_none() {
            return Err(Error::value(
                "screen_size",
                "missing, expected it beside screen_corners",
            ));
        }
        if self.width.is_some() && self.length.is_none() {
            return Err(Error::value("length", "missing, expected it beside width"));
        }
        let sized = self.length.map(|length| {
            self.width
                .map_or(Scale::Length(length), |w| Scale::Size([length, w]))
        });
        let screen = self
            .screen_size
            .map(|size| Scale::Screen(size, self.screen_corners));
        let told = [
            sized,
            self.px_per_metre.map(Scale::PxPerMetre),
            screen,
            self.marker_size.map(Scale::Marker),
        ];
        let names = "length, px_per_metre, screen_size or marker_size";
        match told.into_iter().flatten().collect::<Vec<_>>()[..] {
            [scale] => Ok(scale),
            [] => Err(Error::value("length", format!("missing, expected {names}"))),
            _ => Err(Error::value(
                "length",
                format!("one of several scales, expected one of {names}"),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(line: &str) -> std::result::Result<Scale, String> {
        let text = format!("[[photos]]\nfile = \"a.png\"\nasset = \"a\"\nclass = \"c\"\n{line}");
        let list: List = toml::from_str(&text).map_err(|e| e.to_string())?;
        list.photos[0].scale().map_err(|e| e.to_string())
    }

    #[test]
    fn one_thing_tells_the_scale() {
        assert_eq!(
            scale("screen_size = [0.6, 0.4]"),
            Ok(Scale::Screen([0.6, 0.4], None))
        );
        assert_eq!(scale("marker_size = 0.05"), Ok(Scale::Marker(0.05)));
        let corners = [[1.0, 1.0], [9.0, 1.0], [9.0, 6.0], [1.0, 6.0]];
        let told = scale(&format!(
            "screen_size = [0.6, 0.4]\nscreen_corners = {corners:?}"
        ));
        assert_eq!(told, Ok(Scale::Screen([0.6, 0.4], Some(corners))));
        let missing = "length: missing, expected length, px_per_metre, screen_size or marker_size";
        assert_eq!(scale("").unwrap_err(), missing);
        assert!(
            scale("length = 0.2\nmarker_size = 0.05")
                .unwrap_err()
                .contains("expected one of length")
        );
        let alone = scale(&format!("length = 0.2\nscreen_corners = {corners:?}")).unwrap_err();
        assert_eq!(
            alone,
            "screen_size: missing, expected it beside screen_corners"
        );
    }
}
