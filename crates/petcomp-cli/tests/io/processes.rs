//! Processes and their memory, as Linux tells of them; none elsewhere.

/// Workers that this process started and that still run.
pub(crate) fn workers() -> Vec<u32> {
    let own = std::process::id().to_string();
    let started_here = |pid: &u32| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        // Behind the name in brackets: state, then the parent.
        let mut rest = stat.rsplit(") ").next().unwrap_or_default().split(' ');
        rest.next() != Some("Z") && rest.next() == Some(&own) && stat.contains("(petcomp-oiio-wo")
    };
    let Ok(processes) = std::fs::read_dir("/proc") else {
        return Vec::new();
    };
    processes
        .flatten()
        .filter_map(|p| p.file_name().to_str()?.parse().ok())
        .filter(started_here)
        .collect()
}

/// What the system says of a process.
pub(crate) fn status(pid: impl std::fmt::Display) -> String {
    std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default()
}
