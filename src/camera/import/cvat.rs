//! CVAT: the export "CVAT for images 1.1", an XML file for many pictures.

use super::{AnnotatedShape, Annotation, ShapeKind, turned_about, upright_corners, with_shapes};
use crate::bounds;
use crate::error::{Error, Result};
use roxmltree::{Document, Node};

/// The source of surfaces that were drawn in it.
pub(super) const PROGRAM: &str = "cvat";

/// The pictures with shapes on them; none for XML of another kind.
pub(super) fn annotations(text: &str) -> Result<Option<Vec<Annotation>>> {
    if !text.contains("<annotations") {
        return Ok(None);
    }
    // Document types are refused: nothing is fetched, and nothing grows.
    let document = Document::parse(text).map_err(|e| Error::value("document", e))?;
    let root = document.root_element();
    if root.tag_name().name() != "annotations" {
        return Ok(None);
    }
    let images = root.children().filter(|node| node.has_tag_name("image"));
    let annotations = images
        .enumerate()
        .map(|(i, node)| annotation(node).map_err(|e| e.within(&format!("image[{i}]"))));
    with_shapes(annotations).map(Some)
}

/// CVAT's pixels are ours: 0 is the edge of the picture.
fn annotation(image: Node<'_, '_>) -> Result<Annotation> {
    let (width, height) = (side_px(image, "width")?, side_px(image, "height")?);
    let name = image.attribute("name").unwrap_or_default();
    Ok(Annotation {
        pictures: vec![vec![name.replace('\\', "/")]],
        size: Some([width, height]),
        shapes: shapes(image)?,
        source: PROGRAM,
        ..Annotation::default()
    })
}

fn shapes(image: Node<'_, '_>) -> Result<Vec<AnnotatedShape>> {
    image
        .children()
        .filter(Node::is_element)
        .filter_map(|node| shape(node).transpose())
        .collect()
}

fn shape(node: Node<'_, '_>) -> Result<Option<AnnotatedShape>> {
    let name = node.attribute("label").unwrap_or_default().to_owned();
    let (kind, points) = match node.tag_name().name() {
        "polygon" | "polyline" => (ShapeKind::Polygon, points(node)?),
        "points" => (ShapeKind::Points, points(node)?),
        "box" => (ShapeKind::Rectangle, box_corners(node)?),
        _ => return Ok(None),
    };
    Ok(Some(AnnotatedShape { kind, name, points }))
}

fn box_corners(node: Node<'_, '_>) -> Result<Vec<[f64; 2]>> {
    let first = [number(node, "xtl")?, number(node, "ytl")?];
    let opposite = [number(node, "xbr")?, number(node, "ybr")?];
    let corners = upright_corners(first, opposite);
    match node.attribute("rotation") {
        None => Ok(corners),
        Some(_) => Ok(turned_about_middle(corners, number(node, "rotation")?)),
    }
}

/// `x,y;x,y` as numbers.
fn points(node: Node<'_, '_>) -> Result<Vec<[f64; 2]>> {
    let text = node.attribute("points").unwrap_or_default();
    text.split(';')
        .filter(|part| !part.trim().is_empty())
        .map(point)
        .collect()
}

/// `x,y` as numbers.
fn point(text: &str) -> Result<[f64; 2]> {
    let parts = text.split_once(',');
    match parts.map(|(x, y)| [x, y].map(|part| part.trim().parse::<f64>())) {
        Some([Ok(x), Ok(y)]) => Ok([x, y]),
        _ => Err(Error::value("points", format!("\"{text}\", expected x,y"))),
    }
}

fn number(node: Node<'_, '_>, name: &str) -> Result<f64> {
    let text = node
        .attribute(name)
        .ok_or_else(|| Error::value(name, "missing, expected a number"))?;
    text.parse()
        .map_err(|_| Error::value(name, format!("\"{text}\", expected a number")))
}

/// A side of a picture.
fn side_px(image: Node<'_, '_>, name: &str) -> Result<u32> {
    let side = number(image, name)?;
    if (1.0..=f64::from(u32::MAX)).contains(&side) && side.fract() == 0.0 {
        return Ok(side as u32);
    }
    let what = format!(
        "{}, expected whole pixels, at least 1",
        bounds::number(side)
    );
    Err(Error::value(name, what))
}

/// The corners of a rectangle that was turned clockwise about its middle.
fn turned_about_middle(corners: Vec<[f64; 2]>, degrees: f64) -> Vec<[f64; 2]> {
    if degrees == 0.0 {
        return corners;
    }
    let middle = [0, 1].map(|axis| (corners[0][axis] + corners[2][axis]) / 2.0);
    corners
        .into_iter()
        .map(|[x, y]| turned_about(middle, [x - middle[0], y - middle[1]], degrees))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::annotations;
    use super::super::tests::only;

    const XML: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<annotations><version>1.1</version><meta><job><id>1</id></job></meta>
  <image id="0" name="bg0.jpg" width="200" height="100">
    <polygon label="tray" source="manual" occluded="0" points="10.00,20.00;110.00,22.00;108.00,90.00;9.00,88.00" z_order="0">
      <attribute name="side">up</attribute></polygon>
    <tag label="good" source="manual"></tag>
  </image>
  <image id="1" name="empty.jpg" width="200" height="100"></image>
</annotations>"#;

    #[test]
    fn pictures_with_a_polygon_are_labels() {
        let annotation = only(XML);
        assert_eq!(
            (annotation.size, annotation.pictures.as_slice()),
            (Some([200, 100]), &[vec!["bg0.jpg".to_owned()]][..])
        );
        let label = annotation.label().unwrap();
        assert_eq!(
            label.surface.corners_px,
            Some([[10.0, 20.0], [110.0, 22.0], [108.0, 90.0], [9.0, 88.0]])
        );
    }

    #[test]
    fn points_and_boxes_are_read() {
        let with = |shape: &str| {
            let text = format!(
                r#"<annotations><image name="a" width="9" height="9">{shape}</image></annotations>"#
            );
            only(&text).label().unwrap().surface.corners_px.unwrap()
        };
        assert_eq!(
            with(r#"<points label="c" points="1,2;3,4;5,6;7,8"/>"#)[3],
            [7.0, 8.0]
        );
        assert_eq!(
            with(r#"<box label="c" xtl="1" ytl="2" xbr="5" ybr="8"/>"#)[2],
            [5.0, 8.0]
        );
        let [x, y] = with(r#"<box label="c" xtl="1" ytl="2" xbr="5" ybr="8" rotation="90"/>"#)[0];
        assert!(
            (x - 6.0).abs() < 1e-12 && (y - 3.0).abs() < 1e-12,
            "{x} {y}"
        );
    }

    #[test]
    fn a_side_that_no_picture_has_is_named() {
        for (side, shown) in [
            ("-5", "-5"),
            ("NaN", "NaN"),
            ("1e99", "1e99"),
            ("0.5", "0.5"),
        ] {
            let text = XML.replacen("width=\"200\"", &format!("width=\"{side}\""), 1);
            let told = annotations(&text).unwrap_err().to_string();
            let expected = format!("image[0].width: {shown}, expected whole pixels, at least 1");
            assert_eq!(told, expected);
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let error = |text: &str| annotations(text).unwrap_err().to_string();
        assert!(
            error(&XML.replace("110.00,22.00", "110.00"))
                .contains("image[0].points: \"110.00\", expected x,y")
        );
        assert!(error(&XML.replace("width=\"200\"", "")).contains("image[0].width: missing"));
        assert!(
            error("<!DOCTYPE a [<!ENTITY b \"c\">]><annotations/>").contains("document"),
            "no document types"
        );
        assert!(error("<annotations>").contains("document"));
    }
}
