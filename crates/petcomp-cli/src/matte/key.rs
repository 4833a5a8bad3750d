//! `petcomp matte key`: Blender's Keying node on a picture, or on the frames of a sequence.

use super::picture_files::{canvas_of, check_same_size, write_optional, write_picture};
use crate::batch::FileBatch;
use crate::diagnostics::report_diagnostics;
use crate::global::GlobalArgs;
use crate::interruption::interruption;
use crate::values::parse_color;
use anyhow::{Context, Result};
use clap::ArgGroup;
use petcomp::io::{self, Format, FromFile, Override, Picture};
use petcomp::matte::key::{Deviations, KeyOptions, Keyed, Keying, Profile, Screen};
use petcomp::matte::{PlateOptions, ScreenPlate, SegmentOptions, segment};
use petcomp::{Coverage, Error, Image, LinearRgb, PremulRgba};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering;

/// Memory per pixel of a frame while it is keyed: 78 to 88 bytes, measured.
const BYTES_PER_PIXEL: u64 = 100;

/// Keys pictures against a screen colour or plate, as Blender's Keying node does.
#[derive(clap::Args, Debug)]
#[command(group(ArgGroup::new("background").args(["screen", "plate"]).required(true)))]
pub(crate) struct KeyArgs {
    /// Image to key, or the frames of a sequence; alpha is treated as premultiplied
    #[arg(required = true, value_name = "PICTURE")]
    frames: Vec<PathBuf>,
    /// Cut-out to write: .exr (32-bit floats, scene-linear, premultiplied); .png or .tif (sRGB
    /// codes, straight alpha); or a folder (existing, or ending in /) for an .exr under the frame's
    /// name. The same goes for folders of --matte and --edges; with several frames all three must
    /// be folders
    #[arg(short, long, value_name = "FILE|FOLDER")]
    output: PathBuf,
    /// Matte to write
    #[arg(long, value_name = "FILE")]
    matte: Option<PathBuf>,
    /// Edges to write, which the black and white levels leave unchanged
    #[arg(long, value_name = "FILE")]
    edges: Option<PathBuf>,
    /// Colour of the screen, scene-linear
    #[arg(long, value_name = "R,G,B", value_parser = parse_color)]
    screen: Option<LinearRgb>,
    /// Or: image of the empty screen; each pixel is keyed against its colour there
    #[arg(long, value_name = "FILE")]
    plate: Option<PathBuf>,
    /// Garbage matte: what is certainly not foreground
    #[arg(long, value_name = "FILE")]
    garbage: Option<PathBuf>,
    /// Core matte: what is certainly foreground
    #[arg(long, value_name = "FILE")]
    core: Option<PathBuf>,
    /// Find the object first: everything around it is garbage, and what is certainly opaque is core
    #[arg(long, conflicts_with_all = ["garbage", "core"])]
    auto_mattes: bool,
    /// Keyer to use: blender-3.4, blender-4.2, blender-4.5 or robust; by default that of --set
    /// key.profile, or blender-3.4
    #[arg(long, value_name = "NAME")]
    profile: Option<Profile>,
    /// Setting by its Blender name, such as key.clip_black=0.1
    #[arg(long = "set", value_name = "key.NAME=VALUE")]
    settings: Vec<Override>,
}

impl KeyArgs {
    /// The input and its mattes, if any.
    fn read_input(&self, frame: &Path, plate: Option<&Image<LinearRgb>>) -> Result<KeyerInput> {
        if self.auto_mattes {
            return with_found_mattes(frame, plate);
        }
        Ok(KeyerInput {
            photo: io::read(frame)?,
            garbage: read_optional(&self.garbage)?,
            core: read_optional(&self.core)?,
        })
    }

    /// The output files of each frame.
    fn files(&self) -> Result<Vec<FrameFiles>> {
        self.targets()
            .try_for_each(|path| self.check_folder(path))?;
        let files = self.frames.iter().map(|frame| self.files_of(frame));
        let files = files.collect::<Result<Vec<_>>>()?;
        io::check_distinct(self.inputs(), files.iter().flat_map(FrameFiles::targets))?;
        Ok(files)
    }

    /// All input files.
    fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        let common = [&self.plate, &self.garbage, &self.core];
        self.frames.iter().chain(common.into_iter().flatten())
    }

    /// The given outputs, files or folders.
    fn targets(&self) -> impl Iterator<Item = &PathBuf> {
        let optional = [&self.matte, &self.edges];
        std::iter::once(&self.output).chain(optional.into_iter().flatten())
    }

    /// Several frames cannot go into one file.
    fn check_folder(&self, path: &Path) -> Result<()> {
        let count = self.frames.len();
        anyhow::ensure!(
            count == 1 || !is_picture_name(path),
            "{}: the name of a picture, expected a folder for {count} frames",
            path.display()
        );
        Ok(())
    }

    /// With several frames, everything goes into folders.
    fn is_folder(&self, path: &Path) -> bool {
        self.frames.len() > 1 || is_named_folder(path)
    }

    /// Creates none if no frame is a picture, since then nothing would be written to them.
    fn create_folders(&self) -> petcomp::Result<()> {
        let mut frames = self.frames.iter();
        if !frames.any(|frame| io::read_format(frame).is_ok()) {
            return Ok(());
        }
        let mut folders = self.targets().filter(|path| self.is_folder(path));
        folders.try_for_each(io::create_folder)
    }

    fn files_of(&self, frame: &Path) -> Result<FrameFiles> {
        let place = |path: &PathBuf| self.place(path, frame);
        Ok(FrameFiles {
            frame: frame.to_owned(),
            cutout: place(&self.output)?,
            matte: self.matte.as_ref().map(place).transpose()?,
            edges: self.edges.as_ref().map(place).transpose()?,
        })
    }

    /// The given file, or one with the frame's name in the given folder.
    fn place(&self, path: &Path, frame: &Path) -> Result<PathBuf> {
        if !self.is_folder(path) {
            return Ok(path.to_owned());
        }
        let name = frame
            .file_name()
            .context(format!("{}: no file", frame.display()))?;
        Ok(path.join(exr_name(Path::new(name))))
    }
}

/// A picture's name with the extension `.exr` instead of its own: no other format keeps everything
/// in a cut-out (alpha, colours of any gamut, floats). What follows the last dot may be a number.
fn exr_name(name: &Path) -> PathBuf {
    if Format::from_extension(name).is_some() {
        return name.with_extension("exr");
    }
    let mut whole = name.as_os_str().to_owned();
    whole.push(".exr");
    whole.into()
}

/// A folder that exists, or that is marked as one by its last character.
fn is_named_folder(path: &Path) -> bool {
    path.is_dir() || path.to_string_lossy().ends_with(std::path::is_separator)
}

fn is_picture_name(path: &Path) -> bool {
    let written = ["exr", "png", "tif", "tiff", "jpg", "jpeg"];
    let is_written = written.iter().any(|ending| io::has_extension(path, ending));
    is_written && !is_named_folder(path)
}

/// A frame, and the output files for it.
struct FrameFiles {
    frame: PathBuf,
    cutout: PathBuf,
    matte: Option<PathBuf>,
    edges: Option<PathBuf>,
}

impl FrameFiles {
    fn targets(&self) -> impl Iterator<Item = &PathBuf> {
        let optional = [&self.matte, &self.edges];
        std::iter::once(&self.cutout).chain(optional.into_iter().flatten())
    }
}

fn with_found_mattes(frame: &Path, plate: Option<&Image<LinearRgb>>) -> Result<KeyerInput> {
    let picture = Picture::read(frame)?;
    let [garbage, core] = find_mattes(frame, &picture.pixels()?, plate)?;
    Ok(KeyerInput {
        photo: picture.pixels()?,
        garbage: Some(garbage),
        core: Some(core),
    })
}

/// Garbage and core matte around and inside the object detected in a photo.
fn find_mattes(
    path: &Path,
    photo: &Image<LinearRgb>,
    plate: Option<&Image<LinearRgb>>,
) -> Result<[Image<Coverage>; 2]> {
    if let Some(plate) = plate {
        check_same_size("--plate", plate.size(), path, photo.size())?;
    }
    let found = segment(photo, &SegmentOptions::default()).map_err(|e| e.in_file(path))?;
    report_diagnostics(path.display(), &found.diagnostics);
    Ok(match plate {
        Some(plate) => found.mattes(photo, plate),
        None => {
            let options = PlateOptions::default();
            let plate = ScreenPlate::fit_outside(photo, &found.mask, &options)?;
            found.mattes(photo, &plate.image)
        }
    })
}

/// The picture to key, and where it is certainly not foreground, or certainly foreground.
struct KeyerInput {
    photo: Image<PremulRgba>,
    garbage: Option<Image<Coverage>>,
    core: Option<Image<Coverage>>,
}

pub(crate) fn run(args: &KeyArgs, global: &GlobalArgs) -> Result<()> {
    let files = args.files()?;
    let work = KeyerWork {
        options: args.options()?,
        plate: read_optional(&args.plate)?,
        args,
    };
    args.create_folders()?;
    match &files[..] {
        [one] => work.key(one, &mut Keyed::default()),
        frames => work.key_sequence(frames, global),
    }
}

impl KeyArgs {
    fn options(&self) -> Result<KeyOptions> {
        let options = self.profile_options()?;
        options.check()?;
        Ok(options)
    }

    /// # Errors
    /// If `--profile` names a different keyer from the settings.
    fn profile_options(&self) -> Result<KeyOptions> {
        let Some(profile) = self.profile else {
            return Ok(io::from_overrides("key", &self.settings)?);
        };
        // Settings that name a profile override it.
        let named: Override = format!("key.profile={profile}").parse()?;
        let settings = [&[named], &self.settings[..]].concat();
        let options: KeyOptions = io::from_overrides("key", &settings)?;
        let set = options.profile;
        anyhow::ensure!(
            set == profile,
            "--profile {profile}, but --set key.profile={set}"
        );
        Ok(options)
    }
}

/// What all frames have in common.
struct KeyerWork<'a> {
    args: &'a KeyArgs,
    options: KeyOptions,
    plate: Option<Image<LinearRgb>>,
}

impl KeyerWork<'_> {
    /// Keys as many frames in parallel as fit in memory: while some are read or written, others are
    /// keyed. A frame that cannot be keyed does not stop the others; after an interruption no more
    /// are started.
    fn key_sequence(&self, frames: &[FrameFiles], global: &GlobalArgs) -> Result<()> {
        let progress = global.start_progress("frames");
        let (stop, count) = (interruption(), frames.len() as u64);
        progress.update(0, count);
        let batch = Mutex::new((FileBatch::default(), 0));
        let key = |keyed: &mut Keyed, frame: &FrameFiles| {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let outcome = self.key(frame, keyed);
            if let Ok((batch, done)) = batch.lock().as_deref_mut() {
                batch.count(outcome);
                *done += 1;
                progress.update(*done, count);
            }
        };
        // Frames are alike.
        let first = frames.first().map(|files| &files.frame);
        for some in frames.chunks(io::pictures_at_once(first, BYTES_PER_PIXEL)) {
            some.par_iter().for_each_init(Keyed::default, key);
        }
        drop(progress);
        let counted = batch.into_inner();
        counted.map_or(Ok(()), |(batch, done)| match done < count {
            true => Err(interrupted(done, count).into()),
            false => batch.finish(),
        })
    }

    /// Keys one frame into existing pictures.
    fn key(&self, files: &FrameFiles, keyed: &mut Keyed) -> Result<()> {
        let input = self.args.read_input(&files.frame, self.plate.as_ref())?;
        let color = Screen::Color(self.args.screen.unwrap_or_default());
        let keying = input.keying(self.plate.as_ref().map_or(color, Screen::Plate));
        let located = |e: petcomp::Error| e.in_file(&files.frame);
        keying.run_into(&self.options, keyed).map_err(located)?;
        if keyed.deviations != Deviations::default() {
            log::warn!("{}: {}", files.frame.display(), keyed.deviations);
        }
        let canvas = canvas_of(&files.frame)?;
        write_picture(&files.cutout, &keyed.cutout, canvas)?;
        write_optional(&files.matte, &keyed.matte, canvas)?;
        match &files.edges {
            Some(path) => write_picture(path, &keying.edges(&self.options)?, canvas),
            None => Ok(()),
        }
    }
}

fn interrupted(done: u64, count: u64) -> Error {
    let what =
        format!("{done} of {count} frames are done; the same command starts again from the first");
    Error::Interrupted { what }
}

fn read_optional<P: FromFile>(path: &Option<PathBuf>) -> petcomp::Result<Option<Image<P>>> {
    path.as_ref().map(io::read).transpose()
}

impl KeyerInput {
    fn keying<'a>(&'a self, screen: Screen<'a>) -> Keying<'a, PremulRgba> {
        let mut keying = Keying::new(&self.photo, screen);
        if let Some(garbage) = &self.garbage {
            keying = keying.with_garbage(garbage);
        }
        if let Some(core) = &self.core {
            keying = keying.with_core(core);
        }
        keying
    }
}
