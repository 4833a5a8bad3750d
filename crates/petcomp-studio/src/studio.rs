//! State shared by all requests: the folder, and what each page keeps between them.

use crate::corners::Corners;
use crate::dataset::Catalogs;
use crate::folder::Folder;
use crate::mattes::Mattes;
use crate::recipe::Recipe;
use crate::refusal::Answer;
use crate::turn::blocking;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tokio::sync::Semaphore;

/// Maximum number of photos decoded at the same time.
const MAX_DECODING: usize = 2;

/// A number that is unique in this process.
pub(crate) fn next_number() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// The studio's folder, and the state of each page.
pub(crate) struct Studio {
    pub(crate) folder: Folder,
    /// Limits how many photos are decoded at the same time for pages: a large one takes half a
    /// gigabyte.
    decoding: Arc<Semaphore>,
    pub(crate) corners: Corners,
    pub(crate) mattes: Mattes,
    pub(crate) recipe: Recipe,
    pub(crate) dataset: Catalogs,
}

impl Studio {
    pub(crate) fn new(folder: Folder) -> Self {
        Self {
            folder,
            decoding: Arc::new(Semaphore::new(MAX_DECODING)),
            corners: Corners::default(),
            mattes: Mattes::default(),
            recipe: Recipe::default(),
            dataset: Catalogs::default(),
        }
    }

    /// Decodes a photo for a page. Its place stays taken until the work is done, also where whoever
    /// asked has hung up: the work goes on.
    pub(crate) async fn decode<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> Answer<T> + Send + 'static,
    ) -> Answer<T> {
        let permit = self.decoding.clone().acquire_owned().await;
        blocking(move || {
            let _permit = permit;
            work()
        })
        .await
    }
}
