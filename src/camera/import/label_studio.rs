//! Label Studio: the exports JSON (tasks with annotations and results) and JSON-MIN (tasks with their results beside each
//! other). Places are in percent of the picture.

use super::{Drawing, Kind, Shape};
use crate::error::{Error, Result};
use serde::Deserialize;
use serde_json::Value;

/// Length of what Label Studio puts before the name of an uploaded file: eight hexadecimal digits and a hyphen.
const PREFIX: usize = 9;

/// A result as both exports write it; JSON keeps the geometry in `value`, JSON-MIN in the result itself.
#[derive(Deserialize)]
struct Drawn {
    original_width: u32,
    original_height: u32,
    #[serde(default)]
    image_rotation: f64,
    value: Option<Geometry>,
    #[serde(flatten)]
    own: Geometry,
}

#[derive(Clone, Default, Deserialize)]
#[serde(default)]
struct Geometry {
    points: Option<Vec<[f64; 2]>>,
    x: Option<f64>,
    y: Option<f64>,
    width: Option<f64>,
    height: Option<f64>,
    rotation: f64,
    polygonlabels: Vec<String>,
    rectanglelabels: Vec<String>,
    keypointlabels: Option<Vec<String>>,
    labels: Vec<String>,
}

pub(super) fn is_one(value: &Value) -> bool {
    let tasks = value.as_array().map_or(&[][..], Vec::as_slice);
    !tasks.is_empty()
        && tasks
            .iter()
            .all(|task| task.get("annotations").is_some() || !results_beside(task).is_empty())
}

pub(super) fn drawings(value: Value) -> Result<Vec<Drawing>> {
    let tasks = value.as_array().map_or(&[][..], Vec::as_slice);
    let found: Result<Vec<Drawing>> = tasks
        .iter()
        .enumerate()
        .map(|(i, task)| drawing(task).map_err(|e| e.within(&format!("[{i}]"))))
        .collect();
    Ok(found?
        .into_iter()
        .filter(|drawing| !drawing.shapes.is_empty())
        .collect())
}

fn drawing(task: &Value) -> Result<Drawing> {
    let results = match task.get("annotations") {
        Some(annotations) => of_annotations(annotations)?,
        None => results_beside(task),
    };
    let mut drawing = Drawing {
        files: names(task),
        source: "label-studio",
        ..Default::default()
    };
    for (i, result) in results.iter().enumerate() {
        // Choices, ratings and the like have no size of a picture.
        if result.get("original_width").is_none() {
            continue;
        }
        let at = |e: String| Error::value(format!("result[{i}]"), e);
        let drawn: Drawn =
            serde_path_to_error::deserialize((*result).clone()).map_err(|e| at(e.to_string()))?;
        if drawn.image_rotation != 0.0 {
            return Err(at(format!(
                "image_rotation: {}, expected 0",
                drawn.image_rotation
            )));
        }
        drawing.size = Some([drawn.original_width, drawn.original_height]);
        drawing.shapes.extend(shape(&drawn));
    }
    Ok(drawing)
}

/// The results of the only annotation that was not cancelled.
fn of_annotations(annotations: &Value) -> Result<Vec<&Value>> {
    let all = annotations.as_array().map_or(&[][..], Vec::as_slice);
    let kept: Vec<&Value> = all
        .iter()
        .filter(|a| a.get("was_cancelled").and_then(Value::as_bool) != Some(true))
        .collect();
    match kept.as_slice() {
        [] => Ok(Vec::new()),
        [one] => Ok(one
            .get("result")
            .and_then(Value::as_array)
            .map_or(Vec::new(), |list| list.iter().collect())),
        more => Err(Error::value(
            "annotations",
            format!("{}, expected one", more.len()),
        )),
    }
}

/// JSON-MIN: results in lists under the names of the tools that drew them.
fn results_beside(task: &Value) -> Vec<&Value> {
    let lists = task
        .as_object()
        .into_iter()
        .flat_map(|task| task.values())
        .filter_map(Value::as_array);
    lists
        .flatten()
        .filter(|result| result.get("original_width").is_some())
        .collect()
}

fn shape(drawn: &Drawn) -> Option<Shape> {
    let geometry = drawn.value.as_ref().unwrap_or(&drawn.own);
    let percent = [
        f64::from(drawn.original_width) / 100.0,
        f64::from(drawn.original_height) / 100.0,
    ];
    let px = |[x, y]: [f64; 2]| [x * percent[0], y * percent[1]];
    let names = [
        &geometry.polygonlabels,
        &geometry.rectanglelabels,
        &geometry.labels,
    ];
    let points_of = geometry.keypointlabels.iter();
    let name = names
        .into_iter()
        .chain(points_of)
        .find_map(|names| names.first())
        .cloned()
        .unwrap_or_default();
    let (kind, points) = match (&geometry.points, geometry.x.zip(geometry.y)) {
        (Some(points), _) => (Kind::Polygon, points.iter().copied().map(px).collect()),
        (None, Some((x, y))) if geometry.keypointlabels.is_some() => {
            (Kind::Points, vec![px([x, y])])
        }
        (None, Some((x, y))) => {
            let [w, h] = px([geometry.width?, geometry.height?]);
            (
                Kind::Rectangle,
                turned(px([x, y]), [w, h], geometry.rotation),
            )
        }
        _ => return None,
    };
    Some(Shape { kind, name, points })
}

/// The corners of a rectangle that was turned clockwise about its first one.
fn turned([x, y]: [f64; 2], [w, h]: [f64; 2], degrees: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = (
        libm::sin(degrees.to_radians()),
        libm::cos(degrees.to_radians()),
    );
    let corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
    corners
        .map(|[u, v]| [x + u * cos - v * sin, y + u * sin + v * cos])
        .into()
}

/// Names that a task's picture may have, the most likely first.
fn names(task: &Value) -> Vec<String> {
    const ENDINGS: [&str; 8] = [
        ".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".webp", ".exr",
    ];
    let data = task.get("data").unwrap_or(task);
    let texts = data
        .as_object()
        .into_iter()
        .flat_map(|data| data.values())
        .filter_map(Value::as_str);
    let texts = texts.chain(task.get("file_upload").and_then(Value::as_str));
    let file = |text: &str| {
        let path = text.rsplit_once("?d=").map_or(text, |(_, path)| path);
        let name = decoded(path.rsplit(['/', '\\']).next()?);
        ENDINGS
            .iter()
            .any(|end| name.to_lowercase().ends_with(end))
            .then_some(name)
    };
    let mut names: Vec<String> = Vec::new();
    for name in texts.filter_map(file) {
        let bare = name.as_bytes().get(..PREFIX).filter(|front| {
            front[..PREFIX - 1].iter().all(u8::is_ascii_hexdigit) && front[PREFIX - 1] == b'-'
        });
        let bare = bare.map(|_| name[PREFIX..].to_owned());
        names.extend([Some(name), bare].into_iter().flatten());
    }
    names
}

/// A text with its `%20` and the like undone.
fn decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let hex = after
            .get(..2)
            .filter(|_| first == b'%')
            .and_then(|hex| std::str::from_utf8(hex).ok());
        let byte = hex.and_then(|hex| u8::from_str_radix(hex, 16).ok());
        bytes.push(byte.unwrap_or(first));
        rest = if byte.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::tests::only;
    use super::*;

    const JSON: &str = r#"[{"id": 3, "annotations": [
        {"id": 1, "was_cancelled": true, "result": []},
        {"id": 2, "was_cancelled": false, "result": [
          {"original_width": 200, "original_height": 100, "image_rotation": 0, "type": "polygonlabels",
           "value": {"points": [[5, 20], [55, 22], [54, 90], [4.5, 88]], "closed": true, "polygonlabels": ["tray"]}},
          {"type": "choices", "value": {"choices": ["good"]}, "from_name": "quality", "to_name": "image"}]}],
        "file_upload": "0123abcd-bg_1.jpg", "data": {"image": "/data/upload/3/0123abcd-bg%5F1.jpg"}}]"#;

    const MIN: &str = r#"[{"image": "/data/local-files/?d=photos/my%20bg.jpg", "id": 3, "annotator": 1, "label": [
        {"x": 10, "y": 20, "width": 50, "height": 60, "rotation": 0, "rectanglelabels": ["tray"],
         "original_width": 200, "original_height": 100}]}]"#;

    #[test]
    fn percent_become_pixels_and_the_added_name_is_known() {
        let drawing = only(JSON);
        assert_eq!(drawing.size, Some([200, 100]));
        assert!(
            drawing.files.contains(&"bg_1.jpg".into()),
            "{:?}",
            drawing.files
        );
        let label = drawing.label().unwrap();
        assert_eq!(
            label.surface.corners_px,
            Some([[10.0, 20.0], [110.0, 22.0], [108.0, 90.0], [9.0, 88.0]])
        );
        assert_eq!(label.surface.id, "tray");
    }

    #[test]
    fn the_short_export_is_read_too() {
        let drawing = only(MIN);
        assert_eq!(drawing.files, ["my bg.jpg"]);
        let corners = drawing.label().unwrap().surface.corners_px;
        assert_eq!(
            corners,
            Some([[20.0, 20.0], [120.0, 20.0], [120.0, 80.0], [20.0, 80.0]])
        );
    }

    #[test]
    fn key_points_are_points() {
        let point = |x: f64, y: f64| {
            format!(
                r#"{{"x": {x}, "y": {y}, "width": 0.3, "keypointlabels": ["c"], "original_width": 200, "original_height": 100}}"#
            )
        };
        let points = [
            point(5.0, 20.0),
            point(55.0, 22.0),
            point(54.0, 90.0),
            point(4.5, 88.0),
        ]
        .join(",");
        let label = only(&format!(r#"[{{"img": "a.png", "kp": [{points}]}}]"#))
            .label()
            .unwrap();
        assert_eq!(label.surface.corners_px.unwrap()[2], [108.0, 90.0]);
    }

    #[test]
    fn a_turned_rectangle_is_turned_about_its_first_corner() {
        let corners = turned([10.0, 20.0], [30.0, 40.0], 90.0);
        let expected = [[10.0, 20.0], [10.0, 50.0], [-30.0, 50.0], [-30.0, 20.0]];
        for (a, b) in corners.iter().zip(expected) {
            assert!(
                (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12,
                "{corners:?}"
            );
        }
    }

    #[test]
    fn two_annotators_and_turned_pictures_are_named() {
        let two = JSON.replace("\"was_cancelled\": true", "\"was_cancelled\": false");
        assert!(
            super::super::drawings(&two)
                .unwrap_err()
                .to_string()
                .contains("[0].annotations: 2, expected one")
        );
        let turned = JSON.replace("\"image_rotation\": 0", "\"image_rotation\": 90");
        assert!(
            super::super::drawings(&turned)
                .unwrap_err()
                .to_string()
                .contains("image_rotation: 90")
        );
    }

    #[test]
    fn tasks_without_a_drawing_are_left_out() {
        let empty = r#"[{"annotations": [], "data": {"image": "a.jpg"}}]"#;
        assert_eq!(super::super::drawings(empty).unwrap(), Some(vec![]));
    }
}
