//! petcomp's library where a peer is a library too: one piece of work, done a number of times in
//! one process.
//!
//! `peers TIMES WORK FILES..` is run by the scripts beside this file, on as many threads as it is
//! given cores. With 0 times it only reads: the difference of two processes is what the work costs.
//! `convert` reads and writes each time.

mod all_stages;

use all_stages::all_stages;
use petcomp::camera::{self, SolveOptions};
use petcomp::eval;
use petcomp::filter::Pyramid;
use petcomp::io::{self, Bits, WriteOptions};
use petcomp::matte::{
    self, KeyOptions, Keyed, Keying, PlateOptions, Screen, ScreenPlate, SegmentOptions,
};
use petcomp::settle::settle;
use petcomp::{Coverage, Image, LinearRgb, PremulRgba, Result};
use std::hint::black_box;
use std::path::Path;

fn main() -> std::process::ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    // `cargo bench` runs every bench with a word that is no number: nothing to do.
    let Some(times) = words.first().and_then(|word| word.parse().ok()) else {
        return std::process::ExitCode::SUCCESS;
    };
    let done = match words[1..] {
        ["key", photo, screen] => key(times, photo, screen, &KeyOptions::default()),
        ["key_all", photo, screen] => key(times, photo, screen, &all_stages(Default::default())),
        ["film", photo, mask] => film(times, photo, mask),
        ["cut", photo] => cut(times, photo),
        ["solve", ref labels @ ..] => solve(times, labels),
        ["rectify", photo, label, px_per_metre] => rectify(times, photo, label, px_per_metre),
        ["convert", from, to] => convert(times, from, to),
        ["settle", ref scenes @ ..] => fall(times, scenes),
        ["eval", found, truth] => evaluate(times, found, truth),
        _ => Err(petcomp::Error::value(
            "work",
            format!("{:?} is none that is known", &words[1..]),
        )),
    };
    match done {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            std::process::ExitCode::FAILURE
        }
    }
}

/// Every time into the same pictures, as a loop over frames does it.
fn key(times: usize, photo: &str, screen: &str, options: &KeyOptions) -> Result<()> {
    let photo: Image<PremulRgba> = io::read(photo)?;
    let channel = |k: usize| {
        screen
            .split(',')
            .nth(k)
            .and_then(|number| number.parse().ok())
            .unwrap_or(0.0)
    };
    let job = Keying::new(
        &photo,
        Screen::Color(LinearRgb::new(channel(0), channel(1), channel(2))),
    );
    let mut keyed = Keyed::default();
    (0..times).try_for_each(|_| job.run_into(options, black_box(&mut keyed)))
}

/// Film inside a given mask; the screen is fitted around it.
fn film(times: usize, photo: &str, mask: &str) -> Result<()> {
    let photo: Image<LinearRgb> = io::read(photo)?;
    let mask: Image<Coverage> = io::read(mask)?;
    (0..times).try_for_each(|_| film_within(&photo, &mask))
}

/// Film of an object that is searched for.
fn cut(times: usize, photo: &str) -> Result<()> {
    let photo: Image<LinearRgb> = io::read(photo)?;
    (0..times).try_for_each(|_| {
        film_within(
            &photo,
            &matte::segment(&photo, &SegmentOptions::default())?.tight,
        )
    })
}

fn film_within(photo: &Image<LinearRgb>, mask: &Image<Coverage>) -> Result<()> {
    let plate = ScreenPlate::fit_outside(photo, mask, &PlateOptions::default())?;
    black_box(matte::film(photo, &plate, mask, &Default::default())?);
    Ok(())
}

fn solve(times: usize, labels: &[&str]) -> Result<()> {
    let labels = labels
        .iter()
        .map(|path| camera::read_label(Path::new(path)))
        .collect::<Result<Vec<_>>>()?;
    (0..times).for_each(|_| {
        labels
            .iter()
            .for_each(|label| drop(black_box(camera::solve(label, &SolveOptions::default()))));
    });
    Ok(())
}

/// The pyramid counts: it is made anew for every photo.
fn rectify(times: usize, photo: &str, label: &str, px_per_metre: &str) -> Result<()> {
    let photo: Image<LinearRgb> = io::read(photo)?;
    let seen = camera::solve(
        &camera::read_label(Path::new(label))?,
        &SolveOptions::default(),
    )?;
    let px_per_metre = px_per_metre.parse().unwrap_or(seen.fit.px_per_metre);
    (0..times).try_for_each(|_| {
        let map = camera::rectify(
            &Pyramid::new(photo.clone()),
            &seen.camera,
            seen.k1(),
            seen.size,
            px_per_metre,
        )?;
        black_box(map);
        Ok(())
    })
}

/// Scene-linear floats in between; PNG gets 16 bits and EXR the half floats that are their default.
fn convert(times: usize, from: &str, to: &str) -> Result<()> {
    let bits = to.ends_with(".png").then_some(Bits::Sixteen);
    let options = WriteOptions {
        bits,
        ..Default::default()
    };
    (0..times).try_for_each(|_| io::write_with(to, &io::read::<LinearRgb>(from)?, &options))
}

fn fall(times: usize, scenes: &[&str]) -> Result<()> {
    let scenes = scenes
        .iter()
        .map(io::read_document)
        .collect::<Result<Vec<petcomp::Scene>>>()?;
    (0..times).try_for_each(|_| {
        scenes.iter().try_for_each(|scene| {
            black_box(settle(scene.clone(), &Default::default())?);
            Ok(())
        })
    })
}

/// Reads both files too, as the peer's timed part does; the COCO definition alone.
fn evaluate(times: usize, found: &str, truth: &str) -> Result<()> {
    (0..times).try_for_each(|_| {
        let mut all = eval::read_coco_truth(Path::new(truth))?;
        eval::read_coco_results(Path::new(found), &mut all)?;
        black_box(eval::coco(&all.sheets, &[]));
        Ok(())
    })
}
