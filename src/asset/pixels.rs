//! The pixels of cut-outs: in memory, or read from their folder when they are first shown.

use super::flow_file;
use super::manifest::PhotoRecord;
use super::surface::{SurfaceCache, SurfaceTexel, WeakSurface};
use super::texture::{Texture, WeakTexture};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io::{self, Checksum};
use crate::lru::{LruCache, Shared, upgrade_optional};
use crate::matte::Flow;
use crate::pixel::Film;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};

/// What a card shows. Clones share it.
#[derive(Clone, Debug)]
pub struct Pixels {
    /// The cut-out, premultiplied, scene-linear.
    pub texture: Texture,
    /// How it bends what is seen through it; none where that was not measured.
    #[doc(hidden)]
    pub flow: Option<Arc<Flow>>,
    /// What its texels are of.
    #[doc(hidden)]
    pub surface: SurfaceCache,
}

impl<T: Into<Texture>> From<T> for Pixels {
    fn from(cut_out: T) -> Self {
        Self {
            texture: cut_out.into(),
            flow: None,
            surface: SurfaceCache::default(),
        }
    }
}

/// Pixels while somebody shows them.
#[derive(Debug)]
pub(crate) struct WeakPixels {
    texture: WeakTexture,
    flow: Option<Weak<Flow>>,
    surface: WeakSurface,
}

impl Shared for Pixels {
    type Weak = WeakPixels;

    fn bytes(&self) -> usize {
        let flow = self.flow.as_ref().map_or(0, |flow| flow_bytes(flow));
        // With all that is made of it later, so that the number stays.
        let (w, h) = self.texture.size();
        (BYTES_PER_PIXEL * (w * h) as f64) as usize + flow
    }

    fn downgrade(&self) -> WeakPixels {
        WeakPixels {
            texture: self.texture.downgrade(),
            flow: self.flow.as_ref().map(Arc::downgrade),
            surface: self.surface.downgrade(),
        }
    }

    fn upgrade(weak: &WeakPixels) -> Option<Self> {
        Some(Self {
            texture: weak.texture.upgrade()?,
            flow: upgrade_optional(&weak.flow)?,
            surface: SurfaceCache::upgrade(&weak.surface)?,
        })
    }
}

fn flow_bytes(flow: &Flow) -> usize {
    size_of_val(flow.paths.pixels()) + size_of_val(flow.known.pixels())
}

/// CRC-32 of a cut-out and of its flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PixelChecksums {
    /// Of its texels, or of the file that has them.
    pub(crate) texture: u32,
    /// Of where light goes, or of the file that says so.
    pub(crate) flow: Option<u32>,
}

impl Pixels {
    /// Checksums of what is in memory.
    pub(super) fn checksums(&self) -> PixelChecksums {
        PixelChecksums {
            texture: self.texture.checksum(),
            flow: self.flow.as_ref().map(|flow| flow_checksum(flow)),
        }
    }
}

/// CRC-32 of where light goes and of the height over what is seen there; the width is the photo's.
fn flow_checksum(flow: &Flow) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&flow.height.to_le_bytes());
    for (path, known) in flow.paths.pixels().iter().zip(flow.known.pixels()) {
        let ([x, y], [sx, sy]) = (path.displacement, path.scatter_displacement);
        let values = [x, y, path.haze, sx, sy, path.scatter_width];
        hasher.update(bytemuck::bytes_of(&values));
        hasher.update(&[u8::from(*known)]);
    }
    hasher.finalize()
}

/// The share of the machine's memory that holds cut-outs of a folder, and as much again the plates
/// of its places: one in so many bytes.
const MEMORY_SHARE: u64 = 4;
/// Bytes that hold either where the machine's memory is not known.
const DEFAULT_BYTES: u64 = 1 << 30;

/// Memory of a film, its smaller levels and the map of its surface, for each of its pixels.
pub(super) const BYTES_PER_PIXEL: f64 =
    4.0 / 3.0 * (size_of::<Film>() + size_of::<SurfaceTexel>()) as f64;

/// Memory that holds cut-outs of a folder, or plates of its places, beside those that pictures in
/// the making show.
pub(crate) fn most_bytes() -> usize {
    let share = io::machine_bytes().map_or(DEFAULT_BYTES, |bytes| bytes / MEMORY_SHARE);
    usize::try_from(share).unwrap_or(usize::MAX)
}

/// The cut-outs of a folder; those that were shown last are in memory.
#[derive(Debug)]
pub(super) struct CutOutFiles {
    folder: PathBuf,
    kept: LruCache<Pixels>,
}

impl CutOutFiles {
    /// None of them read yet: they are read late, whatever the working folder is then.
    ///
    /// # Errors
    /// Without a working folder.
    pub(super) fn in_folder(folder: &Path) -> Result<Self> {
        Ok(Self {
            folder: io::absolute_folder(folder)?,
            kept: LruCache::of_bytes(most_bytes()),
        })
    }

    /// The pixels of a record, whose files have these checksums.
    ///
    /// # Errors
    /// [`Error::File`] for a file that cannot be read, has other bytes or holds values that no
    /// picture has.
    pub(super) fn pixels(&self, record: &PhotoRecord, files: PixelChecksums) -> Result<Pixels> {
        if let Some(pixels) = self.kept.get(&record.file) {
            return Ok(pixels);
        }
        let pixels = self.read(record, files)?;
        Ok(self.kept.insert(&record.file, pixels))
    }

    /// The same from the files, without keeping it.
    pub(super) fn read(&self, record: &PhotoRecord, files: PixelChecksums) -> Result<Pixels> {
        let path = io::inside(&self.folder, &record.file)?;
        let image: Image<Film> = io::read_checked(&path, |bytes| {
            check_unchanged(crc32fast::hash(bytes), files.texture)
        })?;
        check_pixels(&image).map_err(|what| Error::file(path, what))?;
        let flow = flow_file::read(&self.folder, record, image.size())?;
        if let (Some(path), Some(crc32)) = (flow_file::path(&self.folder, record)?, files.flow) {
            let found = Checksum::from_file(&path)?.crc32;
            check_unchanged(found, crc32).map_err(|what| Error::file(path, what))?;
        }
        Ok(Pixels {
            flow: flow.map(Arc::new),
            ..image.into()
        })
    }
}

/// Bytes of a file have the checksum that they had when its folder was opened.
pub(crate) fn check_unchanged(found: u32, expected: u32) -> std::result::Result<(), String> {
    if found == expected {
        return Ok(());
    }
    Err("has changed since its folder was opened".into())
}

/// What is wrong with the first pixel that no picture has.
pub(super) fn check_pixels(image: &Image<Film>) -> std::result::Result<(), String> {
    let unsound = image.pixels().iter().position(|p| !p.is_sound());
    unsound.map_or(Ok(()), |i| {
        let at = (i % image.width(), i / image.width());
        Err(unsound_pixel(&image[at], at))
    })
}

fn unsound_pixel(film: &Film, (x, y): (usize, usize)) -> String {
    let [color, opacity] = [film.color, film.opacity].map(<[f32; 3]>::from);
    format!(
        "colour {color:?} and opacity {opacity:?} at ({x}, {y}), expected finite colour and opacity from 0 to 1"
    )
}
