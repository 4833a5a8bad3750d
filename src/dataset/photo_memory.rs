//! Photos of places kept in memory: the plates and masks that pictures used last.

use crate::dataset::known_files::KnownFiles;
use crate::image::Image;
use crate::lru::{InMemory, LruCache};
use crate::pixel::{Coverage, LinearRgb};
use std::sync::Arc;

/// Plates and masks of all places of a recipe, at each requested size.
#[derive(Debug)]
pub(crate) struct PhotoMemory {
    pub(crate) plates: LruCache<Arc<Image<LinearRgb>>>,
    pub(crate) masks: LruCache<Arc<Image<Coverage>>>,
    /// What they are read from.
    pub(crate) files: KnownFiles,
}

impl PhotoMemory {
    /// Room for this many bytes, as many plates as masks, in addition to those in use by pictures
    /// in progress.
    pub(crate) fn of_bytes(most_bytes: usize) -> Self {
        let [plate_px, mask_px] = [size_of::<LinearRgb>(), size_of::<Coverage>()];
        let pixels = most_bytes / (plate_px + mask_px);
        Self {
            plates: LruCache::of_bytes(pixels * plate_px),
            masks: LruCache::of_bytes(pixels * mask_px),
            files: KnownFiles::default(),
        }
    }
}

impl<P: Copy> InMemory for Image<P> {
    fn bytes(&self) -> usize {
        size_of_val(self.pixels())
    }
}
