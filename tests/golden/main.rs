//! Golden cases: every folder `golden/<stage>/<case>/` with a `case.toml` is one named test.

mod camera;
mod case;
mod color;
mod eval;
mod matte;
mod render;

use case::Case;
use libtest_mimic::{Arguments, Trial};
use std::path::Path;

/// A stage's way to run one of its cases.
type Run = fn(&Case) -> Result<(), String>;

/// The stages that have golden cases: folder name and runner.
const STAGES: &[(&str, Run)] = &[
    ("camera", camera::run),
    ("color", color::run),
    ("eval", eval::run),
    ("matte", matte::run),
    ("render", render::run),
];

fn main() {
    let args = Arguments::from_args();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    let trials = STAGES.iter().flat_map(|&(stage, run)| {
        let cases = Case::all(&root.join(stage));
        cases.into_iter().map(move |case| {
            let name = format!("{stage}/{}", case.name);
            Trial::test(name, move || run(&case).map_err(Into::into))
        })
    });
    libtest_mimic::run(&args, trials.collect()).exit();
}
