//! `petcomp report flags`: whether a wrong cut-out says so.

use super::TruthArgs;
use crate::common::Common;
use crate::print;
use petcomp::report::flags;

pub(crate) fn run(args: &TruthArgs, common: &Common) -> anyhow::Result<()> {
    let progress = common.progress("cutting out");
    let table = flags::write(&args.truth, &args.output, |done, of| progress.at(done, of))?;
    drop(progress);
    print::text(table.markdown().trim_end());
    common.say(format_args!(
        "{}: flags.csv and flags.md",
        args.output.display()
    ));
    Ok(())
}
