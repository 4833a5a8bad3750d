//! Time and memory of a whole process, and points that are measured in one of their own.

use super::{ScaleCase, ScalePoint};
use petcomp::{Error, Result};
use rustix::time::{ClockId, clock_gettime};
use std::path::Path;
use std::process::Command;

/// A point as another process tells it.
pub(super) fn in_a_child(program: &Path, case: &ScaleCase, seconds: f64) -> Result<ScalePoint> {
    let failed = |what: String| Error::file(program, what);
    let case = serde_json::to_string(case).map_err(|e| failed(e.to_string()))?;
    let mut command = Command::new(program);
    command.args(["scale", "--case", &case, "--seconds", &seconds.to_string()]);
    let out = command
        .output()
        .map_err(|e| failed(format!("cannot be run: {e}")))?;
    if !out.status.success() {
        return Err(failed(format!(
            "{case}: {}: {}",
            out.status,
            String::from_utf8_lossy(&out.stderr).trim()
        )));
    }
    serde_json::from_slice(&out.stdout).map_err(|e| failed(format!("{case}: told no point: {e}")))
}

/// Seconds that processors have worked for this process, all of its threads, those that have ended too.
pub(super) fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Most memory that was ever resident in this process, bytes.
pub(super) fn peak_bytes() -> Result<f64> {
    let path = Path::new("/proc/self/status");
    let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e))?;
    peak_kilobytes(&text)
        .map(|kilobytes| kilobytes * 1024.0)
        .ok_or_else(|| Error::file(path, "no VmHWM in it"))
}

fn peak_kilobytes(status: &str) -> Option<f64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn the_peak_is_found_by_its_name() {
        assert_eq!(
            peak_kilobytes("VmPeak:\t 9 kB\nVmHWM:\t  1234 kB\n"),
            Some(1234.0)
        );
        assert_eq!(peak_kilobytes("VmPeak:\t 9 kB\n"), None);
    }

    #[test]
    fn a_program_that_tells_no_point_is_named() {
        let case = super::super::grid::USUAL;
        let told = |program: &str| {
            in_a_child(Path::new(program), &case, 1.0)
                .unwrap_err()
                .to_string()
        };
        assert!(told("/nowhere/petcomp").contains("cannot be run"));
        assert!(told("/bin/true").contains("told no point") && told("/bin/false").contains("640"));
    }
}
