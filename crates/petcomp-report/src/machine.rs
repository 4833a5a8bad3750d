//! The machine used for the measurements.

use petcomp::plot::Table;
use std::path::Path;

const BYTES_PER_KIB: f64 = 1024.0;
pub(crate) const BYTES_PER_GIB: f64 = 1024.0 * 1024.0 * 1024.0;

/// The machine and the versions of its software; unknown values and an empty date are left out.
pub(super) fn machine_table(date: &str) -> Table {
    let mut table = Table::new(["what", "value"]);
    for (what, value) in properties(date) {
        if let Some(value) = value {
            table.push([what.to_owned(), value]);
        }
    }
    table
}

fn properties(date: &str) -> [(&'static str, Option<String>); 8] {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    [
        ("petcomp", Some(env!("CARGO_PKG_VERSION").to_owned())),
        ("processor", line_of("/proc/cpuinfo", "model name")),
        ("cores", Some(cores.to_string())),
        ("memory", memory()),
        ("system", system_name()),
        ("kernel", kernel_release()),
        ("OpenImageIO", petcomp::io::worker_version().ok()),
        ("date", (!date.is_empty()).then(|| date.to_owned())),
    ]
}

fn memory() -> Option<String> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    bytes_in(&text, "MemTotal").map(gib_text)
}

fn gib_text(bytes: f64) -> String {
    format!("{:.1} GiB", bytes / BYTES_PER_GIB)
}

fn system_name() -> Option<String> {
    let name = line_of("/etc/os-release", "PRETTY_NAME")?;
    Some(name.trim_matches('"').to_owned())
}

fn kernel_release() -> Option<String> {
    let text = std::fs::read_to_string("/proc/sys/kernel/osrelease").ok()?;
    Some(text.trim().to_owned())
}

/// The value in the first line of a file that begins with a name, after a `:` or `=`.
fn line_of(path: impl AsRef<Path>, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    value_in(&text, name).map(str::to_owned)
}

fn value_in<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let mut values = text.lines().filter_map(|line| value_of(line, name));
    values.next().map(str::trim)
}

fn value_of<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let rest = line.strip_prefix(name)?.trim_start();
    rest.strip_prefix([':', '='])
}

/// The value of a line `Name:   123 kB` in a file of Linux's `/proc`, bytes.
pub(crate) fn bytes_in(text: &str, name: &str) -> Option<f64> {
    let kib: f64 = value_in(text, name)?.strip_suffix(" kB")?.parse().ok()?;
    Some(kib * BYTES_PER_KIB)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_by_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("info");
        let text = "MemTotalFoo: 1\nMemTotal:  2097152 kB\nVmHWM:\t  12 kB\nPRETTY_NAME=\"A B\"\n";
        std::fs::write(&path, text).unwrap();
        assert_eq!(line_of(&path, "PRETTY_NAME"), Some("\"A B\"".into()));
        assert_eq!(
            (line_of(&path, "nothing"), line_of("nowhere", "a")),
            (None, None)
        );
        assert_eq!(
            ["MemTotal", "VmHWM", "VmRSS", "MemTotalFoo"].map(|name| bytes_in(text, name)),
            [Some(2.0 * BYTES_PER_GIB), Some(12288.0), None, None]
        );
        assert_eq!(gib_text(2.0 * BYTES_PER_GIB), "2.0 GiB");
    }

    #[test]
    fn a_date_is_there_only_if_it_is_given() {
        let has_date = |date: &str| machine_table(date).rows.iter().any(|row| row[0] == "date");
        assert!(has_date("today") && !has_date(""));
    }
}
