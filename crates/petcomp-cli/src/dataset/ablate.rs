//! `petcomp dataset ablate`: datasets of the same scenes that differ in one switch of the recipe,
//! the paper's or any other.

use super::{LongRunConsent, generate_supervised, print_counts};
use crate::documents::RecipeArgs;
use crate::global::GlobalArgs;
use crate::interruption::interruption;
use crate::output::folder_parser;
use crate::print;
use anyhow::Context;
use petcomp::Error;
use petcomp::dataset::{DatasetConfig, Pipeline, Plan};
use petcomp::io::{self, Override};
use petcomp::scene::Draws;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct AblateArgs {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Recipe value that one of the datasets overrides, in addition to a dataset with the unchanged
    /// recipe; may be repeated. By default the paper's datasets: one source of variation switched
    /// off in each
    #[arg(long = "switch", value_name = "KEY=VALUE")]
    switches: Vec<Override>,
    /// Number of images in each dataset; 0 writes only the recipes
    #[arg(short = 'n', long, value_name = "N")]
    count: u64,
    /// Seed of all datasets: their scenes differ only in what is switched off
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder for a subfolder per dataset
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
    #[command(flatten)]
    consent: LongRunConsent,
}

pub(crate) fn run(args: &AblateArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let datasets = args.datasets()?;
    for (name, config) in &datasets {
        check_recipe(&args.output.join(name), config)?;
    }
    for (name, config) in &datasets {
        write_recipe(&args.output.join(name), config)?;
    }
    // All are opened before any is generated, so that an invalid switch is reported at once. One at
    // a time, since each may take a quarter of the memory.
    for (name, _) in &datasets {
        args.opened(name)?;
    }
    for (name, _) in &datasets {
        print::line(recipe_in(&args.output.join(name)).display());
        if let Some((pipeline, plan)) = args.opened(name)? {
            let counts = generate_supervised(&pipeline, &plan, &args.consent, global)?;
            print_counts(&counts);
        }
    }
    Ok(())
}

fn recipe_in(folder: &Path) -> PathBuf {
    folder.join("recipe.toml")
}

fn dataset_in(folder: &Path) -> PathBuf {
    folder.join("dataset")
}

/// Fails if a dataset was started with another recipe than the one to be written next to it.
fn check_recipe(folder: &Path, config: &DatasetConfig) -> petcomp::Result<()> {
    let (recipe, dataset) = (recipe_in(folder), dataset_in(folder));
    if !dataset.exists() || !recipe.exists() || config.is_written(&recipe)? {
        return Ok(());
    }
    let what = format!(
        "differs from this run, and {} was started with it; ablate into a new folder, or delete the file if only folders were moved",
        dataset.display()
    );
    Err(Error::file(recipe, what))
}

fn write_recipe(folder: &Path, config: &DatasetConfig) -> petcomp::Result<()> {
    io::create_folder(folder)?;
    config.write(recipe_in(folder))
}

impl AblateArgs {
    /// Names, which are those of the folders, and recipes.
    fn datasets(&self) -> anyhow::Result<Vec<(String, DatasetConfig)>> {
        let base = self.recipe.read_config()?;
        if self.switches.is_empty() {
            let paper = base.ablations();
            return Ok(paper
                .map(|(ablation, config)| (ablation.name.into(), config))
                .collect());
        }
        check_folders(&self.switches)?;
        let switched = self.switches.iter().map(|switch| {
            let config = self.recipe.read_config_with(switch)?;
            Ok((folder_name(switch), config))
        });
        [Ok(("all".into(), base))]
            .into_iter()
            .chain(switched)
            .collect()
    }

    /// The pipeline and plan of the dataset with this name; none if only recipes are written.
    fn opened(&self, name: &str) -> anyhow::Result<Option<(Pipeline, Plan)>> {
        let planned = (self.count > 0).then(|| self.planned(&self.output.join(name)));
        planned.transpose().with_context(|| name.to_owned())
    }

    fn planned(&self, folder: &Path) -> petcomp::Result<(Pipeline, Plan)> {
        let config = DatasetConfig::read(recipe_in(folder), &[])?;
        let pipeline = Pipeline::open(config)?.stopped_by(interruption());
        let plan = pipeline.plan(self.count, self.seed, dataset_in(folder))?;
        Ok((pipeline, plan))
    }
}

/// Fails if two switches would have the same folder.
fn check_folders(switches: &[Override]) -> petcomp::Result<()> {
    let mut known = BTreeMap::new();
    for switch in switches {
        if let Some(first) = known.insert(folder_name(switch), switch) {
            let what =
                format!("{switch}, which would use the folder of {first}, expected another switch");
            return Err(Error::value("--switch", what));
        }
    }
    Ok(())
}

/// Maximum number of bytes of a switch in its folder's name; file systems allow 255.
const MAX_NAME: usize = 100;

/// The switch without characters that file names cannot have everywhere; if it is long, or has
/// other characters, it ends in its hash.
fn folder_name(switch: &Override) -> String {
    let switch = switch.to_string();
    let short = switch.replace(", ", ",").replace('"', "");
    let name = plain_name(&short);
    if name == short && name.len() <= MAX_NAME {
        return name;
    }
    let hash = Draws::new(0, 0).bits(&switch);
    format!("{}-{hash:016x}", &name[..name.len().min(MAX_NAME)])
}

/// Replaces everything but plain ASCII characters.
fn plain_name(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "._-=,[]".contains(c);
    text.chars()
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_named_for_its_switch() {
        let name = |switch: &str| folder_name(&switch.parse().unwrap());
        assert_eq!(name("scene.objects=[4, 12]"), "scene.objects=[4,12]");
        assert_eq!(
            name("scene.finish.noise=\"match_plate\""),
            "scene.finish.noise=match_plate"
        );
    }

    #[test]
    fn switches_of_other_letters_have_folders_of_their_own() {
        let switch = |value: &str| -> Override { format!("a=\"{value}\"").parse().unwrap() };
        let switches = ["x/b", "x#b", "x b", "xb", "xé", "xö"].map(switch);
        assert!(check_folders(&switches).is_ok());
        assert!(folder_name(&switches[0]).starts_with("a=x_b-"));
        let alike = ["a=1".parse().unwrap(), switch("1")];
        assert_eq!(
            check_folders(&alike).unwrap_err().to_string(),
            "--switch: a=\"1\", which would use the folder of a=1, expected another switch"
        );
    }

    #[test]
    fn long_switches_have_short_names_of_their_own() {
        let name =
            |last: &str| folder_name(&format!("a={}{last}", "é".repeat(300)).parse().unwrap());
        assert!(name("1").len() <= 120);
        assert_ne!(name("1"), name("2"));
    }
}
