//! Memory of a whole process, and points measured in a process of their own.

use super::{ScaleCase, ScalePoint};
use crate::machine::bytes_in;
use petcomp::{Error, Result};
use std::path::Path;
use std::process::{Command, Output};

/// A point as printed by another process.
pub(super) fn run_in_child(program: &Path, case: &ScaleCase, seconds: f64) -> Result<ScalePoint> {
    let case = serde_json::to_string(case).map_err(|e| Error::file(program, e))?;
    let output = Command::new(program)
        .args(["scale", "--case", &case, "--seconds", &seconds.to_string()])
        .output()
        .map_err(|e| Error::file(program, format!("cannot be run: {e}")))?;
    printed_point(&output).map_err(|what| Error::file(program, format!("{case}: {what}")))
}

fn printed_point(output: &Output) -> std::result::Result<ScalePoint, String> {
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{}: {}", output.status, message.trim()));
    }
    serde_json::from_slice(&output.stdout).map_err(|e| format!("printed no point: {e}"))
}

/// Peak resident memory of this process, bytes.
pub(super) fn peak_bytes() -> Result<f64> {
    let path = Path::new("/proc/self/status");
    let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e))?;
    bytes_in(&text, "VmHWM").ok_or_else(|| Error::file(path, "no VmHWM in it"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::cpu_seconds;

    #[test]
    fn work_of_threads_that_have_ended_counts() {
        let before = cpu_seconds();
        let work = || {
            std::hint::black_box((0..3_000_000_u64).fold(0, |sum, n| sum ^ std::hint::black_box(n)))
        };
        std::thread::spawn(work).join().unwrap();
        assert!(cpu_seconds() > before + 1e-4);
    }

    #[test]
    fn a_program_that_prints_no_point_is_named() {
        let case = super::super::grid::DEFAULT_PICTURE;
        let message = |program: &str| {
            run_in_child(Path::new(program), &case, 1.0)
                .unwrap_err()
                .to_string()
        };
        assert!(message("/nowhere/petcomp").contains("cannot be run"));
        assert!(
            message("/bin/true").contains("printed no point")
                && message("/bin/false").contains("640")
        );
    }
}
