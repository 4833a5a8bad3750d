//! `petcomp camera init` and `markers`: labels for photos.

use super::outside::warn_of_outside;
use crate::documents::{shell_word, stem_of};
use crate::global::GlobalArgs;
use crate::values::{parse_corners, parse_metres};
use petcomp::camera::{self, Label};
use petcomp::{Error, Image, LinearRgb, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct InitLabelArgs {
    /// Photo
    photo: PathBuf,
    /// Width and height of the rectangle, metres: 0.56x0.37
    #[arg(long, value_name = "WxH", value_parser = parse_metres, required_unless_present = "like")]
    size: Option<[f64; 2]>,
    /// Corners of the rectangle, pixels, "x,y x,y x,y x,y": top left, top right, bottom right,
    /// bottom left
    #[arg(long, value_name = "CORNERS", value_parser = parse_corners)]
    corners: Option<[[f64; 2]; 4]>,
    /// Label of another photo of the same rectangle: its surface, markers and camera name are
    /// copied, lens and crop too if the photos have the same size, and the markers detected
    #[arg(long, value_name = "LABEL")]
    like: Option<PathBuf>,
    /// Label to write; by default NAME.label.json next to the photo
    #[arg(short, long, value_name = "LABEL")]
    output: Option<PathBuf>,
    /// Overwrite an existing label
    #[arg(long)]
    force: bool,
}

#[derive(clap::Args)]
pub(crate) struct MarkersArgs {
    /// Photo
    photo: PathBuf,
    /// Label with the markers' family, size and positions: the photo's own, or that of another
    /// photo of the same rectangle, from which the same is copied as by `camera init --like`
    #[arg(long, value_name = "LABEL")]
    map: PathBuf,
    /// Label to write
    #[arg(short, long, value_name = "LABEL")]
    output: PathBuf,
}

pub(super) fn init_label(args: &InitLabelArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let path = args.output_path();
    args.check_is_free(&path)?;
    io::check_distinct(args.like.iter().chain([&args.photo]), [&path])?;
    let label = args.with_markers(args.known_label(&path)?)?;
    io::write_text(&path, &camera::commented(&label)?)?;
    warn_of_outside(path.display(), &label);
    let corners = args.describe_corners(marker_corners(&label));
    let word = shell_word(&path);
    global.print_written(
        &path,
        format_args!("{corners}; then `petcomp camera solve {word}`"),
    );
    Ok(())
}

impl InitLabelArgs {
    /// The given file, or `photos/bg.label.json` for `photos/bg.jpg`.
    fn output_path(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| {
            let name = format!("{}.label.json", stem_of(&self.photo));
            self.photo.with_file_name(name)
        })
    }

    fn check_is_free(&self, path: &Path) -> petcomp::Result<()> {
        match self.force || !path.exists() {
            true => Ok(()),
            false => Err(Error::file(path, "already exists; --force replaces it")),
        }
    }

    /// What is known without looking at the photo's pixels.
    fn known_label(&self, path: &Path) -> petcomp::Result<Label> {
        let like = self.like.as_deref().map(camera::read_label).transpose()?;
        let mut label = camera::init_label(&self.photo, path, like.as_ref())?;
        if let Some([w, h]) = self.size {
            (label.surface.width_m, label.surface.height_m) = (Some(w), Some(h));
        }
        camera::check_size(&label)?;
        label.surface.corners_px = self.corners;
        Ok(label)
    }

    /// The label with the corners of its markers; if its own corners are given, the markers are
    /// optional.
    fn with_markers(&self, label: Label) -> petcomp::Result<Label> {
        if label.markers.is_none() {
            return Ok(label);
        }
        let photo: Image<LinearRgb> = io::read(&self.photo)?;
        match camera::with_markers(label.clone(), &photo) {
            Err(why) if self.corners.is_some() => {
                log::warn!("{}: {why}", self.photo.display());
                Ok(label)
            }
            found => found.map_err(|why| self.needs_corners(&why)),
        }
    }

    fn needs_corners(&self, why: &Error) -> Error {
        let what = format!("{why}; give the rectangle with --corners instead");
        Error::file(&self.photo, what)
    }

    /// The source of the corners, for a photo with `found` marker corners.
    fn describe_corners(&self, found: usize) -> String {
        match (self.corners, found) {
            (_, 1..) => format!("{found} marker corners found"),
            (Some(_), _) => "corners as given".into(),
            _ => {
                "fill in surface.corners_px (top left, top right, bottom right, bottom left)".into()
            }
        }
    }
}

pub(super) fn add_markers(args: &MarkersArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    // The map may be the label to write: then the markers are added to it.
    io::check_distinct([&args.photo], [&args.output])?;
    let label = args.known_label()?;
    let photo: Image<LinearRgb> = io::read(&args.photo)?;
    let label = camera::with_markers(label, &photo).map_err(|e| e.in_file(&args.map))?;
    io::write_json(&args.output, &label)?;
    let found = marker_corners(&label);
    global.print_written(&args.output, format_args!("{found} marker corners"));
    Ok(())
}

impl MarkersArgs {
    /// The map's label if it belongs to this photo, otherwise a new one with what photos share.
    fn known_label(&self) -> petcomp::Result<Label> {
        let mut map = camera::read_label(&self.map)?;
        let new = camera::init_label(&self.photo, &self.output, Some(&map))?;
        if is_same_file(&self.map.with_file_name(&map.image.file), &self.photo) {
            map.image.file = new.image.file;
            return Ok(map);
        }
        Ok(new)
    }
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    let [a, b] = [a, b].map(Path::canonicalize);
    a.is_ok_and(|a| b.is_ok_and(|b| a == b))
}

fn marker_corners(label: &Label) -> usize {
    let points = label.points.iter();
    points.filter(|point| point.is_marker_corner()).count()
}
