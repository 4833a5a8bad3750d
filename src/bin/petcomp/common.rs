//! What every subcommand shares: global flags, progress, interruption, and how an error ends the program.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use petcomp::dataset::{Setup, Studio};
use petcomp::io::Override;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Flags that mean the same everywhere.
#[derive(clap::Args)]
pub(crate) struct Common {
    /// Worker threads; 0 is one per core
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0, global = true)]
    threads: usize,
    /// Say nothing but results and errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say more; twice for everything
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
}

impl Common {
    /// Sets up threads and messages; called once.
    pub(crate) fn apply(&self) {
        let level = match (self.quiet, self.verbose) {
            (true, _) => log::LevelFilter::Error,
            (_, 0) => log::LevelFilter::Warn,
            (_, 1) => log::LevelFilter::Info,
            _ => log::LevelFilter::Debug,
        };
        let mut logger = env_logger::Builder::new();
        logger.filter_module("petcomp", level).format(|out, record| {
            use std::io::Write;
            writeln!(out, "{}: {}", record.level().as_str().to_lowercase(), record.args())
        });
        logger.init();
        // Fails only if a pool exists already, and then that pool serves.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build_global();
    }

    /// Prints a result line, unless told to be quiet.
    pub(crate) fn say(&self, line: impl std::fmt::Display) {
        if !self.quiet {
            println!("{line}");
        }
    }

    /// A progress display: a bar on a terminal, plain lines elsewhere, nothing when quiet.
    pub(crate) fn progress(&self, what: &'static str) -> Progress {
        Progress::new(what, self.quiet)
    }
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
    /// Opens the folders that the recipe names.
    pub(crate) fn studio(&self) -> anyhow::Result<Studio> {
        Ok(Studio::open(self.setup()?)?)
    }

    /// What the recipe file says.
    pub(crate) fn setup(&self) -> anyhow::Result<Setup> {
        Ok(Setup::read(&self.recipe, &self.overrides)?)
    }
}

/// How far a long job is.
pub(crate) struct Progress {
    bar: ProgressBar,
    lines: Option<std::sync::Mutex<Instant>>,
    what: &'static str,
}

impl Progress {
    const LINE_EVERY: Duration = Duration::from_secs(10);

    fn new(what: &'static str, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target = if terminal && !quiet { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}  {per_sec}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_message(what);
        let lines = (!terminal && !quiet).then(|| std::sync::Mutex::new(Instant::now()));
        Self { bar, lines, what }
    }

    /// So many steps of so many are done.
    pub(crate) fn at(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.bar.set_position(done);
        let Some(Ok(mut last)) = self.lines.as_ref().map(|l| l.lock()) else { return };
        if last.elapsed() >= Self::LINE_EVERY {
            *last = Instant::now();
            eprintln!("{}: {done} of {total}", self.what);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Turns true at the first Ctrl-C (or SIGTERM), so that a long job can stop between two pictures; the second one ends
/// the program at once.
pub(crate) fn interruption() -> &'static AtomicBool {
    static STOP: AtomicBool = AtomicBool::new(false);
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let handler = || {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(INTERRUPTED.into());
            }
            eprintln!("stopping after the pictures in hand; interrupt again to stop at once");
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            log::warn!("interrupts cannot be caught: {error}");
        }
    });
    &STOP
}

const DATA: u8 = 3;
const FILE: u8 = 4;
const INTERRUPTED: u8 = 130;

/// Prints one line of causes and gives the exit status: 3 for data that cannot be right, 4 for files that cannot be used,
/// 130 after an interruption. (2 is a wrong command line; clap says that.)
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    let line = format!("{error:#}").replace('\n', " ");
    eprintln!("error: {line}");
    ExitCode::from(match error.downcast_ref::<petcomp::Error>() {
        Some(petcomp::Error::File { .. }) => FILE,
        Some(petcomp::Error::Interrupted { .. }) => INTERRUPTED,
        _ => DATA,
    })
}
