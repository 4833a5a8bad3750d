//! `petcomp render`: scene -> picture.

use crate::common::{Common, SceneArgs};
use anyhow::bail;
use petcomp::composite::{self, Aov};
use petcomp::io::exr::write_parts;
use petcomp::{Image, LinearRgb, PremulRgba, Quality, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Picture to write: .png, .jpg, or .exr for scene-linear values with alpha
    #[arg(short, long, value_name = "PICTURE")]
    output: PathBuf,
    /// draft, normal or reference: how finely everything is computed; by default as the recipe or the scene's settings say
    #[arg(long)]
    quality: Option<Quality>,
    /// Parts of a multi-part .exr: beauty,coverage,shadow,id,depth,position,uv,cryptomatte,layers
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    aov: Vec<Aov>,
    /// Also write the picture as it is displayed
    #[arg(long, value_name = "PNG")]
    preview: Option<PathBuf>,
    /// Also write the scene with everything solved, to be rendered without a recipe
    #[arg(long, value_name = "SCENE")]
    resolved: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let scene = args.scene.read()?;
    let mut config = args.scene.config_for(&scene)?;
    if let Some(quality) = args.quality {
        config = quality.config(config);
    }
    let pipeline = petcomp::dataset::Pipeline::open_for(config, &scene)?;
    let (scene, shot) = pipeline
        .resolve(scene)
        .map_err(|e| e.in_file(&args.scene.path))?;
    let (deep, frame) = pipeline.shoot(&scene, &shot);
    match args.aov.as_slice() {
        [] => write(&args.output, &frame)?,
        aovs => {
            if extension(&args.output) != "exr" {
                bail!("{}: parts need a file called .exr", args.output.display());
            }
            write_parts(
                &args.output,
                frame.size(),
                &composite::parts(aovs, &deep, &shot, &frame),
            )?;
        }
    }
    if let Some(path) = &args.preview {
        io::write(path, &displayed(&frame))?;
    }
    if let Some(path) = &args.resolved {
        let scene = pipeline.config().with_files(scene.clone(), path)?;
        io::write_document(path, &scene)?;
    }
    let (w, h) = frame.size();
    common.say(format_args!(
        "{}: {w} x {h}, {} objects",
        args.output.display(),
        scene.objects.len()
    ));
    Ok(())
}

fn write(path: &Path, frame: &Image<PremulRgba>) -> anyhow::Result<()> {
    match extension(path).as_str() {
        "exr" | "tif" | "tiff" => io::write(path, frame)?,
        "png" | "jpg" | "jpeg" => io::write(path, &displayed(frame))?,
        _ => bail!(
            "{}: no format for this extension, expected .png, .jpg, .exr or .tif",
            path.display()
        ),
    }
    Ok(())
}

/// The picture over black.
fn displayed(frame: &Image<PremulRgba>) -> Image<LinearRgb> {
    frame.map(PremulRgba::color)
}

fn extension(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default()
}
