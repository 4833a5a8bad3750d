//! The options that every subcommand has, and what they set up.

use crate::print;
use crate::progress::{ProgressDisplay, ProgressFormat};
use crate::short_help::GLOBAL_HEADING;
use crate::values::count;
use petcomp::io::{Fallback, LimitOverride, Limits, ReadOptions};
use petcomp::printable;
use std::fmt::Display;
use std::io::Write as _;
use std::path::Path;

/// Flags that mean the same everywhere: explained once, in `petcomp --help`.
#[derive(clap::Args)]
#[command(next_help_heading = GLOBAL_HEADING)]
pub(crate) struct GlobalArgs {
    /// Worker threads, at most 1024; 0 means one per core
    #[arg(short = 'j', long, value_name = "N", default_value_t = 0, global = true, value_parser = count(0..=1024))]
    threads: usize,
    /// Print only results and errors: no progress, notes or warnings
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Progress display of long jobs: `bar` (lines if there is no terminal) or `json` (one object
    /// per line on standard error)
    #[arg(long, value_name = "HOW", default_value = "bar", global = true)]
    progress: ProgressFormat,
    /// Print more messages; repeat to print all
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    verbose: u8,
    /// Raise or lower a limit on input images and documents: side=65536, pixels=512M,
    /// decoded_bytes=4G, seconds=60, document_bytes=64M; also channels, ratio, file_bytes,
    /// metadata_bytes, parts, document_depth, memory_percent
    #[arg(long = "limit", value_name = "NAME=N", global = true)]
    limits: Vec<LimitOverride>,
    /// Where OpenImageIO reads images that petcomp's own decoders do not support
    #[arg(long, value_enum, default_value_t, global = true)]
    oiio: OpenImageIo,
}

/// Where OpenImageIO runs.
#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum OpenImageIo {
    /// In a separate sandboxed process
    #[default]
    Worker,
    /// The same, but reject such images if the system lacks Landlock or seccomp for the sandbox
    WorkerStrict,
    /// In this process: a corrupt file may crash it (requires a build with the feature
    /// in-process-oiio)
    InProcess,
    /// Not at all: reject such images
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

impl GlobalArgs {
    /// Sets up threads, messages and read options; called once.
    pub(crate) fn apply(&self) -> anyhow::Result<()> {
        self.start_logger();
        // Fails only if a pool exists already, and then that pool will do.
        let _ = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads)
            .build_global();
        Ok(self.read_options()?.make_default()?)
    }

    fn start_logger(&self) {
        env_logger::Builder::new()
            .filter_module("petcomp", self.log_level())
            .format(|out, record| writeln!(out, "{}", log_line(record)))
            .init();
    }

    fn log_level(&self) -> log::LevelFilter {
        match (self.quiet, self.verbose) {
            (true, _) => log::LevelFilter::Error,
            (_, 0) => log::LevelFilter::Warn,
            (_, 1) => log::LevelFilter::Info,
            _ => log::LevelFilter::Debug,
        }
    }

    fn read_options(&self) -> anyhow::Result<ReadOptions> {
        let mut limits = self.limits.iter();
        Ok(ReadOptions {
            limits: limits.try_fold(Limits::default(), Limits::with)?,
            fallback: self.oiio.fallback()?,
            ..Default::default()
        })
    }

    /// Whether only results and errors are printed.
    pub(crate) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Prints a line about the work (what was written, what to look at), except with `--quiet`. The
    /// results that a command exists for go through [`print`] instead.
    pub(crate) fn print_status(&self, line: impl Display) {
        if !self.quiet {
            print::line(line);
        }
    }

    /// Prints the contents of a written file: `FILE: what`.
    pub(crate) fn print_written(&self, file: &Path, what: impl Display) {
        self.print_status(format_args!("{}: {what}", file.display()));
    }

    /// Tells the user to look at a picture or page.
    pub(crate) fn print_look_at(&self, file: &Path) {
        self.print_status(format_args!("look at {}", file.display()));
    }

    /// A progress display: a bar on a terminal, plain lines elsewhere, nothing when quiet; or JSON,
    /// if requested.
    pub(crate) fn start_progress(&self, job: &'static str) -> ProgressDisplay {
        ProgressDisplay::new(job, self.quiet, self.progress)
    }
}

fn log_line(record: &log::Record<'_>) -> String {
    let message = printable(&record.args().to_string());
    format!("{}: {message}", level_name(record.level()))
}

fn level_name(level: log::Level) -> String {
    match level {
        log::Level::Warn => "warning".into(),
        level => level.as_str().to_lowercase(),
    }
}
