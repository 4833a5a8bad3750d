//! What the measurements were made on.

use petcomp::plot::Table;
use std::path::Path;

const KIB_PER_GIB: f64 = 1024.0 * 1024.0;

/// The machine and the versions of what runs on it; what cannot be found out is left out, and so is an empty date.
pub(super) fn machine(date: &str) -> Table {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut table = Table::new(["what", "value"]);
    let rows = [
        ("petcomp", Some(env!("CARGO_PKG_VERSION").to_owned())),
        ("processor", line_of("/proc/cpuinfo", "model name")),
        ("cores", Some(cores.to_string())),
        (
            "memory",
            line_of("/proc/meminfo", "MemTotal").and_then(|text| gib(&text)),
        ),
        (
            "system",
            line_of("/etc/os-release", "PRETTY_NAME").map(|name| name.trim_matches('"').to_owned()),
        ),
        (
            "kernel",
            std::fs::read_to_string("/proc/sys/kernel/osrelease")
                .ok()
                .map(|text| text.trim().to_owned()),
        ),
        ("OpenImageIO", openimageio()),
        (
            "date",
            Some(date.to_owned()).filter(|date| !date.is_empty()),
        ),
    ];
    rows.into_iter()
        .filter_map(|(what, value)| Some([what.to_owned(), value?]))
        .for_each(|row| table.push(row));
    table
}

/// What stands behind the first line of a file that begins with a name, and a `:` or `=`.
fn line_of(path: impl AsRef<Path>, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    let value = text.lines().find_map(|line| {
        line.strip_prefix(name)?
            .trim_start()
            .strip_prefix([':', '='])
    })?;
    Some(value.trim().to_owned())
}

fn gib(kib: &str) -> Option<String> {
    let kib: f64 = kib.split_whitespace().next()?.parse().ok()?;
    Some(format!("{:.1} GiB", kib / KIB_PER_GIB))
}

fn openimageio() -> Option<String> {
    petcomp::io::worker_version().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_by_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("info");
        std::fs::write(
            &path,
            "MemTotalFoo: 1\nMemTotal:  2097152 kB\nPRETTY_NAME=\"A B\"\n",
        )
        .unwrap();
        assert_eq!(
            line_of(&path, "MemTotal").and_then(|t| gib(&t)),
            Some("2.0 GiB".into())
        );
        assert_eq!(line_of(&path, "PRETTY_NAME"), Some("\"A B\"".into()));
        assert_eq!(
            (
                line_of(&path, "nothing"),
                line_of("nowhere", "a"),
                gib("much")
            ),
            (None, None, None)
        );
    }

    #[test]
    fn a_date_is_there_only_if_it_is_given() {
        let has_date = |date: &str| machine(date).rows.iter().any(|row| row[0] == "date");
        assert!(has_date("today") && !has_date(""));
    }
}
