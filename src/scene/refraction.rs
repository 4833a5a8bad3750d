//! How a card bends what is seen through it.

use crate::matte::Flow;
use std::sync::Arc;

/// How a card bends what is seen through it; the default does not.
#[derive(Clone, Debug, Default)]
pub struct Refraction {
    /// The flows of its front and of its back; none where that side does not bend. A back without a
    /// texture of its own bends as the front does.
    pub flows: [Option<Arc<Flow>>; 2],
    /// Thickness of the body that the card stands for, metres: half of it is how far its middle is
    /// from what it lies on.
    pub thickness: f64,
}

impl Refraction {
    /// Nothing is bent.
    pub fn is_none(&self) -> bool {
        self.flows.iter().flatten().all(|flow| flow.is_empty())
    }
}
