//! `petcomp dataset init` and `explain`: writes and explains recipes.

use crate::documents::RecipeArgs;
use crate::global::GlobalArgs;
use crate::print;
use petcomp::asset::Role;
use petcomp::dataset::{DatasetConfig, Provenance};
use petcomp::scene::Drawn;
use petcomp::{Error, Scene, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum RecipeCommand {
    /// Write a recipe file that explains every setting and its default
    Init(InitRecipeArgs),
    /// Print every random draw of image K
    Explain(ExplainArgs),
}

#[derive(clap::Args)]
pub(crate) struct InitRecipeArgs {
    /// File to write
    #[arg(value_name = "RECIPE", default_value = "recipe.toml")]
    recipe: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct ExplainArgs {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Index of the image
    #[arg(short = 'k', long, value_name = "K")]
    index: u64,
    /// Seed of the dataset
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(super) fn run(command: &RecipeCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        RecipeCommand::Init(args) => init_recipe(args, global),
        RecipeCommand::Explain(args) => explain_draws(args),
    }
}

fn check_is_new(recipe: &Path) -> petcomp::Result<()> {
    if !recipe.exists() {
        return Ok(());
    }
    let what = "already exists, expected a new file";
    Err(Error::file(recipe, what))
}

fn init_recipe(args: &InitRecipeArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    check_is_new(&args.recipe)?;
    io::write_text(&args.recipe, DatasetConfig::template())?;
    global.print_status(args.recipe.display());
    Ok(())
}

/// Generates the image, in order to know which of its scenes came to rest, and prints the draws of
/// that one.
fn explain_draws(args: &ExplainArgs) -> anyhow::Result<()> {
    let sample = args.recipe.open_pipeline()?.sample(args.seed, args.index)?;
    if let Some(provenance) = &sample.provenance {
        print_rejected(provenance);
        print_draws(provenance);
    }
    Ok(())
}

fn print_rejected(provenance: &Provenance) {
    for reason in &provenance.rejected {
        print::line(format_args!("# rejected scene: {reason}"));
    }
    if !provenance.rejected.is_empty() {
        let seed = provenance.scene_seed;
        print::line(format_args!("# the scene was drawn with seed {seed}"));
    }
}

/// Prints path, distribution, value and the name of the selected item, in columns.
fn print_draws(provenance: &Provenance) {
    let draws = &provenance.draws;
    let froms: Vec<String> = draws.iter().map(|draw| draw.from.to_string()).collect();
    let path_width = draws.iter().map(|draw| draw.path.len()).max().unwrap_or(0);
    let from_width = froms.iter().map(String::len).max().unwrap_or(0);
    for (draw, from) in draws.iter().zip(&froms) {
        let (path, value) = (&draw.path, draw.value);
        let chosen = chosen_name(draw, &provenance.drawn);
        let line = format!("{path:path_width$}  {from:from_width$}  {value}  {chosen}");
        print::line(line.trim_end());
    }
}

/// The name of the item selected by a draw.
fn chosen_name<'a>(draw: &Drawn, scene: &'a Scene) -> &'a str {
    match chosen_asset(&draw.path) {
        Some((role, i)) => asset_name(scene, role, i),
        None if draw.path == "background" => &scene.plate,
        None => "",
    }
}

/// The asset of the `i`-th object of a role.
fn asset_name(scene: &Scene, role: Role, i: usize) -> &str {
    let mut objects = scene.objects.iter().filter(|object| object.role == role);
    objects.nth(i).map_or("", |object| &object.asset)
}

/// Object 2 of `selection[2].asset`, distractor 0 of `distractors[0].asset`.
fn chosen_asset(path: &str) -> Option<(Role, usize)> {
    let (part, index) = path.strip_suffix("].asset")?.split_once('[')?;
    let role = match part {
        "distractors" => Role::Distractor,
        _ => Role::Object,
    };
    Some((role, index.parse().ok()?))
}
