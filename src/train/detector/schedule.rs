//! How fast to learn, when.

use serde::{Deserialize, Serialize};

/// Learning rate and momentum over the course of a training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Schedule {
    /// Learning rate after the warm-up. Default: 0.01.
    pub rate: f64,
    /// Learning rate at the end, reached along half a cosine. Default: 0.002.
    pub final_rate: f64,
    /// Epochs in which the rate rises from 0, in proportion. Default: 3.
    pub warmup_epochs: f64,
    /// Nesterov momentum. Default: 0.937.
    pub momentum: f64,
    /// Momentum at the start of the warm-up. Default: 0.8.
    pub warmup_momentum: f64,
    /// Weight decay, of the convolutions' weights alone. Default: 0.0005.
    pub weight_decay: f64,
}

impl Default for Schedule {
    fn default() -> Self {
        Self {
            rate: 0.01,
            final_rate: 0.002,
            warmup_epochs: 3.0,
            momentum: 0.937,
            warmup_momentum: 0.8,
            weight_decay: 0.0005,
        }
    }
}

impl Schedule {
    /// Learning rate and momentum of an update: `epoch` of `epochs`, after `part` (0 to 1) of its batches.
    pub fn at(&self, epoch: usize, part: f64, epochs: usize) -> [f64; 2] {
        let done = epoch as f64 / epochs.max(1) as f64;
        let fall = 0.5 * (1.0 - libm::cos(std::f64::consts::PI * done));
        let rate = self.rate + (self.final_rate - self.rate) * fall;
        let warm = if self.warmup_epochs > 0.0 { ((epoch as f64 + part) / self.warmup_epochs).min(1.0) } else { 1.0 };
        [rate * warm, self.warmup_momentum + (self.momentum - self.warmup_momentum) * warm]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_warms_up_and_falls_along_a_cosine() {
        let schedule = Schedule::default();
        let rate = |epoch, part| schedule.at(epoch, part, 300)[0];
        assert_eq!(schedule.at(0, 0.0, 300), [0.0, 0.8]);
        assert!((rate(1, 0.5) - 0.005).abs() < 1e-5);
        assert!((schedule.at(3, 0.0, 300)[1] - 0.937).abs() < 1e-12);
        assert!((rate(150, 0.0) - 0.006).abs() < 1e-12);
        assert!((rate(300, 0.0) - 0.002).abs() < 1e-12);
    }
}
