//! The keyer's blur: Blender's sums against running sums, error against run time.
//!
//! The reference is the mean over the window in double precision, added up pixel by pixel from the matte before the blur.

use super::clock::timed;
use super::{Diagram, Point};
use petcomp::Image;
use petcomp::Result;
use petcomp::matte::key::Blur;
use petcomp::matte::{KeyOptions, Keying, Screen};
use petcomp::plot::three;
use petcomp::{Coverage, LinearRgb};

const SIZE: (usize, usize) = (640, 480);
/// Sizes of the blur, pixels: a window reaches one pixel less to every side.
const SIZES: [u32; 4] = [3, 10, 30, 100];
const RUNS: usize = 5;
const SCREEN: LinearRgb = LinearRgb::new(0.1, 0.75, 0.2);
/// Rows and columns between the pixels that are compared: coprime to all windows.
const STRIDE: usize = 7;

/// Error and time of both ways to blur, at several sizes.
///
/// # Errors
/// A thread that cannot be had.
pub fn diagrams() -> Result<Vec<Diagram>> {
    let photo = photo();
    let job = Keying::new(&photo, Screen::Color(SCREEN));
    let sharp = job.matte(&KeyOptions::default())?;
    let mut points = Vec::new();
    for (blur, name) in [
        (Blur::Exact, "Blender's order"),
        (Blur::RunningSum, "running sums"),
    ] {
        for size in SIZES {
            let options = KeyOptions {
                blur_post: size,
                blur,
                ..KeyOptions::default()
            };
            let (matte, seconds) = timed(RUNS, || job.matte(&options))?;
            let error = rms(&matte, &sharp, size as usize - 1);
            points.push(Point::new(name, format!("size {size}"), seconds, error));
        }
    }
    let ratio = |i: usize| three(points[i].cost / points[SIZES.len() + i].cost);
    let ratios: Vec<_> = SIZES
        .iter()
        .enumerate()
        .map(|(i, size)| format!("{} at size {size}", ratio(i)))
        .collect();
    let why = format!(
        "Sizes are different work, not different precision: compare the two forms at one size. Blender's order takes {} times \
         as long as running sums, and is further from the mean. It is the default all the same: its bits are Blender's, and \
         the default size is 0, which is no blur at all. `blur = \"running_sum\"` is for large sizes.",
        ratios.join(", ")
    );
    Ok(vec![Diagram {
        file: "matte_blur".into(),
        title: "matte: blur of the keyer".into(),
        input: format!(
            "a soft disc before a screen, {} x {}; key and blur",
            SIZE.0, SIZE.1
        ),
        error: "RMS error of the matte".into(),
        cost: "CPU seconds".into(),
        reference: "mean over the window in double precision (closed form)".into(),
        points,
        why,
        ..Diagram::default()
    }])
}

/// A soft disc of grey and red tiles before a screen with a slope of light.
fn photo() -> Image<LinearRgb> {
    const RADIUS: f32 = 160.0;
    const EDGE: f32 = 8.0;
    const TILE: usize = 40;
    Image::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (dx, dy) = (
            x as f32 - SIZE.0 as f32 / 2.0,
            y as f32 - SIZE.1 as f32 / 2.0,
        );
        let cover = ((RADIUS - (dx * dx + dy * dy).sqrt()) / EDGE + 0.5).clamp(0.0, 1.0);
        let front = if (x / TILE + y / TILE).is_multiple_of(2) {
            [0.6, 0.3, 0.2]
        } else {
            [0.75, 0.72, 0.7]
        };
        let light = 0.95 + 0.1 * x as f32 / SIZE.0 as f32;
        (LinearRgb::from(front).scale(cover) + SCREEN.scale(1.0 - cover)).scale(light)
    })
}

/// Root mean squared difference between a blurred matte and the means of the sharp one's windows, cut off at the border.
fn rms(blurred: &Image<Coverage>, sharp: &Image<Coverage>, radius: usize) -> f64 {
    let (w, h) = sharp.size();
    let window =
        |at: usize, length: usize| at.saturating_sub(radius)..(at + radius + 1).min(length);
    let places = (0..h)
        .step_by(STRIDE)
        .flat_map(|y| (0..w).step_by(STRIDE).map(move |x| (x, y)));
    let (mut squares, mut count) = (0.0, 0.0);
    for (x, y) in places {
        let (columns, rows) = (window(x, w), window(y, h));
        let area = (columns.len() * rows.len()) as f64;
        let sum: f64 = rows
            .map(|j| {
                sharp.row(j)[columns.clone()]
                    .iter()
                    .map(|c| f64::from(c.0))
                    .sum::<f64>()
            })
            .sum();
        squares += (f64::from(blurred[(x, y)].0) - sum / area).powi(2);
        count += 1.0;
    }
    (squares / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_blurs_are_the_mean_of_the_window() {
        let photo = photo();
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
                rms(&blurred, &sharp, 9) < 1e-6,
                "{blur:?}: {}",
                rms(&blurred, &sharp, 9)
            );
            assert!(
                rms(&blurred, &sharp, 8) > 1e-4,
                "a window of another size is told apart"
            );
        }
    }
}
