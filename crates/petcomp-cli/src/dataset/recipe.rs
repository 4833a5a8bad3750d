//! `petcomp dataset init` and `explain`: recipes to write and to understand.

use crate::common::{Common, RecipeArgs};
use crate::print;
use petcomp::dataset::{DatasetConfig, Provenance};
use petcomp::scene::Drawn;
use petcomp::{Error, Scene, io};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Init {
    /// File to write
    #[arg(value_name = "RECIPE", default_value = "recipe.toml")]
    recipe: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct Explain {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Number of the image
    #[arg(long, value_name = "K")]
    index: u64,
    /// Seed of the dataset
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(crate) fn init(args: &Init, common: &Common) -> anyhow::Result<()> {
    if args.recipe.exists() {
        return Err(Error::file(&args.recipe, "is there already, expected a new file").into());
    }
    io::write_text(&args.recipe, DatasetConfig::template())?;
    common.say(args.recipe.display());
    Ok(())
}

/// Makes the image to know which of its scenes came to rest, and prints the draws of that one.
pub(crate) fn explain(args: &Explain) -> anyhow::Result<()> {
    let sample = args.recipe.pipeline()?.sample(args.seed, args.index)?;
    sample.provenance.iter().for_each(print_draws);
    Ok(())
}

fn print_draws(provenance: &Provenance) {
    for reason in &provenance.rejected {
        print::line(format_args!("# rejected a scene: {reason}"));
    }
    if !provenance.rejected.is_empty() {
        print::line(format_args!(
            "# what follows was drawn with seed {}",
            provenance.scene_seed
        ));
    }
    let width = |text: &dyn Fn(&Drawn) -> String| {
        provenance
            .draws
            .iter()
            .map(|d| text(d).len())
            .max()
            .unwrap_or(0)
    };
    let (paths, froms) = (width(&|d| d.path.clone()), width(&|d| d.from.to_string()));
    for draw in &provenance.draws {
        let from = draw.from.to_string();
        let line = format!(
            "{:paths$}  {from:froms$}  {}  {}",
            draw.path,
            draw.value,
            chosen(draw, &provenance.drawn)
        );
        print::line(line.trim_end());
    }
}

/// The name of what a choice chose.
fn chosen<'a>(draw: &Drawn, scene: &'a Scene) -> &'a str {
    let object = draw
        .path
        .strip_prefix("selection[")
        .and_then(|rest| rest.strip_suffix("].asset"));
    match object.and_then(|i| i.parse::<usize>().ok()) {
        Some(i) => scene.objects.get(i).map_or("", |object| &object.asset),
        None if draw.path == "background" => &scene.plate,
        None => "",
    }
}
