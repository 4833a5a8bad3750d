//! `petcomp dataset init` and `explain`: recipes to write and to understand.

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
    /// Write a recipe file that explains every default
    Init(InitRecipeArgs),
    /// Print every draw that image K is made with
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
    /// Number of the image
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

/// Makes the image to know which of its scenes came to rest, and prints the draws of that one.
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
        print::line(format_args!("# rejected a scene: {reason}"));
    }
    if !provenance.rejected.is_empty() {
        let seed = provenance.scene_seed;
        print::line(format_args!("# what follows was drawn with seed {seed}"));
    }
}

fn print_draws(provenance: &Provenance) {
    print_rows(&draw_rows(provenance));
}

fn draw_rows(provenance: &Provenance) -> Vec<DrawRow<'_>> {
    let draws = provenance.draws.iter();
    draws
        .map(|draw| DrawRow::new(draw, &provenance.drawn))
        .collect()
}

/// A draw as it is printed.
struct DrawRow<'a> {
    path: &'a str,
    /// The distribution.
    from: String,
    /// The value, and the name of what a choice chose.
    outcome: String,
}

impl<'a> DrawRow<'a> {
    fn new(draw: &'a Drawn, scene: &Scene) -> Self {
        Self {
            path: &draw.path,
            from: draw.from.to_string(),
            outcome: format!("{}  {}", draw.value, chosen_name(draw, scene)),
        }
    }
}

/// Prints draws in columns.
fn print_rows(rows: &[DrawRow]) {
    let paths = rows.iter().map(|row| row.path.len()).max().unwrap_or(0);
    let froms = rows.iter().map(|row| row.from.len()).max().unwrap_or(0);
    for DrawRow {
        path,
        from,
        outcome,
    } in rows
    {
        let line = format!("{path:paths$}  {from:froms$}  {outcome}");
        print::line(line.trim_end());
    }
}

/// The name of what a choice chose.
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
