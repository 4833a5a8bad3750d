//! Text and numbers in HTML and SVG.

use crate::error::printable;
use maud::{Markup, Render, html};

/// A text to be put into markup, which escapes it; control characters, which SVG does not allow,
/// are written out.
pub(crate) fn text(text: &str) -> impl Render {
    printable(text)
}

/// Text as it may stand in HTML and SVG, attributes included; control characters, which SVG does
/// not allow, are written out.
pub fn escaped(text: &str) -> String {
    html! { (printable(text)) }.into_string()
}

/// A length in a drawing: a tenth of a pixel is as fine as anybody sees.
pub(super) fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// A word at a place of a drawing; `anchor` says which end of it is there.
pub(super) fn label(x: f64, y: f64, anchor: &str, content: &str) -> Markup {
    html! { text x=(tenths(x)) y=(tenths(y)) text-anchor=(anchor) { (text(content)) } }
}

/// A text of at most so many letters; one that is cut ends in an ellipsis.
pub(crate) fn clipped(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    let kept = text.chars().take(letters.saturating_sub(1));
    kept.chain(['…']).collect()
}
