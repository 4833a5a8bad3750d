//! `petcomp dataset ablate`: the paper's datasets, one source of variation switched off in each.

use super::{LongRunConsent, generate_supervised, print_counts};
use crate::documents::RecipeArgs;
use crate::global::GlobalArgs;
use crate::interruption::interruption;
use crate::print;
use petcomp::dataset::{DatasetConfig, Pipeline};
use petcomp::io;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct AblateArgs {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Number of pictures of each dataset; 0 writes the recipes only
    #[arg(short = 'n', long, value_name = "N")]
    count: u64,
    /// Seed of all of them: the same scenes but for what is switched off
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write a folder for each into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    #[command(flatten)]
    consent: LongRunConsent,
}

pub(crate) fn run(args: &AblateArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    for (ablation, config) in args.recipe.read_config()?.ablations() {
        let folder = args.output.join(ablation.name);
        io::create_folder(&folder)?;
        let recipe = folder.join("recipe.toml");
        config.write(&recipe)?;
        print::line(recipe.display());
        if args.count > 0 {
            args.generate(&recipe, &folder.join("dataset"), global)?;
        }
    }
    Ok(())
}

impl AblateArgs {
    fn generate(&self, recipe: &Path, folder: &Path, global: &GlobalArgs) -> anyhow::Result<()> {
        let config = DatasetConfig::read(recipe, &[])?;
        let pipeline = Pipeline::open(config)?.stopped_by(interruption());
        let plan = pipeline.plan(self.count, self.seed, folder)?;
        let counts = generate_supervised(&pipeline, &plan, &self.consent, global)?;
        print_counts(&counts);
        Ok(())
    }
}
