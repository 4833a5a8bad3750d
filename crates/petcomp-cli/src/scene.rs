//! `petcomp scene`: recipe -> scene.

use crate::common::{Common, RecipeArgs};
use crate::print;
use petcomp::scene::cycles;
use petcomp::{Scene, io};
use std::path::PathBuf;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Draw scene K of a recipe
    Draw(Draw),
    /// Check that a scene file is possible
    Check {
        /// Scene, TOML or JSON
        scene: PathBuf,
    },
    /// Write a scene for another renderer: JSON, plate and textures that Blender renders with one more command
    Export(Export),
}

#[derive(clap::Args)]
pub(crate) struct Export {
    /// Scene, TOML or JSON; what is unknown in it is solved first
    scene: PathBuf,
    #[command(flatten)]
    recipe: RecipeArgs,
    /// The other renderer
    #[arg(long, value_name = "RENDERER")]
    to: Renderer,
    /// Folder to write
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Renderer {
    /// Blender's path tracer, by the script that makes our golden references
    Cycles,
}

#[derive(clap::Args)]
pub(crate) struct Draw {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Seed of the dataset
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of the scene
    #[arg(short = 'k', long, default_value_t = 0, value_name = "K")]
    index: u64,
    /// Scene to write, TOML or JSON by its extension
    #[arg(short, long, value_name = "SCENE")]
    output: PathBuf,
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Draw(args) => {
            let pipeline = args.recipe.pipeline()?;
            let scene = pipeline.draw(args.seed, args.index)?;
            let scene = pipeline.config().with_files(scene, &args.output)?;
            io::write_document(&args.output, &scene)?;
            common.say(format_args!(
                "{}: {} objects over {}",
                args.output.display(),
                scene.objects.len(),
                scene.plate
            ));
        }
        Command::Check { scene: path } => {
            let scene: Scene = io::read_document(path)?;
            scene.check().map_err(|e| e.in_file(path))?;
            print::line(format_args!("{}: possible", path.display()));
        }
        Command::Export(args) => export(args, common)?,
    }
    Ok(())
}

fn export(args: &Export, common: &Common) -> anyhow::Result<()> {
    let scene: Scene = io::read_document(&args.scene)?;
    let Renderer::Cycles = args.to;
    let (scene, shot) = args
        .recipe
        .pipeline()?
        .resolve(scene)
        .map_err(|e| e.in_file(&args.scene))?;
    cycles::export(&shot, scene.surface.size, &args.folder)?;
    let folder = args.folder.display();
    common.say(format_args!(
        "{folder}: {} cards; render it with",
        shot.cards.len()
    ));
    common.say(format_args!(
        "  blender -b --factory-startup --python-use-system-env -P {folder}/{} -- \
         {folder}/scene.json --out {folder}/cycles --preview",
        cycles::SCRIPT
    ));
    Ok(())
}
