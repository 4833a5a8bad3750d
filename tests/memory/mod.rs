//! The high-water mark of this process's memory.

use std::fs;

/// A line of `/proc/self/status`, bytes.
fn status(name: &str) -> Option<usize> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text
        .lines()
        .find_map(|l| l.strip_prefix(name)?.strip_prefix(':').map(str::trim))?;
    line.strip_suffix(" kB")?
        .parse()
        .ok()
        .map(|kib: usize| kib * 1024)
}

/// What a call needs at its worst beyond what was there before it, bytes; none where the system
/// does not tell.
pub(crate) fn peak_growth<T>(call: impl FnOnce() -> T) -> Option<usize> {
    // 5 sets the high-water mark back to what is resident now.
    fs::write("/proc/self/clear_refs", "5").ok()?;
    let before = status("VmHWM")?;
    let _kept = call();
    status("VmHWM")?.checked_sub(before)
}
