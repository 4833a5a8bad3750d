//! Python programs that datasets are written for: `$PETCOMP_PYTHON` (or `python3`) is asked for them.

use std::io::Write as _;
use std::path::Path;
use std::process::Command;

/// Runs a check of `tests/formats.py`; says so where Python or the package is missing.
pub(crate) fn check(name: &str, package: &str, folder: &Path) {
    let python = std::env::var_os("PETCOMP_PYTHON").unwrap_or_else(|| "python3".into());
    let has = Command::new(&python)
        .args(["-c", &format!("import {package}")])
        .output();
    if !has.is_ok_and(|out| out.status.success()) {
        // Not by `eprintln!`, which only failing tests show.
        let _ = writeln!(
            std::io::stderr(),
            "skipped: {} has no {package}; `make formats` fetches it",
            python.display()
        );
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats.py");
    let out = Command::new(&python)
        .arg(script)
        .arg(name)
        .arg(folder)
        .output()
        .unwrap();
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(
        out.status.success(),
        "{}{}",
        said(&out.stdout),
        said(&out.stderr)
    );
    eprintln!("{}", said(&out.stdout));
}
