//! `petcomp scene`: recipe -> scene.

use crate::common::{Common, RecipeArgs};
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
            let scene = args.recipe.studio()?.draw(args.seed, args.index)?;
            io::write_document(&args.output, &scene)?;
            common.say(format_args!("{}: {} objects over {}", args.output.display(), scene.objects.len(), scene.plate));
        }
        Command::Check { scene: path } => {
            let scene: Scene = io::read_document(path)?;
            scene.check().map_err(|e| e.in_file(path))?;
            common.say(format_args!("{}: possible", path.display()));
        }
    }
    Ok(())
}
