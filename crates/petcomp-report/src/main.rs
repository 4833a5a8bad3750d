//! The program `petcomp-report`: measures how good each stage is and writes tables and plots.

mod allocator;
mod command;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use std::process::ExitCode;

/// Measure how well each stage works on simulated data; write tables and plots.
#[derive(Parser)]
#[command(version)]
struct ReportCli {
    #[command(flatten)]
    common: ReportFlags,
    #[command(subcommand)]
    command: command::Command,
}

/// Flags common to all reports.
#[derive(clap::Args)]
pub(crate) struct ReportFlags {
    /// Worker threads; 0 means one per core
    #[arg(
        short = 'j',
        long,
        value_name = "N",
        default_value_t = 0,
        global = true
    )]
    pub(crate) threads: usize,
    /// Print only results and errors
    #[arg(short, long, global = true)]
    quiet: bool,
}

impl ReportFlags {
    /// Prints a line about the work, unless `--quiet` is set.
    pub(crate) fn print_line(&self, line: impl std::fmt::Display) {
        if !self.quiet {
            println!("{line}");
        }
    }

    /// Runs `measure`, whose argument shows the number of finished steps and of all steps on a
    /// terminal.
    pub(crate) fn with_progress<T>(
        &self,
        job: &'static str,
        measure: impl FnOnce(&dyn Fn(u64, u64)) -> T,
    ) -> T {
        let bar = self.progress_bar(job);
        let result = measure(&|done, total| {
            bar.set_length(total);
            bar.set_position(done);
        });
        bar.finish_and_clear();
        result
    }

    fn progress_bar(&self, job: &'static str) -> ProgressBar {
        let bar = if self.quiet {
            ProgressBar::hidden()
        } else {
            ProgressBar::new(0)
        };
        bar.set_style(progress_style());
        bar.set_message(job);
        bar
    }
}

fn progress_style() -> ProgressStyle {
    ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}  {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn main() -> ExitCode {
    let cli = ReportCli::parse();
    // Fails only if a pool already exists, which is then used.
    let _ = rayon::ThreadPoolBuilder::new()
        .num_threads(cli.common.threads)
        .build_global();
    cli.run()
}

impl ReportCli {
    fn run(&self) -> ExitCode {
        match command::run(&self.command, &self.common) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("error: {error:#}");
                ExitCode::FAILURE
            }
        }
    }
}
