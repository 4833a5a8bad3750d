//! What is odd about a photo without making it useless.

use super::film::ColorDoubts;
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
    /// What was taken for one object may be two beside each other.
    #[error("there may be two objects, {} and {}: nothing but a narrow gap joins them", .0[0], .0[1])]
    Parted([String; 2]),
    /// The object reaches these borders of the photo.
    #[error("the object reaches the {} border: what lies beyond is missing from its size", .0.join(" and "))]
    Truncated(Vec<&'static str>),
    /// The background has no colour to key.
    #[error(
        "the background ({:.2}, {:.2}, {:.2}) is too grey to tell what is see-through: guessed, as plastic has it",
        .0.r, .0.g, .0.b
    )]
    GreyScreen(LinearRgb),
    /// Searches at other depths found another outline: they overlap with this one by this share.
    #[error("the outline is unsure: searches at other depths agree with it to {:.0} %", 100.0 * .0)]
    Unstable(f64),
    /// Only this share of the outline lies on edges.
    #[error("the outline is unsure: only {:.0} % of it lies on edges; is the object in focus, and is all of it seen?", 100.0 * .0)]
    Unsupported(f64),
    /// A side of the box moves by so many pixels of the picture that was searched when edges must be stronger.
    #[error(
        "the outline is unsure: a search for stronger edges moves its box by {0:.0} pixels; is a part of it as faint as the screen?"
    )]
    Drifting(f64),
    /// The object's edges are blurred by this standard deviation, pixels of the picture that was searched.
    #[error("the object's edges are blurred by {0:.1} pixels: out of focus, or moved")]
    Blurred(f64),
    /// Only a picture so many times smaller let the object stand out from the noise.
    #[error(
        "the photo is noisy: the object was searched in a picture {0:.0} times smaller, and told no better than that"
    )]
    Noisy(f64),
    /// Something inside the object looks like the screen.
    #[error(
        "parts of the object look like the screen: taken for holes, or on a grey board for clear plastic; are they?"
    )]
    Hollow,
    /// A side of the box lies so many pixels of the picture that was searched beyond the outline.
    #[error(
        "the outline is unsure: its box lies {0:.0} pixels beyond its outline, where edges enclose nothing"
    )]
    Strayed(f64),
    /// So many specks lie on the screen.
    #[error(
        "{0} specks lie on the screen: one beside the object may have been taken for a part of it; wipe it, or look"
    )]
    Specks(usize),
    /// The object is only so many pixels wide.
    #[error(
        "the object is only {0:.0} pixels wide: its outline is told to a pixel; photograph it from nearer"
    )]
    Narrow(f64),
    /// This share of the screen is clipped: brighter than the camera can tell.
    #[error("{:.0} % of the screen is clipped: what the object lets through cannot be told; photograph it darker", 100.0 * .0)]
    ClippedScreen(f32),
    /// The key leaves this share of the screen.
    #[error("the key leaves {:.0} % of the screen: uneven light, or an object of the screen's hue", 100.0 * .0)]
    Residue(f32),
    /// This share of the object is brighter in the screen's hue than plastic in front of the screen can be.
    #[error(
        "{:.1} % of the object has the screen's hue: taken for opaque, but photograph it on another screen colour to be sure",
        100.0 * .0
    )]
    ScreenHue(f32),
    /// This share of the object looks like bare screen, where plastic is.
    #[error(
        "{:.1} % of the object looks like bare screen: keyed away, but it may be paint of the screen's hue; photograph it on another screen colour to be sure",
        100.0 * .0
    )]
    KeyedAway(f32),
    /// Tints that explain the photo as well let through so much more or less.
    #[error(
        "the plastic may have the screen's hue: its tint is told to +- {0:.2} only; photograph it on another screen colour"
    )]
    TintUnsure(f32),
    /// This share of the object is clipped: brighter than the camera can tell.
    #[error("{:.1} % of the object is clipped: its transmittance there is that of its surroundings", 100.0 * .0)]
    Clipped(f32),
    /// The object lay elsewhere in another photo, pixels right and down; it was moved back.
    #[error("photo {photo} lies ({:.2}, {:.2}) pixels off the first; it was moved back", .shift_px[0], .shift_px[1])]
    Moved {
        /// Which photo, counted from 1.
        photo: usize,
        /// How far it lay off.
        shift_px: [f64; 2],
    },
    /// The screens do not differ in this channel.
    #[error("the screens are too alike in {0}: its transmittance is told from the other channels")]
    Undetermined(&'static str),
}

impl Remark {
    /// It is about the colour and the transmittance of what is inside the outline, and says nothing of the outline.
    pub fn is_about_color(&self) -> bool {
        matches!(
            self,
            Self::GreyScreen(_)
                | Self::ScreenHue(_)
                | Self::KeyedAway(_)
                | Self::TintUnsure(_)
                | Self::Clipped(_)
        )
    }

    /// A person should look at the cut-out: it may be wrong. Otherwise it is merely less than it could be.
    pub fn is_doubt(&self) -> bool {
        match self {
            Self::LeftOut { .. }
            | Self::Parted(_)
            | Self::Truncated(_)
            | Self::Residue(_)
            | Self::Unstable(_)
            | Self::Unsupported(_)
            | Self::Drifting(_)
            | Self::Blurred(_)
            | Self::Noisy(_)
            | Self::Strayed(_)
            | Self::Hollow
            | Self::Specks(_)
            | Self::Narrow(_)
            | Self::ClippedScreen(_)
            | Self::GreyScreen(_) => true,
            Self::KeyedAway(share) => *share > ColorDoubts::LOOK.keyed_away,
            Self::ScreenHue(share) => *share > ColorDoubts::LOOK.screen_hue,
            Self::TintUnsure(off) => *off > ColorDoubts::LOOK.tint,
            Self::Clipped(_) | Self::Moved { .. } | Self::Undetermined(_) => false,
        }
    }
}
