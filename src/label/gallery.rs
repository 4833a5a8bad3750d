//! Pictures in a grid on a page, each enlarged by a click or by the keyboard, without another file.

use crate::color::to_srgb8;
use crate::error::Result;
use crate::filter::resize;
use crate::geom::BBox;
use crate::image::{Image, Roi};
use crate::io;
use crate::pixel::LinearRgb;
use crate::plot::{base64, escaped};
use std::path::Path;

/// Longest side of a picture on a page, pixels, and its quality as JPEG: about 30 kB.
const SIDE_PX: f64 = 480.0;
const QUALITY: u8 = 82;

/// What a page with galleries needs once. An enlarged picture is the target of the address, so no script is needed for
/// it; the script adds the keys Escape and the arrows.
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
    /// What is to be seen.
    pub(crate) caption: String,
}

impl Figure {
    /// A part of a picture, as the drawing counts its pixels: in a picture of `size`.
    ///
    /// # Errors
    /// A picture that cannot be read.
    pub(crate) fn of(path: &Path, size: [f64; 2], view: BBox) -> Result<Self> {
        let picture = io::read::<LinearRgb>(path)?;
        let scale = [
            picture.width() as f64 / size[0],
            picture.height() as f64 / size[1],
        ];
        let whole = |v: f64, most: usize| (v.max(0.0) as usize).min(most);
        let [x0, x1] =
            [view.x0, view.x1 + 1.0 / scale[0]].map(|x| whole(x * scale[0], picture.width()));
        let [y0, y1] =
            [view.y0, view.y1 + 1.0 / scale[1]].map(|y| whole(y * scale[1], picture.height()));
        if x0 >= x1 || y0 >= y1 {
            return Err(crate::Error::file(
                path,
                "nothing of it lies in the part to be shown",
            ));
        }
        let part = small(&picture.crop(Roi {
            x: x0,
            y: y0,
            width: x1 - x0,
            height: y1 - y0,
        }));
        let edge = |i: usize, k: usize| i as f64 / scale[k];
        let view = BBox {
            x0: edge(x0, 0),
            y0: edge(y0, 1),
            x1: edge(x1, 0),
            y1: edge(y1, 1),
        };
        let jpeg = io::jpeg_bytes(&to_srgb8(&part), QUALITY)?;
        Ok(Self {
            jpeg,
            view,
            drawing: String::new(),
            caption: String::new(),
        })
    }

    /// The whole of a picture.
    ///
    /// # Errors
    /// As [`Figure::of`].
    pub(crate) fn whole(path: &Path, size: [f64; 2]) -> Result<Self> {
        Self::of(
            path,
            size,
            BBox {
                x0: 0.0,
                y0: 0.0,
                x1: size[0],
                y1: size[1],
            },
        )
    }

    /// Height of letters, in the units of the drawing.
    pub(crate) fn letter(&self) -> f64 {
        0.045 * self.view.width().max(self.view.height())
    }

    /// Where it begins, in the units of the drawing.
    pub(crate) fn top(&self) -> f64 {
        self.view.y0
    }

    fn html(&self, name: &str, i: usize, count: usize) -> String {
        let Self {
            jpeg,
            view,
            drawing,
            caption,
        } = self;
        let (x, y, w, h) = (view.x0, view.y0, view.width(), view.height());
        let aspect = w / h;
        let (data, caption) = (base64(jpeg), escaped(caption));
        let to = |class: &str, to: usize, word: &str| {
            format!("<a class=\"{class}\" href=\"#{name}-{to}\">{word}</a>")
        };
        let back = if i > 0 {
            to("back", i - 1, "&larr; previous")
        } else {
            String::new()
        };
        let on = if i + 1 < count {
            to("on", i + 1, "next &rarr;")
        } else {
            String::new()
        };
        format!(
            "<div id=\"{name}-{i}-at\"><figure id=\"{name}-{i}\">\
             <a class=\"frame\" href=\"#{name}-{i}\" title=\"enlarge\" style=\"--aspect:{aspect:.4}\">\
             <img alt=\"{caption}\" src=\"data:image/jpeg;base64,{data}\">\
             <svg viewBox=\"{x:.2} {y:.2} {w:.2} {h:.2}\">{drawing}</svg></a><figcaption>{caption}</figcaption>\
             <nav>{back}<a class=\"close\" href=\"#{name}-{i}-at\">close</a>{on}</nav></figure></div>\n"
        )
    }
}

/// A picture no larger than is shown.
fn small(picture: &Image<LinearRgb>) -> Image<LinearRgb> {
    let (w, h) = picture.size();
    let factor = SIDE_PX / w.max(h) as f64;
    let side = |n: usize| ((n as f64 * factor).round() as usize).max(1);
    if factor < 1.0 {
        resize(picture, side(w), side(h))
    } else {
        picture.clone()
    }
}

/// A grid of figures; `name` begins their addresses on the page.
pub(crate) fn gallery(name: &str, figures: &[Figure]) -> String {
    let all: String = figures
        .iter()
        .enumerate()
        .map(|(i, figure)| figure.html(name, i, figures.len()))
        .collect();
    format!("<div class=\"gallery\">\n{all}</div>\n")
}

/// A box with words at its upper left corner, inside it where there is no room above; `style` are attributes.
pub(crate) fn marked_box(
    b: &BBox,
    text: &str,
    letter: f64,
    top: f64,
    color: &str,
    style: &str,
) -> String {
    let (w, h) = (b.width(), b.height());
    let rect = format!(
        "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"{w:.2}\" height=\"{h:.2}\" fill=\"none\" stroke=\"{color}\" {style}/>",
        b.x0, b.y0
    );
    let y = if b.y0 - 1.2 * letter < top {
        b.y0 + letter
    } else {
        b.y0 - 0.25 * letter
    };
    if text.is_empty() {
        rect
    } else {
        rect + &words([b.x0, y], text, letter, color)
    }
}

/// Words that begin at a place.
pub(crate) fn words([x, y]: [f64; 2], text: &str, letter: f64, color: &str) -> String {
    let text = escaped(text);
    format!(
        "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{letter:.2}\" fill=\"{color}\">{text}</text>"
    )
}

/// No more letters of a text than there is room for.
pub(crate) fn clipped(text: &str, letters: usize) -> String {
    match text.char_indices().nth(letters) {
        Some(_) => text
            .chars()
            .take(letters.saturating_sub(1))
            .chain(['…'])
            .collect(),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_picture_is_shown_where_the_drawing_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        io::write(&path, &Image::filled(40, 20, LinearRgb::WHITE)).unwrap();
        // The drawing counts in a picture half as large.
        let part = BBox {
            x0: 5.0,
            y0: 2.0,
            x1: 10.0,
            y1: 30.0,
        };
        let figure = Figure::of(&path, [20.0, 10.0], part).unwrap();
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
            Figure::of(
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
