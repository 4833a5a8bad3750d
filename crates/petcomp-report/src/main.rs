//! The program `petcomp-report`: measures how good each stage is and writes tables and plots.

mod allocator;
mod command;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use std::process::ExitCode;

/// Measure how good a stage is, on simulated data: tables and plots.
#[derive(Parser)]
#[command(version)]
struct ReportCli {
    #[command(flatten)]
    common: ReportFlags,
    #[command(subcommand)]
    command: command::Command,
}

/// Flags that mean the same for every report.
#[derive(clap::Args)]
pub(crate) struct ReportFlags {
    /// Worker threads; 0 is one per core
    #[arg(
        short = 'j',
        long,
        value_name = "N",
        default_value_t = 0,
        global = true
    )]
    threads: usize,
    /// Print nothing but results and errors
    #[arg(short, long, global = true)]
    quiet: bool,
}

impl ReportFlags {
    /// Prints a line about the work, unless asked to be quiet.
    pub(crate) fn say(&self, line: impl std::fmt::Display) {
        if !self.quiet {
            println!("{line}");
        }
    }

    /// A progress bar on a terminal, nothing elsewhere.
    pub(crate) fn progress(&self, job: &'static str) -> ProgressLine {
        let bar = if self.quiet {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(0)
        };
        let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_message(job);
        ProgressLine(bar)
    }
}

/// How far a measurement is; cleared when dropped.
pub(crate) struct ProgressLine(ProgressBar);

impl ProgressLine {
    /// So many steps of so many are done.
    pub(crate) fn at(&self, done: u64, total: u64) {
        self.0.set_length(total);
        self.0.set_position(done);
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn main() -> ExitCode {
    let cli = ReportCli::parse();
    // Fails only if a pool exists already, and then that pool serves.
    let _ = rayon::ThreadPoolBuilder::new()
        .num_threads(cli.common.threads)
        .build_global();
    match command::run(&cli.command, &cli.common) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
