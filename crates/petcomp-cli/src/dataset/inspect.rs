//! `petcomp dataset check`, `report` and `sheet`: what is in a dataset.

use crate::diagnostics::located;
use crate::exit::NeedsReview;
use crate::global::GlobalArgs;
use crate::print::{self, counted};
use petcomp::dataset::page::DatasetReportOptions;
use petcomp::dataset::{self, Checked, JOURNAL, YoloSet, contact_sheet_of};
use petcomp::io;
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum InspectCommand {
    /// Check for what trainers reject and for what makes results too good: duplicates, leakage
    /// between the parts
    Check(CheckArgs),
    /// Write an HTML report: images with their labels, drawn values, visibility, run times
    Report(ReportArgs),
    /// Draw a contact sheet of images from across the dataset, with their boxes
    Sheet(SheetArgs),
}

#[derive(clap::Args)]
pub(crate) struct CheckArgs {
    /// Dataset folder
    folder: PathBuf,
    /// Exit with status 1 instead of 0 if there are only notes: images without a label file, classes
    /// with few or no labels, very small boxes
    #[arg(long)]
    strict: bool,
}

#[derive(clap::Args)]
pub(crate) struct ReportArgs {
    /// Dataset folder
    folder: PathBuf,
    /// Page to write; by default report.html in the folder
    #[arg(short, long, value_name = "HTML")]
    output: Option<PathBuf>,
    /// Number of sample images
    #[arg(short = 'n', long, value_name = "N", default_value_t = 32)]
    most: usize,
    /// Your own images to compare with: a YOLO dataset, or a folder of images with YOLO labels
    #[arg(long, value_name = "FOLDER")]
    beside: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct SheetArgs {
    /// Dataset folder
    folder: PathBuf,
    /// Image to write
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// Number of images
    #[arg(short = 'n', long, value_name = "N", default_value_t = 24)]
    most: usize,
}

pub(super) fn run(command: &InspectCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        InspectCommand::Check(args) => check_dataset(args),
        InspectCommand::Report(args) => write_report(args, global),
        InspectCommand::Sheet(args) => write_sheet(args, global),
    }
}

fn check_dataset(args: &CheckArgs) -> anyhow::Result<()> {
    let folder = args.folder.display();
    let checked = dataset::check(&args.folder)?;
    if checked.has_yolo {
        print::text(checked.balance().markdown());
    }
    let notes = checked.notes();
    for note in &notes {
        print::line(located(&folder, note));
    }
    print_findings(&checked, &args.folder)?;
    if args.strict && !notes.is_empty() {
        let notes = counted(notes.len(), "note");
        return Err(NeedsReview(format!("{folder}: {notes}")).into());
    }
    Ok(())
}

/// Prints the findings, which make an error, or how much was checked.
fn print_findings(checked: &Checked, folder: &Path) -> anyhow::Result<()> {
    let (folder, errors) = (folder.display(), checked.findings.len());
    checked.findings.iter().for_each(print::line);
    anyhow::ensure!(errors == 0, "{folder}: {}", counted(errors, "error"));
    print::line(format_args!(
        "{folder}: {}, no errors",
        what_was_checked(checked)
    ));
    Ok(())
}

fn what_was_checked(checked: &Checked) -> String {
    if !checked.has_yolo {
        return "no YOLO labels, only the files compared with index.jsonl".into();
    }
    let (images, rows) = (checked.images, checked.rows.iter().sum::<usize>());
    format!("{}, {}", counted(images, "image"), counted(rows, "label"))
}

fn page_folder(page: &Path) -> &Path {
    let folder = page.parent().filter(|path| *path != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

/// Folders of files joined from those of many samples, which the journal does not list.
const JOINED: [&str; 4] = ["annotations", "mot", "voc", "webdataset"];

/// Fails if a file of the dataset would be overwritten.
fn check_dataset_stays(folder: &Path, output: &Path) -> petcomp::Result<()> {
    // A file that does not exist yet is none of the dataset's.
    let Ok(real) = output.canonicalize() else {
        return Ok(());
    };
    let own = ["data.yaml", "dataset.json", JOURNAL].map(|file| folder.join(file));
    // Errors in the journal are reported when it is read for the page or the sheet.
    let listed = dataset::listed_files(folder).unwrap_or_default();
    let listed = listed.into_iter();
    let alike = listed.filter(|file| file.file_name() == real.file_name());
    let lists = YoloSet::choosing_files(folder).unwrap_or_default();
    let joined = is_joined(folder, &real).then_some(real.clone());
    let files = own.into_iter().chain(alike).chain(lists).chain(joined);
    io::check_distinct(files, [output])
}

fn is_joined(folder: &Path, file: &Path) -> bool {
    let folder = folder.canonicalize().unwrap_or_default();
    let below = file.strip_prefix(folder);
    below.is_ok_and(|below| JOINED.iter().any(|name| below.starts_with(name)))
}

fn write_report(args: &ReportArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let output = args.page_path();
    check_dataset_stays(&args.folder, &output)?;
    args.check_beside_stays(&output)?;
    let page = dataset::page::page(&args.folder, &args.options_for(&output))?;
    io::write_text(&output, &page.document())?;
    global.print_look_at(&output);
    Ok(())
}

impl ReportArgs {
    /// Fails if a file of the user's own pictures would be overwritten.
    fn check_beside_stays(&self, output: &Path) -> petcomp::Result<()> {
        match &self.beside {
            Some(beside) => io::check_distinct(YoloSet::files_like(beside, output)?, [output]),
            None => Ok(()),
        }
    }

    fn options_for(&self, page: &Path) -> DatasetReportOptions {
        DatasetReportOptions {
            most: self.most,
            page: Some(page_folder(page).into()),
            beside: self.beside.clone(),
        }
    }

    fn page_path(&self) -> PathBuf {
        match &self.output {
            Some(path) => path.clone(),
            None => self.folder.join("report.html"),
        }
    }
}

/// Draws this many pictures of a dataset, evenly spread.
pub(crate) fn write_contact_sheet(
    dataset: &Path,
    count: usize,
    output: &Path,
) -> petcomp::Result<()> {
    io::write(output, &contact_sheet_of(dataset, count)?)
}

fn write_sheet(args: &SheetArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    check_dataset_stays(&args.folder, &args.output)?;
    write_contact_sheet(&args.folder, args.most, &args.output)?;
    global.print_status(args.output.display());
    Ok(())
}
