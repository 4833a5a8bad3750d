//! Against rendered photos with ground truth: `PETCOMP_WORLD=FOLDER cargo test --release --lib
//! film::tests::world -- --ignored --nocapture`, FOLDER holding photos with their `_fg`, `_trans`,
//! `_view`, `_mask` and `_plate` pictures.

use super::*;
use crate::io;
use crate::matte::{
    KeyOptions, Keying, Screen, TriangulateOptions, Triangulated, screen_color, triangulate,
};
use std::path::Path;

const BACKGROUNDS: [[f32; 3]; 5] = [
    [0.3, 0.3, 0.3],
    [0.7, 0.7, 0.7],
    [0.05, 0.05, 0.06],
    [0.5, 0.25, 0.12],
    [0.12, 0.3, 0.55],
];

struct Truth {
    photo: Image<LinearRgb>,
    f: Image<LinearRgb>,
    t: Image<LinearRgb>,
    v: Image<LinearRgb>,
    k: Image<LinearRgb>,
    mask: Image<Coverage>,
}

fn read(folder: &Path, name: &str) -> Truth {
    let at = |end: &str| folder.join(format!("{name}{end}"));
    let rgb = |end: &str| io::read::<LinearRgb>(at(end)).unwrap();
    let codes = rgb("_view.png");
    // Linear codes, which the reader took for display-encoded ones.
    let v = codes
        .map(|p| p.map(|c| f32::from(crate::color::encode_srgb8(LinearRgb::grey(c)).r) / 255.0));
    let mask = io::read(at("_mask.png")).unwrap();
    Truth {
        photo: rgb(".png"),
        f: rgb("_fg.exr"),
        t: rgb("_trans.exr"),
        v,
        k: rgb("_plate.exr"),
        mask,
    }
}

impl Truth {
    fn error(&self, film: &Image<Film>, through: &Image<LinearRgb>) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for i in (0..film.pixels().len()).filter(|&i| self.mask.pixels()[i].0 > 0.02) {
            for b in BACKGROUNDS.map(LinearRgb::from) {
                let told: [f32; 3] = film.pixels()[i].over_color(b).into();
                let real: [f32; 3] = (self.f.pixels()[i] + through.pixels()[i] * b).into();
                sum += told
                    .iter()
                    .zip(real)
                    .map(|(a, r)| f64::from((a - r).abs()))
                    .sum::<f64>();
                count += 3.0;
            }
        }
        sum / count
    }

    /// `F + T * screen` with sensor noise.
    fn simulated(&self, screen: &Image<LinearRgb>, seed: u64) -> Image<LinearRgb> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut out = self
            .f
            .zip_map(&self.t.zip_map(screen, |t, k| t * k), |f, s| f + s);
        for p in out.pixels_mut() {
            *p = p.map(|v| {
                let grain = (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
                v + grain * (0.006 * 0.006 * v.max(0.0) + 0.002 * 0.002).sqrt()
            });
        }
        out
    }

    fn paper(&self, photo: &Image<LinearRgb>) -> Image<Film> {
        let color = screen_color(photo, &self.mask).unwrap();
        let keyed = Keying::new(photo, Screen::Color(color))
            .run(&KeyOptions::default())
            .unwrap();
        keyed.cutout.zip_map(&self.mask, |p, m| p.masked(m).into())
    }

    /// The same screen as a board of some other paint.
    fn board(&self, paint: LinearRgb) -> Image<LinearRgb> {
        let light = self.k.pixels().iter().map(|p| p.max_channel());
        let most = light.fold(0.0, f32::max);
        self.k.map(|p| paint.scale(p.max_channel() / most))
    }

    /// Mean error of alpha over the object.
    fn alpha_error(&self, film: &Image<Film>) -> f64 {
        let pairs = film
            .pixels()
            .iter()
            .zip(self.v.pixels())
            .zip(self.mask.pixels());
        let errors = pairs
            .filter(|(_, c)| c.0 > 0.02)
            .map(|((f, v), _)| f64::from((f.to_rgba().a - (1.0 - (v.r + v.g + v.b) / 3.0)).abs()));
        let (sum, count) = errors.fold((0.0, 0_u64), |(sum, count), e| (sum + e, count + 1));
        sum / count.max(1) as f64
    }

    /// The same screen in the other colour.
    fn other_screen(&self) -> Image<LinearRgb> {
        let other = if strongest_channel(self.k[(0, 0)]) == 1 {
            BLUE
        } else {
            GREEN
        };
        let level = |p: LinearRgb| p.max_channel() / other.g.max(other.b);
        self.k.map(|p| other.scale(level(p)))
    }

    fn two(&self) -> Triangulated {
        let screens = [self.k.clone(), self.other_screen()];
        let photos = [
            self.simulated(&screens[0], 1),
            self.simulated(&screens[1], 2),
        ];
        let plates = [0, 1].map(|i| ScreenPlate {
            image: screens[i].clone(),
            ..ScreenPlate::even(GREEN, self.k.size())
        });
        triangulate(
            &[(&photos[0], &plates[0]), (&photos[1], &plates[1])],
            &self.mask,
            &TriangulateOptions::default(),
        )
        .unwrap()
    }
}

fn plate_around(photo: &Image<LinearRgb>, mask: &Image<Coverage>) -> ScreenPlate {
    ScreenPlate::fit_outside(photo, mask, &PlateOptions::default()).unwrap()
}

fn plate_error(plate: &ScreenPlate, truth: &Truth) -> f64 {
    let pairs = plate.image.pixels().iter().zip(truth.k.pixels());
    let differs: Vec<f64> = pairs
        .map(|(a, b)| {
            f64::from(
                (a.r - b.r)
                    .abs()
                    .max((a.g - b.g).abs())
                    .max((a.b - b.b).abs())
                    / b.r.max(b.g).max(b.b),
            )
        })
        .collect();
    differs.iter().sum::<f64>() / differs.len() as f64
}

/// Every photo of the folder with its name.
fn truths() -> impl Iterator<Item = (String, Truth)> {
    let folder = std::env::var("PETCOMP_WORLD").expect("PETCOMP_WORLD names a folder");
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut names: Vec<String> = entries
        .filter_map(|e| {
            e.unwrap()
                .file_name()
                .to_str()?
                .strip_suffix("_fg.exr")
                .map(String::from)
        })
        .collect();
    names.sort();
    names.into_iter().map(move |name| {
        let truth = read(Path::new(&folder), &name);
        (name, truth)
    })
}

/// Paints of boards that tell nothing of film, scene-linear as seen.
const BOARDS: [[f32; 3]; 6] = [
    [0.02; 3],
    [0.15; 3],
    [0.4; 3],
    [0.75; 3],
    [0.7, 0.62, 0.5],
    [0.3, 0.38, 0.32],
];

#[test]
#[ignore = "needs a folder of rendered photos, and minutes"]
fn errors_on_grey_boards() {
    let mut worse = Vec::new();
    for paint in BOARDS.map(LinearRgb::from) {
        let mut rows = Vec::new();
        for (name, truth) in truths() {
            let photo = truth.simulated(&truth.board(paint), 5);
            let plate = plate_around(&photo, &truth.mask);
            let found = film(&photo, &plate, &truth.mask, &FilmOptions::default()).unwrap();
            let opaque: Image<Film> =
                photo.zip_map(&truth.mask, |p, m| p.opaque().masked(m).into());
            let paper = truth.paper(&photo);
            let both = |film: &Image<Film>| [truth.alpha_error(film), truth.error(film, &truth.v)];
            let row = [both(&opaque), both(&paper), both(&found.film)];
            if row[2][1] > row[1][1] {
                worse.push(format!("{name} on {paint:?}: {row:.4?}"));
            }
            rows.push(row.concat());
        }
        let mean = |c: usize| rows.iter().map(|r| r[c]).sum::<f64>() / rows.len() as f64;
        let told: Vec<f64> = (0..6).map(mean).collect();
        println!("{paint:?}: alpha and light of opaque, paper, guess: {told:.4?}");
    }
    println!("worse than the paper:\n{}", worse.join("\n"));
    assert!(worse.is_empty());
}

#[test]
#[ignore = "needs a folder of rendered photos, and minutes"]
fn doubts_follow_errors() {
    for (name, truth) in truths() {
        let other = truth.simulated(&truth.other_screen(), 3);
        for (screen, photo) in [("own", &truth.photo), ("other", &other)] {
            let plate = plate_around(photo, &truth.mask);
            let found = film(photo, &plate, &truth.mask, &FilmOptions::default()).unwrap();
            let (lit, shaded) = (
                truth.error(&found.film, &truth.v),
                truth.error(&shaded(&found.film, &found.transmittance), &truth.t),
            );
            let hue = strongest_channel(plate.color());
            println!(
                "{name} {screen} {hue} {lit:.4} {shaded:.4} {:?} {:?}",
                found.flat, found.color_uncertainty
            );
        }
    }
}

#[test]
#[ignore = "needs a folder of rendered photos, and minutes"]
fn errors_on_rendered_photos() {
    let mut rows = Vec::new();
    for (name, truth) in truths() {
        let started = std::time::Instant::now();
        let plate = plate_around(&truth.photo, &truth.mask);
        let fitted = started.elapsed();
        let one = film(&truth.photo, &plate, &truth.mask, &FilmOptions::default()).unwrap();
        let ms = started.elapsed().as_secs_f64() * 1e3;
        let simulated = truth.simulated(&truth.k, 1);
        let clean = film(&simulated, &plate, &truth.mask, &FilmOptions::default()).unwrap();
        let two = truth.two();
        let (paper, paper_clean) = (truth.paper(&truth.photo), truth.paper(&simulated));
        let row = [
            truth.error(&paper, &truth.t),
            truth.error(&shaded(&one.film, &one.transmittance), &truth.t),
            truth.error(&paper, &truth.v),
            truth.error(&one.film, &truth.v),
            truth.error(&paper_clean, &truth.t),
            truth.error(&shaded(&clean.film, &clean.transmittance), &truth.t),
            truth.error(&shaded(&two.film, &two.transmittance), &truth.t),
            truth.error(&paper_clean, &truth.v),
            truth.error(&clean.film, &truth.v),
            truth.error(&two.film, &truth.v),
            plate_error(&plate, &truth),
            ms,
        ];
        let flat = one.flat;
        println!(
            "{name} {} degree {:?} uneven {:.2} plate {:.1} ms flat {:.2} {:.2} {:.2} {:?}",
            row.map(|v| format!("{v:.4}")).join(" "),
            plate.degree,
            plate.unevenness,
            fitted.as_secs_f64() * 1e3,
            flat.r,
            flat.g,
            flat.b,
            one.diagnostics
        );
        rows.push(row);
    }
    let mean: Vec<f64> = (0..rows[0].len())
        .map(|c| rows.iter().map(|r| r[c]).sum::<f64>() / rows.len() as f64)
        .collect();
    println!("mean {mean:.4?}");
    println!(
        "one screen over paper: shaded {:.3}, lit by itself {:.3}",
        mean[1] / mean[0],
        mean[3] / mean[2]
    );
    println!(
        "simulated: one {:.3} and {:.3}, two {:.3} and {:.3}",
        mean[5] / mean[4],
        mean[8] / mean[7],
        mean[6] / mean[4],
        mean[9] / mean[7]
    );
    assert!(mean[1] < mean[0] && mean[3] < mean[2]);
}
