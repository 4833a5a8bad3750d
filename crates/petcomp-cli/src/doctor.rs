//! `petcomp doctor`: what this machine has, and whether petcomp works on it.

use crate::{exit, print};
use petcomp::io::ToFile;
use petcomp::{Error, Image, PremulRgba, Srgba8, io};
use std::process::Command;

/// Exit status if something that petcomp needs does not work.
const UNHEALTHY_STATUS: u8 = 1;

#[derive(clap::Args)]
pub(crate) struct DoctorArgs {}

/// Prints one line per check; the exit status is 1 if something that petcomp needs does not work.
pub(crate) fn run(_: &DoctorArgs) -> anyhow::Result<u8> {
    print::line(format_args!("petcomp {}", env!("CARGO_PKG_VERSION")));
    print::line(format_args!("threads  {}", rayon::current_num_threads()));
    let missing = "not found (only `make golden` needs it)";
    let blender = blender_version().unwrap_or_else(|| missing.into());
    print::line(format_args!("blender  {blender}"));
    let outcomes = [
        #[cfg(feature = "oiio")]
        report_check("oiio", worker_answers()),
        report_check("png", png_alpha()),
        report_check("exr", exr_round_trip()),
    ];
    let is_healthy = outcomes.iter().all(|&passed| passed);
    Ok(if is_healthy {
        exit::SUCCESS_STATUS
    } else {
        UNHEALTHY_STATUS
    })
}

/// First line of `blender --version`.
fn blender_version() -> Option<String> {
    let output = Command::new("blender").arg("--version").output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines().next().map(str::to_owned)
}

/// Prints the result of a check, and returns whether it passed.
fn report_check(name: &str, outcome: anyhow::Result<String>) -> bool {
    match &outcome {
        Ok(found) => print::line(format_args!("{name:8} {found}")),
        Err(error) => print::line(format_args!("{name:8} FAILED: {error:#}")),
    }
    outcome.is_ok()
}

/// The worker that reads what only OpenImageIO can.
#[cfg(feature = "oiio")]
fn worker_answers() -> anyhow::Result<String> {
    Ok(io::worker_version()?)
}

const HALF_WHITE: Srgba8 = Srgba8 {
    r: 255,
    g: 255,
    b: 255,
    a: 128,
};

/// Half-transparent white must come back as half of linear white, not of encoded white.
fn png_alpha() -> anyhow::Result<String> {
    let pixel = round_trip("half.png", HALF_WHITE)?;
    let red = petcomp::color::encode_srgb8(pixel.color()).r;
    anyhow::ensure!(
        red == 188,
        "half-transparent white reads as {red}/255, expected 188"
    );
    Ok("alpha is premultiplied in linear light".into())
}

/// What is read equals what was written.
fn exr_round_trip() -> anyhow::Result<String> {
    let value = PremulRgba::new(0.25, 3.5, -0.125, 0.5);
    let back = round_trip("value.exr", value)?;
    anyhow::ensure!(back == value, "what was read differs from what was written");
    Ok("values above 1 and below 0 survive".into())
}

/// Writes a picture of one value and reads back its last pixel.
fn round_trip<P: ToFile + Copy>(name: &str, value: P) -> anyhow::Result<PremulRgba> {
    let folder = tempfile::tempdir().map_err(|e| Error::file(std::env::temp_dir(), e))?;
    let path = folder.path().join(name);
    io::write(&path, &Image::filled(2, 2, value))?;
    Ok(io::read::<PremulRgba>(&path)?[(1, 1)])
}
