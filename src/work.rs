//! Work: what a scene made the stages do, counted, not timed.
//!
//! The stages count once per row, tile or call, with numbers that they have anyway. Without the
//! feature `counters` counting compiles to nothing; with it, `counted` runs a job and returns the
//! work it did.
#![cfg_attr(
    not(feature = "counters"),
    allow(dead_code, unreachable_pub, reason = "nothing is counted")
)]

#[cfg(feature = "counters")]
mod tally;

#[cfg(feature = "counters")]
pub use tally::{LARGE_BYTES, Work, allocated, counted, pool};
#[cfg(feature = "counters")]
pub(crate) use tally::{add, add_all};

/// Counts nothing.
#[cfg(not(feature = "counters"))]
#[inline]
pub(crate) fn add(_: Kind, _: u64) {}

/// Counts nothing.
#[cfg(not(feature = "counters"))]
#[inline]
pub(crate) fn add_all<const N: usize>(_: [(Kind, u64); N]) {}

/// A pool of this many threads.
#[cfg(not(feature = "counters"))]
pub(crate) fn pool(threads: usize) -> std::io::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(std::io::Error::other)
}

/// Kinds of work with their names; their meaning is written once, for the documentation and for
/// tables.
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

            /// Its name in tables.
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
    /// Receiver nodes times samples of area lights: light before occlusion
    LightSamples, "light samples";
    /// Receiver nodes times samples of lights and sky that a card or the surface may occlude
    ShadowRays, "shadow rays";
    /// Transmittance lookups of see-through cards: one per card that a shadow ray crosses
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
    /// Pixels of cards in which the background is displaced
    BentPixels, "bent pixels";
    /// Textures prepared for a picture or a shadow: a mip level in the card's own colours
    Bakes, "bakes";
    /// Levels of detail made
    Levels, "levels of detail";
    /// Blurs, changes of size, gains and other filters over a whole picture
    Filters, "filters";
    /// Pixels of frames that get noise
    NoisyPixels, "noisy pixels";
    /// Deep samples looked at for labels
    LabelSamples, "label samples";
    /// Masks drawn for labels, two per object
    Masks, "masks";
    /// Pictures encoded
    Encodes, "encodes";
    /// Bytes of files written
    BytesWritten, "bytes written";
    /// Files written from memory that are put on the disk each by itself
    SyncedFiles, "synced files";
    /// Files read
    FilesRead, "files read";
    /// Bytes of files read
    BytesRead, "bytes read";
    /// Allocations of 1 MiB or more; where a program's allocator reports them
    LargeAllocations, "large allocations";
}

#[cfg(test)]
mod tests {
    use super::*;

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
            ("masks", "Masks drawn for labels, two per object")
        );
    }
}
