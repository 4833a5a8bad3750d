//! Pictures in a grid on a page, each enlarged by a click or the keyboard, without further files.

use crate::color::to_srgb8;
use crate::error::{Error, Result};
use crate::filter::resize;
use crate::geom::BBox;
use crate::image::{Image, Roi};
use crate::io;
use crate::pixel::LinearRgb;
use crate::plot::base64;
pub(crate) use crate::plot::clipped;
use crate::plot::markup::text;
use maud::{Markup, PreEscaped, html};
use std::ops::Range;
use std::path::Path;

/// Longest side of a picture on a page, pixels, and its quality as JPEG: about 30 kB.
const MAX_SIDE_PX: f64 = 480.0;
const JPEG_QUALITY: u8 = 82;
/// Height of letters, as a share of the longer side of the shown part.
const LETTER_SHARE: f64 = 0.045;

/// Style and script that a page with galleries needs once. An enlarged picture is the target of the
/// URL, so enlarging needs no script; the script adds the Escape and arrow keys.
pub(crate) const STYLE: &str = "<style>.gallery{display:grid;grid-template-columns:repeat(auto-fill,minmax(240px,1fr));\
    gap:14px;margin:1em 0}.gallery>div{min-width:0}.gallery figure{margin:0;overflow:visible}\
    .gallery .frame{display:block;position:relative;width:min(100%,calc(320px*var(--aspect)));background:#eee}\
    .gallery img{display:block;width:100%}.gallery svg{position:absolute;inset:0;width:100%;height:100%}\
    .gallery svg *{vector-effect:non-scaling-stroke}.gallery text{paint-order:stroke;stroke:#fff;stroke-width:3px}\
    .gallery nav{display:none}.gallery a:focus-visible{outline:3px solid #0072b2}\
    .gallery figure:target{position:fixed;inset:0;z-index:1;padding:12px;background:#fff;overflow:auto;text-align:center}\
    .gallery figure:target .frame{width:min(100%,calc((100vh - 130px)*var(--aspect)));margin:auto}\
    .gallery figure:target nav{display:flex;gap:2em;justify-content:center;padding:6px}</style>\n\
    <script>addEventListener('keydown',e=>{const c={Escape:'.close',ArrowLeft:'.back',ArrowRight:'.on'}[e.key],\
    a=c&&document.querySelector('.gallery figure:target '+c);if(a){e.preventDefault();a.click()}})</script>\n";

/// A picture with what is drawn over it.
pub(crate) struct Figure {
    jpeg: Vec<u8>,
    /// The part of the picture that is shown, in the units of the drawing.
    view: BBox,
    /// Marks as SVG.
    pub(crate) drawing: String,
    /// Description of the picture.
    pub(crate) caption: String,
}

impl Figure {
    /// A part of a picture, in the drawing's pixels, of which the picture has `size`.
    ///
    /// # Errors
    /// A picture that cannot be read.
    pub(crate) fn cropped(path: &Path, size: [f64; 2], view: BBox) -> Result<Self> {
        let picture = io::read::<LinearRgb>(path)?;
        let scale = scale_of(&picture, size);
        let [columns, rows] = visible_pixels(&picture, &view, scale);
        if columns.is_empty() || rows.is_empty() {
            let what = "none of it is in the part to show";
            return Err(Error::file(path, what));
        }
        Ok(Self {
            view: view_of(&columns, &rows, scale),
            jpeg: page_jpeg(&picture.crop(Roi::spanning(columns, rows)))?,
            drawing: String::new(),
            caption: String::new(),
        })
    }

    /// The whole of a picture.
    ///
    /// # Errors
    /// As [`Figure::cropped`].
    pub(crate) fn whole(path: &Path, size: [f64; 2]) -> Result<Self> {
        let view = BBox {
            x0: 0.0,
            y0: 0.0,
            x1: size[0],
            y1: size[1],
        };
        Self::cropped(path, size, view)
    }

    /// Height of letters, in the units of the drawing.
    pub(crate) fn letter_height(&self) -> f64 {
        LETTER_SHARE * self.view.width().max(self.view.height())
    }

    /// Its top edge, in the units of the drawing.
    pub(crate) fn top(&self) -> f64 {
        self.view.y0
    }

    /// Figure `i` of `count` in the gallery called `name`.
    fn html(&self, name: &str, i: usize, count: usize) -> Markup {
        html! {
            div id=(format_args!("{name}-{i}-at")) {
                figure id=(format_args!("{name}-{i}")) {
                    (self.frame(&format!("#{name}-{i}")))
                    figcaption { (text(&self.caption)) }
                    nav {
                        @if i > 0 {
                            a class="back" href=(format_args!("#{name}-{}", i - 1)) { "\u{2190} previous" }
                        }
                        a class="close" href=(format_args!("#{name}-{i}-at")) { "close" }
                        @if i + 1 < count {
                            a class="on" href=(format_args!("#{name}-{}", i + 1)) { "next \u{2192}" }
                        }
                    }
                }
            }
        }
    }

    /// The picture under its drawing; a click enlarges it.
    fn frame(&self, address: &str) -> Markup {
        let aspect = self.view.width() / self.view.height();
        let data = format!("data:image/jpeg;base64,{}", base64(&self.jpeg));
        html! {
            a class="frame" href=(address) title="enlarge" style=(format_args!("--aspect:{aspect:.4}")) {
                img alt=(text(&self.caption)) src=(data);
                svg viewBox=(self.view_box()) { (PreEscaped(&self.drawing)) }
            }
        }
    }

    fn view_box(&self) -> String {
        let (w, h) = (self.view.width(), self.view.height());
        format!("{:.2} {:.2} {w:.2} {h:.2}", self.view.x0, self.view.y0)
    }
}

/// Columns and rows of the picture that a view shows.
fn visible_pixels(
    picture: &Image<LinearRgb>,
    view: &BBox,
    [scale_x, scale_y]: [f64; 2],
) -> [Range<usize>; 2] {
    let columns = pixel_span([view.x0, view.x1], scale_x, picture.width());
    let rows = pixel_span([view.y0, view.y1], scale_y, picture.height());
    [columns, rows]
}

/// Pixels of the picture per unit of a drawing of `size`.
fn scale_of(picture: &Image<LinearRgb>, [width, height]: [f64; 2]) -> [f64; 2] {
    [
        picture.width() as f64 / width,
        picture.height() as f64 / height,
    ]
}

/// The whole pixels between two positions of a drawing, in a picture `scale` times as large.
fn pixel_span([start, end]: [f64; 2], scale: f64, length: usize) -> Range<usize> {
    let [start, end] =
        [start, end + 1.0 / scale].map(|v| ((v * scale).max(0.0) as usize).min(length));
    start..end
}

/// The view of these whole pixels.
fn view_of(columns: &Range<usize>, rows: &Range<usize>, [scale_x, scale_y]: [f64; 2]) -> BBox {
    BBox {
        x0: columns.start as f64 / scale_x,
        y0: rows.start as f64 / scale_y,
        x1: columns.end as f64 / scale_x,
        y1: rows.end as f64 / scale_y,
    }
}

/// A picture at the size at which it is shown, as the bytes of a JPEG file.
fn page_jpeg(picture: &Image<LinearRgb>) -> Result<Vec<u8>> {
    io::jpeg_bytes(&to_srgb8(&shrunk_for_page(picture)), JPEG_QUALITY)
}

/// A picture no larger than it is shown.
fn shrunk_for_page(picture: &Image<LinearRgb>) -> Image<LinearRgb> {
    let (w, h) = picture.size();
    let factor = MAX_SIDE_PX / w.max(h) as f64;
    if factor >= 1.0 {
        return picture.clone();
    }
    let [w, h] = [w, h].map(|side| scaled_side(side, factor));
    resize(picture, w, h)
}

fn scaled_side(side: usize, factor: f64) -> usize {
    ((side as f64 * factor).round() as usize).max(1)
}

/// A grid of figures; `name` is the prefix of their ids on the page.
pub(crate) fn gallery(name: &str, figures: &[Figure]) -> String {
    html! {
        div class="gallery" {
            @for (i, figure) in figures.iter().enumerate() { (figure.html(name, i, figures.len())) }
        }
    }
    .into_string()
        + "\n"
}

/// A box with words at its upper left corner, inside it if there is no room above; `style` holds
/// attributes.
pub(crate) fn marked_box(
    b: &BBox,
    content: &str,
    letter: f64,
    top: f64,
    color: &str,
    style: &str,
) -> String {
    let rect = rectangle(b, color, style);
    if content.is_empty() {
        return rect;
    }
    rect + &words(
        [b.x0, words_baseline(b, letter, top)],
        content,
        letter,
        color,
    )
}

/// Above the box if there is room, else inside.
fn words_baseline(b: &BBox, letter: f64, top: f64) -> f64 {
    let has_room_above = b.y0 - 1.2 * letter >= top;
    if has_room_above {
        b.y0 - 0.25 * letter
    } else {
        b.y0 + letter
    }
}

fn rectangle(b: &BBox, color: &str, style: &str) -> String {
    let [x, y, w, h] = [b.x0, b.y0, b.width(), b.height()].map(|v| format!("{v:.2}"));
    format!(
        "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" fill=\"none\" stroke=\"{color}\" {style}/>"
    )
}

/// Words that begin at a position.
pub(crate) fn words([x, y]: [f64; 2], content: &str, letter: f64, color: &str) -> String {
    html! {
        text x=(format_args!("{x:.2}")) y=(format_args!("{y:.2}")) font-size=(format_args!("{letter:.2}"))
            fill=(color) { (text(content)) }
    }
    .into_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_picture_is_shown_where_the_drawing_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        io::write(&path, &Image::filled(40, 20, LinearRgb::WHITE)).unwrap();
        // The drawing uses the pixels of a picture half as large.
        let part = BBox {
            x0: 5.0,
            y0: 2.0,
            x1: 10.0,
            y1: 30.0,
        };
        let figure = Figure::cropped(&path, [20.0, 10.0], part).unwrap();
        assert_eq!(
            figure.view,
            BBox {
                x0: 5.0,
                y0: 2.0,
                x1: 10.5,
                y1: 10.0
            }
        );
        assert!(
            Figure::cropped(
                &path,
                [20.0, 10.0],
                BBox {
                    x0: 30.0,
                    y0: 0.0,
                    x1: 40.0,
                    y1: 9.0
                }
            )
            .is_err()
        );
    }

    #[test]
    fn each_figure_leads_to_its_neighbours_and_back() {
        let figure = |caption: &str| Figure {
            jpeg: vec![1],
            view: BBox {
                x0: 0.0,
                y0: 0.0,
                x1: 4.0,
                y1: 2.0,
            },
            drawing: String::new(),
            caption: caption.into(),
        };
        let html = gallery("m", &[figure("a < b"), figure("\u{1b}[31m"), figure("c")]);
        assert!(
            html.contains("a &lt; b") && html.contains("\\x1b[31m"),
            "{html}"
        );
        for link in ["#m-0\"", "#m-1\"", "#m-2\"", "#m-0-at\"", "#m-1-at\""] {
            let target = link.trim_start_matches('#');
            assert!(
                html.contains(&format!("href=\"{link}"))
                    && html.contains(&format!("id=\"{target}")),
                "{link}"
            );
        }
        assert_eq!(
            (
                html.matches("previous").count(),
                html.matches("next").count()
            ),
            (2, 2)
        );
    }

    #[test]
    fn long_words_are_cut_at_letters() {
        assert_eq!(
            (clipped("größere", 4), clipped("größe", 5), clipped("", 3)),
            ("grö…".into(), "größe".into(), "".into())
        );
    }
}
