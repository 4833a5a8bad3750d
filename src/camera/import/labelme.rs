//! LabelMe: a JSON file for each picture.

use super::{AnnotatedShape, Annotation, ShapeKind, upright_corners};
use crate::error::{Error, Result};
use serde::Deserialize;
use serde_json::Value;

/// The source of surfaces that were drawn in it.
pub(super) const PROGRAM: &str = "labelme";

/// What is read from a file; there is more in it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct LabelMe {
    #[serde(default)]
    image_path: String,
    #[serde(default)]
    image_width: Option<u32>,
    #[serde(default)]
    image_height: Option<u32>,
    shapes: Vec<LabelMeShape>,
}

#[derive(Deserialize)]
struct LabelMeShape {
    #[serde(default)]
    label: String,
    #[serde(default)]
    shape_type: String,
    points: Vec<[f64; 2]>,
}

pub(super) fn is_labelme(value: &Value) -> bool {
    value.get("shapes").is_some_and(Value::is_array)
}

/// LabelMe's pixels are ours: 0 is the edge of the picture.
pub(super) fn annotation(value: Value) -> Result<Annotation> {
    let file: LabelMe = serde_path_to_error::deserialize(value)
        .map_err(|e| Error::value(e.path().to_string(), e.inner()))?;
    Ok(Annotation {
        pictures: vec![vec![file.image_path.replace('\\', "/")]],
        size: file.image_width.zip(file.image_height).map(|(w, h)| [w, h]),
        shapes: file.shapes.into_iter().map(shape).collect(),
        source: PROGRAM,
        ..Annotation::default()
    })
}

fn shape(shape: LabelMeShape) -> AnnotatedShape {
    let points = shape.points;
    let (kind, points) = match (shape.shape_type.as_str(), points.as_slice()) {
        ("rectangle", [a, b]) => (ShapeKind::Rectangle, upright_corners(*a, *b)),
        ("rectangle", _) => (ShapeKind::Rectangle, points),
        ("point" | "points", _) => (ShapeKind::Points, points),
        _ => (ShapeKind::Polygon, points),
    };
    AnnotatedShape {
        kind,
        name: shape.label,
        points,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::label::Label;
    use crate::io;

    const FILE: &str = r#"{ "version": "5.4.1", "flags": {}, "shapes": [
        { "label": "tray", "points": [[10, 20], [110, 22], [108, 90], [9, 88]], "group_id": null,
          "shape_type": "polygon", "flags": {} },
        { "label": "dot", "points": [[1, 2]], "shape_type": "point" } ],
        "imagePath": "a.jpg", "imageData": null, "imageHeight": 100, "imageWidth": 200 }"#;

    fn read(text: &str) -> Result<Label> {
        annotation(io::parse_json(text)?)?.label()
    }

    #[test]
    fn the_polygon_becomes_the_rectangle() {
        let label = read(FILE).unwrap();
        assert_eq!(
            (label.image_size(), label.image.file.as_str()),
            ([200, 100], "a.jpg")
        );
        assert_eq!(label.surface.corners_px.unwrap()[2], [108.0, 90.0]);
        assert_eq!(label.surface.id, "tray");
    }

    #[test]
    fn two_corners_of_a_rectangle_are_four() {
        let text = FILE.replace(
            "[[10, 20], [110, 22], [108, 90], [9, 88]]",
            "[[110, 90], [10, 20]]",
        );
        let label = read(&text.replace("\"polygon\"", "\"rectangle\"")).unwrap();
        assert_eq!(
            label.surface.corners_px,
            Some([[10.0, 20.0], [110.0, 20.0], [110.0, 90.0], [10.0, 90.0]])
        );
    }

    #[test]
    fn another_number_of_polygons_is_an_error() {
        let none = FILE.replace(", [9, 88]]", "]");
        assert!(
            read(&none)
                .unwrap_err()
                .to_string()
                .contains("0 polygons of four points")
        );
        assert!(read("{}").unwrap_err().to_string().contains("shapes"));
        let wrong = read(&FILE.replace("[10, 20]", "[10]"))
            .unwrap_err()
            .to_string();
        assert!(wrong.contains("shapes[0].points[0]"), "{wrong}");
    }
}
