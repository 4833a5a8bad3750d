//! A least-recently-used cache with a limit in bytes.

use std::fmt::Debug;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Processes that cache the same values, including this one.
static PROCESSES: AtomicUsize = AtomicUsize::new(1);

/// Limits every cache of this process to its share, where this many processes cache the same values.
pub fn share_memory(processes: usize) {
    PROCESSES.store(processes.max(1), Ordering::Relaxed);
}

fn own_share(bytes: usize) -> usize {
    bytes / PROCESSES.load(Ordering::Relaxed)
}

/// A value whose clones share its large parts.
pub(crate) trait Shared: Clone {
    /// A weak reference that finds the value again while a clone of it exists.
    type Weak: Debug;

    /// Maximum number of bytes it uses; always the same.
    fn bytes(&self) -> usize;

    /// A reference that keeps nothing alive.
    fn downgrade(&self) -> Self::Weak;

    /// The value, if a clone of it still exists.
    fn upgrade(weak: &Self::Weak) -> Option<Self>;
}

/// A type that knows how much memory it uses.
pub(crate) trait InMemory {
    /// Bytes, always the same.
    fn bytes(&self) -> usize;
}

impl<T: InMemory> Shared for Arc<T> {
    type Weak = Weak<T>;

    fn bytes(&self) -> usize {
        T::bytes(self)
    }

    fn downgrade(&self) -> Self::Weak {
        Arc::downgrade(self)
    }

    fn upgrade(weak: &Self::Weak) -> Option<Self> {
        weak.upgrade()
    }
}

/// Values by name: the most recently used ones are kept within a limit in bytes, but at least one
/// of any size; values that are held elsewhere are also kept, since they use no additional memory.
#[derive(Debug)]
pub(crate) struct LruCache<V: Shared> {
    most_bytes: usize,
    /// From least to most recently used.
    entries: Mutex<Vec<Cached<V>>>,
}

#[derive(Debug)]
struct Cached<V: Shared> {
    name: String,
    /// None where it is kept alive elsewhere.
    kept: Option<V>,
    weak: V::Weak,
}

impl<V: Shared> Cached<V> {
    fn value(&self) -> Option<V> {
        self.kept.clone().or_else(|| V::upgrade(&self.weak))
    }
}

impl<V: Shared> LruCache<V> {
    /// An empty cache that keeps this many bytes.
    pub(crate) fn of_bytes(most_bytes: usize) -> Self {
        Self {
            most_bytes,
            entries: Mutex::default(),
        }
    }

    /// The value of a name, which becomes the most recently used one.
    pub(crate) fn get(&self, name: &str) -> Option<V> {
        let mut entries = self.entries();
        let value = used(&mut entries, name)?;
        self.drop_oldest(entries);
        Some(value)
    }

    /// Keeps a value and returns it, or the one that another thread inserted first. Values are
    /// computed before the call, not under the lock, since the work may be parallel and a waiting
    /// thread may re-enter the cache.
    pub(crate) fn insert(&self, name: &str, value: V) -> V {
        let mut entries = self.entries();
        if let Some(known) = used(&mut entries, name) {
            return known;
        }
        entries.retain(|entry| entry.name != name && entry.value().is_some());
        entries.push(Cached {
            name: name.to_owned(),
            kept: Some(value.clone()),
            weak: value.downgrade(),
        });
        self.drop_oldest(entries);
        value
    }

    /// Drops values beyond its limit. Large memory is freed outside the lock, for which other
    /// threads wait.
    fn drop_oldest(&self, mut entries: MutexGuard<'_, Vec<Cached<V>>>) {
        let oldest = take_oldest(&mut entries, own_share(self.most_bytes));
        drop(entries);
        drop(oldest);
    }

    fn entries(&self) -> MutexGuard<'_, Vec<Cached<V>>> {
        // Every change is complete, even if a thread panicked afterwards.
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The value of a name, which becomes the most recently used one.
fn used<V: Shared>(entries: &mut [Cached<V>], name: &str) -> Option<V> {
    let place = entries.iter().position(|entry| entry.name == name)?;
    let value = entries[place].value()?;
    entries[place].kept = Some(value.clone());
    entries[place..].rotate_left(1);
    Some(value)
}

/// Removes the least recently used values until the others fit the limit.
fn take_oldest<V: Shared>(entries: &mut [Cached<V>], most_bytes: usize) -> Vec<V> {
    let mut taken = Vec::new();
    let bytes = |entry: &Cached<V>| entry.kept.as_ref().map_or(0, V::bytes);
    let mut total: usize = entries.iter().map(bytes).sum();
    let others = entries.len().saturating_sub(1);
    for entry in &mut entries[..others] {
        if total <= most_bytes {
            break;
        }
        total -= bytes(entry);
        taken.extend(entry.kept.take());
    }
    taken
}

/// [`Shared::upgrade`] for an optional reference.
pub(crate) fn upgrade_optional<T>(weak: &Option<Weak<T>>) -> Option<Option<Arc<T>>> {
    match weak {
        Some(weak) => weak.upgrade().map(Some),
        None => Some(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl InMemory for usize {
        fn bytes(&self) -> usize {
            *self
        }
    }

    fn found(cache: &LruCache<Arc<usize>>, name: &str) -> Option<usize> {
        cache.get(name).map(|value| *value)
    }

    #[test]
    fn what_was_used_last_stays() {
        let cache = LruCache::of_bytes(10);
        for (name, bytes) in [("a", 4), ("b", 5)] {
            assert_eq!(*cache.insert(name, Arc::new(bytes)), bytes);
        }
        assert_eq!(found(&cache, "a"), Some(4));
        cache.insert("c", Arc::new(6));
        assert_eq!(["b", "a"].map(|name| found(&cache, name)), [None, Some(4)]);
        cache.insert("d", Arc::new(100));
        let left = ["a", "c", "d"].map(|name| found(&cache, name));
        assert_eq!(left, [None, None, Some(100)]);
    }

    #[test]
    fn what_somebody_holds_is_not_made_twice() {
        let cache = LruCache::of_bytes(10);
        let held = cache.insert("a", Arc::new(8));
        cache.insert("b", Arc::new(8));
        let found = cache.get("a").unwrap();
        assert!(Arc::ptr_eq(&found, &held));
        drop((found, held));
        cache.insert("c", Arc::new(8));
        assert!(cache.get("a").is_none());
    }

    #[test]
    fn what_is_used_again_takes_the_place_of_others() {
        let cache = LruCache::of_bytes(10);
        let held = cache.insert("a", Arc::new(8));
        cache.insert("b", Arc::new(8));
        assert_eq!(found(&cache, "a"), Some(8));
        assert_eq!(found(&cache, "b"), None);
        drop(held);
        assert_eq!(found(&cache, "a"), Some(8));
    }

    #[test]
    fn the_first_of_two_threads_is_right() {
        let cache = LruCache::of_bytes(10);
        cache.insert("a", Arc::new(4));
        assert_eq!(*cache.insert("a", Arc::new(5)), 4);
    }
}
