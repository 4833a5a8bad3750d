//! Every case of `petcomp report stability` is a named test; those that take long are run by `-- --ignored`.

use libtest_mimic::{Arguments, Failed, Trial};
use petcomp::report::stability::{Case, cases};

fn main() {
    // One at a time: some are held to what the whole process takes of memory.
    let args = Arguments { test_threads: Some(1), ..Arguments::from_args() };
    let trials =
        cases("").unwrap_or_else(|error| panic!("{error}")).into_iter().map(|(stage, case)| trial(stage, case));
    libtest_mimic::run(&args, trials.collect()).exit();
}

fn trial(stage: &str, case: Case) -> Trial {
    let (name, long) = (format!("{stage}/{}", case.name), case.long);
    Trial::test(name, move || held(&case)).with_ignored_flag(long)
}

fn held(case: &Case) -> Result<(), Failed> {
    let outcome = case.outcome();
    let told = format!("{}; expected: {}; found: {}", case.input, case.expectation, outcome.measured);
    if outcome.passed { Ok(()) } else { Err(told.into()) }
}
