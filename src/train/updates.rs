//! How many epochs give equally many updates.

/// Number of batches in an epoch; the last may be smaller.
pub fn batches_per_epoch(images: u64, batch: u64) -> u64 {
    images.div_ceil(batch.max(1))
}

/// Weight updates of a training run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Updates {
    /// Batches in an epoch.
    pub batches: u64,
    /// Updates in all.
    pub total: u64,
}

impl Updates {
    /// The updates of `epochs` over `images` in batches of `batch`.
    pub fn new(images: u64, batch: u64, epochs: u64) -> Self {
        let batches = batches_per_epoch(images, batch);
        Self {
            batches,
            total: batches * epochs,
        }
    }

    /// How many epochs of `batches` batches give as many updates; rarely a whole number.
    pub fn epochs_of(&self, batches: u64) -> f64 {
        self.total as f64 / batches.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_the_paper() {
        let concatenated = Updates::new(1624 + 4000, 32, 300);
        assert_eq!((concatenated.batches, concatenated.total), (176, 52_800));
        assert_eq!(
            (batches_per_epoch(4000, 32), batches_per_epoch(1624, 32)),
            (125, 51)
        );
        // 422.4 and 1035.3: the paper rounds one up to 423 and the other down to 1035.
        assert_eq!(concatenated.epochs_of(125).ceil(), 423.0);
        assert_eq!(concatenated.epochs_of(51).floor(), 1035.0);
    }
}
