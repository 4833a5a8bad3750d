//! What an object was photographed on.

use crate::error::{Error, Result};
use crate::image::Image;
use crate::io;
use crate::lru::LruCache;
use crate::pixel::LinearRgb;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

/// What is known about the screen: `auto`, a colour `R,G,B` (scene-linear) or a photo of the empty
/// screen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum ScreenSource {
    /// Nothing: it is fitted to each photo.
    #[default]
    Auto,
    /// One colour, evenly lit.
    Color(LinearRgb),
    /// A photo of it without the object.
    Photo(PathBuf),
}

impl ScreenSource {
    /// The colour, where it is given.
    pub(super) fn color(&self) -> Option<LinearRgb> {
        if let Self::Color(color) = self {
            Some(*color)
        } else {
            None
        }
    }

    /// With its photo, where it is one, at the path that its own stands for.
    pub(super) fn locate(&mut self, located: impl FnOnce(&Path) -> PathBuf) {
        if let Self::Photo(path) = self {
            *path = located(path.as_path());
        }
    }

    fn color_or_photo(text: String) -> std::result::Result<Self, String> {
        match numbers(&text) {
            Some(numbers) => color_of(numbers).map(Self::Color),
            None => Ok(Self::Photo(text.into())),
        }
    }

    pub(super) fn photo(&self) -> Option<&Path> {
        if let Self::Photo(path) = self {
            Some(path)
        } else {
            None
        }
    }
}

impl TryFrom<String> for ScreenSource {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        match text.as_str() {
            "auto" => Ok(Self::Auto),
            "" => Err("empty, expected auto, R,G,B or a photo".into()),
            _ => Self::color_or_photo(text),
        }
    }
}

/// The numbers of a text that has nothing else between its commas.
fn numbers(text: &str) -> Option<Vec<f32>> {
    text.split(',').map(|n| n.trim().parse().ok()).collect()
}

fn color_of(channels: Vec<f32>) -> std::result::Result<LinearRgb, String> {
    <[f32; 3]>::try_from(channels)
        .map(LinearRgb::from)
        .map_err(|n| format!("{} numbers, expected auto, R,G,B or a photo", n.len()))
}

impl FromStr for ScreenSource {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::try_from(text.to_owned()).map_err(|what| Error::value("screen", what))
    }
}

impl fmt::Display for ScreenSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Color(LinearRgb { r, g, b }) => write!(f, "{r},{g},{b}"),
            Self::Photo(path) => write!(f, "{}", path.display()),
        }
    }
}

impl From<ScreenSource> for String {
    fn from(screen: ScreenSource) -> Self {
        screen.to_string()
    }
}

/// Memory for photos of empty screens that several photos share, bytes: two of 48 megapixels.
const KEPT_BYTES: usize = 1 << 30;

/// Photos of empty screens: the last of those that several photos share are kept.
#[derive(Debug)]
pub(super) struct EmptyScreens {
    shared: BTreeSet<PathBuf>,
    kept: LruCache<Arc<Image<LinearRgb>>>,
}

impl Default for EmptyScreens {
    fn default() -> Self {
        Self::shared_by(std::iter::empty())
    }
}

/// How often each photo of an empty screen is named.
fn use_counts<'a>(screens: impl Iterator<Item = &'a ScreenSource>) -> BTreeMap<&'a Path, usize> {
    let mut counts = BTreeMap::new();
    for path in screens.filter_map(ScreenSource::photo) {
        *counts.entry(path).or_default() += 1;
    }
    counts
}

impl EmptyScreens {
    /// Keeps those that are named more than once.
    pub(super) fn shared_by<'a>(screens: impl Iterator<Item = &'a ScreenSource>) -> Self {
        let often = use_counts(screens).into_iter().filter(|(_, n)| *n > 1);
        Self {
            shared: often.map(|(path, _)| path.to_owned()).collect(),
            kept: LruCache::of_bytes(KEPT_BYTES),
        }
    }

    /// The photo of the empty screen, where there is one.
    ///
    /// # Errors
    /// Those of [`io::read`].
    pub(super) fn get(&self, screen: &ScreenSource) -> Result<Option<Arc<Image<LinearRgb>>>> {
        let path = screen.photo();
        path.map(|path| self.image(path)).transpose()
    }

    fn image(&self, path: &Path) -> Result<Arc<Image<LinearRgb>>> {
        if !self.shared.contains(path) {
            return io::read(path).map(Arc::new);
        }
        let name = format!("{path:?}");
        match self.kept.get(&name) {
            Some(image) => Ok(image),
            None => Ok(self.kept.insert(&name, Arc::new(io::read(path)?))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screen_is_told_in_three_ways() {
        let of = |text: &str| ScreenSource::from_str(text);
        assert_eq!(of("auto").unwrap(), ScreenSource::Auto);
        assert_eq!(
            of("0.1, 0.5,0.2").unwrap(),
            ScreenSource::Color(LinearRgb::new(0.1, 0.5, 0.2))
        );
        assert_eq!(
            of("empty.png").unwrap(),
            ScreenSource::Photo("empty.png".into())
        );
        assert_eq!(
            of("1,2").unwrap_err().to_string(),
            "screen: 2 numbers, expected auto, R,G,B or a photo"
        );
        assert!(of("").is_err());
    }

    #[test]
    fn a_screen_in_a_document_is_the_text_that_gives_it() {
        #[derive(Debug, PartialEq, Serialize, Deserialize)]
        struct Document {
            screen: ScreenSource,
        }
        for text in ["auto", "0.1,0.5,0.25", "empty.png"] {
            let document: Document = toml::from_str(&format!("screen = \"{text}\"")).unwrap();
            assert_eq!(document.screen.to_string(), text);
            let written = toml::to_string(&document).unwrap();
            assert_eq!(toml::from_str::<Document>(&written).unwrap(), document);
        }
    }

    #[test]
    fn an_empty_screen_that_two_photos_share_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("empty.png");
        let green = Image::filled(4, 3, LinearRgb::new(0.0, 1.0, 0.0));
        io::write(&path, &green).unwrap();
        let shared = ScreenSource::Photo(path.clone());
        let lost = ScreenSource::Photo(folder.path().join("lost.png"));
        let all = [&shared, &shared, &lost, &lost, &ScreenSource::Auto];
        let screens = EmptyScreens::shared_by(all.into_iter());
        let read = || screens.get(&shared).unwrap().unwrap();
        assert_eq!(*read(), green);
        std::fs::remove_file(path).unwrap();
        assert_eq!(*read(), green);
        assert!(
            screens
                .get(&lost)
                .unwrap_err()
                .to_string()
                .contains("lost.png")
        );
        assert!(screens.get(&ScreenSource::Auto).unwrap().is_none());
        let one = EmptyScreens::shared_by([&shared].into_iter());
        assert!(one.get(&shared).is_err(), "read each time");
    }
}
