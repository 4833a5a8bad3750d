//! `petcomp matte chroma-key`, `channel-key`, `difference-key`, `color-spill`, `keying-screen`: Blender's other keyers.

use super::picture::{color, write, write_some};
use anyhow::Result;
use nalgebra::Point2;
use petcomp::io::{Override, from_overrides};
use petcomp::matte::{
    ScreenPoint, channel_key, chroma_key, color_spill, difference_key, keying_screen,
};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba, io};
use std::path::PathBuf;

/// A picture in, pictures out, settings in between.
#[derive(clap::Args, Debug)]
pub(crate) struct Pictures {
    /// The picture to key; alpha is taken as premultiplied
    input: PathBuf,
    /// Where the premultiplied result goes; an EXR holds 32-bit floats
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Where the matte goes
    #[arg(long, value_name = "FILE")]
    matte: Option<PathBuf>,
    /// A setting under Blender's name, such as key.tolerance=0.2 or key.profile=blender-4.5
    #[arg(long = "set", value_name = "key.NAME=VALUE")]
    settings: Vec<Override>,
}

#[derive(clap::Subcommand, Debug)]
pub(crate) enum Command {
    /// Key by the angle between colour differences
    ChromaKey {
        #[command(flatten)]
        pictures: Pictures,
        /// Colour of the screen, scene-linear
        #[arg(long, value_name = "R,G,B", value_parser = color)]
        screen: LinearRgb,
    },
    /// Key by one channel against the others
    ChannelKey(Pictures),
    /// Key by the difference from a picture without the subject
    DifferenceKey {
        #[command(flatten)]
        pictures: Pictures,
        /// The picture without the subject
        #[arg(long, value_name = "FILE")]
        clean: PathBuf,
    },
    /// Take the screen's light from the subject
    ColorSpill(Pictures),
    /// Make a plate from points where the screen is seen
    KeyingScreen(ScreenPoints),
}

/// A plate from a few points.
#[derive(clap::Args, Debug)]
pub(crate) struct ScreenPoints {
    /// The picture whose size the plate gets
    input: PathBuf,
    /// Where the plate goes
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Where the screen is seen, pixels from the top left; its colour is that of the picture there
    #[arg(long = "point", value_name = "X,Y", value_parser = point, required = true)]
    points: Vec<[usize; 2]>,
    /// How far the colour of a point reaches, 0 to 1
    #[arg(long, default_value_t = 0.0)]
    smoothness: f64,
}

impl ScreenPoints {
    fn run(&self) -> Result<()> {
        let photo: Image<PremulRgba> = io::read(&self.input)?;
        let points = self.points.iter().map(|&at| screen_point(&photo, at));
        let points = points.collect::<Result<Vec<_>>>()?;
        let plate = keying_screen(photo.size(), &points, self.smoothness)?;
        write(&self.output, &plate)
    }
}

pub(crate) fn run(command: &Command) -> Result<()> {
    match command {
        Command::ChromaKey { pictures, screen } => pictures
            .cut(|photo, given| Ok(chroma_key(photo, *screen, &from_overrides("key", given)?))),
        Command::DifferenceKey { pictures, clean } => {
            let clean: Image<PremulRgba> = io::read(clean)?;
            pictures.cut(|photo, given| {
                let options = from_overrides("key", given)?;
                Ok(difference_key(photo, &clean, &options)?)
            })
        }
        Command::ChannelKey(pictures) => pictures.channel_key(),
        Command::ColorSpill(pictures) => pictures.color_spill(),
        Command::KeyingScreen(args) => args.run(),
    }
}

impl Pictures {
    fn channel_key(&self) -> Result<()> {
        let options = from_overrides("key", &self.settings)?;
        let keyed = channel_key(&io::read::<PremulRgba>(&self.input)?, &options);
        self.write(&keyed.cutout, &keyed.matte)
    }

    fn color_spill(&self) -> Result<()> {
        let photo: Image<PremulRgba> = io::read(&self.input)?;
        let options = from_overrides("key", &self.settings)?;
        write(&self.output, &color_spill(&photo, &options))
    }

    /// Writes the picture seen through a matte.
    fn cut(
        &self,
        matte: impl Fn(&Image<PremulRgba>, &[Override]) -> Result<Image<Coverage>>,
    ) -> Result<()> {
        let photo: Image<PremulRgba> = io::read(&self.input)?;
        let matte = matte(&photo, &self.settings)?;
        self.write(&photo.zip_map(&matte, |p, m| p.masked(m)), &matte)
    }

    fn write(&self, cutout: &Image<PremulRgba>, matte: &Image<Coverage>) -> Result<()> {
        write(&self.output, cutout)?;
        write_some(&self.matte, matte)
    }
}

/// The screen where it is seen.
fn screen_point(photo: &Image<PremulRgba>, [x, y]: [usize; 2]) -> Result<ScreenPoint> {
    let (width, height) = photo.size();
    anyhow::ensure!(
        x < width && y < height,
        "--point {x},{y}: outside the picture of {width} x {height} pixels"
    );
    Ok(ScreenPoint {
        at_px: Point2::new(x as f64 + 0.5, y as f64 + 0.5),
        color: photo[(x, y)].color(),
    })
}

/// A pixel from `X,Y`.
fn point(text: &str) -> Result<[usize; 2], String> {
    let numbers: Result<Vec<usize>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    numbers
        .map_err(|e| e.to_string())?
        .try_into()
        .map_err(|_| "expected X,Y".into())
}
