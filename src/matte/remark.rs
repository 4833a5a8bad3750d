//! What is odd about a photo without making it useless.

use crate::pixel::LinearRgb;

/// Something a person should know of a cut-out; it stands nevertheless.
#[non_exhaustive]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Remark {
    /// Something lies beside the object, too small to be one itself.
    #[error("left out what is {what}: too far from the object {object}")]
    LeftOut {
        /// Where it is, in words.
        what: String,
        /// Where the object is, in words.
        object: String,
    },
    /// The object reaches these borders of the photo.
    #[error("the object reaches the {} border: what lies beyond is missing from its size", .0.join(" and "))]
    Truncated(Vec<&'static str>),
    /// The background has no colour to key.
    #[error(
        "the background ({:.2}, {:.2}, {:.2}) is too grey to be keyed: the matte is the object's outline, nothing is see-through",
        .0.r, .0.g, .0.b
    )]
    GreyScreen(LinearRgb),
    /// Searches at other depths found another outline: they overlap with this one by this share.
    #[error("the outline is unsure: searches at other depths agree with it to {:.0} %", 100.0 * .0)]
    Unstable(f64),
    /// Only this share of the outline lies on edges.
    #[error("the outline is unsure: only {:.0} % of it lies on edges; is the object in focus, and is all of it seen?", 100.0 * .0)]
    Unsupported(f64),
    /// The key leaves this share of the screen.
    #[error("the key leaves {:.0} % of the screen: uneven light, or an object of the screen's hue", 100.0 * .0)]
    Residue(f32),
}

impl Remark {
    /// The cut-out may be wrong; otherwise it is merely less than it could be.
    pub fn is_doubt(&self) -> bool {
        !matches!(self, Self::GreyScreen(_))
    }
}
