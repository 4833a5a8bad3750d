//! Text and numbers in HTML and SVG.

use crate::error::printable;
use maud::{Markup, Render, html};

/// A text for markup, which escapes it; control characters, which SVG does not allow, are written
/// out.
pub(crate) fn text(text: &str) -> impl Render {
    printable(text)
}

/// Text escaped for HTML and SVG, attributes included; control characters, which SVG does not
/// allow, are written out.
pub fn escaped(text: &str) -> String {
    html! { (printable(text)) }.into_string()
}

/// A length in a drawing: nobody sees differences below a tenth of a pixel.
pub(super) fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// A word at a position of a drawing; `anchor` is the end of it that is there.
pub(super) fn label(x: f64, y: f64, anchor: &str, content: &str) -> Markup {
    html! { text x=(tenths(x)) y=(tenths(y)) text-anchor=(anchor) { (text(content)) } }
}

/// A text truncated to at most this many letters, with an ellipsis at the end.
pub(crate) fn clipped(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    let kept = text.chars().take(letters.saturating_sub(1));
    kept.chain(['…']).collect()
}
