//! Handles for C: numbers that are never reused, so that use of a closed handle is detected.

use crate::status::{Failure, Status};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Shared by all tables: a sample and a pipeline never have the same number.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// All open values of one kind.
pub(crate) struct Handles<T> {
    kind: &'static str,
    open: Mutex<BTreeMap<u64, Arc<T>>>,
}

impl<T> Handles<T> {
    pub(crate) const fn new(kind: &'static str) -> Self {
        Self {
            kind,
            open: Mutex::new(BTreeMap::new()),
        }
    }

    pub(crate) fn open(&self, value: T) -> u64 {
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        self.locked().insert(id, Arc::new(value));
        id
    }

    pub(crate) fn get(&self, id: u64) -> Result<Arc<T>, Failure> {
        let value = self.locked().get(&id).cloned();
        value.ok_or_else(|| self.closed(id))
    }

    /// Calls that still use the value may finish.
    pub(crate) fn close(&self, id: u64) -> Result<(), Failure> {
        let value = self.locked().remove(&id);
        value.map(drop).ok_or_else(|| self.closed(id))
    }

    fn closed(&self, id: u64) -> Failure {
        let message = format!("{} {id}: closed, or never opened", self.kind);
        Failure::new(Status::Closed, message)
    }

    fn locked(&self) -> MutexGuard<'_, BTreeMap<u64, Arc<T>>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
