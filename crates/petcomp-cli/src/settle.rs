//! `petcomp settle`: dropped objects come to rest.

use crate::documents::{check_picture_target, check_scene_target, read_options};
use crate::global::GlobalArgs;
use petcomp::dataset::DatasetConfig;
use petcomp::settle::{SettleOptions, Settled, preview, settle_traced, trace_csv};
use petcomp::{Quality, Scene, io};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct SettleArgs {
    /// Scene file (TOML or JSON)
    scene: PathBuf,
    /// Scene file to write; its extension selects TOML or JSON
    #[arg(short, long, value_name = "SCENE")]
    output: PathBuf,
    /// TOML file with settle options, used instead of the scene's own settings or the defaults
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
    /// draft, normal or reference: how finely the fall is computed; by default as set in the
    /// options
    #[arg(long)]
    quality: Option<Quality>,
    /// CSV file for the path of every object that may touch another: about one line per object and
    /// 1/60 second
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Image of the objects at rest to write, from above and from the side
    #[arg(long, value_name = "FILE")]
    preview: Option<PathBuf>,
}

/// Lines of the trace for each second and object.
const TRACE_RATE: f64 = 60.0;

pub(crate) fn run(args: &SettleArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    args.check_targets()?;
    io::check_distinct(args.options.iter().chain([&args.scene]), args.targets())?;
    let scene: Scene = io::read_document(&args.scene)?;
    let options = args.options_for(&scene)?;
    let settled = args.settle(scene, &options)?;
    let (seconds, rejected) = (settled.seconds, settled.rejected.len());
    let rest = args.write_rest(settled.into_scene()?)?;
    if let Some(path) = &args.preview {
        io::write(path, &preview(&rest, &options))?;
    }
    let what = format!("at rest after {seconds:.2} s, {rejected} attempts rejected");
    global.print_written(&args.output, what);
    Ok(())
}

impl SettleArgs {
    /// Rejects invalid output paths before anything falls.
    fn check_targets(&self) -> petcomp::Result<()> {
        check_scene_target(&self.output)?;
        let mut pictures = self.preview.iter();
        pictures.try_for_each(|path| check_picture_target(path))?;
        let mut texts = self.trace.iter();
        texts.try_for_each(|path| io::check_folder_of(path))
    }

    /// The files to write.
    fn targets(&self) -> impl Iterator<Item = &PathBuf> {
        let extras = self.trace.iter().chain(&self.preview);
        extras.chain([&self.output])
    }

    /// Lets the objects fall and writes the trace, even of a failed fall: it shows what went wrong.
    fn settle(&self, scene: Scene, options: &SettleOptions) -> petcomp::Result<Settled> {
        let (settled, samples) = settle_traced(scene, options, self.trace_interval(options))
            .map_err(|e| e.in_file(&self.scene))?;
        if let Some(path) = &self.trace {
            io::write_text(path, &trace_csv(&samples))?;
        }
        Ok(settled)
    }

    /// Simulation steps between lines of the trace; 0 without a trace.
    fn trace_interval(&self, options: &SettleOptions) -> usize {
        match self.trace {
            Some(_) => (1.0 / (TRACE_RATE * options.step)).round().max(1.0) as usize,
            None => 0,
        }
    }

    /// Writes the scene at rest, with the paths of its files relative to its new location.
    fn write_rest(&self, mut scene: Scene) -> petcomp::Result<Scene> {
        if let Some(files) = &scene.files {
            scene.files = Some(files.moved(&self.scene, &self.output)?);
        }
        io::write_document(&self.output, &scene)?;
        Ok(scene)
    }

    fn options_for(&self, scene: &Scene) -> petcomp::Result<SettleOptions> {
        let options = self.given_options(scene)?;
        Ok(match self.quality {
            Some(quality) => quality.settle(options),
            None => options,
        })
    }

    /// The options of the given file, or the scene's own.
    fn given_options(&self, scene: &Scene) -> petcomp::Result<SettleOptions> {
        match &self.options {
            Some(path) => read_options(Some(path), SettleOptions::check),
            None => self.scene_options(scene),
        }
    }

    /// The options from the scene's own settings.
    fn scene_options(&self, scene: &Scene) -> petcomp::Result<SettleOptions> {
        let config = DatasetConfig::from_settings(&scene.settings, &[]);
        Ok(config.map_err(|e| e.in_file(&self.scene))?.scene.settle)
    }
}
