//! `petcomp render`: scene -> picture.

use crate::documents::{SceneArgs, check_picture_target, check_scene_target};
use crate::global::GlobalArgs;
use anyhow::bail;
use petcomp::composite::{self, Aov};
use petcomp::dataset::DatasetConfig;
use petcomp::io::WriteOptions;
use petcomp::io::exr::write_parts;
use petcomp::{DeepImage, Image, LinearRgb, PremulRgba, Quality, Scene, Shot, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Image to write: .png, .jpg (as set in the recipe's `pictures`), .tif (sRGB codes with alpha)
    /// or .exr (scene-linear values with alpha); in a .png or .jpg a scene without a plate is over
    /// black, without alpha
    #[arg(short, long, value_name = "PICTURE")]
    output: PathBuf,
    /// draft, normal or reference: how finely everything is computed; by default as set in the
    /// recipe or the scene
    #[arg(long)]
    quality: Option<Quality>,
    /// Parts of a multi-part .exr: beauty,coverage,shadow,id,depth,position,uv,cryptomatte,layers;
    /// the Cryptomatte comes first, where Blender finds it
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    aov: Vec<Aov>,
    /// Also write the image as displayed
    #[arg(long, value_name = "PNG")]
    preview: Option<PathBuf>,
    /// Also write the scene with everything solved, which renders without a recipe
    #[arg(long, value_name = "SCENE")]
    resolved: Option<PathBuf>,
}

pub(crate) fn run(args: &RenderArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    args.check_targets()?;
    io::check_distinct(args.scene.files(), args.targets())?;
    let scene = args.scene.read_scene()?;
    let pipeline = args
        .scene
        .open_pipeline(&scene, args.quality, args.targets())?;
    let (scene, shot) = pipeline
        .resolve(scene)
        .map_err(|e| e.in_file(&args.scene.path))?;
    let (deep, frame) = pipeline.shoot(&scene, &shot);
    let options = pipeline.config().pictures.middle_options();
    args.write_frame(&deep, &shot, &frame, &options)?;
    let ((w, h), objects) = (frame.size(), scene.objects.len());
    args.write_resolved(scene, pipeline.config())?;
    global.print_written(&args.output, format_args!("{w} x {h}, {objects} objects"));
    Ok(())
}

impl RenderArgs {
    /// Rejects invalid output paths before anything is rendered.
    fn check_targets(&self) -> anyhow::Result<()> {
        if !self.aov.is_empty() && !io::has_extension(&self.output, "exr") {
            let path = self.output.display();
            bail!("{path}: parts need the extension .exr");
        }
        let mut pictures = self.preview.iter().chain([&self.output]);
        pictures.try_for_each(|path| check_picture_target(path))?;
        let mut scenes = self.resolved.iter();
        scenes.try_for_each(|path| check_scene_target(path))?;
        Ok(())
    }

    /// The files to write.
    fn targets(&self) -> impl Iterator<Item = &PathBuf> {
        let extras = self.preview.iter().chain(&self.resolved);
        extras.chain([&self.output])
    }

    fn write_frame(
        &self,
        deep: &DeepImage,
        shot: &Shot,
        frame: &Image<PremulRgba>,
        options: &WriteOptions,
    ) -> petcomp::Result<()> {
        if self.aov.is_empty() {
            write_picture(&self.output, frame, options)?;
        } else {
            self.write_parts(deep, shot, frame)?;
        }
        self.write_preview(frame, options)
    }

    fn write_preview(
        &self,
        frame: &Image<PremulRgba>,
        options: &WriteOptions,
    ) -> petcomp::Result<()> {
        match &self.preview {
            Some(path) => io::write_with(path, &displayed(frame), options),
            None => Ok(()),
        }
    }

    fn write_resolved(&self, scene: Scene, config: &DatasetConfig) -> petcomp::Result<()> {
        let Some(path) = &self.resolved else {
            return Ok(());
        };
        io::write_document(path, &config.with_files(scene, path)?)
    }

    fn write_parts(
        &self,
        deep: &DeepImage,
        shot: &Shot,
        frame: &Image<PremulRgba>,
    ) -> petcomp::Result<()> {
        let parts = composite::parts(&self.aov, deep, shot, frame);
        write_parts(&self.output, frame.size(), &parts)
    }
}

fn write_picture(
    path: &Path,
    frame: &Image<PremulRgba>,
    options: &WriteOptions,
) -> petcomp::Result<()> {
    let with_alpha = ["exr", "tif", "tiff"];
    match with_alpha.iter().any(|end| io::has_extension(path, end)) {
        true => io::write_with(path, frame, options),
        false => io::write_with(path, &displayed(frame), options),
    }
}

/// The picture over black.
fn displayed(frame: &Image<PremulRgba>) -> Image<LinearRgb> {
    frame.map(PremulRgba::color)
}
