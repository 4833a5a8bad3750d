//! No number, word or nesting in any argument or document ends the program otherwise than by a
//! result or an error: every door, with values that are huge, negative, no numbers or of another
//! kind.
//!
//! Documents are tried in a process of their own with 4 GiB of address space, so that an allocation
//! without end is seen as what it is: the end of the process. `PETCOMP_DRAWS=100000 cargo test
//! --release --test doors -- --nocapture` tries more of them, `PETCOMP_DOOR=recipe` at one door
//! only, `PETCOMP_KEEP=FOLDER` keeps the documents that fail.
#![cfg(target_os = "linux")]

mod arguments;
mod change;
mod documents;
mod world;

use change::Chance;
use documents::Door;
use std::io::{BufRead, BufReader, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use world::World;

/// Draws at all doors together, where nobody asks for more.
const DRAWS: u64 = 1_500;
/// A draw that takes so long never ends.
const PATIENCE: Duration = Duration::from_secs(90);
/// Address space of a process that reads documents, kilobytes.
const ADDRESS_SPACE: &str = "4194304";

/// Draws asked for.
fn draws() -> u64 {
    std::env::var("PETCOMP_DRAWS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(DRAWS)
}

/// What became of one draw that should not have.
#[derive(Debug)]
#[expect(dead_code, reason = "printed")]
struct Failure {
    door: String,
    draw: u64,
    how: String,
}

#[test]
fn every_document_ends_in_a_result_or_an_error() {
    let only = std::env::var("PETCOMP_DOOR").ok();
    let doors: Vec<Door> = documents::doors()
        .into_iter()
        .filter(|door| only.as_ref().is_none_or(|o| o == door.name))
        .collect();
    // A slow door is tried less often.
    let shares: f64 = doors.iter().map(|door| 1.0 / door.weight as f64).sum();
    let mut failures = Vec::new();
    let mut world = whole_world();
    for door in &doors {
        let count = (draws() as f64 / shares / door.weight as f64).ceil() as u64;
        let began = Instant::now();
        failures.extend(knock(door.name, count, &mut world));
        println!(
            "{}: {count} draws in {:.1} s",
            door.name,
            began.elapsed().as_secs_f64()
        );
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// A world with every valid document in it.
fn whole_world() -> World {
    let world = World::new();
    for door in documents::doors() {
        documents::give(&door, &world);
    }
    world
}

/// Tries so many draws at a door, in another process for as long as each lives.
fn knock(door: &str, count: u64, world: &mut World) -> Vec<Failure> {
    let (mut failures, mut next) = (Vec::new(), 0);
    while next < count && failures.len() < 20 {
        let (told, last, end) = one_life(door, next, count, world);
        let failure = |draw, how| Failure {
            door: door.to_owned(),
            draw,
            how,
        };
        failures.extend(told.into_iter().map(|(draw, how)| failure(draw, how)));
        if let Some(how) = end {
            failures.push(failure(last, how));
            // Nobody has put back what that process changed.
            *world = whole_world();
        }
        next = last + 1;
    }
    failures
}

/// Draws from `first` on until the process ends: what it told, the last draw that it began, and how
/// it ended otherwise than by itself.
fn one_life(
    door: &str,
    first: u64,
    count: u64,
    world: &World,
) -> (Vec<(u64, String)>, u64, Option<String>) {
    let program = std::env::current_exe().unwrap();
    let mut child = Command::new("sh")
        .args([
            "-c",
            &format!("ulimit -v {ADDRESS_SPACE}; ulimit -c 0; exec \"$0\" \"$@\""),
        ])
        .arg(program)
        .args([
            "--ignored",
            "--exact",
            "one_life_of_documents",
            "--nocapture",
            "--test-threads",
            "1",
        ])
        .env(
            "PETCOMP_DOOR_DRAWS",
            format!("{door}|{first}|{count}|{}", world.root().display()),
        )
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (tell, hear) = channel();
    let out = BufReader::new(child.stdout.take().unwrap());
    std::thread::spawn(move || {
        out.lines()
            .map_while(Result::ok)
            .for_each(|line| drop(tell.send(line)))
    });
    let mut err = child.stderr.take().unwrap();
    let errors = std::thread::spawn(move || std::io::read_to_string(&mut err).unwrap_or_default());
    let (mut told, mut last, mut done) = (Vec::new(), first, false);
    let end = loop {
        match hear.recv_timeout(PATIENCE) {
            Ok(line) => {
                if let Some(draw) = line.strip_prefix("draw ") {
                    last = draw.parse().unwrap();
                } else if let Some(how) = line.strip_prefix("panic ") {
                    told.push((last, how.to_owned()));
                } else if line == "done" {
                    (done, last) = (true, count - 1);
                }
            }
            Err(RecvTimeoutError::Timeout) => {
                let _ = child.kill();
                break Some(format!("took longer than {PATIENCE:?}"));
            }
            Err(RecvTimeoutError::Disconnected) => {
                let status = child.wait().unwrap();
                let why = errors.join().unwrap();
                break (!done)
                    .then(|| format!("{status}: {}", why.lines().last().unwrap_or_default()));
            }
        }
    };
    let _ = child.wait();
    (told, last, end)
}

/// Where the document of a draw is kept that did not end well: `PETCOMP_KEEP` names a folder.
fn kept(door: &str, draw: u64) -> Option<PathBuf> {
    Some(
        PathBuf::from(std::env::var_os("PETCOMP_KEEP")?)
            .join(format!("{}-{draw}", door.replace(' ', "_"))),
    )
}

/// What `one_life` starts.
#[test]
#[ignore = "a part of every_document_ends_in_a_result_or_an_error"]
fn one_life_of_documents() {
    static WHERE: Mutex<String> = Mutex::new(String::new());
    let Ok(asked) = std::env::var("PETCOMP_DOOR_DRAWS") else {
        return;
    };
    let [name, first, count, folder] = asked.split('|').collect::<Vec<_>>().try_into().unwrap();
    let (first, count): (u64, u64) = (first.parse().unwrap(), count.parse().unwrap());
    let world = World::at(folder);
    let door = documents::doors()
        .into_iter()
        .find(|door| door.name == name)
        .unwrap();
    let valid = door.valid(&world);
    // What is valid passes, or the changes change nothing.
    door.enter(&world, &valid);
    std::panic::set_hook(Box::new(|info| {
        let told = info.to_string().replace('\n', " ");
        WHERE.lock().map_or_else(|_| (), |mut at| *at = told);
    }));
    for draw in first..count {
        let mut out = std::io::stdout().lock();
        writeln!(out, "\ndraw {draw}")
            .and_then(|()| out.flush())
            .unwrap();
        drop(out);
        let changed = door.changed(&valid, &mut Chance::new(name, draw));
        let kept = kept(name, draw);
        kept.iter()
            .for_each(|path| std::fs::write(path, &changed).unwrap());
        match catch_unwind(AssertUnwindSafe(|| door.enter(&world, &changed))) {
            Ok(()) => kept
                .iter()
                .for_each(|path| std::fs::remove_file(path).unwrap()),
            Err(_) => println!(
                "panic {}",
                WHERE.lock().map_or_else(|_| String::new(), |at| at.clone())
            ),
        }
        door.leave(&world, &valid);
    }
    let _ = std::panic::take_hook();
    println!("\ndone");
}
