//! `petcomp-report flags`: whether a wrong cut-out says so.

use super::TruthArgs;
use crate::ReportFlags;
use petcomp_report::flags;

pub(crate) fn run(args: &TruthArgs, common: &ReportFlags) -> anyhow::Result<()> {
    let progress = common.progress("cutting out");
    let table = flags::write(&args.truth, &args.output, |done, of| progress.at(done, of))?;
    drop(progress);
    println!("{}", table.markdown().trim_end());
    common.say(format_args!(
        "{}: flags.csv and flags.md",
        args.output.display()
    ));
    Ok(())
}
