//! The real program under bad luck: broken inputs among good ones, little memory, signals, many
//! runs on one folder.
#![cfg(unix)]

mod desk;
mod hearing;

use desk::{Desk, PETCOMP, SAMPLES, text, words};
use hearing::hearing;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

impl Desk {
    fn shell(&self, script: &str) -> Command {
        let mut shell = Command::new("sh");
        shell.args(["-c", script]).current_dir(self.folder());
        shell
    }

    /// The program in a shell that may map so many KiB of memory, and take ten seconds of a
    /// processor.
    fn run_within(&self, kib: u64, args: &str) -> Output {
        let script = format!("ulimit -v {kib}; ulimit -t 10; exec {PETCOMP} {args}");
        self.shell(&script).output().unwrap()
    }

    /// A run of [`GENERATE`] with more options.
    fn generate(&self, more: &str) -> Command {
        self.command(&words(&format!("{GENERATE} {more}")))
    }
}

const GENERATE: &str = "dataset generate demo/recipe.toml";

/// Starts a program that nobody listens to.
fn start(command: &mut Command) -> Child {
    let quiet = command.stdout(Stdio::null()).stderr(Stdio::null());
    quiet.spawn().unwrap()
}

fn said(output: &Output) -> String {
    text(&output.stdout) + &text(&output.stderr)
}

const LABEL: &str = r#"{"format": "plane-label", "version": 1, "image": {"file": "none.jpg", "width": 640, "height": 480},
    "surface": {"id": "tray", "width_m": 0.6, "height_m": 0.4, "corners_px": [[100, 100], [500, 110], [510, 400], [90, 390]]}}"#;

#[test]
fn a_broken_file_among_good_ones_is_named_and_the_rest_done() {
    let desk = Desk::new();
    for name in ["a", "c"] {
        desk.write(format!("{name}.label.json"), LABEL);
    }
    desk.write("b.label.json", "{");
    let pipe = desk.shell("mkfifo d.label.json").status();
    assert!(pipe.unwrap().success());
    let labels = ["a", "b", "c", "d", "e"].map(|name| format!("{name}.label.json"));
    let solve = format!("camera solve {}", labels.join(" "));
    let output = desk.run(&words(&solve));
    let said = said(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("failed: b.label.json: line 1")
            && said.contains("d.label.json: not a regular file"),
        "{said}"
    );
    assert!(
        said.contains("error: 3 of 5 files could not be used; the rest is done"),
        "{said}"
    );
    assert!(desk.path("a.camera.json").exists() && desk.path("c.camera.json").exists());
}

#[test]
fn a_label_that_points_outside_is_refused() {
    let desk = Desk::new();
    for outside in ["../a.jpg", "/etc/passwd"] {
        desk.write("a.label.json", LABEL.replace("none.jpg", outside));
        let said = said(&desk.run(&["camera", "solve", "a.label.json"]));
        assert!(
            said.contains("a.label.json: image.file:") && said.contains("expected a path below"),
            "{said}"
        );
    }
}

/// A grey PNG, all of it one value.
fn plain_png(width: u32, height: u32) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_compression(png::Compression::Fast);
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&vec![100; width as usize * height as usize])
        .unwrap();
    out
}

#[test]
fn a_picture_larger_than_memory_is_refused_and_not_attempted() {
    let desk = Desk::new();
    desk.write("large.png", plain_png(9_000, 9_000));
    // 81 million pixels of three floats.
    let output = desk.run_within(1_000_000, "-j 1 matte cut large.png -o cut.exr");
    let text = said(&output);
    assert!(output.status.signal().is_none(), "{text}");
    assert!(
        text.contains("large.png: needs 926 MiB of memory, more than the system provides"),
        "{text}"
    );
}

#[test]
fn little_memory_is_enough_or_said() {
    let desk = Desk::new();
    desk.write("photo.png", plain_png(1_000, 800));
    let (mut worked, mut told) = (0, 0);
    for mebibytes in [128, 256, 512, 1024, 2048] {
        let output = desk.run_within(mebibytes << 10, "-j 2 diff photo.png photo.png");
        let said = said(&output);
        match output.status.code() {
            Some(0) => worked += 1,
            _ => {
                assert!(said.contains("memory"), "{mebibytes} MiB: {said}");
                told += 1;
            }
        }
    }
    println!(
        "of five sizes of memory from 128 MiB to 2 GiB, {worked} were enough and {told} were said not to be"
    );
    assert!(worked >= 3);
}

/// Nothing here takes as long, on however busy a machine: what does will not end.
const HANGS: Duration = Duration::from_secs(300);

/// Waits, and not for ever.
fn ends(mut child: Child) -> std::process::ExitStatus {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        if start.elapsed() > HANGS {
            child.kill().unwrap();
            panic!("did not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Waits for something, and not for ever.
fn wait_until(missing: &str, is_there: impl Fn() -> bool) {
    let start = Instant::now();
    while !is_there() {
        assert!(start.elapsed() < HANGS, "{missing} in {HANGS:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Until a run has finished its first picture, and so listens to signals.
fn wait_for_a_sample(folder: &Path) {
    let journal = folder.join("index.jsonl");
    wait_until("no picture", || {
        journal.metadata().is_ok_and(|about| about.len() > 0)
    });
}

/// A recipe and what it needs.
fn demo(desk: &Desk) {
    let demo = words("demo -n 1 -q -o demo --samples");
    let output = desk.run(&[&demo[..], &[SAMPLES]].concat());
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn twenty_runs_on_one_folder_make_one_dataset() {
    let desk = Desk::new();
    demo(&desk);
    let start = |_| {
        let mut run = desk.generate("-n 4 --seed 1 -q -j 1 -o out");
        let heard = run.stdout(Stdio::null()).stderr(Stdio::piped());
        heard.spawn().unwrap()
    };
    let runs: Vec<Child> = (0..20).map(start).collect();
    let outcomes: Vec<Output> = runs
        .into_iter()
        .map(|run| run.wait_with_output().unwrap())
        .collect();
    let done = outcomes.iter().filter(|o| o.status.success()).count();
    for outcome in outcomes.iter().filter(|o| !o.status.success()) {
        assert!(
            said(outcome).contains("another run is writing this dataset"),
            "{}",
            said(outcome)
        );
    }
    assert!(done >= 1);
    println!(
        "20 runs: {done} did it or found it done, {} left it to another",
        20 - done
    );
    assert!(desk.run(&["dataset", "check", "out"]).status.success());
}

/// By the shell's own `kill`: the program of that name is not on every machine.
fn send(signal: &str, child: &std::process::Child) {
    let line = format!("kill -s {signal} {}", child.id());
    let sent = Command::new("sh").args(["-c", &line]).status();
    assert!(sent.unwrap().success(), "{line}");
}

#[test]
fn a_signal_stops_between_pictures_and_the_same_command_goes_on() {
    let desk = Desk::new();
    demo(&desk);
    for signal in ["INT", "TERM"] {
        let run = |count: &str| {
            let more = format!("-n {count} -q -j 2 -o {signal}");
            start(&mut hearing(&desk.generate(&more)))
        };
        let child = run("100000");
        wait_for_a_sample(&desk.path(signal));
        send(signal, &child);
        assert_eq!(ends(child).code(), Some(130), "{signal}");
        let killed = run("100000");
        std::thread::sleep(Duration::from_millis(700));
        send("KILL", &killed);
        assert_eq!(ends(killed).signal(), Some(9));
        let lines = std::fs::read_to_string(desk.path(signal).join("index.jsonl")).unwrap();
        let last = lines.lines().filter_map(|line| {
            line.strip_prefix("{\"k\":")?
                .split(',')
                .next()?
                .parse::<u64>()
                .ok()
        });
        let count = (last.max().unwrap() + 1).to_string();
        assert_eq!(ends(run(&count)).code(), Some(0), "after {signal} and KILL");
    }
}

/// The names of what is in a folder; none where it is not there.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect()
}

#[test]
fn a_signal_stops_a_sequence_between_frames_and_leaves_whole_pictures_alone() {
    let desk = Desk::new();
    let green = petcomp::LinearRgb::new(0.02, 0.6, 0.05);
    let screen = petcomp::Image::filled(512, 512, green);
    petcomp::io::write(desk.path("0.png"), &screen).unwrap();
    let mut args = ["matte", "key", "0.png"].map(String::from).to_vec();
    for k in 1..300 {
        let frame = format!("{k}.png");
        std::fs::copy(desk.path("0.png"), desk.path(&frame)).unwrap();
        args.push(frame);
    }
    let more = words("-o keyed -q -j 2 --screen 0.02,0.6,0.05");
    args.extend(more.into_iter().map(String::from));
    let child = start(&mut hearing(&desk.command(&args)));
    let folder = desk.path("keyed");
    wait_until("no picture", || {
        names_in(&folder).iter().any(|name| name.ends_with(".exr"))
    });
    send("TERM", &child);
    assert_eq!(ends(child).code(), Some(130));
    let names = names_in(&folder);
    assert!(names.len() < 300, "all were keyed");
    assert!(names.iter().all(|name| !name.starts_with('.')), "{names:?}");
}

#[test]
fn signals_that_a_run_was_started_to_ignore_do_not_stop_it() {
    let desk = Desk::new();
    demo(&desk);
    let run = format!("{GENERATE} -n 100000 --yes -q -j 1 -o out");
    let script = format!("trap '' HUP INT; exec {PETCOMP} {run}");
    let mut child = start(&mut desk.shell(&script));
    wait_for_a_sample(&desk.path("out"));
    // Two signals end a run at once.
    send("HUP", &child);
    send("INT", &child);
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(child.try_wait().unwrap(), None);
    send("TERM", &child);
    assert_eq!(ends(child).code(), Some(130));
}

/// Pictures that take minutes: heaps of 250 at the shortest steps, and room for such work.
const LONG_FALL: &str = "--set scene.objects=[250,250] --set scene.scale=0.4 \
    --set scene.settle.step=0.0001 --set scene.settle.most_work=1000000000000";

/// A run whose first picture takes minutes, once it listens to signals.
fn long_run(desk: &Desk, folder: &str) -> Child {
    let more = format!("-n 1 -q -j 1 -o {folder} {LONG_FALL}");
    let child = start(&mut desk.generate(&more));
    await_lock(desk, folder);
    child
}

/// Waits until a dataset is begun.
fn await_lock(desk: &Desk, folder: &str) {
    let lock = desk.path(folder).join("index.jsonl");
    wait_until("no beginning", || lock.exists());
}

/// Several times what it takes, 8 s after one signal and none after two.
const ENDS_SOON: [Duration; 2] = [Duration::from_secs(30), Duration::from_secs(6)];

#[test]
fn one_signal_ends_a_long_picture_soon_and_two_at_once() {
    let desk = Desk::new();
    demo(&desk);
    for (signals, limit) in [1, 2].into_iter().zip(ENDS_SOON) {
        let folder = format!("out{signals}");
        let child = long_run(&desk, &folder);
        send("TERM", &child);
        if signals == 2 {
            std::thread::sleep(Duration::from_secs(2));
            send("TERM", &child);
        }
        let start = Instant::now();
        assert_eq!(ends(child).code(), Some(130), "{signals} signals");
        assert!(
            start.elapsed() < limit,
            "{signals} signals: {:?}",
            start.elapsed()
        );
        // The folder goes on: with the recipe that it was begun with.
        let mut again = desk.generate(&format!("-n 1 -q -o {folder}"));
        let said = said(&again.output().unwrap());
        assert!(said.contains("recipe.scene.objects"), "{said}");
    }
}

#[test]
fn a_number_that_is_too_great_is_refused_at_once() {
    let desk = Desk::new();
    demo(&desk);
    let run = |more: &str| {
        let mut generate = desk.generate(&format!("-q -o out {more}"));
        let output = generate.stdout(Stdio::null()).output().unwrap();
        (output.status.code(), said(&output))
    };
    for number in ["1000000000000", "18446744073709551615"] {
        for flag in ["-n", "--only", "--preview"] {
            let (code, said) = run(&format!("{flag} {number}"));
            assert_eq!(code, Some(3), "{flag} {number}: {said}");
            assert!(
                said.contains("samples, expected at most 1000000000"),
                "{flag} {number}: {said}"
            );
        }
    }
    assert!(!desk.path("out").exists());
    assert_eq!(run("--only 999999999").0, Some(0));
}

/// A fall ends between two steps: the picture in hand is left to the run that goes on, and what is
/// told is what is there.
#[test]
fn a_signal_stops_a_fall() {
    let desk = Desk::new();
    demo(&desk);
    let mut command = desk.generate(&format!("-n 2 -j 2 -o out {LONG_FALL}"));
    let heard = command.stdout(Stdio::null()).stderr(Stdio::piped());
    let child = heard.spawn().unwrap();
    await_lock(&desk, "out");
    std::thread::sleep(Duration::from_millis(500));
    send("TERM", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    let expected = "interrupted: 0 of 2 samples are in out; rerun the same command to resume";
    assert!(said(&output).contains(expected), "{}", said(&output));
}

#[test]
fn a_reader_that_goes_away_is_no_crash() {
    let desk = Desk::new();
    for args in ["--help", "doctor", "dataset --help"] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut unheard = desk.command(&words(args));
        let output = unheard.stdout(writer).output().unwrap();
        let said = said(&output);
        assert!(!said.contains("panicked"), "{args}: {said}");
        // As SIGPIPE ends others.
        assert_eq!(output.status.code(), Some(141), "{args}: {said}");
    }
}

#[test]
fn an_output_folder_with_a_link_inside_is_refused() {
    let desk = Desk::new();
    demo(&desk);
    let (inside, outside) = (desk.path("out/images"), tempfile::tempdir().unwrap());
    desk.write("out/dataset.json", "{}");
    std::os::unix::fs::symlink(outside.path(), &inside).unwrap();
    let said = said(&desk.generate("-n 1 -q -o out").output().unwrap());
    assert!(said.contains("out/images: is a link to a folder"), "{said}");
    assert_eq!(std::fs::read_dir(outside.path()).unwrap().count(), 0);
}

/// So many make the hundredths of a second that a shell counts in small.
const HELPS: u32 = 50;

/// What a shell says (`times`) that so many runs of the program took, whatever else the machine did
/// meanwhile.
fn processor_seconds_of_children(runs: u32, args: &str) -> f64 {
    let script = format!(
        "i=0; while [ $i -lt {runs} ]; do {PETCOMP} {args} >&2 || exit 1; i=$((i+1)); done; times"
    );
    let output = Command::new("sh")
        .args(["-c", &script])
        .stderr(Stdio::null())
        .output()
        .unwrap();
    assert!(output.status.success());
    // Two lines, the shell's own and that of its children, both `0m0.010000s 0m0.020000s` for user
    // and system.
    let text = String::from_utf8(output.stdout).unwrap();
    let seconds = |time: &str| -> Option<f64> {
        let (minutes, seconds) = time.strip_suffix('s')?.split_once('m')?;
        Some(60.0 * minutes.parse::<f64>().ok()? + seconds.parse::<f64>().ok()?)
    };
    text.lines()
        .nth(1)
        .unwrap()
        .split_whitespace()
        .map(|time| seconds(time).unwrap())
        .sum()
}

/// Loading OpenImageIO would cost 0.2 s and 130 MB.
#[test]
fn help_is_quick_and_small() {
    let each = processor_seconds_of_children(HELPS, "--help") / f64::from(HELPS);
    println!("--help: {:.1} ms of a processor", 1e3 * each);
    assert!(each < 0.02, "{each} s");
    let measured = Command::new("/usr/bin/time")
        .args(["-f", "%M", PETCOMP, "--help"])
        .output();
    let Ok(output) = measured else { return };
    let kib: u64 = String::from_utf8_lossy(&output.stderr)
        .trim()
        .parse()
        .unwrap();
    assert!(kib < 20 << 10, "{kib} KiB");
}
