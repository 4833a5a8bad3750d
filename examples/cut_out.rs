//! Cuts an object and its transparency out of a photo on a green or blue screen.
//!
//! `cargo run --release --example cut_out [PHOTO [CUT_OUT]]`

use petcomp::matte::{CutOutOptions, cut_out};
use petcomp::{Image, LinearRgb, Result, io};

fn main() -> Result<()> {
    let mut names = std::env::args().skip(1);
    let mut name = |default: &str| names.next().unwrap_or_else(|| default.into());
    let (photo, result) = (
        name("tests/samples/bottles/b0002_0.png"),
        name("cut_out.exr"),
    );
    let picture: Image<LinearRgb> = io::read(&photo)?;
    let cut = cut_out(&picture, &CutOutOptions::default()).map_err(|e| e.in_file(&photo))?;
    for diagnostic in &cut.diagnostics {
        println!("{photo}: {diagnostic} [{}]", diagnostic.code);
    }
    io::write(&result, &cut.to_rgba())?;
    let (width, height) = cut.film.size();
    println!("{result}: {width} x {height}");
    Ok(())
}
