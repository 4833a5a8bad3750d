//! `petcomp-report render`: the renderer compared with Cycles and with the quadrature of its
//! definition.

use crate::ReportFlags;
use petcomp_report::render::{self, RenderReportOptions};

pub(crate) fn run(options: &RenderReportOptions, common: &ReportFlags) -> anyhow::Result<()> {
    let (table, golden_pictures) = render::write(options)?;
    println!("{}", table.markdown());
    common.print_line(format_args!(
        "{}: render.csv, render.md, render.svg; {golden_pictures} golden pictures",
        options.output.display()
    ));
    Ok(())
}
