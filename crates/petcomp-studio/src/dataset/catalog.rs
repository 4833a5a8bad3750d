//! Listed folders, and what was read of their pictures so far.

use crate::folder::Folder;
use crate::refusal::{Answer, Refusal};
use crate::studio::next_number;
use axum::http::StatusCode;
use petcomp::dataset::index::{DatasetIndex, ObjectFacts, PictureFacts};
use serde::Serialize;
use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Maximum number of listings kept: two side by side in each of two tabs, and two previous ones.
const KEPT: usize = 6;

/// The most recently used listings of folders, the latest at the end.
#[derive(Default)]
pub(crate) struct Catalogs(Mutex<VecDeque<(String, Arc<Catalog>)>>);

impl Catalogs {
    /// Lists a folder, again if it was listed before; rows of the earlier listing stay valid.
    pub(super) fn open(&self, folder: &Folder, name: &str) -> Answer<Arc<Catalog>> {
        let index = DatasetIndex::open(&folder.folder(name)?)?;
        let catalog = Arc::new(Catalog::new(index));
        let mut kept = self.kept();
        kept.push_back((name.to_owned(), catalog.clone()));
        if kept.len() > KEPT {
            kept.pop_front();
        }
        Ok(catalog)
    }

    /// A listing of a folder by its number; without a number, the most recently used one.
    pub(super) fn get(
        &self,
        folder: &Folder,
        name: &str,
        listing: Option<u64>,
    ) -> Answer<Arc<Catalog>> {
        match (self.find(name, listing), listing) {
            (Some(known), _) => Ok(known),
            (None, None) => self.open(folder, name),
            (None, Some(_)) => Err(forgotten(name)),
        }
    }

    fn find(&self, name: &str, listing: Option<u64>) -> Option<Arc<Catalog>> {
        let mut kept = self.kept();
        let place = kept.iter().rposition(|(known, catalog)| {
            known == name && listing.is_none_or(|listing| listing == catalog.listing)
        })?;
        let used = kept.remove(place)?;
        let catalog = used.1.clone();
        kept.push_back(used);
        Some(catalog)
    }

    fn kept(&self) -> MutexGuard<'_, VecDeque<(String, Arc<Catalog>)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn forgotten(name: &str) -> Refusal {
    let name = petcomp::printable(name);
    let what = format!("this listing of \"{name}\" has expired; reload the page");
    Refusal::new(StatusCode::NOT_FOUND, what)
}

/// The pictures of a folder when it was listed.
pub(super) struct Catalog {
    /// Number of the listing: listing the same folder again gives another number.
    pub(super) listing: u64,
    pub(super) index: DatasetIndex,
    /// None for a picture whose record cannot be read.
    facts: Vec<OnceLock<Option<PictureFacts>>>,
    read: AtomicUsize,
    is_reading: AtomicBool,
}

/// A picture as shown in a list.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    row: usize,
    name: String,
    part: Option<petcomp::dataset::Part>,
    background: String,
    objects: Vec<ObjectFacts>,
    flags: Vec<Flag>,
}

/// Reasons to look at a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Flag {
    /// Objects lie on top of each other in a cycle.
    Knotted,
    /// A scene was rejected before this one.
    Rejected,
    /// There is no object.
    Empty,
    /// There are objects, but none has a label.
    Unlabelled,
    /// There are objects without a class.
    Distractors,
    /// Its record cannot be read.
    Unreadable,
}

impl Catalog {
    fn new(index: DatasetIndex) -> Self {
        Self {
            listing: next_number(),
            facts: index.pictures.iter().map(|_| OnceLock::new()).collect(),
            read: AtomicUsize::new(0),
            is_reading: AtomicBool::new(false),
            index,
        }
    }

    /// Checks that a row exists.
    pub(super) fn checked(&self, row: usize) -> Answer<usize> {
        let count = self.index.pictures.len();
        if row < count {
            return Ok(row);
        }
        let what = format!("row: {row}, expected less than {count}");
        Err(Refusal::new(StatusCode::NOT_FOUND, what))
    }

    /// The contents of a picture, read now if necessary; none if they cannot be read.
    pub(super) fn facts(&self, row: usize) -> Option<&PictureFacts> {
        let facts = self.facts[row].get_or_init(|| {
            self.read.fetch_add(1, Ordering::Relaxed);
            let read = self.index.facts(row);
            read.inspect_err(|error| log::warn!("{error}")).ok()
        });
        facts.as_ref()
    }

    /// The contents of a picture, without reading anything; none if not read yet.
    pub(super) fn known(&self, row: usize) -> Option<&Option<PictureFacts>> {
        self.facts[row].get()
    }

    /// Number of pictures read so far.
    pub(super) fn read_count(&self) -> usize {
        self.read.load(Ordering::Relaxed)
    }

    /// Reads all remaining pictures, while what is known can already be used.
    pub(super) fn read_in_background(self: &Arc<Self>) {
        let is_done = self.read_count() == self.index.pictures.len();
        if is_done || self.is_reading.swap(true, Ordering::Relaxed) {
            return;
        }
        let catalog = Arc::downgrade(self);
        tokio::task::spawn_blocking(move || {
            let mut row = 0;
            // Ends when the listing is dropped.
            while let Some(catalog) = catalog.upgrade() {
                if row == catalog.index.pictures.len() {
                    break;
                }
                catalog.facts(row);
                row += 1;
            }
        });
    }

    /// Photos of the place in the pictures read so far.
    pub(super) fn backgrounds(&self) -> BTreeSet<String> {
        let known = self.facts.iter().filter_map(|facts| facts.get()?.as_ref());
        let named = known.filter(|facts| !facts.background.is_empty());
        named.map(|facts| facts.background.clone()).collect()
    }

    /// A picture for a list.
    pub(super) fn row(&self, row: usize) -> Answer<Row> {
        let picture = &self.index.pictures[self.checked(row)?];
        let facts = self.facts(row).cloned().unwrap_or_default();
        Ok(Row {
            row,
            name: picture.name.clone(),
            part: picture.part,
            background: facts.background,
            objects: facts.objects,
            flags: self.flags(row),
        })
    }

    /// The known flags of a picture.
    pub(super) fn flags(&self, row: usize) -> Vec<Flag> {
        let all = [
            Flag::Knotted,
            Flag::Rejected,
            Flag::Empty,
            Flag::Unlabelled,
            Flag::Distractors,
            Flag::Unreadable,
        ];
        let raised = all.into_iter();
        raised
            .filter(|flag| self.has_flag(row, *flag) == Some(true))
            .collect()
    }

    /// Whether a picture has a flag; none if that is not known yet.
    pub(super) fn has_flag(&self, row: usize, flag: Flag) -> Option<bool> {
        let written = self.index.pictures[row].written.as_ref();
        match flag {
            Flag::Knotted => Some(written.is_some_and(|written| written.knotted > 0)),
            Flag::Rejected => Some(written.is_some_and(|written| written.rejected > 0)),
            Flag::Empty => Some(self.counts(row)?[0] == 0),
            Flag::Unlabelled => self
                .counts(row)
                .map(|[objects, labels]| objects > 0 && labels == 0),
            Flag::Distractors => self.of_facts(row, |facts| facts.distractors > 0),
            Flag::Unreadable => Some(self.known(row)?.is_none()),
        }
    }

    /// Numbers of objects and labels of a picture; none if not known yet.
    pub(super) fn counts(&self, row: usize) -> Option<[usize; 2]> {
        if let Some(written) = &self.index.pictures[row].written {
            return Some([0, 1].map(|which| written.count(which) as usize));
        }
        let facts = self.known(row)?.as_ref()?;
        Some([facts.objects.len(); 2])
    }

    /// A property that only the record contains: false if it cannot be read, none before it was
    /// read.
    pub(super) fn of_facts(
        &self,
        row: usize,
        is_so: impl Fn(&PictureFacts) -> bool,
    ) -> Option<bool> {
        let facts = self.known(row)?;
        Some(facts.as_ref().is_some_and(is_so))
    }
}
