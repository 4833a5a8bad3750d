//! How a card displaces what is seen through it.

use crate::matte::Flow;
use std::sync::Arc;

/// How a card displaces what is seen through it; the default does not.
#[derive(Clone, Debug, Default)]
pub struct Refraction {
    /// The flows of its front and of its back; none if that side does not refract. A back without a
    /// texture of its own refracts like the front.
    pub flows: [Option<Arc<Flow>>; 2],
    /// Thickness of the body that the card stands for, metres: its middle is half of that above
    /// what it rests on.
    pub thickness: f64,
}

impl Refraction {
    /// Whether nothing is displaced.
    pub fn is_none(&self) -> bool {
        self.flows.iter().flatten().all(|flow| flow.is_empty())
    }
}
