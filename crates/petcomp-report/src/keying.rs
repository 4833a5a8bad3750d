//! The keyer's blur: Blender's sums compared with running sums, error against run time.
//!
//! The reference is the mean over the window in double precision, summed pixel by pixel from the
//! unblurred matte.

use super::clock::timed;
use super::{Diagram, Point};
use petcomp::matte::key::Blur;
use petcomp::matte::{KeyOptions, Keying, Screen};
use petcomp::plot::three;
use petcomp::{Coverage, Image, LinearRgb, Result};
use std::ops::Range;

const SIZE: (usize, usize) = (640, 480);
/// Sizes of the blur, pixels: a window extends one pixel less to every side.
const BLUR_SIZES_PX: [u32; 4] = [3, 10, 30, 100];
const TIMED_RUNS: usize = 5;
const SCREEN: LinearRgb = LinearRgb::new(0.1, 0.75, 0.2);
/// Rows and columns between the pixels that are compared: coprime to all windows.
const SAMPLE_STRIDE_PX: usize = 7;
/// The disc in the photo: its radius, the width of its edge and the side of its tiles.
const DISC_RADIUS_PX: f32 = 160.0;
const DISC_EDGE_PX: f32 = 8.0;
const DISC_TILE_PX: usize = 40;

/// Error and time of both kinds of blur, at several sizes.
pub(crate) fn diagrams() -> Result<Vec<Diagram>> {
    let photo = disc_photo();
    let job = Keying::new(&photo, Screen::Color(SCREEN));
    let exact = measure_blur(&job, Blur::Exact, "Blender's order")?;
    let running = measure_blur(&job, Blur::RunningSum, "running sums")?;
    let (w, h) = SIZE;
    Ok(vec![Diagram {
        file: "matte_blur".into(),
        title: "matte: blur of the keyer".into(),
        input: format!("a soft disc in front of a screen, {w} x {h}; key and blur"),
        error: "RMS error of the matte".into(),
        cost: "CPU seconds".into(),
        reference: "mean over the window in double precision (closed form)".into(),
        why: why_exact(&exact, &running),
        points: [exact, running].concat(),
        ..Diagram::default()
    }])
}

/// A point for each size.
fn measure_blur(job: &Keying<'_, LinearRgb>, blur: Blur, name: &str) -> Result<Vec<Point>> {
    let sharp = job.matte(&KeyOptions::default())?;
    BLUR_SIZES_PX
        .into_iter()
        .map(|size| {
            let options = blurred_by(size, blur);
            let (matte, seconds) = timed(TIMED_RUNS, || job.matte(&options))?;
            let error = rms_from_means(&matte, &sharp, size as usize - 1);
            Ok(Point::new(name, format!("size {size}"), seconds, error))
        })
        .collect()
}

fn blurred_by(blur_post: u32, blur: Blur) -> KeyOptions {
    KeyOptions {
        blur_post,
        blur,
        ..KeyOptions::default()
    }
}

/// Why the slower form is the default.
fn why_exact(exact: &[Point], running: &[Point]) -> String {
    let pairs = exact.iter().zip(running).zip(BLUR_SIZES_PX);
    let ratios: Vec<_> = pairs
        .map(|((exact, running), size)| {
            format!("{} at size {size}", three(exact.cost / running.cost))
        })
        .collect();
    format!(
        "Sizes differ in work, not in precision: compare the two forms at one size. Blender's order takes {} times as \
         long as running sums, and is further from the mean. It is still the default, since it is bit-identical to \
         Blender and the default size is 0, which means no blur. Use `blur = \"running_sum\"` for large sizes.",
        ratios.join(", ")
    )
}

/// A soft disc of grey and red tiles in front of a screen with a gradient of light.
fn disc_photo() -> Image<LinearRgb> {
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let cover = disc_coverage(x, y);
        let light = 0.95 + 0.1 * x as f32 / SIZE.0 as f32;
        (disc_color(x, y).scale(cover) + SCREEN.scale(1.0 - cover)).scale(light)
    })
}

fn disc_coverage(x: usize, y: usize) -> f32 {
    let dx = x as f32 - SIZE.0 as f32 / 2.0;
    let dy = y as f32 - SIZE.1 as f32 / 2.0;
    let inside = (DISC_RADIUS_PX - (dx * dx + dy * dy).sqrt()) / DISC_EDGE_PX;
    (inside + 0.5).clamp(0.0, 1.0)
}

fn disc_color(x: usize, y: usize) -> LinearRgb {
    if (x / DISC_TILE_PX + y / DISC_TILE_PX).is_multiple_of(2) {
        LinearRgb::new(0.6, 0.3, 0.2)
    } else {
        LinearRgb::new(0.75, 0.72, 0.7)
    }
}

/// Root mean squared difference between a blurred matte and the means of the sharp one's windows,
/// clipped at the border.
fn rms_from_means(blurred: &Image<Coverage>, sharp: &Image<Coverage>, radius: usize) -> f64 {
    let (w, h) = sharp.size();
    let (mut squares, mut count) = (0.0, 0.0);
    for y in (0..h).step_by(SAMPLE_STRIDE_PX) {
        for x in (0..w).step_by(SAMPLE_STRIDE_PX) {
            let mean = window_mean(sharp, (x, y), radius);
            squares += (f64::from(blurred[(x, y)].0) - mean).powi(2);
            count += 1.0;
        }
    }
    (squares / count).sqrt()
}

fn window_mean(sharp: &Image<Coverage>, (x, y): (usize, usize), radius: usize) -> f64 {
    let (w, h) = sharp.size();
    let (columns, rows) = (window(x, radius, w), window(y, radius, h));
    let area = (columns.len() * rows.len()) as f64;
    let sum: f64 = rows.map(|j| row_sum(&sharp.row(j)[columns.clone()])).sum();
    sum / area
}

fn window(at: usize, radius: usize, length: usize) -> Range<usize> {
    at.saturating_sub(radius)..(at + radius + 1).min(length)
}

fn row_sum(row: &[Coverage]) -> f64 {
    row.iter().map(|c| f64::from(c.0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_blurs_are_the_mean_of_the_window() {
        let photo = disc_photo();
        let job = Keying::new(&photo, Screen::Color(SCREEN));
        let sharp = job.matte(&KeyOptions::default()).unwrap();
        for blur in [Blur::Exact, Blur::RunningSum] {
            let blurred = job
                .matte(&KeyOptions {
                    blur_post: 10,
                    blur,
                    ..KeyOptions::default()
                })
                .unwrap();
            assert!(
                rms_from_means(&blurred, &sharp, 9) < 1e-6,
                "{blur:?}: {}",
                rms_from_means(&blurred, &sharp, 9)
            );
            assert!(
                rms_from_means(&blurred, &sharp, 8) > 1e-4,
                "a window of another size is distinguished"
            );
        }
    }
}
