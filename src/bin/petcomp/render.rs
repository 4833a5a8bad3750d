//! `petcomp render`: scene -> picture.

use crate::common::{Common, RecipeArgs};
use anyhow::bail;
use petcomp::{LinearRgb, Scene, io};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene, TOML or JSON; what is unknown in it is found out first
    scene: PathBuf,
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Picture to write: .png, .jpg, or .exr for scene-linear values with alpha
    #[arg(short, long, value_name = "PICTURE")]
    output: PathBuf,
    /// Also write the scene with everything found out
    #[arg(long, value_name = "SCENE")]
    resolved: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let scene: Scene = io::read_document(&args.scene)?;
    let sample = args.recipe.studio()?.take(scene).map_err(|e| e.in_file(&args.scene))?;
    match args.output.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("exr") | Some("tif") | Some("tiff") => io::write(&args.output, &sample.frame)?,
        Some("png") | Some("jpg") | Some("jpeg") => {
            io::write(&args.output, &sample.frame.map(|p| -> LinearRgb { p.color() }))?
        }
        _ => bail!("{}: no format for this extension, expected .png, .jpg, .exr or .tif", args.output.display()),
    }
    if let Some(path) = &args.resolved {
        io::write_document(path, &sample.scene)?;
    }
    let (w, h) = sample.frame.size();
    common.say(format_args!("{}: {w} x {h}, {} objects", args.output.display(), sample.scene.objects.len()));
    Ok(())
}
