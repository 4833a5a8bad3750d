//! The real program with numbers on its command line changed.

use crate::change::{AWKWARD, Chance};
use crate::world::World;
use crate::{Failure, draws};
use std::os::unix::process::ExitStatusExt;
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Command lines that are right and quick; each word with a digit in it may be changed.
const LINES: [&str; 34] = [
    "scene draw recipe.toml -k 3 --seed 1 -o drawn.toml",
    "scene check scene.toml -j 2",
    "dataset explain recipe.toml --index 1 --seed 0",
    "dataset generate recipe.toml -n 2 --seed 0 -o out --quality draft",
    "dataset generate recipe.toml --only 1 -o out -j 1",
    "dataset generate recipe.toml -n 2 --shard 1/2 -o out",
    "dataset generate recipe.toml -n 2 --preview 1 -o out --set scene.image=[128,96]",
    "dataset generate recipe.toml -n 1 -o out --set scene.objects=[0,2]",
    "dataset generate recipe.toml -n 1 -o out --set scene.image=[64,48]",
    "dataset generate recipe.toml -n 1 -o out --set render.subsamples=1 --set render.cell_px=2.0",
    "dataset ablate recipe.toml -n 0 --seed 3 -o out",
    "dataset ablate recipe.toml -n 0 --switch scene.friction=0.1 -o out",
    "dataset split dataset --ratio 0.5 --guard 0 --seed 1 --by consecutive -o out",
    "dataset split dataset --ratio 0.5 --seed 1 --by random -o out",
    "dataset subset dataset --head 1 -o out",
    "dataset sheet dataset -n 3 -o sheet.png",
    "dataset report dataset -n 2 -o report.html",
    "dataset anchors dataset -n 3 --side 640 --seed 0",
    "dataset batches --real dataset --synthetic made --alpha 0.5 --batch 2 --epochs 2 --seed 0 -o batches.jsonl",
    "dataset train-kit --real dataset --synthetic made --alpha 0.5 --batch 2 --epochs 2 --seeds 1 -o out",
    "asset add slab.png -o out --name a --class cap --length 0.2",
    "asset add slab.png -o out --name a --class cap --scale 300 --screen 0.04,0.4,0.08",
    "asset add slab.png -o out --name a --class cap --size 0.2,0.1 --limit seconds=20",
    "camera solve backgrounds/a.label.json -o a.camera.json --limit document_bytes=16M",
    "camera rectify backgrounds/a.png backgrounds/a.label.json -o top.png --px-per-metre 100",
    "matte key slab.png -o cut.png --screen 0.04,0.4,0.08 --set key.clip_black=0.1 --set key.blur_pre=3",
    "matte key slab.png -o cut.png --screen 0.04,0.4,0.08 --set key.dilate_distance=4 --set key.feather_distance=-3",
    "matte chroma-key slab.png -o cut.png --screen 0.04,0.4,0.08 --set key.tolerance=0.5",
    "matte channel-key slab.png -o cut.png --set key.matte_channel=1 --set key.limit_max=0.9",
    "matte keying-screen slab.png -o plate.png --point 3,4 --point 100,70 --point 5,60 --smoothness 0.1",
    "matte film slab.png -o film.exr --set film.clipped=0.9",
    "settle scene.toml -o rest.toml",
    "diff slab.png two.png --fail 0.1 --failpercent 10 --hardfail 1 --allowfailures 3 --scale 2 -o d.png",
    "eval found dataset/labels/val --rounds 5 --seed 1 --size 64,48",
];

/// A command that takes so long never ends.
const PATIENCE: Duration = Duration::from_secs(120);

/// One line of the program with one or two of its values changed.
fn changed(line: &str, chance: &mut Chance) -> Vec<String> {
    let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
    for _ in 0..=chance.below(2) {
        let numbers: Vec<usize> = (2..words.len())
            .filter(|&i| words[i].contains(|c: char| c.is_ascii_digit()) && !is_file(&words[i]))
            .collect();
        if let Some(&i) = numbers.get(chance.below(numbers.len().max(1))) {
            let new = chance.pick(AWKWARD).trim_matches('"');
            if is_long(line, new) {
                continue;
            }
            let parts: Vec<&str> = words[i].split(['=', ',', '/', '[']).collect();
            let part = (*chance.pick(&parts)).trim_end_matches(']').to_owned();
            words[i] = if part.is_empty() {
                new.into()
            } else {
                words[i].replacen(&part, new, 1)
            };
        }
    }
    if chance.below(4) == 0 {
        let extra = [
            "-j",
            "--limit=side",
            "--limit=pixels",
            "--limit=seconds",
            "--limit=document_depth",
        ];
        let name = chance.pick(&extra);
        let number = chance.pick(AWKWARD).trim_matches('"');
        match name.strip_prefix("--") {
            Some(_) => words.push(format!("{name}={number}")),
            None => words.extend([(*name).to_owned(), number.to_owned()]),
        }
    }
    words
}

/// A number of pictures or views that is right but takes long.
fn is_long(line: &str, number: &str) -> bool {
    let many = line.contains("generate") || line.contains("report");
    many && number.parse().is_ok_and(|n: f64| (50.0..=1e7).contains(&n))
}

fn is_file(word: &str) -> bool {
    [".toml", ".png", ".json", ".exr", ".html", ".jsonl"]
        .iter()
        .any(|ending| word.ends_with(ending))
}

#[test]
fn every_command_line_ends_in_a_result_or_an_error() {
    let world = World::new();
    std::fs::create_dir(world.path("found")).unwrap();
    world.write("found/000000.txt", "0 0.5 0.5 0.2 0.2 0.9\n");
    for line in LINES {
        let args: Vec<_> = line.split(' ').map(str::to_owned).collect();
        let (status, told) = run(&world, &args).unwrap();
        assert!(status.success(), "{line}: {status}: {told}");
    }
    let began = Instant::now();
    // Starting a program takes as long as ten documents.
    let count = (draws() / 10).max(LINES.len() as u64);
    let failures: Vec<Failure> = (0..count).filter_map(|draw| fails(&world, draw)).collect();
    println!(
        "{count} command lines in {:.1} s",
        began.elapsed().as_secs_f64()
    );
    assert!(failures.is_empty(), "{failures:#?}");
}

/// What went wrong with a changed line.
fn fails(world: &World, draw: u64) -> Option<Failure> {
    let line = LINES[draw as usize % LINES.len()];
    let args = changed(line, &mut Chance::new("arguments", draw));
    let how = match run(world, &args) {
        Ok((status, told)) if died(status, &told) => format!("{status}: {told}"),
        Ok(_) => return None,
        Err(hung) => hung,
    };
    let door = args.join(" ");
    println!("{door}: {how}");
    Some(Failure { door, draw, how })
}

fn died(status: ExitStatus, told: &str) -> bool {
    status.signal().is_some() || status.code() == Some(101) || told.contains("panicked at")
}

/// How the program ends, and what it says of errors; in words where it does not end.
fn run(world: &World, args: &[String]) -> Result<(ExitStatus, String), String> {
    let _ = std::fs::remove_dir_all(world.path("out"));
    let mut child = Command::new("sh")
        .args([
            "-c",
            "ulimit -v 8388608; ulimit -c 0; exec \"$0\" \"$@\"",
            env!("CARGO_BIN_EXE_petcomp"),
        ])
        .args(args)
        .current_dir(world.root())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = child.stderr.take().unwrap();
    let errors = std::thread::spawn(move || std::io::read_to_string(&mut pipe).unwrap_or_default());
    let began = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if began.elapsed() > PATIENCE {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("took longer than {PATIENCE:?}"));
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    Ok((status, errors.join().unwrap()))
}
