//! Work: what a scene made the stages do, counted and not timed.
//!
//! [`counted`] runs a job and tells what it did. The stages count by themselves, once per row, tile or call, with numbers
//! that they have anyway, and only while somebody listens: else a count is a look at a thread's own empty cell.
//!
//! # Why a pool that listens
//! A value handed back by every function would have to go through filters, lazily made levels of detail and readers of
//! files, which return what they make to whoever asks first. A global sum would mix scenes that are made side by side.
//! So a job that is counted runs on threads of its own, which all know where to add; two jobs share no thread, hence no
//! sum. Sums of whole numbers do not depend on their order, and what may be made twice by threads that race for it is
//! counted where it is kept, so the numbers are the same at any thread count. Nothing that is counted decides a byte.

use std::cell::RefCell;
use std::ops::Index;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes from which on an allocation is a large one.
pub const LARGE: usize = 1 << 20;

/// Kinds of work with their names; what they mean is said once, for the documentation and for tables.
macro_rules! kinds {
    ($(#[doc = $meaning:literal] $kind:ident, $name:literal;)*) => {
        /// A kind of work.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Kind {
            $(#[doc = $meaning] $kind,)*
        }

        impl Kind {
            /// All of them.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$kind),*];

            /// What it is called in tables.
            pub const fn name(self) -> &'static str {
                [$($name),*][self as usize]
            }

            /// What is counted.
            pub fn meaning(self) -> &'static str {
                [$($meaning),*][self as usize].trim()
            }
        }
    };
}

kinds! {
    /// Physics worlds built
    PhysicsWorlds, "physics worlds";
    /// Time steps of all physics worlds
    PhysicsSteps, "physics steps";
    /// Places on receivers times samples of area lights: light before anything is in its way
    LightSamples, "light samples";
    /// Places on receivers times samples of lights and sky that a card, or the surface, may be in the way of
    ShadowRays, "shadow rays";
    /// Readings of how much light a see-through card lets pass: one for each card in the way of a shadow ray, 3 with film
    Transmittances, "transmittances";
    /// The same for cards that are opaque all over, whose textures are read along their edges alone
    OpaqueEdges, "opaque edges";
    /// Pieces of an environment map, weighed for each receiver
    MapPieces, "map pieces";
    /// Texture readings of the picture: cards times sub-samples of pixels
    TextureSamples, "texture samples";
    /// Texture readings of pictures that carry a transmittance for each channel
    FilmSamples, "film samples";
    /// Pixels (or sub-samples) of cards that light is looked up for
    ShadedSamples, "shaded samples";
    /// Pixels of the surface that a shadow is looked up for
    ShadowedPixels, "shadowed pixels";
    /// Textures made ready for a picture or a shadow: a level of detail in the card's own colours
    Bakes, "bakes";
    /// Levels of detail made
    Levels, "levels of detail";
    /// Blurs, changes of size, gains and other filters over a whole picture
    Filters, "filters";
    /// Pixels of frames that get noise
    NoisyPixels, "noisy pixels";
    /// Deep samples looked at for labels
    LabelSamples, "label samples";
    /// Masks drawn for labels, two an object
    Masks, "masks";
    /// Pictures encoded
    Encodes, "encodes";
    /// Bytes of files written
    BytesWritten, "bytes written";
    /// Files read
    FilesRead, "files read";
    /// Bytes of files read
    BytesRead, "bytes read";
    /// Allocations of 1 MiB or more; where a program's allocator tells
    LargeAllocations, "large allocations";
}

/// How much of each kind was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work([u64; Kind::ALL.len()]);

impl Index<Kind> for Work {
    type Output = u64;

    fn index(&self, kind: Kind) -> &u64 {
        &self.0[kind as usize]
    }
}

/// Sums that threads add to.
#[derive(Debug, Default)]
struct Tally([AtomicU64; Kind::ALL.len()]);

impl Tally {
    fn work(&self) -> Work {
        Work(std::array::from_fn(|i| self.0[i].load(Ordering::Relaxed)))
    }
}

thread_local! {
    /// Where this thread adds what it does; nowhere on most.
    static LISTENER: RefCell<Option<Arc<Tally>>> = const { RefCell::new(None) };
}

/// Runs a job on as many threads as the current pool has, and tells what it did.
///
/// A job inside of a job tells the outer one nothing. Threads that the job starts by itself are not heard, other than
/// those of this library.
///
/// # Errors
/// When the system gives no threads.
pub fn counted<T: Send>(job: impl FnOnce() -> T + Send) -> std::io::Result<(T, Work)> {
    let tally = Arc::new(Tally::default());
    let done = pool_for(Some(tally.clone()), rayon::current_num_threads())?.install(job);
    // A job is over when all its parts are.
    Ok((done, tally.work()))
}

/// A pool whose threads are listened to by whoever listens to this one.
pub fn pool(threads: usize) -> std::io::Result<rayon::ThreadPool> {
    pool_for(LISTENER.with_borrow(Clone::clone), threads)
}

fn pool_for(listener: Option<Arc<Tally>>, threads: usize) -> std::io::Result<rayon::ThreadPool> {
    let listens = move |_| LISTENER.set(listener.clone());
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .start_handler(listens)
        .build();
    pool.map_err(std::io::Error::other)
}

/// Adds to what this thread's job did.
#[inline]
pub(crate) fn add(kind: Kind, count: u64) {
    add_all([(kind, count)]);
}

/// Adds several kinds at once.
#[inline]
pub(crate) fn add_all<const N: usize>(counts: [(Kind, u64); N]) {
    LISTENER.with_borrow(|listener| {
        let Some(tally) = listener else { return };
        for (kind, count) in counts {
            tally.0[kind as usize].fetch_add(count, Ordering::Relaxed);
        }
    });
}

/// For the allocator of a program that counts: so many bytes were asked for at once.
///
/// Small ones cost a comparison. Never allocates.
#[inline]
pub fn allocated(bytes: usize) {
    if bytes >= LARGE {
        // A thread that ends has no listener any more.
        let _ = LISTENER.try_with(|listener| {
            if let Ok(Some(tally)) = listener.try_borrow().as_deref() {
                tally.0[Kind::LargeAllocations as usize].fetch_add(1, Ordering::Relaxed);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    fn job(n: u64) -> u64 {
        (0..n).into_par_iter().for_each(|_| add(Kind::Filters, 2));
        n
    }

    #[test]
    fn every_thread_of_a_job_is_heard() {
        let (done, work) = counted(|| job(1000)).unwrap();
        assert_eq!(
            (done, work[Kind::Filters], work[Kind::Masks]),
            (1000, 2000, 0)
        );
    }

    #[test]
    fn jobs_side_by_side_are_not_mixed() {
        let works: Vec<_> = (0..8_u64)
            .into_par_iter()
            .map(|k| counted(|| job(10 * k)).unwrap().1)
            .collect();
        assert!(
            works
                .iter()
                .zip(0..)
                .all(|(work, k)| work[Kind::Filters] == 20 * k)
        );
    }

    #[test]
    fn nobody_listens_outside_of_a_job() {
        let _ = counted(|| job(10)).unwrap();
        job(10);
        let (_, work) = counted(|| ()).unwrap();
        assert_eq!(work, Work::default());
    }

    #[test]
    fn pools_that_a_job_opens_are_heard() {
        let (_, work) = counted(|| pool(2).unwrap().install(|| job(7))).unwrap();
        assert_eq!(work[Kind::Filters], 14);
        let (_, work) = counted(|| counted(|| job(7)).unwrap()).unwrap();
        assert_eq!(work, Work::default(), "a job inside tells its own listener");
    }

    #[test]
    fn large_allocations_are_told_and_small_ones_are_not() {
        let (_, work) = counted(|| [LARGE - 1, LARGE, usize::MAX].map(allocated)).unwrap();
        // The program's own allocator may count as well; here there is none.
        assert_eq!(work[Kind::LargeAllocations], 2);
    }

    #[test]
    fn kinds_lie_where_their_list_says() {
        assert!(
            Kind::ALL
                .iter()
                .enumerate()
                .all(|(i, kind)| *kind as usize == i)
        );
        assert_eq!(
            (Kind::Masks.name(), Kind::Masks.meaning()),
            ("masks", "Masks drawn for labels, two an object")
        );
    }
}
