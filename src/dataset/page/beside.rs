//! A dataset beside the user's own photographs: distributions that should be alike.

use super::outlier::{quantile, short};
use crate::color::encode_srgb8;
use crate::dataset::{Listing, YoloSet};
use crate::error::{Error, Result};
use crate::eval;
use crate::filter::resize;
use crate::geom::BBox;
use crate::image::Image;
use crate::io;
use crate::label::gallery::{Figure, gallery, marked_box};
use crate::pixel::LinearRgb;
use crate::plot::{Page, Table, escaped, heat::heat_map};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// So many pictures of each set are read to compare their pixels, and so wide.
const READ: usize = 64;
const READ_PX: usize = 256;

/// More images than this are no folder of one's own pictures, but a whole disk.
const MOST_FILES: usize = 200_000;

/// Bins of a histogram, and its frame and room in SVG units.
const BINS: usize = 20;
const FRAME: [f64; 2] = [250.0, 110.0];
const LEFT: f64 = 12.0;
const TOP: f64 = 24.0;
const BELOW: f64 = 24.0;

/// Colours of Okabe and Ito: ours as everywhere on the page, the others beside it.
const OURS: &str = "#0072b2";
const THEIRS: &str = "#d55e00";

/// Pictures with boxes, from wherever.
#[derive(Default)]
pub(crate) struct Set {
    /// Names of the classes, in order; may be fewer than occur.
    pub(crate) classes: Vec<String>,
    pub(crate) pictures: Vec<LabelledPicture>,
}

/// A picture and its boxes.
#[derive(Clone)]
pub(crate) struct LabelledPicture {
    pub(crate) path: PathBuf,
    /// Class, and centre, width and height as shares of the picture's; none for a picture without a label file.
    pub(crate) boxes: Option<Vec<(u32, [f64; 4])>>,
}

impl Set {
    /// A YOLO dataset, or a folder with images that have YOLO labels beside them or in `labels` instead of `images`.
    ///
    /// # Errors
    /// A folder without images; a label that cannot be read.
    pub(crate) fn read(folder: &Path) -> Result<Self> {
        let (classes, images) = if folder.join("data.yaml").is_file() {
            let listing = Listing::read(folder)?;
            (listing.classes.clone(), listing.series())
        } else {
            let mut images = Vec::new();
            walk(folder, &mut BTreeSet::new(), &mut images)?;
            images.sort();
            (Vec::new(), images)
        };
        if images.is_empty() {
            return Err(Error::file(
                folder,
                "no images, expected a YOLO dataset or a folder of images with labels",
            ));
        }
        let pictures = images
            .into_par_iter()
            .map(labelled)
            .collect::<Result<_>>()?;
        Ok(Self { classes, pictures })
    }

    fn name(&self, class: u32) -> String {
        eval::class_name(class, &self.classes)
    }

    fn boxes(&self) -> impl Iterator<Item = &(u32, [f64; 4])> {
        self.pictures
            .iter()
            .filter_map(|picture| picture.boxes.as_ref())
            .flatten()
    }

    fn centres(&self) -> Vec<[f64; 2]> {
        self.boxes().map(|(_, [x, y, ..])| [*x, *y]).collect()
    }

    /// Some of the pictures, evenly spread.
    fn spread(&self, most: usize) -> Vec<&LabelledPicture> {
        let count = most.min(self.pictures.len());
        (0..count)
            .map(|i| &self.pictures[i * self.pictures.len() / count])
            .collect()
    }

    /// What can be compared, by what it is.
    fn measures(&self) -> Vec<(&'static str, Vec<f64>)> {
        let side = |i: usize| {
            self.boxes()
                .map(|(_, b)| 100.0 * b[i])
                .collect::<Vec<f64>>()
        };
        let counts = self
            .pictures
            .iter()
            .filter_map(|p| p.boxes.as_ref().map(|boxes| boxes.len() as f64));
        let area = self
            .boxes()
            .map(|(_, [_, _, w, h])| 100.0 * (w * h).max(0.0).sqrt());
        let looks: Vec<Look> = self
            .spread(READ)
            .into_par_iter()
            .filter_map(|picture| Look::of(&picture.path))
            .collect();
        let look = |value: fn(&Look) -> f64| looks.iter().map(value).collect();
        vec![
            ("labels in a picture", counts.collect()),
            ("width of a box, % of the picture", side(2)),
            ("height of a box, % of the picture", side(3)),
            (
                "square root of a box's area, % of the picture",
                area.collect(),
            ),
            ("centre of a box from the left, %", side(0)),
            ("centre of a box from the top, %", side(1)),
            ("brightness of a picture, mean code", look(|l| l.brightness)),
            (
                "contrast of a picture, standard deviation of codes",
                look(|l| l.contrast),
            ),
            ("saturation of a picture, mean code", look(|l| l.saturation)),
            (
                "fine detail of a picture, mean step between pixels",
                look(|l| l.detail),
            ),
        ]
    }
}

/// The images of a folder and of those below it, each folder once: links may lead in circles.
fn walk(folder: &Path, seen: &mut BTreeSet<PathBuf>, images: &mut Vec<PathBuf>) -> Result<()> {
    let failed = |e| Error::file(folder, e);
    if !seen.insert(folder.canonicalize().map_err(failed)?) {
        return Ok(());
    }
    for entry in std::fs::read_dir(folder).map_err(failed)?.flatten() {
        let path = entry.path();
        if path.is_dir() {
            walk(&path, seen, images)?;
        } else if path.is_file() && crate::dataset::is_image(&path) {
            images.push(path);
        }
        if images.len() > MOST_FILES {
            return Err(Error::file(
                folder,
                format!("more than {MOST_FILES} images, expected fewer"),
            ));
        }
    }
    Ok(())
}

fn labelled(path: PathBuf) -> Result<LabelledPicture> {
    let candidates = [YoloSet::label_of(&path), path.with_extension("txt")];
    let Some(label) = candidates.iter().find(|label| label.is_file()) else {
        return Ok(LabelledPicture { path, boxes: None });
    };
    // In a picture of one pixel, pixels are shares.
    let sheet = eval::yolo_sheet(&io::read_text(label)?, "", [1, 1])
        .map_err(|what| Error::file(label, what))?;
    let shares = |t: &eval::GroundTruth| {
        let centre = t.bbox.center();
        (
            t.class,
            [centre.x, centre.y, t.bbox.width(), t.bbox.height()],
        )
    };
    Ok(LabelledPicture {
        path,
        boxes: Some(sheet.truth.iter().map(shares).collect()),
    })
}

/// What the pixels of a picture are like as a whole, in codes of 8 bits.
struct Look {
    brightness: f64,
    contrast: f64,
    saturation: f64,
    detail: f64,
}

impl Look {
    /// None for a picture that cannot be read, which is warned of.
    fn of(path: &Path) -> Option<Self> {
        let picture = io::read::<LinearRgb>(path)
            .inspect_err(|error| log::warn!("{error}"))
            .ok()?;
        let (w, h) = picture.size();
        let width = w.min(READ_PX);
        let small = resize(&picture, width, (h * width).div_ceil(w).max(1));
        let codes = small.map(|p| {
            let c = encode_srgb8(p);
            [c.r, c.g, c.b].map(f32::from)
        });
        let luma = codes.map(|[r, g, b]| 0.299 * r + 0.587 * g + 0.114 * b);
        let spread =
            codes.map(|c| c.into_iter().fold(0.0, f32::max) - c.into_iter().fold(255.0, f32::min));
        let brightness = mean(luma.pixels().iter().copied());
        let squares = mean(
            luma.pixels()
                .iter()
                .map(|v| (v - brightness as f32).powi(2)),
        );
        Some(Self {
            brightness,
            contrast: squares.sqrt(),
            saturation: mean(spread.pixels().iter().copied()),
            detail: detail(&luma),
        })
    }
}

/// Mean distance of a pixel from the one to its right.
fn detail(luma: &Image<f32>) -> f64 {
    mean(
        luma.rows()
            .flat_map(|row| row.windows(2).map(|pair| (pair[1] - pair[0]).abs())),
    )
}

fn mean(values: impl Iterator<Item = f32>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u64), |(sum, count), v| {
        (sum + f64::from(v), count + 1)
    });
    sum / count.max(1) as f64
}

/// Puts the two side by side, what differs most first, with at most `most` of the others' pictures.
pub(crate) fn put_on(page: &mut Page, ours: &Set, theirs: &Set, most: usize) {
    page.heading("Beside your own pictures");
    let unlabelled = theirs
        .pictures
        .iter()
        .filter(|picture| picture.boxes.is_none())
        .count();
    let told = if unlabelled > 0 {
        format!(", {unlabelled} of them without a label file")
    } else {
        String::new()
    };
    page.text(&format!(
        "{} pictures of the dataset (blue) and {} of yours (orange){told}. The distance is that of Kolmogorov and Smirnov: \
         0 for the same distribution, 1 for two that have nothing in common; what differs most comes first.",
        ours.pictures.len(),
        theirs.pictures.len()
    ));
    let mut pairs: Vec<Pair> = ours
        .measures()
        .into_iter()
        .zip(theirs.measures())
        .filter_map(Pair::of)
        .collect();
    pairs.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    page.table(&distances(&pairs));
    let charts: String = pairs.iter().map(Pair::svg).collect();
    let maps = heat_map("centres of the dataset's labels", &ours.centres())
        + &heat_map("centres of your labels", &theirs.centres());
    page.html(&format!(
        "<div class=\"histograms\">\n{charts}{maps}</div>\n"
    ));
    page.subheading("Classes").table(&classes(ours, theirs));
    let shown = theirs.spread(most);
    let figures: Vec<Figure> = shown
        .into_par_iter()
        .filter_map(|picture| figure(theirs, picture))
        .collect();
    page.subheading(&format!(
        "Your pictures ({} of {})",
        figures.len(),
        theirs.pictures.len()
    ));
    page.html(&gallery("yours", &figures));
}

fn figure(set: &Set, picture: &LabelledPicture) -> Option<Figure> {
    // Boxes are shares of the picture, which is a square of 100 then; the frame gives it its shape back.
    let header = io::read_header(&picture.path).ok()?;
    let size = [header.width as f64, header.height as f64];
    let mut figure = Figure::whole(&picture.path, size)
        .inspect_err(|error| log::warn!("{error}"))
        .ok()?;
    let (letter, top) = (figure.letter(), figure.top());
    for (class, [x, y, w, h]) in picture.boxes.iter().flatten() {
        let b = BBox {
            x0: x - w / 2.0,
            y0: y - h / 2.0,
            x1: x + w / 2.0,
            y1: y + h / 2.0,
        };
        let b = BBox {
            x0: b.x0 * size[0],
            y0: b.y0 * size[1],
            x1: b.x1 * size[0],
            y1: b.y1 * size[1],
        };
        let color = super::color_of(*class);
        figure.drawing += &marked_box(
            &b,
            &set.name(*class),
            letter,
            top,
            &color,
            "stroke-width=\"2\"",
        );
    }
    let name = picture
        .path
        .file_name()
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    let count = picture
        .boxes
        .as_ref()
        .map_or("no label file".into(), |boxes| {
            format!("{} labels", boxes.len())
        });
    figure.caption = format!("{name}: {count}");
    Some(figure)
}

/// Shares of the classes, those of the same name beside each other.
fn classes(ours: &Set, theirs: &Set) -> Table {
    let shares = |set: &Set| -> BTreeMap<String, f64> {
        let mut counts: BTreeMap<String, f64> = BTreeMap::new();
        set.boxes()
            .for_each(|(class, _)| *counts.entry(set.name(*class)).or_default() += 1.0);
        let all = counts.values().sum::<f64>().max(1.0);
        counts
            .into_iter()
            .map(|(name, count)| (name, 100.0 * count / all))
            .collect()
    };
    let (a, b) = (shares(ours), shares(theirs));
    let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let mut table = Table::new(["class", "dataset", "yours"]);
    for name in names {
        let share = |shares: &BTreeMap<String, f64>| {
            shares
                .get(name)
                .map_or("-".into(), |share| format!("{share:.1} %"))
        };
        table.push([name.clone(), share(&a), share(&b)]);
    }
    table
}

fn distances(pairs: &[Pair]) -> Table {
    let mut table = Table::new([
        "",
        "dataset: 5 %, median, 95 %",
        "yours: 5 %, median, 95 %",
        "distance",
    ]);
    let told = |values: &[f64]| {
        [0.05, 0.5, 0.95]
            .map(|share| {
                quantile(values.to_vec(), share)
                    .map(short)
                    .unwrap_or_default()
            })
            .join(" / ")
    };
    for pair in pairs {
        table.push([
            pair.title.to_owned(),
            told(&pair.ours),
            told(&pair.theirs),
            format!("{:.2}", pair.distance),
        ]);
    }
    table
}

/// A measure's name, and its values.
type Named = (&'static str, Vec<f64>);

/// One measure of both.
struct Pair {
    title: &'static str,
    ours: Vec<f64>,
    theirs: Vec<f64>,
    distance: f64,
}

impl Pair {
    /// None where one of the two has no value.
    fn of(((title, ours), (_, theirs)): (Named, Named)) -> Option<Self> {
        let some = !ours.is_empty() && !theirs.is_empty();
        some.then(|| Self {
            title,
            distance: distance(ours.clone(), theirs.clone()),
            ours,
            theirs,
        })
    }

    /// Shares of each in bins of the same width: ours as bars, the others as steps.
    fn svg(&self) -> String {
        let all = || self.ours.iter().chain(&self.theirs).copied();
        let (low, high) = (
            all().fold(f64::INFINITY, f64::min),
            all().fold(f64::NEG_INFINITY, f64::max),
        );
        let (low, high) = if low < high {
            (low, high)
        } else {
            (low - 0.5, low + 0.5)
        };
        let [ours, theirs] = [&self.ours, &self.theirs].map(|values| shares(values, low, high));
        let most = ours
            .iter()
            .chain(&theirs)
            .copied()
            .fold(0.0, f64::max)
            .max(1e-9);
        let [w, h] = FRAME;
        let (width, height, wide) = (LEFT + w + 12.0, TOP + h + BELOW, w / BINS as f64);
        let (x, y) = (
            |i: usize| LEFT + wide * i as f64,
            |share: f64| TOP + h * (1.0 - share / most),
        );
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" \
             font-size=\"11\">\n<title>{}</title>\n",
            escaped(self.title)
        );
        for (i, share) in ours.iter().enumerate() {
            let (x, top) = (x(i), y(*share));
            let _ = writeln!(
                svg,
                "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{OURS}\" opacity=\"0.75\"/>",
                x + 0.5,
                wide - 1.0,
                TOP + h - top
            );
        }
        let steps: String = theirs
            .iter()
            .enumerate()
            .map(|(i, share)| format!("V{:.1}H{:.1}", y(*share), x(i + 1)))
            .collect();
        let line = TOP + h;
        let _ = writeln!(
            svg,
            "<path d=\"M{LEFT} {line}{steps}V{line}\" fill=\"none\" stroke=\"{THEIRS}\" stroke-width=\"2\"/>"
        );
        let _ = writeln!(svg, "<path d=\"M{LEFT} {line}h{w}\" stroke=\"#888\"/>");
        for (x, y, anchor, text) in [
            (LEFT, TOP - 10.0, "start", self.title.to_owned()),
            (LEFT, line + 14.0, "start", short(low)),
            (LEFT + w, line + 14.0, "end", short(high)),
        ] {
            let _ = writeln!(
                svg,
                "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{}</text>",
                escaped(&text)
            );
        }
        svg + "</svg>\n"
    }
}

fn shares(values: &[f64], low: f64, high: f64) -> [f64; BINS] {
    let mut shares = [0.0; BINS];
    for value in values {
        let place = (value - low) / (high - low) * BINS as f64;
        shares[(place.max(0.0) as usize).min(BINS - 1)] += 1.0 / values.len() as f64;
    }
    shares
}

/// Greatest distance of two empirical distribution functions.
///
/// # Method
/// Kolmogorov and Smirnov's statistic of two samples.
fn distance(mut a: Vec<f64>, mut b: Vec<f64>) -> f64 {
    a.sort_by(f64::total_cmp);
    b.sort_by(f64::total_cmp);
    let below =
        |values: &[f64], x: f64| values.partition_point(|v| *v <= x) as f64 / values.len() as f64;
    a.iter()
        .chain(&b)
        .map(|&x| (below(&a, x) - below(&b, x)).abs())
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_is_none_for_the_same_and_one_for_others() {
        let [low, high] =
            [0.0, 100.0].map(|from| (0..50).map(|i| from + f64::from(i)).collect::<Vec<f64>>());
        assert_eq!(distance(low.clone(), low.clone()), 0.0);
        assert_eq!(distance(low.clone(), high), 1.0);
        // Half of the values lie above all of the others.
        let up: Vec<f64> = low.iter().map(|v| v + 25.0).collect();
        assert!((distance(low, up) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn images_are_found_with_labels_in_either_place() {
        let root = tempfile::tempdir().unwrap();
        let grey = Image::filled(8, 6, LinearRgb::grey(0.2));
        for (file, label) in [
            (
                "images/a.png",
                Some(("labels/a.txt", "1 0.5 0.25 0.5 0.5\n")),
            ),
            ("images/deep/b.jpg", Some(("images/deep/b.txt", ""))),
            ("images/c.png", None),
        ] {
            for path in [file].into_iter().chain(label.map(|l| l.0)) {
                std::fs::create_dir_all(root.path().join(path).parent().unwrap()).unwrap();
            }
            io::write(root.path().join(file), &grey).unwrap();
            if let Some((path, text)) = label {
                std::fs::write(root.path().join(path), text).unwrap();
            }
        }
        let set = Set::read(root.path()).unwrap();
        let boxes: Vec<_> = set.pictures.iter().map(|p| p.boxes.clone()).collect();
        assert_eq!(
            boxes,
            [Some(vec![(1, [0.5, 0.25, 0.5, 0.5])]), None, Some(vec![])]
        );
        std::fs::write(root.path().join("labels/a.txt"), "x\n").unwrap();
        assert!(
            Set::read(root.path())
                .err()
                .unwrap()
                .to_string()
                .contains("a.txt: line 1")
        );
        assert!(
            Set::read(&root.path().join("labels"))
                .err()
                .unwrap()
                .to_string()
                .contains("no images")
        );
    }
}
