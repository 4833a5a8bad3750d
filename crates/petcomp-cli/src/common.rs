//! What every subcommand shares: global flags, progress, interruption, and how an error ends the program.

use crate::print;
use clap::builder::RangedU64ValueParser;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use petcomp::dataset::{DatasetConfig, Pipeline};
use petcomp::io::{Fallback, LimitOverride, Limits, Override, ReadOptions};
use petcomp::{Diagnostic, Result, Scene, Severity, io, printable};
use serde::de::DeserializeOwned;
use std::io::{IsTerminal, Write as _};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Flags that mean the same everywhere: explained once, in `petcomp --help`.
#[derive(clap::Args)]
#[command(next_help_heading = GLOBAL_HEADING)]
pub(crate) struct Common {
    /// Worker threads, at most 1024; 0 is one per core
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0, global = true, value_parser = count(0..=1024))]
    threads: usize,
    /// Say nothing but results and errors: no progress, no notes, no warnings
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// How to show how far a long job is: `bar` (lines where there is no terminal) or `json`, an object a line on the
    /// standard error
    #[arg(long, value_name = "HOW", default_value = "bar", global = true)]
    progress: Shown,
    /// Say more; twice for everything
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Let pictures and documents ask for more, or less: side=65536, pixels=512M, decoded_bytes=4G, seconds=60,
    /// document_bytes=64M, ...
    #[arg(long = "limit", value_name = "NAME=N", global = true)]
    limits: Vec<LimitOverride>,
    /// What reads pictures that petcomp's own decoders do not know
    #[arg(long, value_enum, default_value_t, global = true)]
    oiio: OpenImageIo,
}

const GLOBAL_HEADING: &str = "Global options";

/// The same program, its global options a line at the end of every subcommand's help.
pub(crate) fn with_short_help(program: clap::Command) -> clap::Command {
    let global: Vec<clap::Arg> = program
        .get_arguments()
        .filter(|arg| arg.is_global_set())
        .cloned()
        .collect();
    let names: Vec<String> = global.iter().map(flag).collect();
    let line = format!(
        "{GLOBAL_HEADING} (see `petcomp --help`): {}",
        names.join(", ")
    );
    program.mut_subcommands(|command| shortened(command, &global, &line))
}

/// What clap would copy from the program is there already, and hidden.
fn shortened(command: clap::Command, global: &[clap::Arg], line: &str) -> clap::Command {
    let hidden = global.iter().map(|arg| arg.clone().hide(true));
    command
        .args(hidden)
        .after_help(line.to_owned())
        .mut_subcommands(|inner| shortened(inner, global, line))
}

/// `-j` or, where it has no letter, `--limit`.
fn flag(arg: &clap::Arg) -> String {
    let long = || arg.get_long().map(|long| format!("--{long}"));
    arg.get_short()
        .map(|short| format!("-{short}"))
        .or_else(long)
        .unwrap_or_default()
}

/// A number of things within a range: more of them would take days, or all of the memory.
pub(crate) fn count(range: RangeInclusive<u64>) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(range)
}

/// Where OpenImageIO runs.
#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum OpenImageIo {
    /// In a sandboxed process of its own
    #[default]
    Worker,
    /// The same, and no such picture is read where the system lacks Landlock or seccomp for its sandbox
    WorkerStrict,
    /// In this process: a damaged file may crash it (needs a build with the feature in-process-oiio)
    InProcess,
    /// Not at all
    Off,
}

impl OpenImageIo {
    fn fallback(self) -> anyhow::Result<Fallback> {
        match self {
            Self::Worker => Ok(Fallback::Worker),
            Self::WorkerStrict => Ok(Fallback::StrictWorker),
            Self::Off => Ok(Fallback::Nothing),
            #[cfg(feature = "in-process-oiio")]
            Self::InProcess => Ok(Fallback::InProcess(petcomp::io::oiio::in_process())),
            #[cfg(not(feature = "in-process-oiio"))]
            Self::InProcess => anyhow::bail!(
                "--oiio in-process: this petcomp does not link OpenImageIO; build it with `--features in-process-oiio`"
            ),
        }
    }
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Shown {
    Bar,
    Json,
}

impl Common {
    /// Sets up threads, messages and what is read; called once.
    pub(crate) fn apply(&self) -> anyhow::Result<()> {
        let level = match (self.quiet, self.verbose) {
            (true, _) => log::LevelFilter::Error,
            (_, 0) => log::LevelFilter::Warn,
            (_, 1) => log::LevelFilter::Info,
            _ => log::LevelFilter::Debug,
        };
        let mut logger = env_logger::Builder::new();
        logger
            .filter_module("petcomp", level)
            .format(|out, record| {
                writeln!(
                    out,
                    "{}: {}",
                    record.level().as_str().to_lowercase(),
                    printable(&record.args().to_string())
                )
            });
        logger.init();
        // Fails only if a pool exists already, and then that pool serves.
        let _ = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build_global();
        let limits = self
            .limits
            .iter()
            .try_fold(Limits::default(), Limits::with)?;
        let options = ReadOptions {
            limits,
            fallback: self.oiio.fallback()?,
            ..Default::default()
        };
        Ok(options.make_default()?)
    }

    /// Nothing but results and errors is asked for.
    pub(crate) fn quiet(&self) -> bool {
        self.quiet
    }

    /// Prints a line about the work (what was written, what to look at), unless told to be quiet. What a command is called
    /// to find out goes through [`print`] instead.
    pub(crate) fn say(&self, line: impl std::fmt::Display) {
        if !self.quiet {
            print::line(line);
        }
    }

    /// Prints a warning, unless told to be quiet.
    pub(crate) fn warn(&self, line: impl std::fmt::Display) {
        if !self.quiet {
            print::aside(format_args!("warning: {line}"));
        }
    }

    /// A progress display: a bar on a terminal, plain lines elsewhere, nothing when quiet; or JSON, asked for or not.
    pub(crate) fn progress(&self, what: &'static str) -> Progress {
        Progress::new(what, self.quiet, self.progress)
    }
}

/// Logs what a stage noticed about a file: `FILE: message [code]`, a note at the level of notes.
pub(crate) fn report_diagnostics(file: &Path, diagnostics: &[Diagnostic]) {
    for diagnostic in diagnostics {
        let level = match diagnostic.severity {
            Severity::Note => log::Level::Info,
            _ => log::Level::Warn,
        };
        let (file, code) = (file.display(), diagnostic.code);
        log::log!(level, "{file}: {diagnostic} [{code}]");
    }
}

/// Options from a TOML file, or the defaults where there is none.
pub(crate) fn options_file<T: Default + DeserializeOwned>(file: Option<&Path>) -> Result<T> {
    file.map_or_else(|| Ok(T::default()), io::read_toml)
}

/// A recipe file, and values in it that are to be different.
#[derive(clap::Args)]
pub(crate) struct RecipeArgs {
    /// Recipe file (TOML): names the folders of assets and backgrounds, and what to draw
    #[arg(value_name = "RECIPE")]
    recipe: PathBuf,
    /// Replace a value of the recipe: scene.objects=[4,12]
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
}

impl RecipeArgs {
    /// Reads the recipe.
    pub(crate) fn config(&self) -> anyhow::Result<DatasetConfig> {
        Ok(DatasetConfig::read(&self.recipe, &self.overrides)?)
    }

    /// Opens the folders that the recipe names.
    pub(crate) fn pipeline(&self) -> anyhow::Result<Pipeline> {
        Ok(Pipeline::open(self.config()?)?)
    }
}

/// A scene file, and where the files that it names are.
#[derive(clap::Args)]
pub(crate) struct SceneArgs {
    /// Scene, TOML or JSON; what is unknown in it is solved first
    #[arg(value_name = "SCENE")]
    pub(crate) path: PathBuf,
    /// Recipe file (TOML) that names the folders of assets and backgrounds; by default the scene's own `[files]` does
    #[arg(value_name = "RECIPE")]
    recipe: Option<PathBuf>,
    /// Replace a value of the recipe or of the scene's settings: render.subsamples=8
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<Override>,
}

impl SceneArgs {
    pub(crate) fn read(&self) -> anyhow::Result<Scene> {
        Ok(io::read_document(&self.path)?)
    }

    /// The recipe's config or, without a recipe, that which the scene brings.
    pub(crate) fn config_for(&self, scene: &Scene) -> anyhow::Result<DatasetConfig> {
        Ok(match &self.recipe {
            Some(recipe) => DatasetConfig::read(recipe, &self.overrides)?,
            None => DatasetConfig::for_scene(scene, &self.path, &self.overrides)?,
        })
    }
}

/// How far a long job is.
pub(crate) struct Progress {
    bar: ProgressBar,
    /// On a terminal; elsewhere there are lines, or nothing.
    drawn: bool,
    lines: Option<std::sync::Mutex<Lines>>,
    what: &'static str,
}

/// Progress that is told in lines.
struct Lines {
    json: bool,
    every: Duration,
    /// When the job began, and how many steps were done then.
    began: Option<(Instant, u64)>,
    last: Instant,
}

impl Progress {
    const LINE_EVERY: Duration = Duration::from_secs(10);
    const JSON_EVERY: Duration = Duration::from_secs(1);

    fn new(what: &'static str, quiet: bool, shown: Shown) -> Self {
        let (terminal, json) = (std::io::stderr().is_terminal(), shown == Shown::Json);
        let drawn = terminal && !quiet && !json;
        // Of no length yet, it would be drawn full.
        let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::hidden());
        let style =
            ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}  {per_sec}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_message(what);
        let every = if json {
            Self::JSON_EVERY
        } else {
            Self::LINE_EVERY
        };
        let lines = Lines {
            json,
            every,
            began: None,
            last: Instant::now(),
        };
        let told = json || (!terminal && !quiet);
        Self {
            bar,
            drawn,
            lines: told.then(|| std::sync::Mutex::new(lines)),
            what,
        }
    }

    /// So many steps of so many are done; the first call tells what was done before.
    pub(crate) fn at(&self, done: u64, total: u64) {
        if self.bar.length() != Some(total) {
            self.bar.set_length(total);
            self.bar.set_position(done);
            self.bar.reset_eta();
            if self.drawn {
                self.bar.set_draw_target(ProgressDrawTarget::stderr());
            }
        }
        self.bar.set_position(done);
        if let Some(Ok(mut lines)) = self.lines.as_ref().map(|lines| lines.lock()) {
            lines.at(self.what, done, total);
        }
    }
}

impl Lines {
    fn at(&mut self, what: &str, done: u64, total: u64) {
        let first = self.began.is_none();
        let (began, before) = *self.began.get_or_insert((Instant::now(), done));
        if !(self.json && (first || done == total)) && self.last.elapsed() < self.every {
            return;
        }
        self.last = Instant::now();
        let rate = done.saturating_sub(before) as f64 / began.elapsed().as_secs_f64().max(1e-9);
        let left = total.saturating_sub(done) as f64 / rate;
        // JSON has no infinity: what is not known yet is null.
        if self.json {
            let (rate, left) = (
                rate.is_finite().then_some(rate),
                left.is_finite().then_some(left),
            );
            print::aside(
                serde_json::json!({ "job": what, "done": done, "of": total, "per_s": rate, "left_s": left }),
            );
        } else if rate > 0.0 {
            print::aside(format_args!(
                "{what}: {done} of {total}, {rate:.1} a second, {left:.0} s left"
            ));
        } else {
            print::aside(format_args!("{what}: {done} of {total}"));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// From the first Ctrl-C (or SIGTERM) to the end of the program at the latest: schedulers kill after 10 s and more.
const GRACE: Duration = Duration::from_secs(8);

/// Turns true at the first Ctrl-C (or SIGTERM), so that a long job can stop between two pictures. What has not ended by
/// itself after [`GRACE`] is ended in the middle, as the second signal ends it at once: every file is whole or not there,
/// so the same command goes on.
pub(crate) fn interruption() -> &'static AtomicBool {
    static STOP: AtomicBool = AtomicBool::new(false);
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let handler = || {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(INTERRUPTED.into());
            }
            std::thread::spawn(|| {
                std::thread::sleep(GRACE);
                std::process::exit(INTERRUPTED.into());
            });
            print::aside(format_args!(
                "stopping after the pictures in hand, in {} s at the latest; the same command goes on; interrupt again to \
                 stop at once",
                GRACE.as_secs()
            ));
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            log::warn!("interrupts cannot be caught: {error}");
        }
    });
    &STOP
}

/// Files of which some could not be used, while the run went on.
#[derive(Default)]
pub(crate) struct Batch {
    files: usize,
    failed: usize,
}

impl Batch {
    /// Counts a file; one that could not be used is named at once.
    pub(crate) fn count(&mut self, outcome: anyhow::Result<()>) {
        self.files += 1;
        if let Err(error) = outcome {
            self.failed += 1;
            print::aside(format_args!("failed: {error:#}"));
        }
    }

    /// # Errors
    /// [`Incomplete`] when any file failed.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        match self.failed {
            0 => Ok(()),
            _ => Err(Incomplete(self).into()),
        }
    }
}

/// The rest was done.
pub(crate) struct Incomplete(Batch);

impl std::fmt::Display for Incomplete {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} of {} files could not be used; the rest is done",
            self.0.failed, self.0.files
        )
    }
}

impl std::fmt::Debug for Incomplete {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Incomplete {}

/// Everything was done, and `--strict` asked for a failure where a person should look.
#[derive(Debug)]
pub(crate) struct NeedsReview(pub(crate) String);

impl std::fmt::Display for NeedsReview {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NeedsReview {}

const NEEDS_REVIEW: u8 = 1;
const INCOMPLETE: u8 = 2;
const DATA: u8 = 3;
pub(crate) const FILE: u8 = 4;
const INTERRUPTED: u8 = 130;

/// Prints one line of causes and gives the exit status: 1 where `--strict` found something to review, 2 where some of many
/// files could not be used, 3 for data that cannot be right, 4 for files that cannot be used, 130 after an interruption. (2 is a wrong command line too; clap says that.)
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    print::aside(format_args!("error: {error:#}"));
    if error.is::<NeedsReview>() {
        return ExitCode::from(NEEDS_REVIEW);
    }
    if error.is::<Incomplete>() {
        return ExitCode::from(INCOMPLETE);
    }
    ExitCode::from(match error.downcast_ref::<petcomp::Error>() {
        Some(petcomp::Error::File { .. }) => FILE,
        Some(petcomp::Error::Interrupted { .. }) => INTERRUPTED,
        _ => DATA,
    })
}
