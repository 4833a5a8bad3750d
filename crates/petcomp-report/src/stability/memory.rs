//! How much memory a case takes, as Linux tells it; nothing elsewhere.

use std::fs;

const KIB_PER_GIB: f64 = 1024.0 * 1024.0;

/// What can be had without swapping, GiB.
pub(super) fn available_gib() -> Option<f64> {
    line("/proc/meminfo", "MemAvailable")
}

/// Runs `call` and tells what the process held at most meanwhile, GiB.
pub(super) fn peak_gib<T>(call: impl FnOnce() -> T) -> (T, Option<f64>) {
    // 5 sets the high-water mark back to what is resident now.
    let reset = fs::write("/proc/self/clear_refs", "5");
    let result = call();
    let peak = reset.ok().and_then(|()| line("/proc/self/status", "VmHWM"));
    (result, peak)
}

/// A line `Name:   123 kB` of a file, GiB.
fn line(file: &str, name: &str) -> Option<f64> {
    let text = fs::read_to_string(file).ok()?;
    let rest = text
        .lines()
        .find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    rest.trim()
        .strip_suffix(" kB")?
        .parse()
        .ok()
        .map(|kib: f64| kib / KIB_PER_GIB)
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
