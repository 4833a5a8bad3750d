//! What a build has done so far, noted in the manifest from time to time, so that it can be resumed.

use super::entry::PhotoEntry;
use super::folder::{lock, read_or_new};
use super::list::List;
use super::manifest::PhotoRecord;
use crate::error::Result;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// From one writing of the manifest to the next.
const JOURNAL_INTERVAL: Duration = Duration::from_secs(10);

/// Cut-outs that are written, on their way into the manifest.
pub(super) struct Journal<'a> {
    list: &'a List,
    folder: &'a Path,
    waiting: Mutex<Waiting<'a>>,
}

struct Waiting<'a> {
    /// Cut-outs that were taken in by now.
    count: usize,
    since: Instant,
    cut_outs: Vec<(&'a PhotoEntry, PhotoRecord)>,
}

impl<'a> Journal<'a> {
    /// Of a list that is built into a folder.
    pub(super) fn new(list: &'a List, folder: &'a Path) -> Self {
        let waiting = Mutex::new(Waiting {
            count: 0,
            since: Instant::now(),
            cut_outs: Vec::new(),
        });
        Self {
            list,
            folder,
            waiting,
        }
    }

    /// Takes a cut-out in where there is one, and writes the manifest from time to time.
    pub(super) fn add(
        &self,
        entry: &'a PhotoEntry,
        record: Result<PhotoRecord>,
    ) -> Result<PhotoRecord> {
        let record = record?;
        let mut waiting = self.waiting();
        waiting.count += 1;
        waiting.cut_outs.push((entry, record.clone()));
        if waiting.since.elapsed() >= JOURNAL_INTERVAL {
            self.write_waiting(&mut waiting)?;
        }
        Ok(record)
    }

    /// How many cut-outs were taken in.
    pub(super) fn count(&self) -> usize {
        self.waiting().count
    }

    /// Writes the manifest with all that was taken in.
    pub(super) fn write(&self) -> Result<()> {
        self.write_waiting(&mut self.waiting())
    }

    fn write_waiting(&self, waiting: &mut Waiting) -> Result<()> {
        if waiting.cut_outs.is_empty() {
            return Ok(());
        }
        let _alone = lock(self.folder)?;
        let mut manifest = read_or_new(self.folder)?;
        self.list.add_classes_to(&mut manifest)?;
        for (entry, record) in &waiting.cut_outs {
            manifest.insert(entry.asset_with(record.clone()))?;
        }
        manifest.write(self.folder)?;
        waiting.cut_outs.clear();
        waiting.since = Instant::now();
        Ok(())
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting<'a>> {
        // Every change is whole, even where a thread panicked afterwards.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
