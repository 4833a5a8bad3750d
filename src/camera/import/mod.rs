//! Labels that were drawn in other programs: LabelMe, CVAT, Label Studio.
//!
//! Each format is read into [`Annotation`]s, a picture and the shapes on it; what they mean is
//! decided here: one quadrangle, or else one upright rectangle, or else four points, is the
//! surface.

mod cvat;
mod label_studio;
mod labelme;

use super::label::{Label, LabelSurface};
use crate::error::{Error, Result};
use crate::io;
use serde_json::Value;

/// What a program recorded for a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Annotation {
    /// The picture; several where the program does not say on which of them the shapes are.
    pub(crate) pictures: Vec<PictureNames>,
    /// Pictures that are named beside it, one of which may be it where it is not there.
    pub(crate) others: Vec<PictureNames>,
    /// Where in the file it stands; empty where no place has a name.
    pub(crate) at: String,
    /// Width and height, pixels; none where the program does not record them.
    pub(crate) size: Option<[u32; 2]>,
    pub(crate) shapes: Vec<AnnotatedShape>,
    /// Which program.
    pub(crate) source: &'static str,
}

/// Names that a picture's file may have, the most likely first; the program may have added
/// something.
pub(crate) type PictureNames = Vec<String>;

/// Something drawn on a picture, with pixels as ours: 0 is the picture's edge.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AnnotatedShape {
    pub(crate) kind: ShapeKind,
    /// Name of its class.
    pub(crate) name: String,
    pub(crate) points: Vec<[f64; 2]>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShapeKind {
    Polygon,
    /// Its four corners.
    Rectangle,
    Points,
}

/// The pictures of another program's file; none where the text is of no program that is known.
///
/// # Errors
/// [`Error::Value`] for a file of one of the programs that does not hold what theirs do.
pub(crate) fn annotations(text: &str) -> Result<Option<Vec<Annotation>>> {
    if text.trim_start().starts_with('<') {
        return cvat::annotations(text);
    }
    io::parse_json(text).map_or(Ok(None), json_annotations)
}

fn json_annotations(value: Value) -> Result<Option<Vec<Annotation>>> {
    if labelme::is_labelme(&value) {
        labelme::annotation(value).map(|one| Some(vec![one]))
    } else if label_studio::is_label_studio(&value) {
        label_studio::annotations(value).map(Some)
    } else {
        Ok(None)
    }
}

/// The sources of surfaces that were drawn in other programs.
const PROGRAMS: [&str; 3] = [cvat::PROGRAM, label_studio::PROGRAM, labelme::PROGRAM];

/// Words for where a person adds to a label: the file of another program has no place for it.
pub(crate) fn place_for_more(label: &Label) -> &'static str {
    match label.surface.source.as_deref() {
        Some(source) if PROGRAMS.contains(&source) => {
            " in petcomp's own label format (`petcomp camera init PHOTO --size WxH --corners \"..\"` writes such a label)"
        }
        _ => "",
    }
}

impl Annotation {
    /// The label for the annotation; the sides of its rectangle are unknown.
    pub(crate) fn label(&self) -> Result<Label> {
        let (mut name, corners_px) = self.rectangle()?;
        if name.is_empty() {
            name = UNNAMED.into();
        }
        let mut label = Label::new(self.size.unwrap_or_default(), corners_px, [1.0; 2]);
        let mut names = self.pictures.iter().flatten();
        label.image.file = names.next().cloned().unwrap_or_default();
        label.surface = LabelSurface {
            id: name,
            corners_px: Some(corners_px),
            source: Some(self.source.into()),
            ..LabelSurface::default()
        };
        Ok(label)
    }

    /// Name and corners of the only shape that can be the surface.
    fn rectangle(&self) -> Result<NamedCorners> {
        self.check_finite()?;
        let mut quads = self.four_cornered(ShapeKind::Polygon);
        let mut boxes = self.four_cornered(ShapeKind::Rectangle);
        let points = self.named_points();
        match [quads.len(), boxes.len(), points.len()] {
            [1, ..] => Ok(quads.remove(0)),
            [0, 1, _] => Ok(boxes.remove(0)),
            [0, 0, 4] => Ok(corners_from_points([0, 1, 2, 3].map(|i| points[i]))),
            counts => Err(self.unclear(counts)),
        }
    }

    fn check_finite(&self) -> Result<()> {
        let mut numbers = self.shapes.iter().flat_map(|s| s.points.as_flattened());
        match numbers.all(|v| v.is_finite()) {
            true => Ok(()),
            false => Err(Error::value("shapes", "a point is not finite")),
        }
    }

    fn named_points(&self) -> Vec<(&String, [f64; 2])> {
        self.shapes_of(ShapeKind::Points)
            .flat_map(|s| s.points.iter().map(|p| (&s.name, *p)))
            .collect()
    }

    fn shapes_of(&self, kind: ShapeKind) -> impl Iterator<Item = &AnnotatedShape> {
        self.shapes.iter().filter(move |shape| shape.kind == kind)
    }

    /// Name and corners of the shapes of a kind that have four.
    fn four_cornered(&self, kind: ShapeKind) -> Vec<NamedCorners> {
        self.shapes_of(kind)
            .filter_map(AnnotatedShape::corners)
            .collect()
    }

    /// The error of an annotation in which no shape, or more than one, can be the surface.
    fn unclear(&self, [quads, boxes, points]: [usize; 3]) -> Error {
        let others = self.shapes_of(ShapeKind::Polygon).count() - quads;
        let what = format!(
            "{quads} polygons of four points, {others} other polygons, {boxes} rectangles and {points} points, expected \
             one polygon of four points, or one rectangle, or four points"
        );
        Error::value("shapes", what)
    }
}

/// What a surface without a name is called.
const UNNAMED: &str = "surface";

/// Name of a surface and its corners, pixels.
type NamedCorners = (String, [[f64; 2]; 4]);

impl AnnotatedShape {
    /// Its corners, where it has four.
    fn corners(&self) -> Option<NamedCorners> {
        let corners = without_repeated_end(&self.points).try_into().ok()?;
        Some((self.name.clone(), corners))
    }
}

/// A polygon without a last point that repeats the first.
fn without_repeated_end(points: &[[f64; 2]]) -> &[[f64; 2]] {
    match points {
        [ring @ .., last] if ring.len() > 1 && ring[0] == *last => ring,
        _ => points,
    }
}

/// What single points are called that are corners, from the top left.
const CORNER_NAMES: [&[&str]; 4] = [
    &["tl", "top left", "topleft", "left top"],
    &["tr", "top right", "topright", "right top"],
    &["br", "bottom right", "bottomright", "right bottom"],
    &["bl", "bottom left", "bottomleft", "left bottom"],
];

/// Single points as they were drawn, or where they are named so, from the top left.
fn corners_from_points(points: [(&String, [f64; 2]); 4]) -> NamedCorners {
    if let Some(corners) = corners_by_name(&points) {
        return (UNNAMED.into(), corners);
    }
    let first = points[0].0;
    let is_shared = points.iter().all(|(name, _)| *name == first);
    let name: &str = if is_shared { first } else { UNNAMED };
    (name.to_owned(), points.map(|(_, point)| point))
}

/// The points in the order of their names, where each corner is named once.
fn corners_by_name(points: &[(&String, [f64; 2]); 4]) -> Option<[[f64; 2]; 4]> {
    let mut corners = [None; 4];
    for (name, point) in points {
        corners[corner_named(name)?] = Some(*point);
    }
    let [Some(a), Some(b), Some(c), Some(d)] = corners else {
        return None;
    };
    Some([a, b, c, d])
}

/// Which corner a point is by its name, from the top left.
fn corner_named(name: &str) -> Option<usize> {
    let name = name.to_lowercase().replace(['_', '-'], " ");
    CORNER_NAMES
        .iter()
        .position(|words| words.contains(&name.trim()))
}

/// Those annotations that hold a shape.
fn with_shapes(annotations: impl Iterator<Item = Result<Annotation>>) -> Result<Vec<Annotation>> {
    let mut all = annotations.collect::<Result<Vec<_>>>()?;
    all.retain(|annotation| !annotation.shapes.is_empty());
    Ok(all)
}

/// The point at an offset from a centre, turned clockwise about that.
fn turned_about([x, y]: [f64; 2], [u, v]: [f64; 2], degrees: f64) -> [f64; 2] {
    let angle = degrees.to_radians();
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    [x + u * cos - v * sin, y + u * sin + v * cos]
}

/// The corners of an upright rectangle between two opposite ones, clockwise from the top left.
pub(crate) fn upright_corners([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> Vec<[f64; 2]> {
    let ([left, right], [top, bottom]) = ([ax.min(bx), ax.max(bx)], [ay.min(by), ay.max(by)]);
    vec![[left, top], [right, top], [right, bottom], [left, bottom]]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn only(text: &str) -> Annotation {
        let mut annotations = annotations(text).unwrap().unwrap();
        assert_eq!(annotations.len(), 1);
        annotations.remove(0)
    }

    fn shape(kind: ShapeKind, name: &str, points: &[[f64; 2]]) -> AnnotatedShape {
        AnnotatedShape {
            kind,
            name: name.into(),
            points: points.to_vec(),
        }
    }

    const QUAD: [[f64; 2]; 4] = [[10.0, 20.0], [110.0, 22.0], [108.0, 90.0], [9.0, 88.0]];

    fn corners(shapes: Vec<AnnotatedShape>) -> std::result::Result<[[f64; 2]; 4], String> {
        let annotation = Annotation {
            shapes,
            ..Default::default()
        };
        annotation
            .label()
            .map(|l| l.surface.corners_px.unwrap())
            .map_err(|e| e.to_string())
    }

    #[test]
    fn a_quadrangle_comes_before_a_rectangle_and_that_before_points() {
        let quad = shape(ShapeKind::Polygon, "tray", &QUAD);
        let rectangle = shape(
            ShapeKind::Rectangle,
            "tray",
            &upright_corners([100.0, 80.0], [10.0, 20.0]),
        );
        let dots = QUAD.map(|p| shape(ShapeKind::Points, "dot", &[p])).to_vec();
        let all: Vec<AnnotatedShape> = dots
            .iter()
            .cloned()
            .chain([rectangle.clone(), quad])
            .collect();
        assert_eq!(corners(all).unwrap(), QUAD);
        let without: Vec<AnnotatedShape> = dots.iter().cloned().chain([rectangle]).collect();
        assert_eq!(
            corners(without).unwrap(),
            [[10.0, 20.0], [100.0, 20.0], [100.0, 80.0], [10.0, 80.0]]
        );
        assert_eq!(corners(dots).unwrap(), QUAD);
    }

    #[test]
    fn points_that_are_called_by_their_corner_are_put_in_order() {
        let named = [(2, "BR"), (0, "top_left"), (3, "bottom-left"), (1, "tr")];
        let shapes = named
            .map(|(i, name)| shape(ShapeKind::Points, name, &[QUAD[i]]))
            .to_vec();
        assert_eq!(corners(shapes).unwrap(), QUAD);
    }

    #[test]
    fn a_closed_polygon_has_one_point_less() {
        let closed: Vec<[f64; 2]> = QUAD.into_iter().chain([QUAD[0]]).collect();
        assert_eq!(
            corners(vec![shape(ShapeKind::Polygon, "", &closed)]).unwrap(),
            QUAD
        );
    }

    #[test]
    fn anything_else_is_counted_in_the_message() {
        let two = vec![
            shape(ShapeKind::Polygon, "a", &QUAD),
            shape(ShapeKind::Polygon, "b", &QUAD),
        ];
        assert!(
            corners(two)
                .unwrap_err()
                .contains("2 polygons of four points")
        );
        let three = vec![shape(ShapeKind::Polygon, "a", &QUAD[..3])];
        assert!(corners(three).unwrap_err().contains("1 other polygons"));
        assert!(corners(vec![]).unwrap_err().contains("0 points"));
        assert!(
            corners(vec![shape(ShapeKind::Polygon, "a", &[[f64::NAN, 0.0]; 4])])
                .unwrap_err()
                .contains("finite")
        );
    }

    #[test]
    fn other_documents_are_of_no_program() {
        for text in [
            "{}",
            "[]",
            "[1]",
            "3",
            "{\"format\": \"plane-label\"}",
            "<html></html>",
            "<a>",
            "{",
            "",
        ] {
            assert_eq!(annotations(text).unwrap(), None, "{text}");
        }
    }
}
