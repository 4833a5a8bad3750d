//! `petcomp scene`: recipe -> scene.

use crate::documents::{RecipeArgs, read_scene};
use crate::global::GlobalArgs;
use crate::output::folder_parser;
use crate::print;
use petcomp::dataset::{DatasetConfig, Pipeline};
use petcomp::scene::{Card, EdgeTreatment, PostProcess, cycles};
use petcomp::{LinearRgb, Scene, Shot, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum SceneCommand {
    /// Draw scene K from a recipe
    Draw(DrawArgs),
    /// Check that the values in a scene file are valid, without opening the files it names
    Check {
        /// Scene file (TOML or JSON)
        scene: PathBuf,
    },
    /// Export a scene to another renderer: JSON, plate and textures, which Blender renders with one
    /// more command
    Export(ExportSceneArgs),
}

#[derive(clap::Args)]
pub(crate) struct ExportSceneArgs {
    /// Scene file (TOML or JSON); its unknowns are solved first
    scene: PathBuf,
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Target renderer
    #[arg(long, value_name = "RENDERER")]
    to: Renderer,
    /// Folder to write into
    #[arg(value_name = "FOLDER", value_parser = folder_parser())]
    folder: PathBuf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Renderer {
    /// Blender's path tracer, with the script that renders our golden references
    Cycles,
}

#[derive(clap::Args)]
pub(crate) struct DrawArgs {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Seed of the dataset
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Index of the scene
    #[arg(short = 'k', long, default_value_t = 0, value_name = "K")]
    index: u64,
    /// Scene file to write; its extension selects TOML or JSON
    #[arg(short, long, value_name = "SCENE")]
    output: PathBuf,
}

pub(crate) fn run(command: &SceneCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        SceneCommand::Draw(args) => draw_scene(args, global),
        SceneCommand::Check { scene } => check_scene(scene),
        SceneCommand::Export(args) => export_scene(args, global),
    }
}

fn draw_scene(args: &DrawArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    io::check_distinct([&args.recipe.path], [&args.output])?;
    let pipeline = args.recipe.open_pipeline()?;
    let scene = pipeline.draw(args.seed, args.index)?;
    io::check_distinct(pipeline.input_files(&scene)?, [&args.output])?;
    let scene = pipeline.config().with_files(scene, &args.output)?;
    io::write_document(&args.output, &scene)?;
    let (objects, plate) = (scene.objects.len(), &scene.plate);
    global.print_written(&args.output, format_args!("{objects} objects over {plate}"));
    Ok(())
}

fn check_scene(path: &Path) -> anyhow::Result<()> {
    let scene = read_scene(path)?;
    DatasetConfig::from_settings(&scene.settings, &[]).map_err(|e| e.in_file(path))?;
    print::line(format_args!("{}: valid", path.display()));
    Ok(())
}

fn export_scene(args: &ExportSceneArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let scene = read_scene(&args.scene)?;
    let Renderer::Cycles = args.to;
    let pipeline = Pipeline::open_for(args.recipe.read_config_for(&scene)?, &scene)?;
    let (scene, shot) = pipeline
        .resolve(scene)
        .map_err(|e| e.in_file(&args.scene))?;
    let left_out = left_out(&scene, &shot);
    if !left_out.is_empty() {
        log::warn!("left out of the Cycles render: {}", left_out.join(", "));
    }
    let retouched = petcomp::render::retouched_fully(&shot, &pipeline.config().render);
    cycles::export(&retouched, scene.surface.size, &args.folder)
        .map_err(|e| e.in_file(&args.scene))?;
    let cards = shot.cards.len();
    global.print_written(&args.folder, format_args!("{cards} cards; render it with"));
    global.print_status(format_args!("  {}", blender_command(&args.folder)));
    Ok(())
}

/// What our pictures have and exported ones lack.
fn left_out(scene: &Scene, shot: &Shot) -> Vec<&'static str> {
    let bends = |card: &Card| card.refraction.flows.iter().any(Option::is_some);
    let parts = [
        (shot.light_grid.is_some(), "the light map"),
        (shot.holdout.is_some(), "occlusion by the walls"),
        (shot.motion_m != [0.0; 2], "motion blur"),
        (shot.cards.iter().any(bends), "refraction"),
        (
            shot.interreflection != LinearRgb::grey(shot.interreflection.g),
            "the colour of the interreflection",
        ),
        (shot.edges == EdgeTreatment::Poisson, "Poisson blending"),
        (scene.finish != PostProcess::default(), "the finish"),
    ];
    parts
        .into_iter()
        .filter_map(|(is_there, name)| is_there.then_some(name))
        .collect()
}

fn blender_command(folder: &Path) -> String {
    let (folder, script) = (folder.display(), cycles::SCRIPT);
    format!(
        "blender -b --factory-startup --python-use-system-env -P {folder}/{script} -- \
         {folder}/scene.json --out {folder}/cycles --preview"
    )
}
