//! Labels drawn in LabelMe.

use super::label::Label;
use crate::error::{Error, Result};
use serde::Deserialize;

/// What is read of a LabelMe file; it has more.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct LabelMe {
    #[serde(default)]
    image_path: String,
    image_width: u32,
    image_height: u32,
    shapes: Vec<Shape>,
}

#[derive(Deserialize)]
struct Shape {
    #[serde(default)]
    label: String,
    points: Vec<[f64; 2]>,
}

/// The label that a LabelMe file means by its only polygon of four points, of a rectangle of `size` metres.
///
/// LabelMe's pixels are ours: 0 is the edge of the picture.
///
/// # Errors
/// [`Error::Value`] for text that is not LabelMe's, and for no polygon of four points or more than one.
pub fn from_labelme(text: &str, size: [f64; 2]) -> Result<Label> {
    let file: LabelMe = serde_json::from_str(text).map_err(|e| Error::value("labelme", e))?;
    let quads: Vec<(&Shape, [[f64; 2]; 4])> =
        file.shapes.iter().filter_map(|s| Some((s, s.points.as_slice().try_into().ok()?))).collect();
    let [(shape, corners_px)] = quads.as_slice() else {
        let what = format!("{} polygons of four points, expected one", quads.len());
        return Err(Error::value("shapes", what));
    };
    let mut label = Label::new([file.image_width, file.image_height], *corners_px, size);
    label.image.file = file.image_path;
    label.surface.id = shape.label.clone();
    label.surface.source = Some("labelme".into());
    Ok(label)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"{ "version": "5.4.1", "flags": {}, "shapes": [
        { "label": "tray", "points": [[10, 20], [110, 22], [108, 90], [9, 88]], "group_id": null,
          "shape_type": "polygon", "flags": {} },
        { "label": "dot", "points": [[1, 2]], "shape_type": "point" } ],
        "imagePath": "a.jpg", "imageData": null, "imageHeight": 100, "imageWidth": 200 }"#;

    #[test]
    fn the_polygon_becomes_the_rectangle() {
        let label = from_labelme(FILE, [0.6, 0.4]).unwrap();
        assert_eq!((label.image_size(), label.image.file.as_str()), ([200, 100], "a.jpg"));
        assert_eq!(label.surface.corners_px.unwrap()[2], [108.0, 90.0]);
        assert_eq!((label.surface.id.as_str(), label.surface.width_m), ("tray", Some(0.6)));
    }

    #[test]
    fn another_number_of_polygons_is_an_error() {
        let none = FILE.replace(", [9, 88]]", "]");
        assert!(from_labelme(&none, [0.6, 0.4]).unwrap_err().to_string().contains("0 polygons"));
        assert!(from_labelme("{}", [0.6, 0.4]).is_err());
    }
}
