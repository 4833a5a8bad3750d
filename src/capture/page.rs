//! The page that shows frames full screen, in one HTML file that needs nothing else.

use super::display::Display;
use super::frame::Frame;
use crate::plot::base64;
use maud::{DOCTYPE, PreEscaped, html};

/// How the page looks, and what it does.
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// A page that shows frames one after the other, by key press, click or timer; `frames` are their
/// PNG files in order.
pub fn page(display: &Display, frames: &[(Frame, Vec<u8>)]) -> String {
    let [w, h] = display.size_px;
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "petcomp capture: " (frames.len()) " frames, " (w) " x " (h) }
                style { (PreEscaped(STYLE)) }
            }
            body data-width=(w) data-height=(h) {
                (ruler())
                (instructions(frames.len()))
                @for (frame, png) in frames {
                    img.frame alt=(frame) title="" src={ "data:image/png;base64," (base64(png)) };
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    page.into_string()
}

/// An arrow as wide as a frame, which a person measures.
fn ruler() -> maud::Markup {
    html! {
        div #ruler { span { "width: measure this from end to end" } }
    }
}

fn instructions(frames: usize) -> maud::Markup {
    html! {
        main #setup {
            h1 { "Capture with " (frames) " photos" }
            p #fit {}
            ol {
                li { "Display: full brightness; automatic brightness, night light and true tone off. Wipe it clean." }
                li { "Full screen: " kbd { "F" } ". Measure the width of the arrow at the top, in metres: it goes into display.toml." }
                li { "Camera on a stand, straight above; exposure, focus and white balance locked, so that white is not clipped." }
                li { "Put the object in the middle. It must not hide a marker; nothing may move until the last photo is taken." }
                li {
                    "One photo of each frame: next " kbd { "→" } " or a click, back " kbd { "←" } ", this page " kbd { "Esc" }
                    ", a frame every " input #seconds type="number" min="1" max="60" value="4"; " seconds " kbd { "T" } "."
                }
                li { "If you can, take all of them again without the object." }
            }
        }
    }
}
