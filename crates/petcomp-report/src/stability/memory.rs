//! How much memory a case takes, as Linux reports it; nothing elsewhere.

use super::Outcome;
use std::fs;

const KIB_PER_GIB: f64 = 1024.0 * 1024.0;

/// Memory that is free without swapping, GiB.
pub(super) fn available_gib() -> Option<f64> {
    gib_of("/proc/meminfo", "MemAvailable")
}

/// A failed outcome where less than `needed_gib` are free.
pub(super) fn shortage(needed_gib: f64) -> Option<Outcome> {
    let free = available_gib().filter(|free| *free < needed_gib)?;
    Some(Outcome::failed(format!(
        "not tried: {free:.1} GiB are free"
    )))
}

/// Runs `call` and measures the peak memory of the process meanwhile, GiB.
pub(super) fn peak_gib<T>(call: impl FnOnce() -> T) -> (T, Option<f64>) {
    let reset = reset_peak();
    let result = call();
    let peak = reset.and_then(|()| gib_of("/proc/self/status", "VmHWM"));
    (result, peak)
}

fn reset_peak() -> Option<()> {
    // 5 sets the high-water mark back to what is resident now.
    fs::write("/proc/self/clear_refs", "5").ok()
}

/// A line `Name:   123 kB` of a file, GiB.
fn gib_of(file: &str, name: &str) -> Option<f64> {
    let text = fs::read_to_string(file).ok()?;
    let kib: f64 = text
        .lines()
        .find_map(|line| kib_after(line, name))?
        .parse()
        .ok()?;
    Some(kib / KIB_PER_GIB)
}

fn kib_after<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let value = line.strip_prefix(name)?.strip_prefix(':')?;
    value.trim().strip_suffix(" kB")
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
