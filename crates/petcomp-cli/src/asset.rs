//! `petcomp asset`: cut-outs with real size and class, kept in a folder.

use crate::batch::FileBatch;
use crate::diagnostics::{located, report_diagnostics};
use crate::documents::stem_of;
use crate::exit::NeedsReview;
use crate::global::GlobalArgs;
use crate::interruption::interruption;
use crate::output::folder_parser;
use crate::print::{self, counted};
use crate::values::{check_companion, parse_corners, parse_metres};
use petcomp::asset::{self, Asset, Built, CONTACT_SHEET, Library, MANIFEST, Manifest};
use petcomp::asset::{CaptureEntry, PhotoEntry, PhotoRecord, Role, Scale, ScreenSource};
use petcomp::matte::{CutOutOptions, MatteMethod};
use petcomp::{Error, Quality, io};
use std::convert::Infallible;
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum AssetCommand {
    /// Cut out all photos in a list
    Build {
        /// List (TOML or CSV), or a folder with photos.toml or photos.csv: file, asset, class and
        /// length (metres, by tape measure), px_per_metre, screen_size (0.60x0.40 in CSV) or
        /// marker_size; role = distractor for objects without labels, matte = outline for opaque
        /// objects
        list: PathBuf,
        /// Asset folder; cut-outs of photos that are not in the list stay, and so do classes, until
        /// you delete the folder
        #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
        output: PathBuf,
        /// Keep existing cut-outs of the same photo, entry, options and petcomp version, for
        /// example after an interruption
        #[arg(long)]
        resume: bool,
    },
    /// Cut out photos of one object
    Add(Box<AddPhotoArgs>),
    /// List an asset folder: name, class, size, confidence of outline and colour (0 to 1), file
    List {
        /// Asset folder
        folder: PathBuf,
    },
    /// Check that an asset folder is intact, and list the cut-outs that need review
    Check {
        /// Asset folder
        folder: PathBuf,
        /// Exit with status 1 if a cut-out needs review
        #[arg(long)]
        strict: bool,
    },
    /// Draw every cut-out over a checkerboard, black, white and green
    Sheet {
        /// Asset folder
        folder: PathBuf,
        /// Image to write; with many cut-outs, further pages are written next to it as PICTURE_2,
        /// PICTURE_3 and so on
        #[arg(short, long, value_name = "PICTURE")]
        output: PathBuf,
    },
}

#[derive(clap::Args)]
pub(crate) struct AddPhotoArgs {
    /// Photos of the object
    #[arg(required = true)]
    photos: Vec<PathBuf>,
    /// Asset folder
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
    /// Name of the asset; by default the name of the first photo
    #[arg(long)]
    name: Option<String>,
    /// Name of its class; a new class is appended to those of the folder. Distractors need none
    #[arg(long, required_unless_present = "role", value_parser = trimmed)]
    class: Option<String>,
    /// object (to be detected) or distractor (falls, hides others and casts shadows, but has no
    /// label)
    #[arg(long, default_value_t)]
    role: Role,
    /// Names of all classes in order: a label's class number is the position in this list, and
    /// other classes are rejected
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = trimmed)]
    classes: Vec<String>,
    /// Screen under the object: auto, a colour R,G,B (scene-linear), or a photo of the empty screen
    #[arg(
        long,
        value_name = "SCREEN",
        default_value = "auto",
        conflicts_with = "captured"
    )]
    screen: ScreenSource,
    /// Matting method: physical (light and transmittance of see-through plastic), key (like
    /// Blender's Keying node) or outline (opaque object); by default physical
    #[arg(long, value_name = "METHOD", conflicts_with = "captured")]
    matte: Option<MatteMethod>,
    #[command(flatten)]
    scale: ScaleArgs,
    /// Corners of the screen for --screen-size, clockwise from the top left, pixels; by default
    /// they are detected
    #[arg(long, value_name = "X,Y X,Y X,Y X,Y", value_parser = parse_corners)]
    screen_corners: Option<[[f64; 2]; 4]>,
    #[command(flatten)]
    capture: CaptureArgs,
    /// Thickness of the object as it lies, metres: with --screen-size, --marker-size or --captured
    /// its size is measured at half this height; by default the folder's value for this asset, or
    /// 0.005
    #[arg(long, value_name = "METRES")]
    thickness: Option<f64>,
    /// Mass of the object, kilograms; by default the folder's value for this asset, or 0.025
    #[arg(long, value_name = "KILOGRAMS")]
    mass: Option<f64>,
    /// draft, normal or reference: how finely the object is searched for and stored
    #[arg(long, default_value_t)]
    quality: Quality,
}

/// Options for photos on a luminous display.
#[derive(clap::Args)]
struct CaptureArgs {
    /// With --captured: photos of the same frames without the object, from the same position
    #[arg(long, value_name = "PHOTO", num_args = 1..)]
    empty: Vec<PathBuf>,
    /// With --captured: display file written by `capture frames`; by default display.toml next to
    /// the first photo
    #[arg(long, value_name = "FILE")]
    display: Option<PathBuf>,
    /// With --captured: width of the whole image on the display, metres, measured with a ruler; by
    /// default that in display.toml
    #[arg(long, value_name = "METRES")]
    display_width: Option<f64>,
}

/// The size of the object, in one of these ways.
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct ScaleArgs {
    /// Longer side of the smallest rectangle around the object, metres, 0.005 to 5, measured with a
    /// tape
    #[arg(long, value_name = "METRES")]
    length: Option<f64>,
    /// Or: width and height of the object, metres
    #[arg(long, value_name = "WxH", value_parser = parse_metres)]
    size: Option<[f64; 2]>,
    /// Or: scale of the photos at half the object's height, pixels per metre (px_per_metre in a
    /// list)
    #[arg(long, value_name = "PX_PER_M")]
    scale: Option<f64>,
    /// Or: width and height of the whole screen, metres; it must lie on another colour, with all
    /// four corners visible
    #[arg(long, value_name = "WxH", value_parser = parse_metres)]
    screen_size: Option<[f64; 2]>,
    /// Or: side of the black square of a printed marker on the screen, metres (AprilTag tag36h11 or
    /// ArUco DICT_4X4_50); cut the paper to a white margin of at most a third of that side, and
    /// leave half that side free between marker and object
    #[arg(long, value_name = "METRES")]
    marker_size: Option<f64>,
    /// Or: the photos show one object on a luminous display with the frames of `capture frames`, in
    /// any order; their markers give the scale
    #[arg(long)]
    captured: bool,
}

impl ScaleArgs {
    /// The given one; `corners` are those of the screen.
    fn scale(&self, corners: Option<[[f64; 2]; 4]>) -> Scale {
        let screen = self.screen_size.map(|size| Scale::Screen(size, corners));
        let scale = self.scale.map(Scale::PxPerMetre);
        let scale = scale.or_else(|| self.object_size()).or(screen);
        let scale = scale.or(self.marker_size.map(Scale::Marker));
        let scale = scale.or(self.captured.then_some(Scale::Display));
        scale.unwrap_or(Scale::Length(self.length.unwrap_or_default()))
    }

    fn object_size(&self) -> Option<Scale> {
        let [w, h] = self.size?;
        Some(Scale::Size([f64::max(w, h), f64::min(w, h)]))
    }
}

pub(crate) fn run(command: &AssetCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        AssetCommand::Build {
            list,
            output,
            resume,
        } => build_all(list, output, *resume, global),
        AssetCommand::Add(args) => add_photos(args, global),
        AssetCommand::List { folder } => list_photos(folder),
        AssetCommand::Check { folder, strict } => check_folder(folder, *strict),
        AssetCommand::Sheet { folder, output } => draw_sheet(folder, output, global),
    }
}

/// A name without surrounding spaces, such as those after a comma.
fn trimmed(name: &str) -> Result<String, Infallible> {
    Ok(name.trim().to_owned())
}

fn draw_sheet(folder: &Path, output: &Path, global: &GlobalArgs) -> anyhow::Result<()> {
    let library = Library::open(folder)?;
    let count = asset::contact_sheets(&library).len();
    let pages = (0..count).map(|page| asset::contact_sheet_page(output, page));
    let read = records_of(&library).flat_map(PhotoRecord::files);
    let read = read.chain([MANIFEST]).map(|file| folder.join(file));
    io::check_distinct(read, pages)?;
    write_pages(&library, output)?;
    if count > 1 {
        global.print_written(output, format_args!("the first of {count} pages"));
    }
    Ok(())
}

fn check_folder(folder: &Path, strict: bool) -> anyhow::Result<()> {
    let library = Library::open(folder)?;
    library.check_pixels()?;
    let records: Vec<_> = records_of(&library).collect();
    records.iter().for_each(|record| list_capture(record));
    let to_review = list_to_review(&records);
    let (folder, assets) = (folder.display(), counted(library.assets.len(), "asset"));
    let cut_outs = counted(records.len(), "cut-out");
    print::line(format_args!(
        "{folder}: {assets}, {cut_outs}, all intact, {to_review} to review"
    ));
    if strict && to_review > 0 {
        let what = format!("{folder}: {} to review", counted(to_review, "cut-out"));
        return Err(NeedsReview(what).into());
    }
    Ok(())
}

/// Lists the cut-outs that need review, and counts them.
fn list_to_review(records: &[&PhotoRecord]) -> usize {
    let to_review = records.iter().filter(|record| record.needs_review());
    to_review.inspect(|record| list_reasons(record)).count()
}

fn records_of(library: &Library) -> impl Iterator<Item = &PhotoRecord> {
    let photos = library.assets.iter().flat_map(|asset| &asset.photos);
    photos.map(|photo| &photo.record)
}

/// Prints why a cut-out needs review.
fn list_reasons(record: &PhotoRecord) {
    for diagnostic in &record.diagnostics {
        print::line(located(&record.file, diagnostic));
    }
}

/// Prints what was measured on a display.
fn list_capture(record: &PhotoRecord) {
    if let Some(captured) = &record.captured {
        print::line(format_args!("{}: {}", record.file, captured.summary()));
    }
}

/// Fails if a photo gave no cut-out, unless it was rejected in a review; the others are finished by
/// then.
fn build_all(list: &Path, folder: &Path, resume: bool, global: &GlobalArgs) -> anyhow::Result<()> {
    let built = build_library(list, folder, resume, global)?;
    let failed = built.refused.len() - built.rejected;
    FileBatch::counted(built.photos + failed, failed).finish()
}

/// Cuts out all photos of a list, showing progress; `resume` keeps existing cut-outs.
pub(crate) fn build_library(
    list: &Path,
    folder: &Path,
    resume: bool,
    global: &GlobalArgs,
) -> anyhow::Result<Built> {
    let progress = global.start_progress("cut-outs");
    let report = |done: usize, total: usize| progress.update(done as u64, total as u64);
    let before = Manifest::read(folder).ok();
    let built = match resume {
        true => asset::resume(list, folder, &report, interruption()),
        false => asset::build(list, folder, &report, interruption()),
    };
    drop(progress);
    let built = built.inspect_err(|error| {
        // After a stop only seconds are left, and resuming draws the sheet.
        if !matches!(error, Error::Interrupted { .. }) {
            refresh_sheet(folder, before.as_ref(), global);
        }
    })?;
    report_built(&built, folder, global);
    let library = &built.library;
    show_classes(&library.classes, "`classes = [...]` in the list", global);
    if folder.join(MANIFEST).exists() {
        write_sheet(folder, library, global)?;
    }
    Ok(built)
}

/// Reports what happened to the photos of a list.
fn report_built(built: &Built, folder: &Path, global: &GlobalArgs) {
    for reason in &built.refused {
        log::warn!("{reason}");
    }
    for record in &built.needs_review {
        report_diagnostics(&record.file, &record.diagnostics);
    }
    let photos = counted(built.photos, "photo");
    let assets = counted(built.library.assets.len(), "asset");
    let kept = match built.kept {
        0 => String::new(),
        kept => format!(" ({kept} as before)"),
    };
    global.print_written(folder, format_args!("{photos}{kept}, {assets}"));
    if !built.unlisted.is_empty() {
        global.print_status(describe_unlisted(&built.unlisted));
    }
    if !built.lengths.is_empty() {
        global.print_status(describe_lengths(&built.lengths));
    }
}

/// Maximum number of cut-outs that are named; more of them belong to another list.
const SHOWN_UNLISTED: usize = 8;

/// Describes what a corrected list leaves behind in the folder.
fn describe_unlisted(files: &[String]) -> String {
    let shown = files[..files.len().min(SHOWN_UNLISTED)].join(", ");
    let more = if files.len() > SHOWN_UNLISTED {
        ", .."
    } else {
        ""
    };
    format!("in the folder but not in the list: {shown}{more}")
}

/// Range of the objects' lengths, and the largest of their errors.
fn describe_lengths(metres: &[[f64; 2]]) -> String {
    let ([short, long], [_, error]) = (extremes_mm(metres, 0), extremes_mm(metres, 1));
    let [short, long] = [short, long].map(|mm| format!("{mm:.0}"));
    let range = if short == long {
        long
    } else {
        format!("{short} to {long}")
    };
    format!("objects are {range} mm long, to within {error:.1} mm; `petcomp asset list` shows each")
}

/// Writes the contact sheet of a folder, and deletes the pages that a longer one had.
fn write_sheet(folder: &Path, library: &Library, global: &GlobalArgs) -> anyhow::Result<()> {
    let first = folder.join(CONTACT_SHEET);
    let count = write_pages(library, &first)?;
    asset::remove_contact_sheet(&first, count)?;
    match count {
        1 => global.print_look_at(&first),
        _ => global.print_status(format_args!(
            "look at {}, the first of {count} pages",
            first.display()
        )),
    }
    Ok(())
}

/// Draws and writes a contact sheet page by page, and counts the pages.
fn write_pages(library: &Library, first: &Path) -> petcomp::Result<usize> {
    let pages = asset::contact_sheets(library);
    let count = pages.len();
    for (i, page) in pages.enumerate() {
        io::write(asset::contact_sheet_page(first, i), &page?)?;
    }
    Ok(count)
}

/// Redraws the contact sheet of a folder whose manifest has changed, even if photos failed: other
/// cut-outs may be new, and those of rejected photos gone.
fn refresh_sheet(folder: &Path, before: Option<&Manifest>, global: &GlobalArgs) {
    if Manifest::read(folder).ok().as_ref() == before {
        return;
    }
    let library = Library::open(folder).map_err(anyhow::Error::from);
    let drawn = library.and_then(|library| write_sheet(folder, &library, global));
    if let Err(error) = drawn {
        log::warn!("{error:#}");
    }
}

fn add_photos(args: &AddPhotoArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    args.check_companions()?;
    let folder = &args.output;
    let before = Manifest::read(folder).ok();
    let refresh = || refresh_sheet(folder, before.as_ref(), global);
    let (added, batch) = args.add_each(global).inspect_err(|_| refresh())?;
    if added == 0 {
        refresh();
    } else {
        let library = Library::open(folder)?;
        show_classes(&library.classes, "--classes", global);
        write_sheet(folder, &library, global)?;
    }
    batch.finish()
}

fn report_added(record: &PhotoRecord, global: &GlobalArgs) {
    global.print_status(describe_size(record));
    if let Some(captured) = &record.captured {
        global.print_status(captured.summary());
    }
    report_diagnostics(&record.file, &record.diagnostics);
}

fn describe_size(record: &PhotoRecord) -> String {
    let [length, width] = record.object_m.map(|m| m * 1e3);
    let (file, error) = (&record.file, record.error_m * 1e3);
    format!("{file}: {length:.1} x {width:.1} mm (+- {error:.1})")
}

impl AddPhotoArgs {
    /// Clap does not enforce `requires` for options of a mutually exclusive group if another one of
    /// it is given.
    fn check_companions(&self) -> petcomp::Result<()> {
        let (scale, capture) = (&self.scale, &self.capture);
        let (corners, screen) = (self.screen_corners.is_some(), scale.screen_size.is_some());
        check_companion("--screen-corners", corners, "--screen-size", screen)?;
        let of_captured = [
            ("--empty", !capture.empty.is_empty()),
            ("--display", capture.display.is_some()),
            ("--display-width", capture.display_width.is_some()),
        ];
        of_captured.into_iter().try_for_each(|(name, is_given)| {
            check_companion(name, is_given, "--captured", scale.captured)
        })
    }

    /// Adds the photos, and counts those that gave a cut-out. With several photos, an unusable one
    /// does not stop the others; an invalid option does, since it applies to all.
    fn add_each(&self, global: &GlobalArgs) -> petcomp::Result<(usize, FileBatch)> {
        let options = self.quality.cut_out(CutOutOptions::default());
        let entries = self.entries();
        asset::check_cut_out_files(&entries)?;
        asset::check_not_written_over(&entries, &self.output)?;
        let (mut added, mut batch) = (0, FileBatch::default());
        for entry in &entries {
            match self.add_photo(entry, &options, global) {
                Err(error) if entries.len() == 1 || matches!(error, Error::Value { .. }) => {
                    return Err(error);
                }
                outcome => {
                    added += usize::from(outcome.is_ok());
                    batch.count(outcome.map_err(Into::into));
                }
            }
        }
        Ok((added, batch))
    }

    fn add_photo(
        &self,
        entry: &PhotoEntry,
        options: &CutOutOptions,
        global: &GlobalArgs,
    ) -> petcomp::Result<()> {
        let record = asset::add_photo(&self.output, entry, &self.classes, options)?;
        report_added(&record, global);
        Ok(())
    }

    /// One for each cut-out; all photos of a capture belong to one.
    fn entries(&self) -> Vec<PhotoEntry> {
        let count = if self.scale.captured {
            1
        } else {
            self.photos.len()
        };
        let photos = self.photos.iter().take(count);
        photos.map(|photo| self.entry_for(photo)).collect()
    }

    fn entry_for(&self, photo: &Path) -> PhotoEntry {
        let scale = self.scale.scale(self.screen_corners);
        PhotoEntry {
            role: self.role,
            screen: self.screen.clone(),
            matte: self.matte,
            thickness: self.thickness,
            mass: self.mass,
            captured: self.scale.captured.then(|| self.capture_entry()),
            ..PhotoEntry::new(photo, self.asset_name(), self.class_name(), scale)
        }
    }

    fn capture_entry(&self) -> CaptureEntry {
        CaptureEntry {
            photos: self.photos.iter().skip(1).cloned().collect(),
            empty: self.capture.empty.clone(),
            display: self.capture.display.clone(),
            width: self.capture.display_width,
        }
    }

    /// Empty if none is given, since a distractor needs none.
    fn class_name(&self) -> &str {
        self.class.as_deref().unwrap_or_default()
    }

    /// The given name, or that of the first photo.
    fn asset_name(&self) -> String {
        let first = self.photos.first().map(|photo| stem_of(photo));
        self.name.clone().or(first).unwrap_or_default()
    }
}

/// Smallest and largest of the `i`-th numbers, millimetres.
fn extremes_mm(metres: &[[f64; 2]], i: usize) -> [f64; 2] {
    let values = metres.iter().map(|pair| pair[i]);
    let ends = values.fold([f64::MAX, 0.0], |[low, high], value| {
        [value.min(low), value.max(high)]
    });
    ends.map(|metres| 1e3 * metres)
}

/// Shows the number of each class, and how to change it; distractors have none.
fn show_classes(classes: &[String], how: &str, global: &GlobalArgs) {
    if classes.is_empty() {
        return;
    }
    let numbered = classes.iter().enumerate();
    let numbered = numbered.map(|(i, class)| format!("{i} {class}"));
    let list = numbered.collect::<Vec<_>>().join(", ");
    global.print_status(format_args!(
        "classes {list}; for another order, use {how} and a new folder"
    ));
}

fn list_photos(folder: &Path) -> anyhow::Result<()> {
    let assets = Manifest::read(folder)?.assets;
    let widths = column_widths(&assets);
    for asset in &assets {
        for photo in &asset.photos {
            print::line(list_line(asset, photo, widths));
        }
    }
    Ok(())
}

/// Widths of the columns for names and classes, characters: those of the longest, with a minimum.
fn column_widths(assets: &[Asset<PhotoRecord>]) -> [usize; 2] {
    assets.iter().fold([12, 10], |[name, class], asset| {
        let class_width = class_column(asset).chars().count();
        [name.max(asset.name.chars().count()), class.max(class_width)]
    })
}

/// Name, class, size, confidence of outline and colour, file.
fn list_line(
    asset: &Asset<PhotoRecord>,
    photo: &PhotoRecord,
    [name_width, class_width]: [usize; 2],
) -> String {
    let (name, class) = (&asset.name, class_column(asset));
    let [length, width, error] =
        [photo.object_m[0], photo.object_m[1], photo.error_m].map(|metres| metres * 1e3);
    let outline = photo.outline_confidence;
    let (color, file) = (color_column(photo.color_confidence), &photo.file);
    format!(
        "{name:name_width$} {class:class_width$} {length:4.0} x {width:3.0} mm (+- {error:.1})  {outline:.2}  {color}  {file}"
    )
}

fn class_column(asset: &Asset<PhotoRecord>) -> String {
    match asset.role {
        Role::Object => asset.class.clone(),
        role => role.to_string(),
    }
}

fn color_column(confidence: Option<f64>) -> String {
    match confidence {
        Some(confidence) => format!("{confidence:.2}"),
        None => "   -".into(),
    }
}
