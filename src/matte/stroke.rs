//! Strokes: what a person paints on a photo where its cut-out is wrong.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::image::{Image, Mask};
use crate::matte::check::check_value;
use crate::pixel::{Coverage, LinearRgb};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A line that a person painted on a photo, and what it says about the pixels under it.
///
/// Of strokes that contradict each other, the later one counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// What it says about the pixels under it.
    pub says: Claim,
    /// Half its width, pixels of the photo.
    pub radius_px: f64,
    /// The corners of the line, pixels from the photo's top left corner; one is a dot.
    pub points_px: Vec<[f64; 2]>,
}

/// What a person says about some pixels: two claims are about the outline, two about what is seen
/// through the object where there is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Claim {
    /// They belong to the object: core matte of the outline.
    Object,
    /// They do not: garbage matte.
    NotObject,
    /// They are plastic, however bright or coloured; what dims the screen there is shadow.
    SeeThrough,
    /// They let nothing through: core matte of the transmittance.
    Opaque,
}

impl Claim {
    /// Whether the pixels are of the object, where that is what it says.
    fn about_outline(self) -> Option<bool> {
        match self {
            Self::Object => Some(true),
            Self::NotObject => Some(false),
            Self::SeeThrough | Self::Opaque => None,
        }
    }

    /// Whether the pixels are see-through, where that is what it says.
    fn about_transmittance(self) -> Option<bool> {
        match self {
            Self::SeeThrough => Some(true),
            Self::Opaque => Some(false),
            Self::Object | Self::NotObject => None,
        }
    }
}

/// Half the width of a stroke: from a pixel to what covers a photo.
const RADIUS: Bounds = Bounds::new(0.5, 10_000.0, "pixels");

impl Stroke {
    /// # Errors
    /// [`Error::Value`] for the first value that cannot be right.
    fn check(&self) -> Result<()> {
        RADIUS.check("radius_px", self.radius_px)?;
        check_value(!self.points_px.is_empty(), "points_px", || {
            "empty, expected at least one point".into()
        })?;
        let wrong = |[x, y]: &[f64; 2]| !(x.is_finite() && y.is_finite());
        match self.points_px.iter().position(wrong) {
            Some(i) => Err(not_finite(i, self.points_px[i])),
            None => Ok(()),
        }
    }

    /// The straight parts of the line; a dot is one without length.
    fn parts(&self) -> impl Iterator<Item = [[f64; 2]; 2]> {
        let points = &self.points_px;
        let dot = (points.len() == 1).then(|| [points[0]; 2]);
        dot.into_iter()
            .chain(points.windows(2).map(|ends| [ends[0], ends[1]]))
    }
}

fn not_finite(i: usize, [x, y]: [f64; 2]) -> Error {
    let what = format!("({x}, {y}), expected finite numbers");
    Error::value(format!("points_px[{i}]"), what)
}

/// Fails on the first stroke that cannot be right.
///
/// # Errors
/// [`Error::Value`] (`strokes[2].radius_px`).
pub(crate) fn check_strokes(strokes: &[Stroke]) -> Result<()> {
    let mut numbered = strokes.iter().enumerate();
    numbered.try_for_each(|(i, stroke)| {
        let checked = stroke.check();
        checked.map_err(|e| e.within(&format!("strokes[{i}]")))
    })
}

/// What is said of each pixel; nothing of most.
pub(super) type Claims = Image<Option<bool>>;

/// What some strokes on a photo say of its pixels, at any size of the picture.
#[derive(Clone, Copy, Default)]
pub(super) struct StrokesOnPhoto<'a> {
    strokes: &'a [Stroke],
    /// Width and height of the photo, pixels.
    pub(super) photo: (usize, usize),
}

impl<'a> StrokesOnPhoto<'a> {
    pub(super) fn new(strokes: &'a [Stroke], photo: &Image<LinearRgb>) -> Self {
        Self {
            strokes,
            photo: photo.size(),
        }
    }

    /// Which pixels of a picture of this size are of the object and which are not; nothing where no
    /// stroke says so.
    pub(super) fn about_outline(self, size: (usize, usize)) -> Option<Claims> {
        self.painted(size, Claim::about_outline)
    }

    /// Which pixels of the photo are see-through and which are not.
    pub(super) fn about_transmittance(self) -> Option<Claims> {
        self.painted(self.photo, Claim::about_transmittance)
    }

    fn painted(
        self,
        size: (usize, usize),
        claim: impl Fn(Claim) -> Option<bool>,
    ) -> Option<Claims> {
        let mut said = self
            .strokes
            .iter()
            .filter_map(|stroke| Some((stroke, claim(stroke.says)?)))
            .peekable();
        said.peek()?;
        let scale = [
            size.0 as f64 / self.photo.0 as f64,
            size.1 as f64 / self.photo.1 as f64,
        ];
        let mut claims = Image::new(size.0, size.1);
        for (stroke, claim) in said {
            paint(&mut claims, stroke, scale, claim);
        }
        Some(claims)
    }
}

/// A set of pixels with those that are said to be in it, without those that are said not to be.
pub(super) fn corrected(set: Mask, claims: Option<&Claims>) -> Mask {
    match claims {
        Some(claims) => set.zip_map(claims, |is_in, claim| claim.unwrap_or(is_in)),
        None => set,
    }
}

/// A matte that is 1 and 0 where a person says so.
pub(super) fn corrected_coverage(
    coverage: Image<Coverage>,
    claims: Option<&Claims>,
) -> Image<Coverage> {
    let whole_or_none = |is_object| Coverage(f32::from(u8::from(is_object)));
    match claims {
        Some(claims) => coverage.zip_map(claims, |c, claim| claim.map_or(c, whole_or_none)),
        None => coverage,
    }
}

/// A set of pixels without those of which something is said.
pub(super) fn unclaimed(set: Mask, claims: Option<&Claims>) -> Mask {
    match claims {
        Some(claims) => set.zip_map(claims, |is_in, claim| is_in && claim.is_none()),
        None => set,
    }
}

/// Paints a stroke on a picture with `scale` times the pixels of the photo in x and y.
fn paint(claims: &mut Claims, stroke: &Stroke, scale: [f64; 2], claim: bool) {
    // In a smaller picture a stroke is still a pixel wide.
    let radius = (stroke.radius_px * scale[0].max(scale[1])).max(MIN_PAINTED_RADIUS_PX);
    for part in stroke.parts() {
        let part = part.map(|[x, y]| [x * scale[0], y * scale[1]]);
        paint_part(claims, part, radius, claim);
    }
}

/// Covers the centre of a pixel wherever it goes.
const MIN_PAINTED_RADIUS_PX: f64 = 0.71;

fn paint_part(claims: &mut Claims, part: [[f64; 2]; 2], radius: f64, claim: bool) {
    let columns = reached(part.map(|end| end[0]), radius, claims.width());
    for y in reached(part.map(|end| end[1]), radius, claims.height()) {
        let row = claims.row_mut(y);
        for x in columns.clone() {
            if square_distance([x as f64 + 0.5, y as f64 + 0.5], part) <= radius * radius {
                row[x] = Some(claim);
            }
        }
    }
}

/// The pixels of a row of `len` that a line between two coordinates may reach.
fn reached([a, b]: [f64; 2], radius: f64, len: usize) -> Range<usize> {
    let low = (a.min(b) - radius).max(0.0) as usize;
    let high = (a.max(b) + radius).max(0.0).ceil() as usize;
    low.min(len)..high.min(len)
}

/// Squared distance of a point from a straight line between two others.
fn square_distance([x, y]: [f64; 2], [[ax, ay], [bx, by]]: [[f64; 2]; 2]) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let square = dx * dx + dy * dy;
    let along = if square > 0.0 {
        (((x - ax) * dx + (y - ay) * dy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (ax + along * dx - x).powi(2) + (ay + along * dy - y).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stroke(says: Claim, radius_px: f64, points_px: &[[f64; 2]]) -> Stroke {
        Stroke {
            says,
            radius_px,
            points_px: points_px.into(),
        }
    }

    fn outline(strokes: &[Stroke], size: (usize, usize)) -> Option<Claims> {
        let photo = (40, 20);
        StrokesOnPhoto { strokes, photo }.about_outline(size)
    }

    #[test]
    fn a_stroke_covers_what_lies_within_its_radius() {
        let line = stroke(Claim::Object, 3.0, &[[10.0, 10.0], [30.0, 10.0]]);
        let claims = outline(&[line], (40, 20)).unwrap();
        let is_near = |x: usize, y: usize| {
            let dx = (10.0 - (x as f64 + 0.5)).max(x as f64 + 0.5 - 30.0);
            dx.max(0.0).hypot(y as f64 + 0.5 - 10.0) <= 3.0
        };
        let near = Image::from_fn(40, 20, |x, y| is_near(x, y).then_some(true));
        assert!(claims == near);
    }

    #[test]
    fn the_later_stroke_is_right() {
        let dot = |says| stroke(says, 4.0, &[[20.0, 10.0]]);
        let claims = outline(&[dot(Claim::Object), dot(Claim::NotObject)], (40, 20)).unwrap();
        assert_eq!(claims[(20, 10)], Some(false));
        let claims = outline(&[dot(Claim::NotObject), dot(Claim::Object)], (40, 20)).unwrap();
        assert_eq!(claims[(20, 10)], Some(true));
    }

    #[test]
    fn a_smaller_picture_has_the_same_strokes() {
        let thin = stroke(Claim::NotObject, 0.5, &[[-8.0, 10.2], [1e9, 10.2]]);
        let claims = outline(&[thin], (10, 5)).unwrap();
        assert!((0..10).all(|x| claims[(x, 2)] == Some(false)));
        assert!((0..10).all(|x| claims[(x, 0)].is_none() && claims[(x, 4)].is_none()));
    }

    #[test]
    fn claims_are_of_the_outline_or_of_the_transmittance() {
        let strokes = [stroke(Claim::Opaque, 4.0, &[[20.0, 10.0]])];
        assert!(outline(&strokes, (40, 20)).is_none());
        let photo = (40, 20);
        let on_photo = StrokesOnPhoto {
            strokes: &strokes,
            photo,
        };
        let claims = on_photo.about_transmittance().unwrap();
        assert_eq!((claims[(20, 10)], claims[(1, 1)]), (Some(false), None));
    }

    #[test]
    fn a_wrong_stroke_is_named() {
        let said = |stroke| check_strokes(&[stroke]).unwrap_err().to_string();
        assert_eq!(
            said(stroke(Claim::Object, 3.0, &[])),
            "strokes[0].points_px: empty, expected at least one point"
        );
        assert!(
            said(stroke(Claim::Object, 0.0, &[[1.0, 1.0]])).starts_with("strokes[0].radius_px: 0")
        );
        assert!(
            said(stroke(Claim::Object, 1.0, &[[1.0, f64::NAN]]))
                .starts_with("strokes[0].points_px[0]: (1, NaN)")
        );
    }
}
