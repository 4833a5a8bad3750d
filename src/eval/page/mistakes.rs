//! What a detector got wrong, as a table and as pictures, the worst first.

use super::{EvalReportOptions, Run};
use crate::eval::{
    ConfusionOptions, Detection, EvalImage, GroundTruth, Mistake, MistakeKind, Picture, class_name,
};
use crate::geom::BBox;
use crate::label::gallery::{self, Figure, gallery, marked_box};
use crate::plot::{Page, Table};
use rayon::prelude::*;

/// Colours of Okabe and Ito, distinguishable with every kind of colour vision.
const TRUTH: &str = "#009e73";
const FOUND: &str = "#0072b2";
const WRONG: &str = "#d55e00";
const CROWD: &str = "#777777";

const THICK: &str = "stroke-width=\"3\"";
const THIN: &str = "stroke-width=\"1.5\"";
const DASHED: &str = "stroke-width=\"1.5\" stroke-dasharray=\"5 3\"";
const THICK_DASHED: &str = "stroke-width=\"3\" stroke-dasharray=\"7 4\"";

/// The area shown around a box: its longer side times this, but at least this share of the
/// picture's.
const VIEW_SCALE: f64 = 3.0;
const MIN_VIEW_SHARE: f64 = 0.15;
/// Maximum number of boxes shown in addition to those of the mistake: more would hide it, and make
/// the page grow without limit.
const MAX_OTHER_BOXES: usize = 100;

/// All mistakes of a run, one per row.
pub(crate) fn table(run: &Run, mistakes: &[Mistake], options: &EvalReportOptions) -> Table {
    let columns = [
        "image",
        "mistake",
        "true class",
        "found class",
        "confidence",
        "iou",
        "x0",
        "y0",
        "x1",
        "y1",
    ];
    let mut table = Table::new(columns);
    for mistake in mistakes {
        table.push(ShownMistake::new(run, mistake).row(options));
    }
    table
}

/// The worst mistakes as pictures.
pub(crate) fn add_to(
    page: &mut Page,
    run: &Run,
    mistakes: &[Mistake],
    options: &EvalReportOptions,
) {
    page.heading("Mistakes")
        .text(&describe_mistakes(mistakes, options));
    if options.pictures.iter().flatten().next().is_none() {
        page.text("No pictures: the images were not found; give their folder with --images.");
        return;
    }
    page.html(gallery::STYLE).html(&legend());
    add_galleries(page, run, mistakes, options);
}

fn add_galleries(page: &mut Page, run: &Run, mistakes: &[Mistake], options: &EvalReportOptions) {
    let (misses, detections): (Vec<&Mistake>, Vec<&Mistake>) =
        mistakes.iter().partition(|m| m.is_miss());
    let title = "False alarms and wrong classes, most confident first";
    add_figures(page, ["alarm", title], run, &detections, options);
    let title = "Missed boxes, largest first";
    add_figures(page, ["miss", title], run, &misses, options);
}

fn describe_mistakes(mistakes: &[Mistake], options: &EvalReportOptions) -> String {
    let [alarms, wrong, missed] = [
        MistakeKind::FalseAlarm,
        MistakeKind::WrongClass,
        MistakeKind::Missed,
    ]
    .map(|kind| mistakes.iter().filter(|m| m.kind == kind).count());
    let ConfusionOptions { confidence, iou } = options.confusion;
    format!(
        "{alarms} false alarms, {wrong} of another class than their box, {missed} boxes missed; detections with a \
         confidence above {confidence} and an IoU above {iou}. All of them, worst first, are in mistakes.csv."
    )
}

fn add_figures(
    page: &mut Page,
    [name, title]: [&str; 2],
    run: &Run,
    mistakes: &[&Mistake],
    options: &EvalReportOptions,
) {
    let figures: Vec<Figure> = with_pictures(mistakes, options)
        .par_iter()
        .filter_map(|mistake| figure(run, mistake, options))
        .collect();
    if !figures.is_empty() {
        let (shown, of) = (figures.len(), mistakes.len());
        page.subheading(&format!("{title} ({shown} of {of})"));
        page.html(&gallery(name, &figures));
    }
}

/// The first ones that have a picture.
fn with_pictures<'a>(mistakes: &[&'a Mistake], options: &EvalReportOptions) -> Vec<&'a Mistake> {
    let shown = mistakes.iter().copied();
    shown
        .filter(|m| options.picture(m.sheet).is_some())
        .take(options.shown)
        .collect()
}

/// None for a picture that cannot be read; that is only a warning, since the scores do not depend
/// on it.
fn figure(run: &Run, mistake: &Mistake, options: &EvalReportOptions) -> Option<Figure> {
    let shown = ShownMistake::new(run, mistake);
    let Picture { path, size } = options.picture(mistake.sheet)?;
    let view = shown.view(*size);
    let mut figure = Figure::cropped(path, *size, view)
        .inspect_err(|error| log::warn!("{error}"))
        .ok()?;
    figure.drawing = shown.drawing(&view, &FigureCanvas::new(&figure, options));
    figure.caption = format!("{}: {}", shown.sheet.image, shown.describe(options));
    Some(figure)
}

/// What all markings of a figure share.
struct FigureCanvas<'a> {
    /// Letter height, in pixels of the picture.
    letter: f64,
    /// Upper edge of the visible area.
    top: f64,
    options: &'a EvalReportOptions,
}

impl<'a> FigureCanvas<'a> {
    fn new(figure: &Figure, options: &'a EvalReportOptions) -> Self {
        Self {
            letter: figure.letter_height(),
            top: figure.top(),
            options,
        }
    }

    fn marked(&self, bbox: &BBox, words: &str, color: &str, style: &str) -> String {
        marked_box(bbox, words, self.letter, self.top, color, style)
    }

    fn class_name(&self, class: u32) -> String {
        gallery::clipped(&class_name(class, &self.options.classes), 24)
    }
}

/// A mistake with the boxes involved.
struct ShownMistake<'a> {
    mistake: &'a Mistake,
    sheet: &'a EvalImage,
    truth: Option<&'a GroundTruth>,
    found: Option<&'a Detection>,
}

impl<'a> ShownMistake<'a> {
    fn new(run: &'a Run, mistake: &'a Mistake) -> Self {
        let sheet = &run.sheets[mistake.sheet];
        Self {
            mistake,
            sheet,
            truth: mistake.truth.map(|t| &sheet.truth[t]),
            found: mistake.found.map(|f| &sheet.found[f]),
        }
    }

    /// The box that is wrong.
    fn wrong(&self) -> BBox {
        let [truth, found] = self.boxes();
        if self.mistake.is_miss() { truth } else { found }.unwrap_or_default()
    }

    /// The boxes of the truth and of the detection.
    fn boxes(&self) -> [Option<BBox>; 2] {
        [self.truth.map(|t| t.bbox), self.found.map(|f| f.bbox)]
    }

    /// The part of the picture around it.
    fn view(&self, size: [f64; 2]) -> BBox {
        let both = self.boxes().into_iter().flatten().reduce(BBox::hull);
        square_around(&both.unwrap_or_default(), size)
    }

    fn drawing(&self, view: &BBox, canvas: &FigureCanvas<'_>) -> String {
        let mut svg = self.other_marks(view, canvas);
        if let Some(truth) = self.truth {
            svg += &self.truth_mark(truth, canvas);
        }
        if let Some(found) = self.found {
            svg += &self.found_mark(found, canvas);
        }
        svg
    }

    /// Boxes and detections that are not part of the mistake.
    fn other_marks(&self, view: &BBox, canvas: &FigureCanvas<'_>) -> String {
        let mut svg = String::new();
        for truth in self.other_boxes(view) {
            let color = if truth.crowd { CROWD } else { TRUTH };
            svg += &canvas.marked(&truth.bbox, "", color, THIN);
        }
        for found in self.other_detections(view, canvas.options.confusion.confidence) {
            svg += &canvas.marked(&found.bbox, "", FOUND, DASHED);
        }
        svg
    }

    fn truth_mark(&self, truth: &GroundTruth, canvas: &FigureCanvas<'_>) -> String {
        let color = if self.mistake.is_miss() { WRONG } else { TRUTH };
        let words = format!("true: {}", canvas.class_name(truth.class));
        canvas.marked(&truth.bbox, &words, color, THICK)
    }

    fn found_mark(&self, found: &Detection, canvas: &FigureCanvas<'_>) -> String {
        let (color, style) = self.found_style();
        let words = format!("{} {:.2}", canvas.class_name(found.class), found.confidence);
        // Away from the text of the ground-truth box, which is at the upper corner.
        let at = [found.bbox.x0, found.bbox.y1 + 1.2 * canvas.letter];
        canvas.marked(&found.bbox, "", color, style)
            + &gallery::words(at, &words, canvas.letter, color)
    }

    fn found_style(&self) -> (&'static str, &'static str) {
        if self.mistake.is_miss() {
            (FOUND, DASHED)
        } else {
            (WRONG, THICK_DASHED)
        }
    }

    /// Its row in the table of mistakes.
    fn row(&self, options: &EvalReportOptions) -> [String; 10] {
        let wrong = self.wrong();
        let [x0, y0, x1, y1] = [wrong.x0, wrong.y0, wrong.x1, wrong.y1].map(|v| format!("{v:.1}"));
        let confidence = self.found.map(|f| format!("{:.4}", f.confidence));
        [
            self.sheet.image.clone(),
            word(self.mistake.kind).to_owned(),
            self.true_class(options),
            self.found_class(options),
            confidence.unwrap_or_default(),
            format!("{:.3}", self.mistake.iou),
            x0,
            y0,
            x1,
            y1,
        ]
    }

    /// Empty if there is no box.
    fn true_class(&self, options: &EvalReportOptions) -> String {
        let truth = self.truth.map(|t| class_name(t.class, &options.classes));
        truth.unwrap_or_default()
    }

    fn found_class(&self, options: &EvalReportOptions) -> String {
        let found = self.found.map(|f| class_name(f.class, &options.classes));
        found.unwrap_or_default()
    }

    /// Ground-truth boxes in the view that are not part of the mistake.
    fn other_boxes(&self, view: &BBox) -> Vec<&'a GroundTruth> {
        let seen = self.sheet.truth.iter().filter(|t| t.bbox.overlaps(view));
        seen.filter(|&t| !is_same(self.truth, t))
            .take(MAX_OTHER_BOXES)
            .collect()
    }

    /// The most confident detections in the view that are not part of the mistake.
    fn other_detections(&self, view: &BBox, confidence: f64) -> Vec<&'a Detection> {
        let found = self.sheet.found.iter();
        let mut seen: Vec<&Detection> = found
            .filter(|f| f.confidence > confidence)
            .filter(|&f| !is_same(self.found, f))
            .filter(|f| f.bbox.overlaps(view))
            .collect();
        seen.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        seen.truncate(MAX_OTHER_BOXES);
        seen
    }

    fn describe(&self, options: &EvalReportOptions) -> String {
        let (truth, iou) = (self.true_class(options), self.mistake.iou);
        let found = self.found_words(options);
        match (self.mistake.kind, self.truth, self.found) {
            (MistakeKind::Missed, _, Some(_)) => {
                format!("{truth} missed; nearest detection: {found}, IoU {iou:.2}")
            }
            (MistakeKind::Missed, ..) => format!("{truth} missed; no detection near"),
            (MistakeKind::WrongClass, ..) => format!("{found} for {truth}, IoU {iou:.2}"),
            (_, Some(_), _) => format!("false alarm: {found}; nearest box: {truth}, IoU {iou:.2}"),
            _ => format!("false alarm: {found}; no box near"),
        }
    }

    /// Class and confidence of the detection.
    fn found_words(&self, options: &EvalReportOptions) -> String {
        let confidence = self.found.map_or(0.0, |f| f.confidence);
        format!("{} {confidence:.2}", self.found_class(options))
    }
}

fn word(kind: MistakeKind) -> &'static str {
    match kind {
        MistakeKind::FalseAlarm => "false alarm",
        MistakeKind::WrongClass => "wrong class",
        MistakeKind::Missed => "missed",
    }
}

fn legend() -> String {
    let keys = [
        legend_key(WRONG, THICK_DASHED, "wrong detection"),
        legend_key(WRONG, THICK, "missed box"),
        legend_key(TRUTH, THIN, "box of the truth"),
        legend_key(FOUND, DASHED, "other detection"),
        legend_key(CROWD, THIN, "crowd"),
    ];
    format!(
        "<p>{}Click a picture to enlarge it; Escape and the arrow keys work too.</p>\n",
        keys.concat()
    )
}

fn legend_key(color: &str, style: &str, words: &str) -> String {
    format!(
        "<span style=\"white-space:nowrap;margin-right:1.5em\"><svg width=\"34\" height=\"14\" viewBox=\"0 0 34 14\">\
         <path d=\"M2 7h30\" stroke=\"{color}\" {style}/></svg> {words}</span>\n"
    )
}

/// The part of a picture that shows a box and its surroundings.
fn square_around(shown: &BBox, [width, height]: [f64; 2]) -> BBox {
    let side = view_side(shown, width.max(height));
    let (w, h, middle) = (side.min(width), side.min(height), shown.center());
    let x0 = (middle.x - w / 2.0).clamp(0.0, width - w);
    let y0 = (middle.y - h / 2.0).clamp(0.0, height - h);
    BBox {
        x0,
        y0,
        x1: x0 + w,
        y1: y0 + h,
    }
}

fn view_side(shown: &BBox, longer_side: f64) -> f64 {
    (VIEW_SCALE * shown.width().max(shown.height())).max(MIN_VIEW_SHARE * longer_side)
}

/// Whether this is the very same box.
fn is_same<T>(own: Option<&T>, other: &T) -> bool {
    own.is_some_and(|own| std::ptr::eq(own, other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::tests::bbox;

    /// Twenty thousand detections in a crowd once made each of 48 pictures two megabytes large.
    #[test]
    fn a_picture_shows_no_more_than_the_surest_detections_around_a_mistake() {
        let at = |i: usize| bbox(i as f64, 0.0, 2.0, 2.0);
        let found = |i: usize| Detection::new(0, at(i), 0.3 + (i % 7) as f64 / 10.0);
        let truth = (0..300).map(|i| GroundTruth::new(0, at(i))).collect();
        let sheet = EvalImage {
            found: (0..5_000).map(found).collect(),
            ..EvalImage::new("a", truth)
        };
        let run = Run {
            name: "run".into(),
            sheets: vec![sheet],
        };
        let mistake = Mistake {
            sheet: 0,
            kind: MistakeKind::FalseAlarm,
            found: Some(3),
            truth: None,
            iou: 0.0,
        };
        let shown = ShownMistake::new(&run, &mistake);
        let view = bbox(100.0, 0.0, 1_300.0, 2.0);
        let (boxes, detections) = (
            shown.other_boxes(&view),
            shown.other_detections(&view, 0.25),
        );
        assert_eq!(
            (boxes.len(), detections.len()),
            (MAX_OTHER_BOXES, MAX_OTHER_BOXES)
        );
        assert!(boxes.iter().all(|t| t.bbox.overlaps(&view)));
        assert!(
            detections
                .iter()
                .all(|f| f.bbox.overlaps(&view) && f.confidence > 0.85)
        );
    }
}
