//! `petcomp asset`: cut-outs with real size and class, kept in a folder.

use crate::common::{Common, NeedsReview};
use crate::print;
use petcomp::asset::{self, Library, Manifest, PhotoEntry, Scale, ScreenSource};
use petcomp::matte::CutOutOptions;
use petcomp::{Quality, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Cut out all photos of a list
    Build {
        /// List (TOML or CSV), or a folder with photos.toml or photos.csv: file, asset, class and length (metres, by a tape
        /// measure), px_per_metre, screen_size (0.60x0.40 in CSV) or marker_size
        list: PathBuf,
        /// Asset folder
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
    },
    /// Cut out photos of one object
    Add(Box<Add>),
    /// Show what an asset folder holds: name, class, size, how sure outline and colour are (0 to 1), file
    List {
        /// Asset folder
        folder: PathBuf,
    },
    /// Check that an asset folder is whole, and list the cut-outs that a person should look at
    Check {
        /// Asset folder
        folder: PathBuf,
        /// Exit with status 1 where a person should look
        #[arg(long)]
        strict: bool,
    },
    /// Show every cut-out over a checkerboard, black, white and green
    Sheet {
        /// Asset folder
        folder: PathBuf,
        /// Picture to write
        #[arg(short, long, value_name = "PICTURE")]
        output: PathBuf,
    },
}

#[derive(clap::Args)]
pub(crate) struct Add {
    /// Photos of the object
    #[arg(required = true)]
    photos: Vec<PathBuf>,
    /// Asset folder
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Name of the asset; by default that of the first photo
    #[arg(long)]
    name: Option<String>,
    /// Name of its class; one that the folder does not have is added behind those that it has
    #[arg(long)]
    class: String,
    /// Names of all classes in order: a label's number is the place in this list, and no other class is taken
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    classes: Vec<String>,
    /// What it was photographed on: auto, a colour R,G,B (scene-linear), or a photo of the empty screen
    #[arg(long, value_name = "SCREEN", default_value = "auto")]
    screen: ScreenSource,
    #[command(flatten)]
    scale: ScaleArgs,
    /// Corners of the screen for --screen-size, from the top left clockwise, pixels; by default they are found
    #[arg(long, value_name = "X,Y X,Y X,Y X,Y", value_parser = corners, requires = "screen_size")]
    screen_corners: Option<[[f64; 2]; 4]>,
    /// Thickness of the object as it lies, metres: with --screen-size or --marker-size its size is that at half its height
    #[arg(long, value_name = "METRES", default_value_t = asset::DEFAULT_THICKNESS)]
    thickness: f64,
    /// draft, normal or reference: how finely the object is searched and kept
    #[arg(long, default_value_t)]
    quality: Quality,
}

/// What tells how large the object is; one of these.
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct ScaleArgs {
    /// Length of the object's longest side, metres, 0.005 to 5: what a tape measure says
    #[arg(long, value_name = "METRES")]
    length: Option<f64>,
    /// Or: width and height of the object, metres
    #[arg(long, value_name = "W,H", value_delimiter = ',', num_args = 2)]
    size: Option<Vec<f64>>,
    /// Or: scale of the photos at half the object's height, pixels per metre
    #[arg(long, value_name = "PX_PER_M")]
    scale: Option<f64>,
    /// Or: width and height of the whole screen, metres: it lies on something of another colour, and all four corners are
    /// seen
    #[arg(long, value_name = "WxH", value_parser = crate::camera::dimensions)]
    screen_size: Option<[f64; 2]>,
    /// Or: side of the black square of a printed marker on the screen, metres (AprilTag tag36h11 or ArUco DICT_4X4_50); cut
    /// its paper to a white margin of at most a third of that
    #[arg(long, value_name = "METRES")]
    marker_size: Option<f64>,
}

impl ScaleArgs {
    /// What is told; `corners` are those of the screen.
    fn scale(&self, corners: Option<[[f64; 2]; 4]>) -> Scale {
        match (
            self.scale,
            self.size.as_deref(),
            self.screen_size,
            self.marker_size,
        ) {
            (Some(px_per_metre), ..) => Scale::PxPerMetre(px_per_metre),
            (None, Some(&[w, h]), ..) => Scale::Size([w.max(h), w.min(h)]),
            (None, _, Some(size), _) => Scale::Screen(size, corners),
            (None, _, None, Some(side)) => Scale::Marker(side),
            (None, _, None, None) => Scale::Length(self.length.unwrap_or_default()),
        }
    }
}

/// Four places from `X,Y X,Y X,Y X,Y`.
fn corners(text: &str) -> Result<[[f64; 2]; 4], String> {
    let wrong =
        || format!("\"{text}\", expected four corners as in \"12,8 630,10 628,470 14,466\"");
    let place = |pair: &str| {
        let (x, y) = pair.split_once(',')?;
        Some([x.trim().parse().ok()?, y.trim().parse().ok()?])
    };
    let places: Option<Vec<[f64; 2]>> = text.split_whitespace().map(place).collect();
    places.ok_or_else(wrong)?.try_into().map_err(|_| wrong())
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Build { list, output } => build(list, output, common).map(|_| ()),
        Command::Add(args) => add(args, common),
        Command::List { folder } => list(folder),
        Command::Check { folder, strict } => check(folder, *strict),
        Command::Sheet { folder, output } => Ok(io::write(
            output,
            &asset::contact_sheet(&Library::open(folder)?),
        )?),
    }
}

/// Name of the contact sheet in an asset folder.
const SHEET: &str = "contact_sheet.png";

fn check(folder: &Path, strict: bool) -> anyhow::Result<()> {
    let library = Library::open(folder)?;
    let photos: Vec<_> = library
        .assets
        .iter()
        .flat_map(|asset| &asset.photos)
        .collect();
    let to_review: Vec<_> = photos
        .iter()
        .filter(|photo| photo.record.needs_review())
        .collect();
    for photo in &to_review {
        print::line(format_args!(
            "{}: {}",
            photo.record.file,
            photo.record.review_reasons()
        ));
    }
    let counts = format!(
        "{} assets, {} cut-outs, all intact, {} to review",
        library.assets.len(),
        photos.len(),
        to_review.len()
    );
    print::line(format_args!("{}: {counts}", folder.display()));
    match to_review.len() {
        n if strict && n > 0 => {
            Err(NeedsReview(format!("{}: {n} cut-outs to review", folder.display())).into())
        }
        _ => Ok(()),
    }
}

/// Cuts out all photos of a list, showing progress; returns all that the folder holds.
pub(crate) fn build(list: &Path, folder: &Path, common: &Common) -> anyhow::Result<Library> {
    let progress = common.progress("cut-outs");
    let built = asset::build(list, folder, &|done, total| {
        progress.at(done as u64, total as u64)
    })?;
    drop(progress);
    let library = built.library;
    built
        .refused
        .iter()
        .for_each(|refusal| log::warn!("{refusal}"));
    built
        .needs_review
        .iter()
        .for_each(|reason| common.say(reason));
    common.say(format_args!(
        "{}: {} photos, {} assets",
        folder.display(),
        built.photos,
        library.assets.len()
    ));
    let (lengths, errors) = spread(&built.lengths);
    common.say(format_args!(
        "objects are {lengths} mm long, to {errors} mm; `petcomp asset list` shows each"
    ));
    show_classes(&library.classes, "`classes = [...]` in the list", common);
    write_sheet(folder, &library, common)?;
    Ok(library)
}

/// Writes the contact sheet of a folder.
fn write_sheet(folder: &Path, library: &Library, common: &Common) -> anyhow::Result<()> {
    let path = folder.join(SHEET);
    io::write(&path, &asset::contact_sheet(library))?;
    common.say(format_args!("look at {}", path.display()));
    Ok(())
}

fn add(args: &Add, common: &Common) -> anyhow::Result<()> {
    let scale = args.scale.scale(args.screen_corners);
    let first = args
        .photos
        .first()
        .and_then(|photo| photo.file_stem())
        .unwrap_or_default();
    let name = args
        .name
        .clone()
        .unwrap_or_else(|| first.to_string_lossy().into_owned());
    let options = args.quality.cut_out(CutOutOptions::default());
    let mut added = Vec::new();
    for photo in &args.photos {
        let entry = PhotoEntry {
            screen: args.screen.clone(),
            thickness: args.thickness,
            ..PhotoEntry::new(photo, &name, &args.class, scale)
        };
        let photo = asset::add_photo(&args.output, &entry, &args.classes, &options)?;
        let record = &photo.record;
        let ([length, width], error) = (record.object_m.map(|m| m * 1e3), record.error_m * 1e3);
        common.say(format_args!(
            "{}: {length:.1} x {width:.1} mm (+- {error:.1})",
            record.file
        ));
        record
            .diagnostics
            .iter()
            .for_each(|diagnostic| common.say(format_args!("{}: {diagnostic}", record.file)));
        added.push(photo);
    }
    let library = Library::open_with(&args.output, added)?;
    show_classes(&library.classes, "--classes", common);
    write_sheet(&args.output, &library, common)
}

/// Smallest and largest of lengths, and the same of their errors, millimetres.
fn spread(lengths: &[[f64; 2]]) -> (String, String) {
    let of = |i: usize| {
        let ends = lengths.iter().fold([f64::MAX, 0.0], |[low, high], l| {
            [l[i].min(low), l[i].max(high)]
        });
        ends.map(|metres| 1e3 * metres)
    };
    let ([short, long], [fine, coarse]) = (of(0), of(1));
    (
        format!("{short:.0} to {long:.0}"),
        format!("{fine:.1} to {coarse:.1}"),
    )
}

/// Shows which number each class has, and how to change that.
fn show_classes(classes: &[String], how: &str, common: &Common) {
    let numbered = classes
        .iter()
        .enumerate()
        .map(|(i, class)| format!("{i} {class}"));
    let list = numbered.collect::<Vec<_>>().join(", ");
    common.say(format_args!("classes {list}; another order: {how}"));
}

fn list(folder: &Path) -> anyhow::Result<()> {
    for asset in Manifest::read(folder)?.assets {
        for photo in &asset.photos {
            let [length, width] = photo.object_m.map(|m| m * 1e3);
            let (name, class, sure) = (&asset.name, &asset.class, photo.outline_confidence);
            let color = photo
                .color_confidence
                .map_or_else(|| "   -".into(), |color| format!("{color:.2}"));
            let size = format!(
                "{length:4.0} x {width:3.0} mm (+- {:.1})",
                photo.error_m * 1e3
            );
            print::line(format_args!(
                "{name:12} {class:10} {size}  {sure:.2}  {color}  {}",
                photo.file
            ));
        }
    }
    Ok(())
}
