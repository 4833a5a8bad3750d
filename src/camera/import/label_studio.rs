//! Label Studio: the exports JSON (tasks with annotations and results) and JSON-MIN (tasks with
//! their results beside each other). Positions are in percent of the picture.

use super::{AnnotatedShape, Annotation, PictureNames, ShapeKind, turned_about, with_shapes};
use crate::error::{Error, Result};
use crate::io::Format;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// The source of surfaces that were drawn in it.
pub(super) const PROGRAM: &str = "label-studio";

/// Length of what Label Studio puts before the name of an uploaded file: eight hexadecimal digits
/// and a hyphen.
const UPLOAD_PREFIX_LENGTH: usize = 9;

/// A result as both exports write it; JSON keeps the geometry in `value`, JSON-MIN in the result
/// itself.
#[derive(Deserialize)]
struct AnnotationResult {
    original_width: u32,
    original_height: u32,
    #[serde(default)]
    image_rotation: f64,
    value: Option<ResultGeometry>,
    #[serde(flatten)]
    own: ResultGeometry,
}

#[derive(Clone, Default, Deserialize)]
#[serde(default)]
struct ResultGeometry {
    points: Option<Vec<[f64; 2]>>,
    x: Option<f64>,
    y: Option<f64>,
    width: Option<f64>,
    height: Option<f64>,
    /// Of an ellipse.
    #[serde(rename = "radiusX")]
    radius_x: Option<f64>,
    rotation: f64,
    polygonlabels: Vec<String>,
    rectanglelabels: Vec<String>,
    keypointlabels: Option<Vec<String>>,
    labels: Vec<String>,
}

pub(super) fn is_label_studio(value: &Value) -> bool {
    let tasks = items(value);
    !tasks.is_empty() && tasks.iter().all(is_task)
}

fn is_task(value: &Value) -> bool {
    value.get("annotations").is_some() || !results_beside(value).is_empty()
}

pub(super) fn annotations(value: Value) -> Result<Vec<Annotation>> {
    let tasks = items(&value).iter().enumerate();
    with_shapes(tasks.map(|(i, task)| annotation_at(format!("[{i}]"), task)))
}

/// The annotation of a task at a place in the file.
fn annotation_at(at: String, task: &Value) -> Result<Annotation> {
    let annotation = annotation(task).map_err(|e| e.within(&at))?;
    if annotation.pictures.is_empty() && !annotation.shapes.is_empty() {
        let place = match task.get("data") {
            Some(_) => format!("{at}.data"),
            None => at,
        };
        let what = "no picture name, expected a URL or path that ends in .jpg, .png, ..";
        return Err(Error::value(place, what));
    }
    Ok(Annotation { at, ..annotation })
}

/// The elements of an array; none of anything else.
fn items(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn annotation(task: &Value) -> Result<Annotation> {
    let results = match task.get("annotations") {
        Some(annotations) => only_annotation_results(annotations)?,
        None => results_beside(task),
    };
    let mut annotation = Annotation {
        source: PROGRAM,
        ..Default::default()
    };
    let mut tags = Vec::new();
    for (i, value) in results.iter().enumerate().filter(|(_, r)| has_size(r)) {
        let in_result = |e: String| Error::value(format!("result[{i}]"), e);
        let result = read_result(value).map_err(in_result)?;
        annotation.set_size(&result).map_err(in_result)?;
        if let Some(shape) = result.shape() {
            annotation.add_region(shape);
            tags.extend(value.get("to_name").and_then(Value::as_str));
        }
    }
    [annotation.pictures, annotation.others] = pictures(task, &tags);
    Ok(annotation)
}

impl Annotation {
    /// The picture's size is that of each result.
    fn set_size(&mut self, result: &AnnotationResult) -> std::result::Result<(), String> {
        let size @ [width, height] = [result.original_width, result.original_height];
        let [w, h] = *self.size.get_or_insert(size);
        if [w, h] == size {
            return Ok(());
        }
        Err(format!(
            "original_width and original_height: {width} x {height}, expected {w} x {h} as in the result before"
        ))
    }

    /// A region has a result for each control that says something of it, all with its geometry:
    /// they are one shape, with the first name that any of them gives.
    fn add_region(&mut self, shape: AnnotatedShape) {
        let mut shapes = self.shapes.iter_mut();
        match shapes.find(|known| known.kind == shape.kind && known.points == shape.points) {
            Some(known) if known.name.is_empty() => known.name = shape.name,
            Some(_) => {}
            None => self.shapes.push(shape),
        }
    }
}

fn read_result(value: &Value) -> std::result::Result<AnnotationResult, String> {
    let result: AnnotationResult =
        serde_path_to_error::deserialize(value.clone()).map_err(|e| e.to_string())?;
    match result.image_rotation {
        0.0 => Ok(result),
        turned => Err(format!("image_rotation: {turned}, expected 0")),
    }
}

/// The results of the only annotation that was not cancelled.
fn only_annotation_results(annotations: &Value) -> Result<Vec<&Value>> {
    let kept: Vec<&Value> = items(annotations)
        .iter()
        .filter(|annotation| !is_cancelled(annotation))
        .collect();
    match kept.as_slice() {
        [] => Ok(Vec::new()),
        [one] => Ok(one.get("result").into_iter().flat_map(items).collect()),
        more => {
            let what = format!("{}, expected one", more.len());
            Err(Error::value("annotations", what))
        }
    }
}

fn is_cancelled(annotation: &Value) -> bool {
    annotation.get("was_cancelled").and_then(Value::as_bool) == Some(true)
}

/// JSON-MIN: results in lists under the names of the tools that drew them.
fn results_beside(task: &Value) -> Vec<&Value> {
    let lists = member_values(task).filter_map(Value::as_array);
    lists.flatten().filter(|result| has_size(result)).collect()
}

/// The values of an object; none of anything else.
fn member_values(value: &Value) -> impl Iterator<Item = &Value> {
    let object = value.as_object().into_iter();
    object.flat_map(|members| members.values())
}

/// Choices, ratings and the like have no size of a picture.
fn has_size(result: &Value) -> bool {
    result.get("original_width").is_some()
}

impl AnnotationResult {
    /// What was drawn; none for a result that is neither points nor a rectangle.
    fn shape(&self) -> Option<AnnotatedShape> {
        let geometry = self.value.as_ref().unwrap_or(&self.own);
        if let Some(points) = &geometry.points {
            return Some(self.points(ShapeKind::Polygon, geometry, points));
        }
        let corner = [geometry.x?, geometry.y?];
        if geometry.is_point() {
            Some(self.points(ShapeKind::Points, geometry, &[corner]))
        } else {
            self.rectangle(geometry, corner)
        }
    }

    fn points(
        &self,
        kind: ShapeKind,
        geometry: &ResultGeometry,
        points: &[[f64; 2]],
    ) -> AnnotatedShape {
        AnnotatedShape {
            kind,
            name: geometry.name(),
            points: points.iter().map(|p| self.to_px(*p)).collect(),
        }
    }

    fn rectangle(&self, geometry: &ResultGeometry, corner: [f64; 2]) -> Option<AnnotatedShape> {
        let size = self.to_px([geometry.width?, geometry.height?]);
        Some(AnnotatedShape {
            kind: ShapeKind::Rectangle,
            name: geometry.name(),
            points: turned_about_corner(self.to_px(corner), size, geometry.rotation),
        })
    }

    /// Pixels from percent of the picture.
    fn to_px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            x * (f64::from(self.original_width) / 100.0),
            y * (f64::from(self.original_height) / 100.0),
        ]
    }
}

impl ResultGeometry {
    /// A key point has a place and the `width` of its dot.
    fn is_point(&self) -> bool {
        self.keypointlabels.is_some() || (self.height.is_none() && self.radius_x.is_none())
    }

    /// The first class that any of the tools gave it.
    fn name(&self) -> String {
        [&self.polygonlabels, &self.rectanglelabels, &self.labels]
            .into_iter()
            .chain(self.keypointlabels.iter())
            .find_map(|names| names.first())
            .cloned()
            .unwrap_or_default()
    }
}

/// The corners of a rectangle that was turned clockwise about its first one.
fn turned_about_corner([x, y]: [f64; 2], [w, h]: [f64; 2], degrees: f64) -> Vec<[f64; 2]> {
    [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]]
        .map(|offset| turned_about([x, y], offset, degrees))
        .into()
}

/// Pictures that Label Studio shows and petcomp does not read.
const UNREAD_ENDINGS: [&str; 2] = [".bmp", ".webp"];

/// The pictures of a task that shapes may be on: the field of the name that their tag has, or else
/// the uploaded file, or else any field, as a tag may have another name than its field. Then those
/// of all fields: the first may be known by an address in a cloud alone.
fn pictures(task: &Value, tags: &[&str]) -> [Vec<PictureNames>; 2] {
    let data = task.get("data").unwrap_or(task);
    let named = tags.iter().filter_map(|tag| data.get(*tag));
    let uploaded = task.get("file_upload");
    let all = pictures_at(member_values(data).chain(uploaded));
    let choices = [pictures_at(named), pictures_at(uploaded)];
    let first = choices.into_iter().find(|choice| !choice.is_empty());
    [first.unwrap_or_else(|| all.clone()), all]
}

fn pictures_at<'a>(addresses: impl IntoIterator<Item = &'a Value>) -> Vec<PictureNames> {
    let addresses = addresses.into_iter().filter_map(Value::as_str);
    let names = addresses.filter_map(picture_name);
    without_repeated(&names.map(with_original_name).collect())
}

/// Without those all of whose names another one has, too: a field often has the bare name of the
/// file whose address is in another.
fn without_repeated(pictures: &BTreeSet<PictureNames>) -> Vec<PictureNames> {
    let is_repeated = |one: &PictureNames| {
        let mut others = pictures.iter().filter(|other| *other != one);
        others.any(|other| one.iter().all(|name| other.contains(name)))
    };
    let kept = pictures.iter().filter(|one| !is_repeated(one));
    kept.cloned().collect()
}

/// A name, and the one that the file may have had before it was uploaded.
fn with_original_name(name: String) -> PictureNames {
    let original = without_upload_prefix(&name).map(str::to_owned);
    [Some(name), original].into_iter().flatten().collect()
}

/// The name of the picture at an address: in its query, or in front of `?` or `#`, which may also
/// belong to the name.
fn picture_name(address: &str) -> Option<String> {
    let in_query = address.rsplit_once("?d=").map(|(_, path)| path);
    let in_front = address.split(['?', '#']).next();
    let mut paths = [in_query, in_front, Some(address)].into_iter().flatten();
    paths.find_map(last_step_if_picture)
}

fn last_step_if_picture(path: &str) -> Option<String> {
    let name = decoded(path.rsplit(['/', '\\']).next()?);
    is_picture(&name).then_some(name)
}

fn is_picture(name: &str) -> bool {
    let lower = name.to_lowercase();
    Format::from_extension(Path::new(name)).is_some()
        || UNREAD_ENDINGS.iter().any(|end| lower.ends_with(end))
}

/// The name that a file had before it was uploaded.
fn without_upload_prefix(name: &str) -> Option<&str> {
    let (digits, rest) = name.split_at_checked(UPLOAD_PREFIX_LENGTH - 1)?;
    let bare = rest.strip_prefix('-')?;
    let is_hexadecimal = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_hexadecimal.then_some(bare)
}

/// A text with its `%20` and the like undone.
fn decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let escaped = escaped_byte(after).filter(|_| first == b'%');
        bytes.push(escaped.unwrap_or(first));
        rest = if escaped.is_some() {
            &after[2..]
        } else {
            after
        };
    }
    String::from_utf8(bytes).unwrap_or_else(|_| text.to_owned())
}

/// The byte that two hexadecimal digits stand for.
fn escaped_byte(text: &[u8]) -> Option<u8> {
    let digits = std::str::from_utf8(text.get(..2)?).ok()?;
    u8::from_str_radix(digits, 16).ok()
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
        let annotation = only(JSON);
        assert_eq!(annotation.size, Some([200, 100]));
        assert_eq!(annotation.pictures, [["0123abcd-bg_1.jpg", "bg_1.jpg"]]);
        let label = annotation.label().unwrap();
        assert_eq!(
            label.surface.corners_px,
            Some([[10.0, 20.0], [110.0, 22.0], [108.0, 90.0], [9.0, 88.0]])
        );
        assert_eq!(label.surface.id, "tray");
    }

    #[test]
    fn the_short_export_is_read_too() {
        let annotation = only(MIN);
        assert_eq!(annotation.pictures, [["my bg.jpg"]]);
        let corners = annotation.label().unwrap().surface.corners_px;
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
    fn key_points_of_labels_for_all_tools_are_points_and_ellipses_are_not() {
        let drawn = |geometry: &str| -> Vec<AnnotatedShape> {
            let result = r#""labels": ["tl"], "original_width": 200, "original_height": 100"#;
            let task = format!(r#"[{{"img": "a.png", "kp": [{{{geometry}, {result}}}]}}]"#);
            let annotations = super::super::annotations(&task).unwrap().unwrap();
            annotations.into_iter().flat_map(|a| a.shapes).collect()
        };
        let point = AnnotatedShape {
            kind: ShapeKind::Points,
            name: "tl".into(),
            points: vec![[10.0, 20.0]],
        };
        assert_eq!(drawn(r#""x": 5, "y": 20, "width": 0.3"#), [point]);
        assert!(drawn(r#""x": 5, "y": 20, "radiusX": 1, "radiusY": 2"#).is_empty());
    }

    #[test]
    fn a_region_that_two_controls_speak_of_is_one_shape() {
        let choice = r#"{"original_width": 200, "original_height": 100, "image_rotation": 0, "type": "choices",
            "value": {"points": [[5, 20], [55, 22], [54, 90], [4.5, 88]], "closed": true, "choices": ["clean"]}},"#;
        for place in ["{\"original_width\"", "{\"type\": \"choices\""] {
            let both = JSON.replace(place, &format!("{choice} {place}"));
            let shapes = only(&both).shapes;
            assert_eq!((shapes.len(), shapes[0].name.as_str()), (1, "tray"));
        }
    }

    #[test]
    fn results_of_pictures_of_two_sizes_are_refused() {
        let other = r#"{"original_width": 400, "original_height": 100, "type": "choices"}, "#;
        let both = JSON.replace(
            "{\"type\": \"choices\"",
            &format!("{other}{{\"type\": \"choices\""),
        );
        let told = super::super::annotations(&both).unwrap_err().to_string();
        let expected = "[0].result[1]: original_width and original_height: 400 x 100, expected 200 x 100 as in the result before";
        assert_eq!(told, expected);
    }

    #[test]
    fn a_turned_rectangle_is_turned_about_its_first_corner() {
        let corners = turned_about_corner([10.0, 20.0], [30.0, 40.0], 90.0);
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
            super::super::annotations(&two)
                .unwrap_err()
                .to_string()
                .contains("[0].annotations: 2, expected one")
        );
        let turned = JSON.replace("\"image_rotation\": 0", "\"image_rotation\": 90");
        assert!(
            super::super::annotations(&turned)
                .unwrap_err()
                .to_string()
                .contains("image_rotation: 90")
        );
    }

    /// The pictures of a task with other data.
    fn pictures_of(data: &str) -> Vec<PictureNames> {
        let (before, _) = JSON.split_once("\"file_upload\"").unwrap();
        let named = before.replace("\"type\": \"polygonlabels\"", "\"to_name\": \"image\"");
        only(&format!("{named}{data}}}]")).pictures
    }

    #[test]
    fn the_tag_and_the_upload_tell_which_picture_it_is() {
        let data = r#""data": {"image": "/x/b.jpg", "before": "/x/a.jpg"}"#;
        assert_eq!(pictures_of(data), [["b.jpg"]]);
        let other = data.replace("image", "photo");
        assert_eq!(pictures_of(&other), [["a.jpg"], ["b.jpg"]]);
        let uploaded = format!(r#""file_upload": "b.jpg", {other}"#);
        assert_eq!(pictures_of(&uploaded), [["b.jpg"]]);
    }

    #[test]
    fn a_picture_under_two_names_is_one() {
        let both = r#""image": "/data/upload/3/0123abcd-bg.jpg", "filename": "bg.jpg""#;
        let min = MIN.replace(
            "\"image\": \"/data/local-files/?d=photos/my%20bg.jpg\"",
            both,
        );
        assert_eq!(only(&min).pictures, [["0123abcd-bg.jpg", "bg.jpg"]]);
    }

    #[test]
    fn other_pictures_of_the_task_are_known() {
        let (before, _) = JSON.split_once("\"file_upload\"").unwrap();
        let named = before.replace("\"type\": \"polygonlabels\"", "\"to_name\": \"image\"");
        let data = r#""data": {"image": "s3://b/9f.jpg", "filename": "bg.jpg"}"#;
        let annotation = only(&format!("{named}{data}}}]"));
        assert_eq!(annotation.pictures, [["9f.jpg"]]);
        assert_eq!(annotation.others, [["9f.jpg"], ["bg.jpg"]]);
    }

    #[test]
    fn signed_addresses_and_every_format_have_names() {
        for (address, name) in [
            ("https://x.org/b/a.jpg?X-Amz-Signature=0f&n=1/2", "a.jpg"),
            ("https://x.org/a.HEIC#top", "a.HEIC"),
            ("/data/local-files/?d=b/a.tif", "a.tif"),
            ("s3://b/bg #1.png", "bg #1.png"),
            ("/data/a.webp", "a.webp"),
        ] {
            assert_eq!(picture_name(address).as_deref(), Some(name), "{address}");
        }
    }

    #[test]
    fn a_task_whose_picture_has_no_name_is_named() {
        // The short export has no `data`.
        for (export, place) in [(JSON, "[0].data"), (MIN, "[0]")] {
            let text = export.replace(".jpg", ".pdf");
            let told = super::super::annotations(&text).unwrap_err().to_string();
            let expected = format!(
                "{place}: no picture name, expected a URL or path that ends in .jpg, .png, .."
            );
            assert_eq!(told, expected);
        }
    }

    #[test]
    fn tasks_without_a_drawing_are_left_out() {
        let empty = r#"[{"annotations": [], "data": {"image": "a.jpg"}}]"#;
        assert_eq!(super::super::annotations(empty).unwrap(), Some(vec![]));
    }
}
