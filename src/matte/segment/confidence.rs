//! How far a segmentation can be believed.

use crate::matte::remark::Remark;
use serde::{Deserialize, Serialize};

/// How far an outline can be believed, 0 to 1 in each respect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Confidence {
    /// Share of the outline that lies on edges.
    pub support: f64,
    /// Mean overlap (intersection over union) with what searches at other depths found.
    pub agreement: f64,
}

/// An outline with less of itself on edges is worth a look.
const LEAST_SUPPORT: f64 = 0.6;
/// An outline that agrees less with other searches is worth a look.
const LEAST_AGREEMENT: f64 = 0.8;

impl Confidence {
    /// Both in one number: their product.
    pub fn value(self) -> f64 {
        self.support * self.agreement
    }

    /// Why it is low; nothing where it is not.
    pub(super) fn remarks(self) -> Vec<Remark> {
        let unstable = (self.agreement < LEAST_AGREEMENT).then_some(Remark::Unstable(self.agreement));
        let unsupported = (self.support < LEAST_SUPPORT).then_some(Remark::Unsupported(self.support));
        unstable.into_iter().chain(unsupported).collect()
    }
}
