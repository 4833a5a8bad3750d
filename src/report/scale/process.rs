//! Time and memory of a whole process, and points that are measured in one of their own.

use super::{Case, Point};
use crate::{Error, Result};
use std::path::Path;
use std::process::Command;

/// Unit of the times in `/proc/self/stat`, seconds: 100 ticks a second on every Linux that programs see (`USER_HZ`).
const TICK: f64 = 0.01;

/// A point as another process tells it.
pub(super) fn in_a_child(program: &Path, case: &Case, seconds: f64) -> Result<Point> {
    let failed = |what: String| Error::file(program, what);
    let case = serde_json::to_string(case).map_err(|e| failed(e.to_string()))?;
    let mut command = Command::new(program);
    command.args(["report", "scale", "--case", &case, "--seconds", &seconds.to_string()]);
    let out = command.output().map_err(|e| failed(format!("cannot be run: {e}")))?;
    if !out.status.success() {
        return Err(failed(format!("{case}: {}: {}", out.status, String::from_utf8_lossy(&out.stderr).trim())));
    }
    serde_json::from_slice(&out.stdout).map_err(|e| failed(format!("{case}: told no point: {e}")))
}

/// Seconds that processors have worked for this process, all of its threads, those that have ended too.
pub(super) fn cpu_seconds() -> Result<f64> {
    let path = Path::new("/proc/self/stat");
    let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e))?;
    cpu_ticks(&text).map(|ticks| ticks * TICK).ok_or_else(|| Error::file(path, "no times in it"))
}

/// User and system time: the 14th and 15th field, the second of which is a name in brackets.
fn cpu_ticks(stat: &str) -> Option<f64> {
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some(next()? + next()?)
}

/// Most memory that was ever resident in this process, bytes.
pub(super) fn peak_bytes() -> Result<f64> {
    let path = Path::new("/proc/self/status");
    let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e))?;
    peak_kilobytes(&text).map(|kilobytes| kilobytes * 1024.0).ok_or_else(|| Error::file(path, "no VmHWM in it"))
}

fn peak_kilobytes(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_behind_a_name_with_brackets_and_blanks() {
        let stat = "12 (a) b (c)) R 1 2 3 4 5 6 7 8 9 10 250 50 0 0 20 0 1";
        assert_eq!(cpu_ticks(stat), Some(300.0));
        assert_eq!((cpu_ticks(""), cpu_ticks("1 (a) R 1 2")), (None, None));
    }

    #[test]
    fn the_peak_is_found_by_its_name() {
        assert_eq!(peak_kilobytes("VmPeak:\t 9 kB\nVmHWM:\t  1234 kB\n"), Some(1234.0));
        assert_eq!(peak_kilobytes("VmPeak:\t 9 kB\n"), None);
    }

    #[test]
    fn a_program_that_tells_no_point_is_named() {
        let case = super::super::grid::USUAL;
        let told = |program: &str| in_a_child(Path::new(program), &case, 1.0).unwrap_err().to_string();
        assert!(told("/nowhere/petcomp").contains("cannot be run"));
        assert!(told("/bin/true").contains("told no point") && told("/bin/false").contains("640"));
    }
}
