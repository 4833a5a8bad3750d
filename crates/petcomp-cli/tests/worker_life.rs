//! Workers live long, see little, and may die at any moment.
//!
//! A program of its own: it counts workers and kills them, which must be nobody else's.
#![cfg(target_os = "linux")]

#[path = "io/make.rs"]
#[allow(dead_code, reason = "other tests need the rest of it")]
mod make;
#[path = "io/processes.rs"]
mod processes;

use make::{Folder, palette_tiff};
use petcomp::io::{self, ReadOptions};
use petcomp::{Image, LinearRgb};
use processes::{status, workers};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

/// They run one at a time.
static ALONE: Mutex<()> = Mutex::new(());

fn read(folder: &Folder) -> Result<Image<LinearRgb>, String> {
    io::read(folder.file("palette.tif")).map_err(|e| e.to_string())
}

#[test]
fn a_worker_may_open_nothing_and_start_nothing() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = Folder::new();
    folder.with("palette.tif", &palette_tiff());
    read(&folder).unwrap();
    let Some(&pid) = workers().first() else {
        panic!("no worker")
    };
    let limits = std::fs::read_to_string(format!("/proc/{pid}/limits")).unwrap();
    let limit = |name: &str| -> Vec<String> {
        let line = limits.lines().find(|l| l.starts_with(name)).unwrap();
        line[name.len()..]
            .split_whitespace()
            .map(String::from)
            .collect()
    };
    assert_eq!(limit("Max file size")[..2], ["0", "0"]);
    assert_eq!(limit("Max core file size")[..2], ["0", "0"]);
    assert_eq!(limit("Max open files")[1], "64");
    assert_eq!(limit("Max cpu time")[1], "600");
    let space: u64 = limit("Max address space")[0].parse().unwrap();
    assert!(
        space < 2 << 30,
        "{space} bytes of address space for a file of 2 KB"
    );
    let status = status(pid);
    let line = |name: &str| {
        status
            .lines()
            .find_map(|l| l.strip_prefix(name))
            .map(str::trim)
    };
    assert_eq!(line("NoNewPrivs:"), Some("1"));
    // 2: a filter. A kernel without one is warned of, and then nothing can be said here.
    if std::path::Path::new("/proc/sys/kernel/seccomp").exists() {
        let threads = std::fs::read_dir(format!("/proc/{pid}/task"))
            .unwrap()
            .flatten();
        for thread in threads {
            let status = std::fs::read_to_string(thread.path().join("status")).unwrap();
            assert!(
                status.contains("Seccomp:\t2\n"),
                "a thread without a filter: {status}"
            );
        }
    }
}

#[test]
fn a_worker_is_used_again() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = Folder::new();
    folder.with("palette.tif", &palette_tiff());
    read(&folder).unwrap();
    let before = workers();
    for _ in 0..20 {
        read(&folder).unwrap();
    }
    assert!(
        before.iter().any(|pid| workers().contains(pid)),
        "every worker was replaced"
    );
}

/// Four readers, and somebody who kills a worker every few milliseconds: pictures are right, or the
/// signal is named.
#[test]
fn killed_workers_spoil_no_picture() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = Folder::new();
    folder.with("palette.tif", &palette_tiff());
    let whole = read(&folder).unwrap();
    let done = AtomicBool::new(false);
    let (killed, refused) = (Mutex::new(0), Mutex::new(0));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                if let Some(pid) = workers().last() {
                    // It may be gone already.
                    let _ = Command::new("sh")
                        .args(["-c", &format!("kill -9 {pid}")])
                        .output();
                    *killed.lock().unwrap() += 1;
                }
                std::thread::sleep(Duration::from_millis(40));
            }
        });
        let readers: Vec<_> = (0..4)
            .map(|_| {
                scope.spawn(|| {
                    for _ in 0..40 {
                        match read(&folder) {
                            Ok(picture) => assert!(picture.pixels() == whole.pixels()),
                            Err(e) => {
                                assert!(e.contains("signal 9"), "{e}");
                                *refused.lock().unwrap() += 1;
                            }
                        }
                    }
                })
            })
            .collect();
        let outcomes: Vec<_> = readers.into_iter().map(|reader| reader.join()).collect();
        done.store(true, Ordering::Relaxed);
        assert!(outcomes.iter().all(Result::is_ok));
    });
    println!(
        "{} workers killed, {} of 160 readings refused",
        killed.lock().unwrap(),
        refused.lock().unwrap()
    );
    assert!(read(&folder).is_ok(), "nothing works any more");
    assert!(
        workers().len() <= 8,
        "more workers than readers ever asked at once"
    );
}

/// Starts so many workers, eight at a time, while every core has other work, and tells how those
/// ended that gave no greeting or did not end well.
fn deaths_at_start(count: usize) -> Vec<String> {
    let (started, done) = (AtomicUsize::new(0), AtomicBool::new(false));
    let dead = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..2 * std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        let starters: Vec<_> = (0..8)
            .map(|_| {
                scope.spawn(|| {
                    while started.fetch_add(1, Ordering::Relaxed) < count {
                        dead.lock().unwrap().extend(death_at_start());
                    }
                })
            })
            .collect();
        let outcomes: Vec<_> = starters.into_iter().map(|starter| starter.join()).collect();
        done.store(true, Ordering::Relaxed);
        assert!(outcomes.iter().all(Result::is_ok));
    });
    dead.into_inner().unwrap()
}

/// A worker's own start, without the parent that would try again.
fn death_at_start() -> Option<String> {
    let mut worker = Command::new(env!("CARGO_BIN_EXE_petcomp-oiio-worker"));
    worker
        .arg("{}")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    let mut child = worker.spawn().unwrap();
    let mut greeting = String::new();
    BufReader::new(child.stdout.take().unwrap())
        .read_line(&mut greeting)
        .unwrap();
    // Nobody asks any more.
    drop(child.stdin.take());
    let status = child.wait().unwrap();
    let lives = greeting.starts_with("{\"petcomp\"") && status.success();
    (!lives).then(|| format!("{greeting:?}, {status}"))
}

/// Threads of the libraries that have not run yet when the filter falls ended 40 of 100 of them.
#[test]
fn no_worker_dies_at_its_start() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    assert_eq!(deaths_at_start(24), [""; 0]);
}

#[test]
#[ignore = "takes minutes"]
fn none_of_a_thousand_workers_dies_at_its_start() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let dead = deaths_at_start(1_000);
    println!("1000 workers started under load, {} died", dead.len());
    assert_eq!(dead, [""; 0]);
}

/// A file as bytes is all a worker gets: one whose name says nothing, in a folder it could not
/// open.
#[test]
fn a_worker_reads_files_it_could_not_open() {
    let _alone = ALONE.lock().unwrap_or_else(|e| e.into_inner());
    let folder = Folder::new();
    std::fs::create_dir(folder.file("private")).unwrap();
    let path = folder.with("private/\u{1F5BC} picture", &palette_tiff());
    assert!(io::read::<LinearRgb>(&path).is_ok());
    let header = io::read_header(&path).unwrap();
    assert_eq!(
        (
            header.width,
            header.height,
            header.bits,
            header.channels.len()
        ),
        (2, 1, 8, 3)
    );
    let told = io::read_in_worker::<LinearRgb>(&path, &ReadOptions::default()).unwrap();
    assert_eq!(told.size(), (2, 1));
}
