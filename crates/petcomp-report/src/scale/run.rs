//! One point: a dataset made here and now.

use super::process::{cpu_seconds, peak_bytes};
use super::{Case, Point};
use crate::pile::{above, lamp};
use crate::settle::median_and_worst;
use petcomp::DeepImage;
use petcomp::asset::Texture;
use petcomp::camera::Camera;
use petcomp::dataset::{
    Obstructed, Pictures, Plan, Provenance, Sample, SampleRange, Sidecar, Split, Writer, Yolo,
    generate,
};
use petcomp::geom::{Point2, Pose, UnitQuaternion, Vector2, Vector3};
use petcomp::label::{LabelOptions, label};
use petcomp::render::{RenderOptions, render};
use petcomp::scene::{
    Appearance, CameraSource, Exposure, Grade, Object, Placement, Scene, Shot, Surface,
};
use petcomp::settle::{SettleOptions, heap, settle};
use petcomp::{Error, Image, LinearRgb, PremulRgba, Result, composite, work};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Height of the camera over the surface, and what it sees of it at 1:1, metres per pixel of focal length and width.
const HEIGHT: f64 = 1.1;
const FOCAL_BY_WIDTH: f64 = 1.166;
/// Where cards lie, metres: a bit less than what is seen.
const ROOM: [f64; 2] = [0.84, 0.6];
/// Width and length of a card, metres: a bottle.
const CARD: [f64; 2] = [0.07, 0.21];
/// Height of the pile, and most that a card adds to it, metres.
const PILE: f64 = 0.25;
const RISE: f64 = 0.006;
/// Different cut-outs.
const CUT_OUTS: usize = 5;
/// What else the machine does only ever adds to the time of a picture: the least of so many rounds counts.
const ROUNDS: u64 = 3;
/// Most pictures of a round.
const MOST: f64 = 1000.0;

/// Makes pictures of a kind for about so many seconds of work, one on each thread at least, and tells what they took.
///
/// For a process that does nothing else: memory is that of the whole process.
///
/// # Errors
/// A temporary folder that cannot be written; no threads; a system that does not tell.
pub fn run(case: &Case, seconds: f64) -> Result<Point> {
    let world = World::of(case);
    let pool = work::pool(case.threads).map_err(|e| Error::value("threads", e))?;
    let (first, layers) = Round::of(1, || pool.install(|| world.make(1)))?;
    // A picture that takes all of the time is made once more, others in several rounds.
    let rounds = if first.cpu < seconds { ROUNDS } else { 1 };
    let share =
        seconds * case.threads as f64 / (rounds as f64 * first.cpu.max(first.wall).max(1e-3));
    let pictures = share.ceil().clamp(case.threads as f64, MOST) as u64;
    let later =
        (0..rounds).map(|_| Ok(Round::of(pictures, || pool.install(|| world.make(pictures)))?.0));
    let later = later.collect::<Result<Vec<_>>>()?;
    let least = |of: fn(&Round) -> f64| later.iter().map(of).fold(f64::INFINITY, f64::min);
    Ok(Point {
        case: *case,
        layers,
        pictures: pictures * rounds,
        cpu_seconds: least(|round| round.cpu).min(first.cpu),
        rate: 1.0 / least(|round| round.wall),
        peak_bytes: peak_bytes()?,
    })
}

/// Seconds that a picture took in one round, of processors and of the clock.
struct Round {
    cpu: f64,
    wall: f64,
}

impl Round {
    fn of<T>(pictures: u64, make: impl FnOnce() -> Result<T>) -> Result<(Self, T)> {
        let (began, before) = (Instant::now(), cpu_seconds());
        let made = make()?;
        let each = |seconds: f64| seconds / pictures as f64;
        Ok((
            Self {
                cpu: each(cpu_seconds() - before),
                wall: each(began.elapsed().as_secs_f64()),
            },
            made,
        ))
    }
}

/// Median seconds of a processor until a heap of so many cards lies still.
pub(super) fn fall_seconds(cards: usize) -> Result<f64> {
    const HEAPS: u64 = 5;
    let seconds = |k| {
        let scene = heap(k, cards)?;
        let before = cpu_seconds();
        settle(scene, &SettleOptions::default())?;
        Ok(cpu_seconds() - before)
    };
    let seconds = (0..HEAPS).map(seconds).collect::<Result<Vec<_>>>()?;
    Ok(median_and_worst(seconds.into_iter())[0])
}

/// What pictures of a kind are made from.
struct World {
    scene: Scene,
    shot: Shot,
}

impl World {
    fn of(case: &Case) -> Self {
        let scene = scene(case);
        let textures: Vec<_> = (0..CUT_OUTS).map(|k| Texture::from(cut_out(k))).collect();
        let outline_uv: Arc<[Point2<f64>]> = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(Point2::from)
            .into();
        let look = |object: &Object| {
            let texture = textures[object.photo % CUT_OUTS].clone();
            Some(Appearance {
                class: 0,
                texture,
                back: None,
                outline_uv: outline_uv.clone(),
            })
        };
        let [w, h] = case.image.map(|side| side as usize);
        let plate = Image::from_fn(w, h, |x, y| {
            LinearRgb::grey(0.2 + 0.01 * ((7 * x + 13 * y) % 11) as f32)
        });
        let shot = scene
            .resolve(look, Some(Arc::new(plate)), None)
            .expect("the scene is known and its plate has its size");
        Self { scene, shot }
    }

    /// A dataset of so many pictures in a folder that is gone afterwards; tells the layers of one.
    fn make(&self, pictures: u64) -> Result<f64> {
        let folder = tempfile::tempdir().map_err(|e| Error::value("temporary folder", e))?;
        let layers = std::sync::OnceLock::new();
        let plan = plan(folder.path(), pictures);
        let make = |_| {
            let sample = self.sample();
            layers.get_or_init(|| mean_layers(&sample.deep));
            Ok(sample)
        };
        generate(&plan, make, &|_| {}, &AtomicBool::new(false))?;
        Ok(layers.into_inner().unwrap_or_default())
    }

    fn sample(&self) -> Sample {
        let deep = render(&self.shot, &RenderOptions::default());
        let frame = composite::frame(&deep, self.shot.plate.as_deref());
        let labels = label(&deep, &self.shot, &LabelOptions::default());
        Sample {
            deep,
            provenance: Some(Provenance::from_scene(self.scene.clone())),
            ..Sample::new(frame, labels)
        }
    }
}

fn plan(folder: &std::path::Path, count: u64) -> Plan {
    let writers: [Box<dyn Writer>; 3] = [
        Box::new(Pictures::default()),
        Box::new(Sidecar),
        Box::new(Yolo::default()),
    ];
    Plan {
        folder: folder.into(),
        count,
        range: SampleRange::All,
        seed: 0,
        recipe: serde_json::json!({ "made": "in code" }),
        classes: vec!["bottle".into()],
        split: Split::default(),
        obstructed: Obstructed::Keep,
        writers: writers.into(),
        inputs: Default::default(),
    }
}

fn mean_layers(deep: &DeepImage) -> f64 {
    let (w, h) = (deep.width(), deep.height());
    let samples: usize = (0..h)
        .flat_map(|y| (0..w).map(move |x| deep.at(x, y).len()))
        .sum();
    samples as f64 / (w * h) as f64
}

/// Cards in a heap under a lamp and an even sky, seen from above.
fn scene(case: &Case) -> Scene {
    let focal_px = Vector2::repeat(FOCAL_BY_WIDTH * f64::from(case.image[0]));
    let camera = Camera {
        focal_px,
        ..above(case.image, HEIGHT)
    };
    Scene {
        image: case.image,
        plate: "tray".into(),
        camera: CameraSource::Known(camera),
        surface: Surface::new([1.0, 0.7]),
        objects: (0..case.cards).map(|k| card(case, k)).collect(),
        lights: vec![lamp(LinearRgb::WHITE)],
        ambient: LinearRgb::grey(0.3),
        environment: None,
        exposure: Exposure::Ev(0.0),
        cast: Default::default(),
        finish: Default::default(),
        files: None,
        settings: Default::default(),
    }
}

/// Card `k` of a heap: spread evenly by the plastic number's sequence (Roberts, "The unreasonable effectiveness of
/// quasirandom sequences", 2018), each a little higher than the one before it.
fn card(case: &Case, k: usize) -> Object {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let share = |power: i32| (0.5 + (k + 1) as f64 * PLASTIC.powi(-power)).fract() - 0.5;
    let rise = RISE.min(PILE / case.cards as f64);
    let at = Vector3::new(
        ROOM[0] * share(1),
        ROOM[1] * share(2),
        rise * (k + 1) as f64,
    );
    Object {
        asset: "bottle".into(),
        photo: k,
        back: None,
        size: CARD.map(|side| side * case.scale),
        thickness: 0.5 * rise,
        outline: Vec::new(),
        mass: 0.02,
        placement: Placement::At(Pose::from_parts(
            at.into(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.4 * k as f64),
        )),
        grade: Grade {
            hue_deg: (7 * k % 60) as f32,
            saturation: 0.9,
            value: 1.1,
        },
    }
}

/// A bottle of 192 x 576 texels: soft outline, half see-through, striped.
fn cut_out(k: usize) -> Image<PremulRgba> {
    Image::from_fn(192, 576, |x, y| {
        let across = (x as f32 - 95.5).abs() / 96.0;
        let half_width = if y < 115 { 0.35 } else { 0.9 };
        let alpha = (20.0 * (half_width - across)).clamp(0.0, 1.0)
            * if (230..346).contains(&y) { 0.95 } else { 0.5 };
        let stripe = if (y / 6 + k).is_multiple_of(2) {
            0.75
        } else {
            0.35
        };
        PremulRgba::new(alpha * stripe, alpha * 0.6, alpha * (1.0 - stripe), alpha)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: Case = Case {
        threads: 2,
        image: [320, 240],
        cards: 5,
        scale: 1.0,
    };

    #[test]
    fn a_point_tells_time_memory_and_layers() {
        let point = run(&SMALL, 0.0).unwrap();
        assert_eq!((point.case, point.pictures), (SMALL, 2));
        assert!(point.rate > 0.0 && point.peak_bytes > 1e6 && point.cpu_seconds >= 0.0);
        // Five cards of 7 x 21 cm over 94 x 71 cm, of which bottles fill 0.79; soft borders touch a few pixels more.
        assert!((0.08..0.13).contains(&point.layers), "{}", point.layers);
    }

    #[test]
    fn larger_cards_are_more_layers_and_larger_pictures_are_not() {
        let layers = |case| mean_layers(&World::of(&case).sample().deep);
        let usual = layers(SMALL);
        assert!(
            layers(Case {
                scale: 2.0,
                ..SMALL
            }) > 2.5 * usual
        );
        assert!(
            (layers(Case {
                image: [640, 480],
                ..SMALL
            }) / usual
                - 1.0)
                .abs()
                < 0.15
        );
    }
}
