//! `petcomp-report matte`: the matting methods on photos with known mattes.

use super::TruthArgs;
use crate::ReportFlags;
use petcomp_report::matte;

pub(crate) fn run(args: &TruthArgs, common: &ReportFlags) -> anyhow::Result<()> {
    let summaries = common.with_progress("measuring", |progress| {
        matte::write(&args.truth, &args.output, progress)
    })?;
    println!("{}", matte::table(&summaries).markdown().trim_end());
    common.print_line(format_args!(
        "{}: matte.csv, matte.md, matte.svg and matte.html",
        args.output.display()
    ));
    Ok(())
}
