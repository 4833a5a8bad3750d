//! Every case of `petcomp-report stability` is a named test; those that take long or are known to
//! fail are run by `-- --ignored`.

use libtest_mimic::{Arguments, Failed, Trial};
use petcomp_report::stability::{HardCase, cases};

fn main() {
    // One at a time: some are held to what the whole process takes of memory.
    let args = Arguments {
        test_threads: Some(1),
        ..Arguments::from_args()
    };
    let trials = cases("")
        .unwrap_or_else(|error| panic!("{error}"))
        .into_iter()
        .map(|(stage, case)| trial(stage, case));
    libtest_mimic::run(&args, trials.collect()).exit();
}

fn trial(stage: &str, case: HardCase) -> Trial {
    let (name, report_only) = (format!("{stage}/{}", case.name), case.report_only);
    Trial::test(name, move || held(&case)).with_ignored_flag(report_only)
}

fn held(case: &HardCase) -> Result<(), Failed> {
    let outcome = case.outcome();
    let message = format!(
        "{}; expected: {}; found: {}",
        case.input, case.expectation, outcome.measured
    );
    if outcome.passed {
        Ok(())
    } else {
        Err(message.into())
    }
}
