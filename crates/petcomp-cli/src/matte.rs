//! `petcomp matte`: photo -> matte and cut-out.

use crate::common::Common;
use crate::{matte_film, matte_key, matte_nodes};
use petcomp::matte::{CutOutOptions, PlateOptions, ScreenPlate, SegmentOptions, cut_out, segment};
use petcomp::{Diagnostic, Image, LinearRgb, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Find the object and write every intermediate picture, and the garbage and core matte that a keyer takes
    Segment {
        /// Photo of one object on a uniform screen or board
        photo: PathBuf,
        /// Folder for the pictures
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
        /// Options to use instead of the defaults, as TOML
        #[arg(long, value_name = "FILE")]
        options: Option<PathBuf>,
    },
    /// Find the object, key it, and write it without its background
    Cut {
        /// Photo of one object on a uniform screen or board
        photo: PathBuf,
        /// Cut-out to write: .exr (scene-linear, premultiplied) or .png
        #[arg(short, long, value_name = "PICTURE")]
        output: PathBuf,
        /// Options to use instead of the defaults, as TOML
        #[arg(long, value_name = "FILE")]
        options: Option<PathBuf>,
    },
    /// Key a picture against a screen colour or plate, as Blender's Keying node does
    Key(Box<matte_key::Args>),
    /// Solve one photo on a coloured screen for what it reflects and what it lets through
    Film(matte_film::Film),
    /// The same, exactly, from two or more photos of one object on different screens
    Triangulate(matte_film::Triangulate),
    #[command(flatten)]
    Node(matte_nodes::Command),
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Key(args) => matte_key::run(args)?,
        Command::Film(args) => args.run(common)?,
        Command::Triangulate(args) => args.run(common)?,
        Command::Node(command) => matte_nodes::run(command)?,
        Command::Segment {
            photo,
            output,
            options,
        } => {
            let options: SegmentOptions = options
                .as_ref()
                .map(io::read_toml)
                .transpose()?
                .unwrap_or_default();
            let picture: Image<LinearRgb> = io::read(photo)?;
            let found = segment(&picture, &options).map_err(|e| e.in_file(photo))?;
            io::create_folder(output)?;
            warn(photo, &found.diagnostics);
            let steps = found.steps.iter().map(|step| (step.name, step.shown()));
            let outcome = [
                ("hull", found.mask.clone()),
                ("outline", found.tight.clone()),
            ];
            // An object that leaves no screen has no plate, and what is opaque of it is not known.
            let plate =
                ScreenPlate::fit_outside(&picture, &found.mask, &PlateOptions::default()).ok();
            let mattes = plate.map(|plate| found.mattes(&picture, &plate.image));
            let mattes = mattes
                .into_iter()
                .flat_map(|[garbage, core]| [("garbage", garbage), ("core", core)]);
            let mattes = outcome.into_iter().chain(mattes);
            let mattes = mattes.map(|(name, matte)| (name, matte.map(|c| c.0)));
            for (i, (name, picture)) in steps.chain(mattes).enumerate() {
                let path = output.join(format!("{i}_{name}.png"));
                io::write(&path, &picture)?;
                common.say(path.display());
            }
        }
        Command::Cut {
            photo,
            output,
            options,
        } => {
            let options: CutOutOptions = options
                .as_ref()
                .map(io::read_toml)
                .transpose()?
                .unwrap_or_default();
            let cut =
                cut_out(&io::read::<LinearRgb>(photo)?, &options).map_err(|e| e.in_file(photo))?;
            io::write(output, &cut.to_rgba())?;
            warn(photo, &cut.diagnostics);
            let (w, h) = cut.film.size();
            common.say(format_args!(
                "{}: {w} x {h}, matte by {}",
                output.display(),
                cut.method
            ));
        }
    }
    Ok(())
}

pub(crate) fn warn(photo: &Path, diagnostics: &[Diagnostic]) {
    diagnostics
        .iter()
        .for_each(|diagnostic| log::warn!("{}: {diagnostic}", photo.display()));
}
