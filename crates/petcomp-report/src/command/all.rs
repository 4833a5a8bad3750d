//! `petcomp-report all`: all measurements on one page.

use crate::ReportFlags;
use petcomp_report::all::{self, AllOptions};

pub(crate) fn run(options: &AllOptions, common: &ReportFlags) -> anyhow::Result<()> {
    // Extreme cases warn as they should; their results are in the tables.
    log::set_max_level(log::LevelFilter::Error);
    common.with_progress("measuring", |progress| all::write(options, progress))?;
    let page = options.output.join("report.html");
    common.print_line(format_args!("look at {}", page.display()));
    Ok(())
}
