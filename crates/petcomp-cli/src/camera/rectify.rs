//! `petcomp camera rectify`: a metric top view, and the way back into the photo.

use super::solve::{accepted, solved};
use crate::values::parse_metres;
use petcomp::camera::{self, Camera, LabelledPhoto, Solution};
use petcomp::filter::Pyramid;
use petcomp::{LinearRgb, PremulRgba, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct RectifyArgs {
    /// Photo (with --back, the result has its size)
    photo: PathBuf,
    /// Label of the photo
    label: PathBuf,
    /// Image to write
    #[arg(short, long)]
    output: PathBuf,
    /// Pixels per metre of the top view; by default those of the photo at the centre of the
    /// rectangle
    #[arg(long, value_name = "N", conflicts_with = "back")]
    px_per_metre: Option<f64>,
    /// Project this image onto the rectangle instead, as the photo would show it
    #[arg(long, value_name = "PICTURE")]
    back: Option<PathBuf>,
    /// Width and height of the rectangle, metres, for labels that do not state them
    #[arg(long, value_name = "WxH", value_parser = parse_metres)]
    size: Option<[f64; 2]>,
    /// Use the camera even if it does not fit its label
    #[arg(long)]
    force: bool,
}

/// Writes the photo as a top view, or another picture as the photo's camera sees it on the surface.
pub(super) fn write_view(args: &RectifyArgs) -> anyhow::Result<()> {
    let inputs = [&args.photo, &args.label].into_iter().chain(&args.back);
    io::check_distinct(inputs, [&args.output])?;
    let labelled = read_only(&args.label, args.size)?;
    let solution = accepted(solved(&labelled)?, &labelled, args.force)?;
    let camera = solution.camera.resized(args.photo_size(&labelled)?);
    match &args.back {
        Some(picture) => args.write_projected(picture, &camera, &solution),
        None => args.write_top_view(&camera, &solution),
    }
}

impl RectifyArgs {
    /// The size of the photo, which may be a reduced copy of the label's.
    fn photo_size(&self, labelled: &LabelledPhoto) -> anyhow::Result<[u32; 2]> {
        let header = io::read_header(&self.photo)?;
        header.check_square_pixels(&self.photo)?;
        let (size, [w, h]) = (
            [header.width as u32, header.height as u32],
            labelled.label.image_size(),
        );
        anyhow::ensure!(
            camera::have_same_shape(size, [w, h]),
            "{}: {} x {} pixels, expected the shape of the label's {w} x {h}",
            self.photo.display(),
            header.width,
            header.height
        );
        Ok(size)
    }

    fn write_projected(
        &self,
        picture: &Path,
        camera: &Camera,
        solution: &Solution,
    ) -> anyhow::Result<()> {
        let picture = Pyramid::new(io::read::<PremulRgba>(picture)?);
        let projected = camera::project_picture(&picture, camera, solution.k1(), solution.size);
        Ok(io::write(&self.output, &projected)?)
    }

    fn write_top_view(&self, camera: &Camera, solution: &Solution) -> anyhow::Result<()> {
        let of_photo = || px_per_metre_of_photo(camera, solution);
        let px_per_metre = self.px_per_metre.unwrap_or_else(of_photo);
        let photo = Pyramid::new(io::read::<LinearRgb>(&self.photo)?);
        let view = camera::rectify(&photo, camera, solution.k1(), solution.size, px_per_metre)?;
        Ok(io::write(&self.output, &view)?)
    }
}

/// At the rectangle's centre, for a photo that may be a reduced copy of the label's.
fn px_per_metre_of_photo(camera: &Camera, solution: &Solution) -> f64 {
    let [photo, label] = [camera, &solution.camera].map(|camera| f64::from(camera.image[0]));
    solution.fit.px_per_metre * photo / label
}

/// The only label of a file.
fn read_only(path: &Path, size: Option<[f64; 2]>) -> anyhow::Result<LabelledPhoto> {
    let labels = camera::read_labels(path, size)?;
    let count = labels.len();
    match <[LabelledPhoto; 1]>::try_from(labels) {
        Ok([only]) => Ok(only),
        Err(_) => anyhow::bail!("{}: {count} labels, expected one", path.display()),
    }
}
