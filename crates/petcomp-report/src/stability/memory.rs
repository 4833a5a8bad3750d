//! Memory use of a case, as reported by Linux; none on other systems.

use super::Outcome;
use crate::machine::{BYTES_PER_GIB, bytes_in};
use std::fs;

/// A failed outcome if less than `needed_gib` are available without swapping.
pub(super) fn shortage(needed_gib: f64) -> Option<Outcome> {
    let free = gib_of("/proc/meminfo", "MemAvailable").filter(|free| *free < needed_gib)?;
    Some(Outcome::failed(format!(
        "skipped: only {free:.1} GiB are free"
    )))
}

/// Runs `call` and measures the peak memory of the process meanwhile, GiB.
pub(super) fn peak_gib<T>(call: impl FnOnce() -> T) -> (T, Option<f64>) {
    // 5 resets the high-water mark to the current resident memory.
    let reset = fs::write("/proc/self/clear_refs", "5").ok();
    let result = call();
    let peak = reset.and_then(|()| gib_of("/proc/self/status", "VmHWM"));
    (result, peak)
}

/// A line `Name:   123 kB` of a file, GiB.
fn gib_of(file: &str, name: &str) -> Option<f64> {
    let text = fs::read_to_string(file).ok()?;
    Some(bytes_in(&text, name)? / BYTES_PER_GIB)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_held_shows_even_when_it_is_gone() {
        let (_, peak) = peak_gib(|| {
            vec![1_u8; 64 << 20]
                .iter()
                .map(|&b| u64::from(b))
                .sum::<u64>()
        });
        assert!(peak.is_none_or(|gib| gib > 64.0 / 1024.0));
    }
}
