//! `petcomp dataset check`, `report` and `sheet`: what is in a dataset.

use crate::common::{Common, NeedsReview};
use crate::print;
use petcomp::dataset::page::DatasetReportOptions;
use petcomp::dataset::{self, Checked, contact_sheet_of};
use petcomp::io;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Check {
    /// Folder of the dataset
    folder: PathBuf,
    /// Exit with status 1 where there is a note, too: classes without labels, very small boxes
    #[arg(long)]
    strict: bool,
}

#[derive(clap::Args)]
pub(crate) struct Report {
    /// Folder of the dataset
    folder: PathBuf,
    /// Page to write; by default report.html in the folder
    #[arg(short, long, value_name = "HTML")]
    output: Option<PathBuf>,
    /// Number of sample pictures
    #[arg(short = 'n', long, value_name = "N", default_value_t = 32)]
    most: usize,
    /// Your own pictures, to compare with: a YOLO dataset, or a folder of images with YOLO labels
    #[arg(long, value_name = "FOLDER")]
    beside: Option<PathBuf>,
}

#[derive(clap::Args)]
pub(crate) struct Sheet {
    /// Folder of the dataset
    folder: PathBuf,
    /// Picture to write
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// Number of pictures
    #[arg(short = 'n', long, value_name = "N", default_value_t = 24)]
    most: usize,
}

pub(crate) fn check(args: &Check, common: &Common) -> anyhow::Result<()> {
    let folder = args.folder.display();
    let checked = dataset::check(&args.folder)?;
    let Checked {
        findings, images, ..
    } = &checked;
    print::text(checked.balance().markdown());
    let notes = checked.notes();
    notes
        .iter()
        .for_each(|note| common.say(format_args!("note: {note} [{}]", note.code)));
    findings.iter().for_each(print::line);
    anyhow::ensure!(findings.is_empty(), "{folder}: {} errors", findings.len());
    let rows: usize = checked.rows.iter().sum();
    print::line(format_args!(
        "{folder}: {images} images, {rows} labels, no errors"
    ));
    match notes.len() {
        n if args.strict && n > 0 => Err(NeedsReview(format!("{folder}: {n} notes")).into()),
        _ => Ok(()),
    }
}

pub(crate) fn report(args: &Report, common: &Common) -> anyhow::Result<()> {
    let output = args
        .output
        .clone()
        .unwrap_or_else(|| args.folder.join("report.html"));
    let folder = output
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let options = DatasetReportOptions {
        most: args.most,
        page: Some(folder.to_path_buf()),
        beside: args.beside.clone(),
    };
    io::write_text(
        &output,
        &dataset::page::page(&args.folder, &options)?.document(),
    )?;
    common.say(format_args!("look at {}", output.display()));
    Ok(())
}

pub(crate) fn sheet(args: &Sheet, common: &Common) -> anyhow::Result<()> {
    io::write(
        &args.output,
        &contact_sheet_of(&args.folder, args.most, &Default::default())?,
    )?;
    common.say(args.output.display());
    Ok(())
}
