//! `petcomp capture`: an object on a luminous display.

use crate::global::GlobalArgs;
use crate::output::folder_parser;
use crate::values::parse_pixel_size;
use anyhow::Context;
use petcomp::capture::{Display, Frame, write_frames};
use std::path::PathBuf;

#[derive(clap::Subcommand)]
pub(crate) enum CaptureCommand {
    /// Write frames to show on a tablet or monitor under the object, and a page that steps through
    /// them; pass photos of them to `petcomp asset add --captured`
    Frames(FramesArgs),
}

#[derive(clap::Args)]
pub(crate) struct FramesArgs {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
    /// Size of the frames, pixels, 400 to 16384 per side; preferably the display's native
    /// resolution, so that nothing is scaled
    #[arg(long, value_name = "WxH", value_parser = parse_pixel_size)]
    size: [u32; 2],
    /// Width of the image on the display, metres, measured with a ruler; can be given later, to
    /// `asset add`
    #[arg(long, value_name = "METRES", conflicts_with = "diagonal")]
    width: Option<f64>,
    /// Or: diagonal of the image on the display, inches
    #[arg(long, value_name = "INCHES")]
    diagonal: Option<f64>,
    /// Also write sixteen frames of stripes, which measure how the object refracts light
    #[arg(long)]
    stripes: bool,
}

const METRES_IN_INCH: f64 = 0.0254;

pub(crate) fn run(command: &CaptureCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        CaptureCommand::Frames(args) => args.write(global),
    }
}

impl FramesArgs {
    fn write(&self, global: &GlobalArgs) -> anyhow::Result<()> {
        let page = write_frames(&self.output, &self.display()?, self.stripes)?;
        let frames = Frame::all(self.stripes).count();
        global.print_written(&self.output, format_args!("{frames} frames"));
        global.print_look_at(&page);
        Ok(())
    }

    fn display(&self) -> anyhow::Result<Display> {
        let display = Display {
            size_px: self.size,
            width: self.width,
        };
        display.check()?;
        self.diagonal.map_or(Ok(display), |inches| {
            with_diagonal(display, inches).with_context(|| format!("--diagonal {inches}"))
        })
    }
}

/// A display of known resolution whose picture has this diagonal.
fn with_diagonal(display: Display, inches: f64) -> petcomp::Result<Display> {
    let width = Display::width_of_diagonal(display.size_px, METRES_IN_INCH * inches);
    let display = Display {
        width: Some(width),
        ..display
    };
    display.check()?;
    Ok(display)
}
