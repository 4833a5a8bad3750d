//! `petcomp doctor`: what this machine has, and whether petcomp works on it.

use crate::print;
use petcomp::{Image, PremulRgba, Srgba8, io};
use std::process::{Command, ExitCode};

#[derive(clap::Args)]
pub(crate) struct Args {}

/// One line per check; the exit status is 1 when something that petcomp needs does not work.
pub(crate) fn run(_: &Args) -> anyhow::Result<ExitCode> {
    print::line(format_args!("petcomp {}", env!("CARGO_PKG_VERSION")));
    print::line(format_args!("threads  {}", rayon::current_num_threads()));
    print::line(format_args!(
        "blender  {}",
        version_of("blender").unwrap_or_else(|| "not found (only `make golden` needs it)".into())
    ));
    let checks: [(&str, anyhow::Result<String>); 3] = [
        ("oiio", openimageio()),
        ("png", png_alpha()),
        ("exr", exr_round_trip()),
    ];
    let mut healthy = true;
    for (name, outcome) in checks {
        match outcome {
            Ok(found) => print::line(format_args!("{name:8} {found}")),
            Err(error) => {
                healthy = false;
                print::line(format_args!("{name:8} FAILED: {error:#}"));
            }
        }
    }
    Ok(if healthy {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// First line of `program --version`.
fn version_of(program: &str) -> Option<String> {
    let output = Command::new(program).arg("--version").output().ok()?;
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .next()
        .map(str::to_owned)
}

/// The worker that reads what only OpenImageIO can.
fn openimageio() -> anyhow::Result<String> {
    Ok(io::worker_version()?)
}

fn temporary() -> petcomp::Result<tempfile::TempDir> {
    tempfile::tempdir().map_err(|e| petcomp::Error::file(std::env::temp_dir(), e))
}

/// Half-transparent white must come back as half of linear white, not of encoded white.
fn png_alpha() -> anyhow::Result<String> {
    let folder = temporary()?;
    let path = folder.path().join("half.png");
    io::write(
        &path,
        &Image::filled(
            1,
            1,
            Srgba8 {
                r: 255,
                g: 255,
                b: 255,
                a: 128,
            },
        ),
    )?;
    let pixel = io::read::<PremulRgba>(&path)?[(0, 0)];
    let display = petcomp::color::encode_srgb8(pixel.color());
    anyhow::ensure!(
        display.r == 188,
        "half-transparent white reads as {}/255, expected 188",
        display.r
    );
    Ok("alpha is premultiplied in linear light".into())
}

/// What is written is what is read.
fn exr_round_trip() -> anyhow::Result<String> {
    let folder = temporary()?;
    let path = folder.path().join("value.exr");
    let value = PremulRgba::new(0.25, 3.5, -0.125, 0.5);
    io::write(&path, &Image::filled(2, 2, value))?;
    let back = io::read::<PremulRgba>(&path)?[(1, 1)];
    anyhow::ensure!(back == value, "what was written is not what is read");
    Ok("values above 1 and below 0 survive".into())
}
