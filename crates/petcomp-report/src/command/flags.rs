//! `petcomp-report flags`: whether a wrong cut-out is flagged.

use super::TruthArgs;
use crate::ReportFlags;
use petcomp_report::flags;

pub(crate) fn run(args: &TruthArgs, common: &ReportFlags) -> anyhow::Result<()> {
    let table = common.with_progress("cutting out", |progress| {
        flags::write(&args.truth, &args.output, progress)
    })?;
    println!("{}", table.markdown().trim_end());
    let folder = args.output.display();
    common.print_line(format_args!("{folder}: flags.csv and flags.md"));
    Ok(())
}
