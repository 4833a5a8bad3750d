//! Far from the usual heap of bottles: every end must be right or told.

use super::{SettleOptions, Settled, Verdict, settle};
use crate::error::Result;
use crate::geom::{UnitQuaternion, Vector3};
use crate::scene::{Background, CameraSource, Choice, Object, Placement, Range, Recipe, Scene, Start};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};
use std::time::Instant;

/// A scene that tries the stage hard.
#[derive(Clone, Debug)]
pub struct Extreme {
    /// What is extreme about it.
    pub name: String,
    /// Its objects still fall.
    pub scene: Scene,
    /// How they shall come to rest.
    pub options: SettleOptions,
    /// What is promised of its end.
    pub promise: Promise,
}

/// What is promised of the end of a fall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Promise {
    /// [`Verdict::Rested`].
    Rests,
    /// Any other verdict, or an error: the scene or its options cannot be right.
    IsRefused,
    /// [`Verdict::Rested`], with all that it says, or another verdict.
    IsTold,
}

/// How an extreme scene ended.
#[derive(Clone, Debug, PartialEq)]
pub struct ExtremeEnd {
    /// What is extreme about it.
    pub name: String,
    /// Objects in it.
    pub cards: usize,
    /// What was promised.
    pub promise: Promise,
    /// How the last try ended; none where the options were refused at the door.
    pub verdict: Option<Verdict>,
    /// How many tries there were.
    pub tries: usize,
    /// Deepest overlap at the end, as a share of the typical card's length.
    pub overlap: f64,
    /// Most energy that appeared between two steps, as a share of what the drop gave away.
    pub energy_rise: f64,
    /// Simulated time to rest, seconds.
    pub seconds: f64,
    /// Time that it took, milliseconds, all tries together.
    pub wall_ms: f64,
}

impl Extreme {
    /// Settles it.
    pub fn run(&self) -> ExtremeEnd {
        let (typical, start) = (super::world::typical_length(&self.scene), Instant::now());
        let end = settle(self.scene.clone(), &self.options).ok();
        let number = |of: fn(&Settled) -> f64| end.as_ref().map_or(0.0, of);
        ExtremeEnd {
            name: self.name.clone(),
            cards: self.scene.objects.len(),
            promise: self.promise,
            tries: end.as_ref().map_or(0, |end| end.rejected.len() + 1),
            overlap: number(|end| end.overlap) / typical,
            energy_rise: number(|end| end.energy_rise),
            seconds: number(|end| end.seconds),
            wall_ms: start.elapsed().as_secs_f64() * 1e3,
            verdict: end.map(|end| end.verdict),
        }
    }
}

impl ExtremeEnd {
    /// Whether the promise was kept.
    pub fn is_as_promised(&self) -> bool {
        match self.promise {
            Promise::Rests => self.verdict == Some(Verdict::Rested),
            Promise::IsRefused => self.verdict != Some(Verdict::Rested),
            Promise::IsTold => true,
        }
    }
}

/// All extreme scenes; their cards are 200 mm long where nothing else is said.
///
/// # Errors
/// None that a caller can cause: scenes are drawn from a fixed recipe.
pub fn extremes() -> Result<Vec<Extreme>> {
    let groups = [thicknesses()?, numbers()?, scales()?, masses()?, gravities()?, arrangements()?, impossible()?];
    Ok(groups.into_iter().flatten().collect())
}

fn extreme(name: impl Into<String>, scene: Scene) -> Extreme {
    Extreme { name: name.into(), scene, options: SettleOptions::default(), promise: Promise::Rests }
}

fn thicknesses() -> Result<Vec<Extreme>> {
    let of = |mm: f64| {
        let scene = changed(heap(1, 12)?, mm / 1e3, |_, object| object.thickness = mm / 1e3);
        Ok(extreme(format!("{mm} mm thick"), scene))
    };
    [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0].into_iter().map(of).collect()
}

fn numbers() -> Result<Vec<Extreme>> {
    [1, 20, 60, 300].into_iter().map(|n| Ok(extreme(format!("{n} in a heap"), heap(2, n)?))).collect()
}

fn scales() -> Result<Vec<Extreme>> {
    // Of a box 0.6 m long.
    let of = |(name, by): (&str, f64)| Ok(extreme(name, scaled(heap(3, 12)?, by)));
    [("box of 0.06 mm", 1e-4), ("box of 1 cm", 1.0 / 60.0), ("box of 10 m", 10.0 / 0.6), ("box of 6 km", 1e4)]
        .into_iter()
        .map(of)
        .collect()
}

fn masses() -> Result<Vec<Extreme>> {
    let of = |ratio: f64| {
        let weigh = |i: usize, object: &mut Object| object.mass = if i.is_multiple_of(2) { 0.03 } else { 0.03 * ratio };
        Ok(extreme(format!("masses 1 : {ratio}"), changed(heap(4, 20)?, 0.0, weigh)))
    };
    [10.0, 1e3, 1e6].into_iter().map(of).collect()
}

fn gravities() -> Result<Vec<Extreme>> {
    let with = |name: String, g: [f64; 3]| -> Result<Extreme> {
        let options = SettleOptions { gravity: g.map(|x| 9.81 * x), ..SettleOptions::default() };
        Ok(Extreme { options, ..extreme(name, heap(3, 12)?) })
    };
    let mut all = Vec::new();
    for factor in [0.1, 1.0, 10.0, 100.0] {
        all.push(with(format!("gravity times {factor}"), [0.0, 0.0, -factor])?);
    }
    let tilted = [libm::sin(FRAC_PI_6), 0.0, -libm::cos(FRAC_PI_6)];
    all.push(with("box tilted by 30 degrees".into(), tilted)?);
    Ok(all)
}

fn arrangements() -> Result<Vec<Extreme>> {
    let aligned = |i: usize, object: &mut Object| {
        (object.size, object.thickness, object.mass) = ([0.2, 0.08], 0.005, 0.03);
        let (above, height) = ([0.0; 2], 0.01 * (i + 1) as f64);
        object.placement = Placement::Drop { above, height, rotation: UnitQuaternion::identity() };
    };
    let on_edge = |i: usize, object: &mut Object| {
        let Placement::Drop { rotation, .. } = &mut object.placement else { return };
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), i as f64);
        *rotation = yaw * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
    };
    let as_long = |i: usize, object: &mut Object| {
        aligned(i, object);
        object.size[0] = if i == 0 { 0.58 } else { 0.2 };
    };
    let mut slippery = heap(6, 20)?;
    slippery.surface.friction = 0.0;
    let mut bouncing = heap(6, 20)?;
    bouncing.surface.restitution = 1.0;
    let short = SettleOptions { time_limit: 10.0, attempts: 2, ..SettleOptions::default() };
    let told = |name: &str, scene| Extreme { promise: Promise::IsTold, options: short, ..extreme(name, scene) };
    Ok(vec![
        extreme("equal and exactly aligned", changed(heap(0, 20)?, 0.0, aligned)),
        extreme("on edge", changed(heap(5, 12)?, 0.1, on_edge)),
        extreme("nearly as long as the box", changed(heap(0, 2)?, 0.0, as_long)),
        extreme("octagons", changed(heap(7, 20)?, 0.0, |_, object| object.outline = octagon(object.size))),
        told("no friction", slippery),
        told("all speed given back", bouncing),
    ])
}

fn impossible() -> Result<Vec<Extreme>> {
    let refused = |name: &str, scene, options| Extreme { promise: Promise::IsRefused, options, ..extreme(name, scene) };
    let usual = SettleOptions { attempts: 2, ..SettleOptions::default() };
    let longer = |times: f64| SettleOptions { step: usual.step * times, ..usual };
    let larger = changed(heap(6, 3)?, 0.3, |_, object| object.size = [0.9, 0.7]);
    let in_one_place = changed(heap(6, 12)?, 0.0, |_, object| {
        let Placement::Drop { above, height, .. } = &mut object.placement else { return };
        (*above, *height) = ([0.0; 2], 0.1);
    });
    Ok(vec![
        refused("larger than the box", larger, usual),
        Extreme { promise: Promise::IsTold, ..extreme("started in one place", in_one_place) },
        Extreme { promise: Promise::IsTold, ..refused("steps twice as long", heap(6, 20)?, longer(2.0)) },
        refused("steps 4 times too long", heap(6, 20)?, longer(4.0)),
    ])
}

/// Cards of 200 x 70 and 190 x 80 mm, 2 to 11 mm thick, over a surface of 0.6 x 0.4 m: scene `k`.
pub(crate) fn heap(k: u64, cards: usize) -> Result<Scene> {
    let tray = Background {
        name: "tray".into(),
        size: [0.6, 0.4],
        camera: CameraSource::Rectangle {
            corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
            photo: [60, 40],
            focal_px: None,
        },
    };
    let choice = |i: usize| Choice {
        asset: format!("b{i}"),
        photo_sizes: vec![[0.2, 0.07], [0.19, 0.08]],
        photo_outlines: vec![],
        thickness: 0.002 + 0.001 * (i % 10) as f64,
        mass: 0.02 + 0.002 * (i % 10) as f64,
    };
    let recipe = Recipe { objects: Range::fixed(cards as f64), start: Start::default(), ..Recipe::default() };
    recipe.scene(0, k, &[tray], &(0..20).map(choice).collect::<Vec<_>>())
}

/// The same cards, `by` times as large, with everything around them.
fn scaled(mut scene: Scene, by: f64) -> Scene {
    scene.surface.size = scene.surface.size.map(|x| x * by);
    for object in &mut scene.objects {
        object.size = object.size.map(|x| x * by);
        object.thickness *= by;
        let Placement::Drop { above, height, .. } = &mut object.placement else { continue };
        (*above, *height) = (above.map(|x| x * by), *height * by);
    }
    scene
}

/// Each object changed; heights grow with `gap` so that thicker bodies still start apart.
fn changed(mut scene: Scene, gap: f64, change: impl Fn(usize, &mut Object)) -> Scene {
    for (i, object) in scene.objects.iter_mut().enumerate() {
        change(i, object);
        if let Placement::Drop { height, .. } = &mut object.placement {
            *height += gap * (i + 1) as f64;
        }
    }
    scene
}

/// An octagon that touches the middle half of each side of its card.
pub(super) fn octagon([w, h]: [f64; 2]) -> Vec<[f64; 2]> {
    let (x, y) = (w / 2.0, h / 2.0);
    let half = [[x, -y / 2.0], [x, y / 2.0], [x / 2.0, y], [-x / 2.0, y]];
    half.into_iter().chain(half.map(|[a, b]| [-a, -b])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `-- --nocapture` shows the table.
    #[test]
    fn every_extreme_ends_as_promised() {
        let mut broken = Vec::new();
        for extreme in extremes().unwrap() {
            // Seconds of work; the report has it.
            if extreme.scene.objects.len() > 100 {
                continue;
            }
            let end = extreme.run();
            println!("{end:?}");
            if !end.is_as_promised() {
                broken.push(end);
            }
        }
        assert!(broken.is_empty(), "{broken:#?}");
    }
}
