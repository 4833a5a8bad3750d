//! The measured datasets.

use serde::{Deserialize, Serialize};

/// A kind of picture, and the number generated at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScaleCase {
    /// Threads, each of which generates its own pictures.
    pub threads: usize,
    /// Width and height, pixels.
    pub image: [u32; 2],
    /// Number of cards in a picture.
    pub cards: usize,
    /// Factor on the sides of the cards, which gives the same number of cards fewer or more layers.
    pub scale: f64,
}

/// The picture of a typical dataset: the recipe's defaults, with the maximum number of cards.
pub(super) const DEFAULT_PICTURE: ScaleCase = ScaleCase {
    threads: 1,
    image: [640, 480],
    cards: 12,
    scale: 1.0,
};

/// From 1 to 33 megapixels, in aspect ratios of cameras.
const LARGER_IMAGES: [[u32; 2]; 4] = [[1152, 864], [2048, 1536], [3648, 2736], [7680, 4320]];
/// Numbers of cards with factors on their sides, so that cards and layers do not grow together.
const CARDS: [(usize, f64); 12] = [
    (1, 1.0),
    (3, 1.0),
    (10, 1.0),
    (30, 1.0),
    (100, 1.0),
    (300, 1.0),
    (30, 0.5),
    (100, 0.5),
    (300, 0.5),
    (300, 0.25),
    (10, 2.0),
    (30, 2.0),
];
/// Corners of the grid, where terms that fit only along its edges would show: few pixels, and many
/// pixels without layers.
const CORNERS: [([u32; 2], usize, f64); 4] = [
    ([160, 120], 12, 1.0),
    ([160, 120], 100, 1.0),
    ([2048, 1536], 1, 0.5),
    ([2048, 1536], 100, 0.5),
];

/// Numbers of cards that fall together.
pub(super) const FALL_SIZES: [usize; 5] = [1, 5, 12, 20, 40];

/// Every case: the default picture on 1, 2, 4 ... threads, then sizes, cards and corners on one.
pub(super) fn cases(max_threads: usize) -> Vec<ScaleCase> {
    let default = DEFAULT_PICTURE;
    let threads = thread_counts(max_threads).map(|threads| ScaleCase { threads, ..default });
    let sizes = LARGER_IMAGES.map(|image| ScaleCase { image, ..default });
    let cards = CARDS.map(|(cards, scale)| ScaleCase {
        cards,
        scale,
        ..default
    });
    let corners = CORNERS.map(|(image, cards, scale)| ScaleCase {
        image,
        cards,
        scale,
        ..default
    });
    threads.chain(sizes).chain(cards).chain(corners).collect()
}

/// Powers of two up to the maximum, and the maximum.
fn thread_counts(max_threads: usize) -> impl Iterator<Item = usize> {
    let powers = std::iter::successors(Some(1), |n| Some(2 * n));
    powers
        .take_while(move |n| *n < max_threads)
        .chain([max_threads.max(1)])
}

impl ScaleCase {
    /// Millions of pixels in a picture.
    pub fn megapixels(&self) -> f64 {
        f64::from(self.image[0]) * f64::from(self.image[1]) * 1e-6
    }

    /// Whether it is the default picture, on any number of threads.
    pub(super) fn is_default_picture(&self) -> bool {
        let single = Self {
            threads: 1,
            ..*self
        };
        single == DEFAULT_PICTURE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_go_up_to_what_is_asked_and_the_rest_is_on_one() {
        let threads = |most: usize| {
            cases(most)
                .iter()
                .map(|case| case.threads)
                .filter(|n| *n > 1)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            (threads(4), threads(6), threads(1)),
            (vec![2, 4], vec![2, 4, 6], vec![])
        );
        assert!(threads(0).is_empty());
    }

    #[test]
    fn the_grid_spans_what_the_report_promises() {
        let cases = cases(1);
        let span = |of: fn(&ScaleCase) -> f64| {
            cases
                .iter()
                .map(of)
                .fold([f64::INFINITY, 0.0], |[low, high], v| {
                    [v.min(low), v.max(high)]
                })
        };
        assert!(span(ScaleCase::megapixels)[0] < 0.3 && span(ScaleCase::megapixels)[1] > 33.0);
        assert_eq!(span(|case| case.cards as f64), [1.0, 300.0]);
    }
}
