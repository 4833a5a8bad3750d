//! What happened in each epoch, as a table and as curves.

use crate::error::Result;
use crate::io;
use crate::report::{Axis, Chart};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::Path;

/// One epoch of a training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Epoch {
    /// Mean loss of an image, weighted as in training: box, objectness, class.
    pub losses: [f64; 3],
    /// Learning rate of the last update.
    pub rate: f64,
    /// Scores of the validation set by the definition of YOLOv5.
    pub map50: f64,
    /// See [`map50`](Self::map50); mAP@0.5:0.95.
    pub map: f64,
}

/// All epochs so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// In order.
    pub epochs: Vec<Epoch>,
}

impl History {
    /// Place of the epoch with the best mAP@0.5:0.95, the first of equals; none before the first.
    pub fn best(&self) -> Option<usize> {
        let better = |best: Option<usize>, i: usize| match best {
            Some(b) if self.epochs[i].map <= self.epochs[b].map => best,
            _ => Some(i),
        };
        (0..self.epochs.len()).fold(None, better)
    }

    /// Writes `history.csv` and `curves.svg` (loss and mAP over epochs).
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) for what cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        io::write_text(folder.join("history.csv"), &self.csv())?;
        io::write_text(folder.join("curves.svg"), &self.picture())
    }

    fn csv(&self) -> String {
        let mut text = "epoch,box,objectness,class,rate,map50,map\n".to_owned();
        for (i, e) in self.epochs.iter().enumerate() {
            let [bbox, object, class] = e.losses;
            let _ =
                writeln!(text, "{},{bbox:.6},{object:.6},{class:.6},{:.6},{:.6},{:.6}", i + 1, e.rate, e.map50, e.map);
        }
        text
    }

    fn picture(&self) -> String {
        let curve = |value: &dyn Fn(&Epoch) -> f64| {
            self.epochs.iter().enumerate().map(|(i, e)| [(i + 1) as f64, value(e)]).collect::<Vec<_>>()
        };
        let across = Axis { title: "epoch".into(), range: [0.0, self.epochs.len().max(1) as f64], logarithmic: false };
        let losses: Vec<_> = (0..3).map(|part| curve(&|e| e.losses[part])).collect();
        let names = ["box, mAP@0.5", "object, mAP@0.5:0.95", "class"];
        let loss = Chart {
            title: "loss per image".into(),
            names: names.map(String::from).into(),
            across: across.clone(),
            up: Axis::over_decades("loss", losses.iter().flatten().map(|p| p[1])),
            curves: losses,
            ..Chart::default()
        };
        let scores = Chart {
            title: "mAP of the validation set".into(),
            across,
            up: Axis { title: "mAP".into(), range: [0.0, 1.0], logarithmic: false },
            curves: vec![curve(&|e| e.map50), curve(&|e| e.map)],
            defaults: self.best().map(|i| [(i + 1) as f64, self.epochs[i].map]).into_iter().collect(),
            ..Chart::default()
        };
        Chart::row(&[loss, scores])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_equally_good_epochs_is_the_best() {
        let epoch = |map| Epoch { map, ..Epoch::default() };
        let history = History { epochs: vec![epoch(0.1), epoch(0.4), epoch(0.4), epoch(0.2)] };
        assert_eq!((history.best(), History::default().best()), (Some(1), None));
        assert_eq!(history.csv().lines().count(), 5);
        assert!(!history.picture().contains("NaN") && !History::default().picture().contains("NaN"));
    }
}
