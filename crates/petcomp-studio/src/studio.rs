//! What all requests share: the folder, and what each room keeps between them.

use crate::corners::Corners;
use crate::dataset::Dataset;
use crate::folder::Folder;
use crate::mattes::Mattes;
use crate::recipe::Recipe;
use tokio::sync::Semaphore;

/// Photos that are decoded at a time.
const MAX_DECODING: usize = 2;

/// The folder that is worked on, and the state of each room.
pub(crate) struct Studio {
    pub(crate) folder: Folder,
    /// How many photos may be decoded at a time for pages: a large one takes half a gigabyte.
    pub(crate) decoding: Semaphore,
    pub(crate) corners: Corners,
    pub(crate) mattes: Mattes,
    pub(crate) recipe: Recipe,
    pub(crate) dataset: Dataset,
}

impl Studio {
    pub(crate) fn new(folder: Folder) -> Self {
        Self {
            folder,
            decoding: Semaphore::new(MAX_DECODING),
            corners: Corners::default(),
            mattes: Mattes::default(),
            recipe: Recipe::default(),
            dataset: Dataset::default(),
        }
    }
}
