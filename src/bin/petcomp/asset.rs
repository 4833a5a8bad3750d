//! `petcomp asset`: cut-outs with real size and class, kept in a folder.

use crate::common::Common;
use petcomp::asset::{self, AddPhoto, Library, Manifest, Scale};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Cut out all photos of a list
    Build {
        /// List (TOML): [[photos]] with file, asset, class and px_per_metre or length
        list: PathBuf,
        /// Asset folder
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
    },
    /// Cut out photos of one object
    Add(Add),
    /// Show what an asset folder holds
    List {
        /// Asset folder
        folder: PathBuf,
    },
    /// Check that an asset folder is whole
    Check {
        /// Asset folder
        folder: PathBuf,
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
    /// Name of the asset
    #[arg(long)]
    name: String,
    /// Name of its class
    #[arg(long)]
    class: String,
    /// Scale of the photos, pixels per metre
    #[arg(long, value_name = "PX_PER_M", required_unless_present = "length")]
    scale: Option<f64>,
    /// Or: length of the object's longest side, metres
    #[arg(long, value_name = "METRES", conflicts_with = "scale")]
    length: Option<f64>,
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Build { list, output } => build(list, output, common),
        Command::Add(args) => add(args, common),
        Command::List { folder } => list(folder),
        Command::Check { folder } => {
            let library = Library::open(folder)?;
            common.say(format_args!("{}: {} assets, all whole", folder.display(), library.assets.len()));
            Ok(())
        }
    }
}

/// Cuts out all photos of a list, showing progress.
pub(crate) fn build(list: &Path, folder: &Path, common: &Common) -> anyhow::Result<()> {
    let progress = common.progress("cut-outs");
    let built = asset::build(list, folder, &|done, total| progress.at(done as u64, total as u64))?;
    drop(progress);
    common.say(format_args!("{}: {} photos, {} assets", folder.display(), built.photos, built.assets));
    Ok(())
}

fn add(args: &Add, common: &Common) -> anyhow::Result<()> {
    let scale = match (args.scale, args.length) {
        (Some(px_per_metre), _) => Scale::PxPerMetre(px_per_metre),
        (None, length) => Scale::Length(length.unwrap_or_default()),
    };
    let add = AddPhoto::new(&args.name, &args.class, scale);
    for photo in &args.photos {
        let record = asset::add_photo(&args.output, photo, &add)?;
        let [length, width] = record.object_m;
        common.say(format_args!("{}: {:.0} x {:.0} mm", record.file, length * 1e3, width * 1e3));
    }
    Ok(())
}

fn list(folder: &Path) -> anyhow::Result<()> {
    for asset in Manifest::read(folder)?.assets {
        for photo in &asset.photos {
            let [length, width] = photo.object_m.map(|m| m * 1e3);
            println!("{:12} {:10} {length:4.0} x {width:3.0} mm  {}", asset.name, asset.class, photo.file);
        }
    }
    Ok(())
}
