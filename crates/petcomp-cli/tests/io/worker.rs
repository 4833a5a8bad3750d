//! Files that only OpenImageIO reads come through its worker; programs that meet none do not load
//! it.

use crate::make::{Folder, palette_tiff};
use petcomp::io::{self, WriteOptions};
use petcomp::{Image, LinearRgb, Srgb8, color};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

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

fn write_ramp(path: &Path) -> Image<LinearRgb> {
    let ramp = Image::from_fn(32, 4, |x, _| LinearRgb::grey(x as f32 / 31.0));
    io::oiio::write_with(path, &ramp, &WriteOptions::default()).unwrap();
    ramp
}

#[test]
fn film_scans_are_read_by_the_worker() {
    let folder = Folder::new();
    let path = folder.file("scan.dpx");
    let ramp = write_ramp(&path);
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

/// A film scan with this code of its transfer (SMPTE 268M) in the header.
fn scan_of_transfer(folder: &Folder, code: u8) -> Result<Image<LinearRgb>, String> {
    let path = folder.file("transfer.dpx");
    write_ramp(&path);
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[801] = code;
    std::fs::write(&path, bytes).unwrap();
    io::read(&path).map_err(|e| e.to_string())
}

#[test]
fn a_film_scan_has_the_curve_that_it_names_or_is_refused() {
    let folder = Folder::new();
    let read = |code| scan_of_transfer(&folder, code).unwrap();
    let (undefined, rec709) = (read(255), read(6));
    assert_ne!(undefined.pixels(), rec709.pixels());
    assert_eq!(read(0).pixels(), undefined.pixels());
    for code in [5, 7, 8] {
        assert_eq!(read(code).pixels(), rec709.pixels(), "transfer {code}");
    }
    for (code, name) in [
        (1, "Printing density"),
        (3, "KodakLog"),
        (4, "Unspecified video"),
        (9, "NTSC composite video"),
        (10, "PAL composite video"),
        (11, "Z depth linear"),
        (12, "Z depth homogeneous"),
        (13, "ADX"),
    ] {
        let e = scan_of_transfer(&folder, code).unwrap_err();
        let expected = format!("colour space {name}, expected linear, sRGB or Rec709");
        assert!(e.contains(&expected), "transfer {code}: {e}");
    }
}

/// The header of a film scan: linear RGB of 10 bits, a pixel in four bytes.
fn scan_header([width, height]: [u32; 2]) -> Vec<u8> {
    const DATA: u32 = 2048;
    let mut header = vec![0_u8; DATA as usize];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, b"SDPX");
    put(4, &DATA.to_be_bytes());
    put(8, b"V1.0");
    put(16, &(DATA + 4 * width * height).to_be_bytes());
    // One element.
    put(770, &[0, 1]);
    put(772, &width.to_be_bytes());
    put(776, &height.to_be_bytes());
    // RGB, linear, of any colorimetry, 10 bits, filled to words by method A.
    put(800, &[50, 2, 0, 10, 0, 1]);
    put(808, &DATA.to_be_bytes());
    header
}

/// More than the 256 MiB that a worker has beside the pictures it has prepared for.
#[test]
fn a_worker_decodes_a_picture_larger_than_its_own_needs() {
    let [width, height] = [8192, 5600];
    let header = scan_header([width, height]);
    let pixels = u64::from(width * height);
    let mut worker = start_worker();
    let mut stdin = worker.stdin.take().unwrap();
    let request = pixel_request("dpx", header.len() as u64 + 4 * pixels);
    stdin.write_all(request.as_bytes()).unwrap();
    stdin.write_all(&header).unwrap();
    std::io::copy(&mut std::io::repeat(0).take(4 * pixels), &mut stdin).unwrap();
    drop(stdin);
    let mut stdout = BufReader::new(worker.stdout.take().unwrap());
    let mut told = String::new();
    for _ in 0..3 {
        stdout.read_line(&mut told).unwrap();
    }
    let last = told.lines().last().unwrap();
    assert!(last.starts_with("{\"picture\":"), "{told}");
    let samples = std::io::copy(&mut stdout, &mut std::io::sink()).unwrap();
    assert_eq!(samples, pixels * 3 * 2);
    assert!(worker.wait().unwrap().success());
}

fn start_worker() -> Child {
    Command::new(env!("CARGO_BIN_EXE_petcomp-oiio-worker"))
        // What it really takes is a small part of what it might.
        .arg(r#"{"memory_percent":10000}"#)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}

fn pixel_request(format: &str, bytes: u64) -> String {
    format!(
        "{{\"format\":\"{format}\",\"ask\":{{\"pixels\":{{\"wanted\":\"color\",\"window\":\"display\"}}}},\"bytes\":{bytes}}}\n"
    )
}

/// Large pictures have more time, which begins with the shape.
#[test]
fn a_worker_tells_the_shape_before_it_decodes() {
    let whole = palette_tiff();
    let cut = &whole[..whole.len() - 2];
    let request = pixel_request("tiff", cut.len() as u64);
    let mut worker = start_worker();
    let mut stdin = worker.stdin.take().unwrap();
    stdin.write_all(request.as_bytes()).unwrap();
    stdin.write_all(cut).unwrap();
    drop(stdin);
    let output = worker.wait_with_output().unwrap();
    let told = String::from_utf8(output.stdout).unwrap();
    let starts = [
        "{\"petcomp\":",
        "{\"picture\":{\"width\":2",
        "{\"refused\":",
    ];
    let is_each = told
        .lines()
        .zip(starts)
        .all(|(line, start)| line.starts_with(start));
    assert!(
        is_each && told.lines().count() == 3,
        "{}: {told}",
        output.status
    );
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

#[test]
fn an_empty_path_of_the_worker_is_none() {
    let folder = Folder::new();
    let picture = folder.with("palette.tif", &palette_tiff());
    let mut program = Command::new(env!("CARGO_BIN_EXE_petcomp"));
    program
        .args(["--oiio", "worker", "diff"])
        .args([&picture, &picture])
        .env("PETCOMP_OIIO_WORKER", "");
    let output = program.output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{told}");
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
