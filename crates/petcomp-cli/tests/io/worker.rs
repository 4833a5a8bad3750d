//! Files that only OpenImageIO reads come through its worker; programs that meet none do not load
//! it.

use crate::make::{Folder, palette_tiff};
use petcomp::io::{self, WriteOptions};
use petcomp::{Image, LinearRgb, Srgb8, color};
use std::io::Write;
use std::process::{Command, Stdio};

#[test]
fn a_palette_tiff_is_read_by_the_worker() {
    let folder = Folder::new();
    let read = io::read::<LinearRgb>(folder.with("palette.tif", &palette_tiff())).unwrap();
    assert_eq!(read[(0, 0)], LinearRgb::new(1.0, 0.0, 0.0));
    assert_eq!(
        read[(1, 0)],
        color::decode_srgb8(Srgb8 {
            r: 0,
            g: 128,
            b: 255
        })
    );
}

#[test]
fn film_scans_are_read_by_the_worker() {
    let folder = Folder::new();
    let path = folder.file("scan.dpx");
    let ramp = Image::from_fn(32, 4, |x, _| LinearRgb::grey(x as f32 / 31.0));
    io::oiio::write_with(&path, &ramp, &WriteOptions::default()).unwrap();
    let read = io::read::<LinearRgb>(&path).unwrap();
    let worst = read
        .pixels()
        .iter()
        .zip(ramp.pixels())
        .map(|(p, q)| (p.g - q.g).abs())
        .fold(0.0, f32::max);
    assert!(worst < 1e-4, "{worst}");

    let bytes = std::fs::read(&path).unwrap();
    let e = io::read::<LinearRgb>(folder.with("cut.dpx", &bytes[..bytes.len() / 2]))
        .unwrap_err()
        .to_string();
    assert!(
        e.contains("cut.dpx: OpenImageIO") && !e.contains('\n'),
        "{e}"
    );
}

/// Large pictures have more time, which begins with the shape.
#[test]
fn a_worker_tells_the_shape_before_it_decodes() {
    let whole = palette_tiff();
    let cut = &whole[..whole.len() - 2];
    let request = format!(
        "{{\"format\":\"tiff\",\"ask\":{{\"pixels\":{{\"wanted\":\"color\",\"window\":\"display\"}}}},\"bytes\":{}}}\n",
        cut.len()
    );
    let mut worker = Command::new(env!("CARGO_BIN_EXE_petcomp-oiio-worker"))
        .arg("{}")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = worker.stdin.take().unwrap();
    stdin.write_all(request.as_bytes()).unwrap();
    stdin.write_all(cut).unwrap();
    drop(stdin);
    let told = String::from_utf8(worker.wait_with_output().unwrap().stdout).unwrap();
    let lines: Vec<&str> = told.lines().collect();
    assert!(lines[1].starts_with("{\"picture\":{\"width\":2"), "{told}");
    assert!(lines[2].starts_with("{\"refused\":"), "{told}");
}

/// A program that takes no chance does not ask a worker that the system leaves loose.
#[test]
fn a_worker_without_a_full_sandbox_is_refused_where_that_is_asked_for() {
    let folder = Folder::new();
    let picture = folder.with("palette.tif", &palette_tiff());
    let worker = folder.file("worker");
    let greeting = format!(
        "#!/bin/sh\necho '{{\"petcomp\":\"{}\",\"libraries\":\"none\",\"missing\":[\"Landlock: not in this kernel\"]}}'\nexec sleep 9\n",
        env!("CARGO_PKG_VERSION")
    );
    // Written by a process of its own: see `write_program` in `src/io/worker/pool.rs`.
    let mut shell = Command::new("/bin/sh");
    let written = shell
        .args(["-c", "printf %s \"$1\" >\"$0\" && chmod 755 \"$0\""])
        .arg(&worker)
        .arg(greeting)
        .status();
    assert!(written.unwrap().success());
    let mut program = Command::new(env!("CARGO_BIN_EXE_petcomp"));
    program
        .args(["--oiio", "worker-strict", "diff"])
        .args([&picture, &picture])
        .env("PETCOMP_OIIO_WORKER", &worker);
    let output = program.output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{told}");
    assert!(
        told.contains("its worker has no full sandbox here (Landlock: not in this kernel)"),
        "{told}"
    );
}

/// Loading OpenImageIO costs 0.2 s and 260 libraries at every start.
#[cfg(target_os = "linux")]
#[test]
fn only_the_worker_links_openimageio() {
    let links = |program: &str| {
        let bytes = std::fs::read(program).unwrap();
        bytes.windows(14).any(|w| w == b"libOpenImageIO")
    };
    assert!(links(env!("CARGO_BIN_EXE_petcomp-oiio-worker")));
    assert!(!links(env!("CARGO_BIN_EXE_petcomp")));
}
