//! `petcomp matte chroma-key`, `channel-key`, `difference-key`, `color-spill`, `keying-screen`:
//! Blender's other keyers.

use super::picture_files::{canvas_of, write_optional, write_picture};
use crate::values::{parse_color, parse_pixel};
use anyhow::Result;
use nalgebra::Point2;
use petcomp::io::{Override, from_overrides};
use petcomp::matte::{
    ChannelKeyOptions, ChromaKeyOptions, ColorSpillOptions, ScreenPoint, channel_key, chroma_key,
    color_spill, difference_key, keying_screen,
};
use petcomp::{Coverage, Image, LinearRgb, PremulRgba, io};
use std::path::{Path, PathBuf};

/// An input picture, an output picture, and settings.
#[derive(clap::Args, Debug)]
pub(crate) struct NodePicture {
    /// Image to key; alpha is treated as premultiplied
    input: PathBuf,
    /// Premultiplied result to write; an EXR holds 32-bit floats
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Setting by its Blender name, such as key.profile=blender-4.5
    #[arg(long = "set", value_name = "key.NAME=VALUE")]
    settings: Vec<Override>,
}

/// The same with a matte.
#[derive(clap::Args, Debug)]
pub(crate) struct KeyerPictures {
    #[command(flatten)]
    picture: NodePicture,
    /// Matte to write
    #[arg(long, value_name = "FILE")]
    matte: Option<PathBuf>,
}

#[derive(clap::Subcommand, Debug)]
pub(crate) enum NodeCommand {
    /// Key by the angle between colour differences
    ChromaKey {
        #[command(flatten)]
        pictures: KeyerPictures,
        /// Colour of the screen, scene-linear
        #[arg(long, value_name = "R,G,B", value_parser = parse_color)]
        screen: LinearRgb,
    },
    /// Key by one channel against the others
    ChannelKey(KeyerPictures),
    /// Key by the difference from a clean plate
    DifferenceKey {
        #[command(flatten)]
        pictures: KeyerPictures,
        /// Clean plate: the image without the subject
        #[arg(long, value_name = "FILE")]
        clean: PathBuf,
    },
    /// Remove the screen's spill from the subject
    ColorSpill(NodePicture),
    /// Build a plate from points where the screen is visible, like Blender 4.5
    KeyingScreen(KeyingScreenArgs),
}

/// A plate from points.
#[derive(clap::Args, Debug)]
pub(crate) struct KeyingScreenArgs {
    /// Image to sample; the plate gets its size
    input: PathBuf,
    /// Plate to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Point where the screen is visible, pixels from the top left; its colour is that of the image
    /// there
    #[arg(long = "point", value_name = "X,Y", value_parser = parse_pixel, required = true)]
    points: Vec<[usize; 2]>,
    /// Reach of a point's colour, 0 to 1
    #[arg(long, default_value_t = 0.0)]
    smoothness: f64,
}

impl KeyingScreenArgs {
    fn run(&self) -> Result<()> {
        io::check_distinct([&self.input], [&self.output])?;
        let photo: Image<PremulRgba> = io::read(&self.input)?;
        let points = self.points.iter().map(|&at| screen_point(&photo, at));
        let points = points.collect::<Result<Vec<_>>>()?;
        let plate = keying_screen(photo.size(), &points, self.smoothness)?;
        write_picture(&self.output, &plate, canvas_of(&self.input)?)
    }
}

pub(crate) fn run(command: &NodeCommand) -> Result<()> {
    match command {
        NodeCommand::ChromaKey { pictures, screen } => pictures.write_cut_out(|photo, given| {
            let options: ChromaKeyOptions = from_overrides("key", given)?;
            options.check()?;
            Ok(chroma_key(photo, *screen, &options))
        }),
        NodeCommand::DifferenceKey { pictures, clean } => pictures.difference_key(clean),
        NodeCommand::ChannelKey(pictures) => pictures.channel_key(),
        NodeCommand::ColorSpill(picture) => picture.color_spill(),
        NodeCommand::KeyingScreen(args) => args.run(),
    }
}

impl NodePicture {
    fn color_spill(&self) -> Result<()> {
        let photo = self.read_photo(&None)?;
        let options: ColorSpillOptions = from_overrides("key", &self.settings)?;
        options.check()?;
        let spilled = color_spill(&photo, &options);
        write_picture(&self.output, &spilled, canvas_of(&self.input)?)
    }

    /// Fails if the input would be overwritten, or the matte has the same path as the output.
    fn read_photo(&self, matte: &Option<PathBuf>) -> Result<Image<PremulRgba>> {
        io::check_distinct([&self.input], matte.iter().chain([&self.output]))?;
        Ok(io::read(&self.input)?)
    }
}

impl KeyerPictures {
    fn channel_key(&self) -> Result<()> {
        let options: ChannelKeyOptions = from_overrides("key", &self.picture.settings)?;
        options.check()?;
        let keyed = channel_key(&self.picture.read_photo(&self.matte)?, &options);
        self.write_pair(&keyed.cutout, &keyed.matte)
    }

    fn difference_key(&self, clean: &Path) -> Result<()> {
        io::check_distinct([clean], self.matte.iter().chain([&self.picture.output]))?;
        let clean: Image<PremulRgba> = io::read(clean)?;
        self.write_cut_out(|photo, given| {
            let options = from_overrides("key", given)?;
            Ok(difference_key(photo, &clean, &options)?)
        })
    }

    /// Writes the picture multiplied by a matte.
    fn write_cut_out(
        &self,
        matte: impl Fn(&Image<PremulRgba>, &[Override]) -> Result<Image<Coverage>>,
    ) -> Result<()> {
        let photo = self.picture.read_photo(&self.matte)?;
        let matte = matte(&photo, &self.picture.settings)?;
        self.write_pair(&photo.zip_map(&matte, |p, m| p.masked(m)), &matte)
    }

    fn write_pair(&self, cutout: &Image<PremulRgba>, matte: &Image<Coverage>) -> Result<()> {
        let canvas = canvas_of(&self.picture.input)?;
        write_picture(&self.picture.output, cutout, canvas)?;
        write_optional(&self.matte, matte, canvas)
    }
}

/// The colour of the screen at a point where it is visible.
fn screen_point(photo: &Image<PremulRgba>, [x, y]: [usize; 2]) -> Result<ScreenPoint> {
    let (width, height) = photo.size();
    anyhow::ensure!(
        x < width && y < height,
        "--point {x},{y}: outside the picture of {width} x {height} pixels"
    );
    let color = photo[(x, y)].color();
    anyhow::ensure!(
        color.is_finite(),
        "--point {x},{y}: the picture is {:?} there, expected finite numbers",
        color.channels()
    );
    Ok(ScreenPoint {
        at_px: Point2::new(x as f64 + 0.5, y as f64 + 0.5),
        color,
    })
}
