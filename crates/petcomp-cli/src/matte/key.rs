//! `petcomp matte key`: Blender's Keying node on one picture.

use super::picture_files::{write_optional, write_picture};
use crate::diagnostics::report_diagnostics;
use crate::values::parse_color;
use anyhow::Result;
use petcomp::io::{self, FromFile, Override, Picture};
use petcomp::matte::key::{Deviations, KeyOptions, Keyed, Keying, Profile, Screen};
use petcomp::matte::{PlateOptions, ScreenPlate, SegmentOptions, segment};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba};
use std::path::PathBuf;

/// Keys a picture against a screen colour or plate, as Blender's Keying node does.
#[derive(clap::Args, Debug)]
pub(crate) struct KeyArgs {
    /// The picture to key; alpha is taken as premultiplied
    input: PathBuf,
    /// Where the premultiplied cut-out goes; an EXR holds 32-bit floats
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Where the matte goes
    #[arg(long, value_name = "FILE")]
    matte: Option<PathBuf>,
    /// Where the edges go that the levels leave alone
    #[arg(long, value_name = "FILE")]
    edges: Option<PathBuf>,
    /// Colour of the screen, scene-linear
    #[arg(long, value_name = "R,G,B", value_parser = parse_color, required_unless_present = "plate", conflicts_with = "plate")]
    screen: Option<LinearRgb>,
    /// A picture of the screen alone: every pixel is keyed against its own colour
    #[arg(long, value_name = "FILE")]
    plate: Option<PathBuf>,
    /// A matte of what is surely not foreground
    #[arg(long, value_name = "FILE")]
    garbage: Option<PathBuf>,
    /// A matte of what is surely foreground
    #[arg(long, value_name = "FILE")]
    core: Option<PathBuf>,
    /// Find the object first: what lies around it is garbage, and what surely lets nothing through
    /// is core
    #[arg(long, conflicts_with_all = ["garbage", "core"])]
    auto_mattes: bool,
    /// Which keyer to be: blender-3.4, blender-4.2, blender-4.5 or robust
    #[arg(long, value_name = "NAME", default_value = "blender-3.4")]
    profile: Profile,
    /// A setting under Blender's name, such as key.clip_black=0.1
    #[arg(long = "set", value_name = "key.NAME=VALUE")]
    settings: Vec<Override>,
}

impl KeyArgs {
    /// The input and its mattes, those that there are.
    fn read_input(&self, plate: Option<&Image<LinearRgb>>) -> Result<KeyerInput> {
        if self.auto_mattes {
            return self.with_found_mattes(plate);
        }
        Ok(KeyerInput {
            photo: io::read(&self.input)?,
            garbage: read_optional(&self.garbage)?,
            core: read_optional(&self.core)?,
        })
    }

    fn with_found_mattes(&self, plate: Option<&Image<LinearRgb>>) -> Result<KeyerInput> {
        let picture = Picture::read(&self.input)?;
        let [garbage, core] = self.find_mattes(&picture.pixels()?, plate)?;
        Ok(KeyerInput {
            photo: picture.pixels()?,
            garbage: Some(garbage),
            core: Some(core),
        })
    }

    /// Garbage and core matte around and inside the object that is found in the photo.
    fn find_mattes(
        &self,
        photo: &Image<LinearRgb>,
        plate: Option<&Image<LinearRgb>>,
    ) -> Result<[Image<Coverage>; 2]> {
        let found =
            segment(photo, &SegmentOptions::default()).map_err(|e| e.in_file(&self.input))?;
        report_diagnostics(self.input.display(), &found.diagnostics);
        Ok(match plate {
            Some(plate) => found.mattes(photo, plate),
            None => {
                let options = PlateOptions::default();
                let plate = ScreenPlate::fit_outside(photo, &found.mask, &options)?;
                found.mattes(photo, &plate.image)
            }
        })
    }
}

/// What is keyed, and where it is sure not to be foreground, or to be foreground.
struct KeyerInput {
    photo: Image<PremulRgba>,
    garbage: Option<Image<Coverage>>,
    core: Option<Image<Coverage>>,
}

pub(crate) fn run(args: &KeyArgs) -> Result<()> {
    let options = args.options()?;
    let plate: Option<Image<LinearRgb>> = read_optional(&args.plate)?;
    let input = args.read_input(plate.as_ref())?;
    let color = Screen::Color(args.screen.unwrap_or_default());
    let keying = input.keying(plate.as_ref().map_or(color, Screen::Plate));
    let keyed = keying.run(&options)?;
    args.write_keyed(&keyed)?;
    if let Some(path) = &args.edges {
        write_picture(path, &keying.edges(&options)?)?;
    }
    Ok(())
}

impl KeyArgs {
    fn options(&self) -> Result<KeyOptions> {
        Ok(KeyOptions {
            profile: self.profile,
            ..io::from_overrides("key", &self.settings)?
        })
    }

    fn write_keyed(&self, keyed: &Keyed) -> Result<()> {
        if keyed.deviations != Deviations::default() {
            log::warn!("{}: {}", self.input.display(), keyed.deviations);
        }
        write_picture(&self.output, &keyed.cutout)?;
        write_optional(&self.matte, &keyed.matte)
    }
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
