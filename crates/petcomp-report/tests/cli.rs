//! The program: what it writes, and what it refuses.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder to run the program in.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, args: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_petcomp-report"));
        command.args(args).current_dir(self.0.path());
        command.output().expect("the program starts")
    }

    /// Runs what must succeed.
    fn ok(&self, args: &[&str]) {
        let output = self.run(args);
        let err = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "petcomp-report {args:?}\n{err}");
    }

    /// Runs what must fail and returns the reason.
    fn refused(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert!(
            !output.status.success(),
            "petcomp-report {args:?} succeeded"
        );
        let written = Path::new(self.0.path())
            .read_dir()
            .expect("a folder")
            .count();
        assert!(written <= 1, "nothing is left behind");
        String::from_utf8_lossy(&output.stderr).into_owned()
    }
}

#[test]
fn everything_measured_is_one_page_with_its_data() {
    let desk = Desk::new();
    let golden = format!("{}/../../golden/render", env!("CARGO_MANIFEST_DIR"));
    desk.ok(&[
        "all",
        "--quick",
        "-q",
        "-o",
        "all",
        "--golden",
        &golden,
        "--date",
        "a Saturday",
    ]);
    let read = |name: &str| std::fs::read_to_string(desk.path("all").join(name)).expect(name);
    let (html, markdown) = (read("report.html"), read("report.md"));
    assert!(html.contains("a Saturday") && html.contains("<svg") && !html.contains("NaN"));
    assert!(
        !html.contains("src=") && !html.contains("<link"),
        "the page needs no other file"
    );
    for stage in [
        "color", "matte", "camera", "settle", "shadow", "render", "label", "encode",
    ] {
        assert!(
            html.contains(&format!("{stage}: ")) && markdown.contains(&format!("| {stage}: ")),
            "{stage}"
        );
    }
    assert!(markdown.contains("| normal (the default) |") && read("quality.csv").contains("1/360"));
    assert!(
        read("render_piles.csv")
            .lines()
            .any(|line| line.starts_with("presets,normal,") && line.matches("normal").count() == 2)
    );
}

#[test]
fn a_report_is_a_table_and_plots() {
    let desk = Desk::new();
    desk.ok(&["camera", "-o", "found", "--views", "2"]);
    let csv = std::fs::read_to_string(desk.path("found/camera.csv")).expect("the table");
    // Two lenses, four noises, ten tilts, eight methods, and the head.
    assert_eq!(csv.lines().count(), 2 * 4 * 10 * 8 + 1);
    let fields = |line: &str| line.split(',').count();
    assert!(csv.lines().all(|line| fields(line) == 11), "{csv}");
    for plot in [
        "tilt_ideal",
        "tilt_realistic",
        "height_ideal",
        "height_realistic",
        "time_ideal",
        "time_realistic",
    ] {
        let svg = std::fs::read_to_string(desk.path(&format!("found/camera_{plot}.svg")))
            .expect("a plot");
        assert!(
            svg.starts_with("<svg") && svg.contains("<circle") && !svg.contains("NaN"),
            "{plot}"
        );
    }
    assert!(
        desk.refused(&["camera", "--views", "0"])
            .contains("0 is not in 1..=100000")
    );
}
