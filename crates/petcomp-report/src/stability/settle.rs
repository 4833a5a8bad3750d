//! Falls that are hard to settle: very thin and thick cards, very many, very small and large, very unequal, started badly.

use super::{HardCase, Outcome};
use petcomp::Result;
use petcomp::geom::{UnitQuaternion, Vector3};
use petcomp::scene::{Object, Placement, Scene, SettleOptions};
use petcomp::settle::{SettleVerdict, Settled, heap, octagon, settle, typical_length};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

/// More cards than this take seconds.
const MANY: usize = 100;

/// What is promised of the end of a fall.
#[derive(Clone, Copy)]
enum ExpectedEnd {
    /// [`SettleVerdict::Rested`].
    Rests,
    /// Any other verdict, or an error: the scene or its options cannot be right.
    IsRefused,
    /// Either; nothing is promised but an end.
    IsTold,
}

/// A fall and what is promised of it.
struct HardFall {
    name: String,
    scene: Scene,
    options: SettleOptions,
    promise: ExpectedEnd,
}

/// Cards are 200 mm long where nothing else is said.
pub(super) fn cases() -> Result<Vec<HardCase>> {
    let groups = [
        thicknesses()?,
        numbers()?,
        scales()?,
        masses()?,
        gravities()?,
        arrangements()?,
        impossible()?,
    ];
    let falls = groups.into_iter().flatten().map(HardFall::into_case);
    Ok(falls.chain([empty(), at_rest()?]).collect())
}

fn empty() -> HardCase {
    HardCase::new(
        "empty scene",
        "no card",
        "the scene as it is, after 0 s",
        || {
            let mut scene = heap(0, 1)?;
            scene.objects.clear();
            Ok(unchanged(
                &scene,
                &settle(scene.clone(), &SettleOptions::default())?,
            ))
        },
    )
}

fn at_rest() -> Result<HardCase> {
    let scene = settle(heap(0, 5)?, &SettleOptions::default())?.into_scene()?;
    Ok(HardCase::new(
        "everything at rest",
        "5 cards that have come to rest",
        "the scene as it is, after 0 s",
        move || {
            Ok(unchanged(
                &scene,
                &settle(scene.clone(), &SettleOptions::default())?,
            ))
        },
    ))
}

fn unchanged(scene: &Scene, end: &Settled) -> Outcome {
    let same = end.scene == *scene;
    Outcome::new(
        format!(
            "{:.2} s, {}",
            end.seconds,
            if same { "the same" } else { "another" }
        ),
        same && end.seconds == 0.0,
    )
}

impl HardFall {
    fn into_case(self) -> HardCase {
        let cards = self.scene.objects.len();
        let input = if cards == 1 {
            "1 card".into()
        } else {
            format!("{cards} cards")
        };
        let Self {
            name,
            scene,
            options,
            promise,
        } = self;
        let case = HardCase::new(name, input, promise.told(&options), move || {
            Ok(promise.outcome(&scene, &options))
        });
        if cards > MANY {
            case.for_the_report()
        } else {
            case
        }
    }
}

impl ExpectedEnd {
    fn told(self, options: &SettleOptions) -> String {
        let [overlap, rise] =
            [options.max_overlap, options.max_energy_rise].map(|share| share * 100.0);
        match self {
            Self::Rests => format!(
                "rests; overlap at most {overlap} % of a card, energy rise at most {rise} %"
            ),
            Self::IsRefused => "refused: it cannot be right".into(),
            Self::IsTold => "an end in time, told for what it is".into(),
        }
    }

    fn outcome(self, scene: &Scene, options: &SettleOptions) -> Outcome {
        let end = match (settle(scene.clone(), options), self) {
            (Ok(end), _) => end,
            (Err(error), promise) => {
                return Outcome::new(error, matches!(promise, Self::IsRefused));
            }
        };
        let rested = end.verdict == SettleVerdict::Rested;
        let passed = match self {
            Self::Rests => rested,
            Self::IsRefused => !rested,
            Self::IsTold => true,
        };
        Outcome::new(told(&end, typical_length(scene)), passed)
    }
}

/// The end of a fall in words and numbers; `typical` is the length of a card, metres.
fn told(end: &Settled, typical: f64) -> String {
    let verdict = match &end.verdict {
        SettleVerdict::Rested => "rests".into(),
        SettleVerdict::TimedOut => "still moves".into(),
        SettleVerdict::Escaped(ids) => format!("{} escaped", ids.len()),
        SettleVerdict::Penetrating(_) => "sinks in".into(),
        SettleVerdict::Exploded(_) => "gains energy".into(),
        SettleVerdict::Hanging(ids) => format!("{} hang in the air", ids.len()),
    };
    let [overlap, rise] = [end.overlap / typical, end.energy_rise].map(|share| share * 100.0);
    let tries = end.rejected.len() + 1;
    format!(
        "{verdict} after {:.2} s at try {tries}; overlap {overlap:.4} %, energy rise {rise:.4} %",
        end.seconds
    )
}

fn extreme(name: impl Into<String>, scene: Scene) -> HardFall {
    HardFall {
        name: name.into(),
        scene,
        options: SettleOptions::default(),
        promise: ExpectedEnd::Rests,
    }
}

fn thicknesses() -> Result<Vec<HardFall>> {
    let of = |mm: f64| {
        let scene = changed(heap(1, 12)?, mm / 1e3, |_, object| {
            object.thickness = mm / 1e3
        });
        Ok(extreme(format!("{mm} mm thick"), scene))
    };
    [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0]
        .into_iter()
        .map(of)
        .collect()
}

fn numbers() -> Result<Vec<HardFall>> {
    let of = |n: usize| {
        let usual = extreme(format!("{n} in a heap"), heap(2, n)?);
        // A try of many takes ten seconds.
        let attempts = if n > MANY { 1 } else { usual.options.attempts };
        Ok(HardFall {
            options: SettleOptions {
                attempts,
                ..usual.options
            },
            ..usual
        })
    };
    [1, 20, 60, 300].into_iter().map(of).collect()
}

fn scales() -> Result<Vec<HardFall>> {
    // Of a box 0.6 m long.
    let of = |(name, by): (&str, f64)| Ok(extreme(name, scaled(heap(3, 12)?, by)));
    [
        ("box of 0.06 mm", 1e-4),
        ("box of 1 cm", 1.0 / 60.0),
        ("box of 10 m", 10.0 / 0.6),
        ("box of 6 km", 1e4),
    ]
    .into_iter()
    .map(of)
    .collect()
}

fn masses() -> Result<Vec<HardFall>> {
    let of = |ratio: f64| {
        let weigh = |i: usize, object: &mut Object| {
            object.mass = if i.is_multiple_of(2) {
                0.03
            } else {
                0.03 * ratio
            }
        };
        Ok(extreme(
            format!("masses 1 : {ratio}"),
            changed(heap(4, 20)?, 0.0, weigh),
        ))
    };
    [10.0, 1e3, 1e6].into_iter().map(of).collect()
}

fn gravities() -> Result<Vec<HardFall>> {
    let with = |name: String, g: [f64; 3]| -> Result<HardFall> {
        let options = SettleOptions {
            gravity: g.map(|x| 9.81 * x),
            ..SettleOptions::default()
        };
        Ok(HardFall {
            options,
            ..extreme(name, heap(3, 12)?)
        })
    };
    let mut all = Vec::new();
    for factor in [0.1, 1.0, 10.0, 100.0] {
        all.push(with(
            format!("gravity times {factor}"),
            [0.0, 0.0, -factor],
        )?);
    }
    let tilted = [libm::sin(FRAC_PI_6), 0.0, -libm::cos(FRAC_PI_6)];
    all.push(with("box tilted by 30 degrees".into(), tilted)?);
    Ok(all)
}

fn arrangements() -> Result<Vec<HardFall>> {
    let aligned = |i: usize, object: &mut Object| {
        (object.size, object.thickness, object.mass) = ([0.2, 0.08], 0.005, 0.03);
        let (above, height) = ([0.0; 2], 0.01 * (i + 1) as f64);
        object.placement = Placement::Drop {
            above,
            height,
            rotation: UnitQuaternion::identity(),
        };
    };
    let on_edge = |i: usize, object: &mut Object| {
        let Placement::Drop { rotation, .. } = &mut object.placement else {
            return;
        };
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
    let short = SettleOptions {
        time_limit: 10.0,
        attempts: 2,
        ..SettleOptions::default()
    };
    let told = |name: &str, scene| HardFall {
        promise: ExpectedEnd::IsTold,
        options: short,
        ..extreme(name, scene)
    };
    Ok(vec![
        extreme(
            "equal and exactly aligned",
            changed(heap(0, 20)?, 0.0, aligned),
        ),
        extreme("on edge", changed(heap(5, 12)?, 0.1, on_edge)),
        extreme(
            "nearly as long as the box",
            changed(heap(0, 2)?, 0.0, as_long),
        ),
        extreme(
            "octagons",
            changed(heap(7, 20)?, 0.0, |_, object| {
                object.outline = octagon(object.size)
            }),
        ),
        told("no friction", slippery),
        told("all speed given back", bouncing),
    ])
}

fn impossible() -> Result<Vec<HardFall>> {
    let refused = |name: &str, scene, options| HardFall {
        promise: ExpectedEnd::IsRefused,
        options,
        ..extreme(name, scene)
    };
    let usual = SettleOptions {
        attempts: 2,
        ..SettleOptions::default()
    };
    let longer = |times: f64| SettleOptions {
        step: usual.step * times,
        ..usual
    };
    let larger = changed(heap(6, 3)?, 0.3, |_, object| object.size = [0.9, 0.7]);
    let in_one_place = changed(heap(6, 12)?, 0.0, |_, object| {
        let Placement::Drop { above, height, .. } = &mut object.placement else {
            return;
        };
        (*above, *height) = ([0.0; 2], 0.1);
    });
    Ok(vec![
        refused("larger than the box", larger, usual),
        HardFall {
            promise: ExpectedEnd::IsTold,
            ..extreme("started in one place", in_one_place)
        },
        HardFall {
            promise: ExpectedEnd::IsTold,
            ..refused("steps twice as long", heap(6, 20)?, longer(2.0))
        },
        refused("steps 4 times too long", heap(6, 20)?, longer(4.0)),
    ])
}

/// The same cards, `by` times as large, with everything around them.
fn scaled(mut scene: Scene, by: f64) -> Scene {
    scene.surface.size = scene.surface.size.map(|x| x * by);
    for object in &mut scene.objects {
        object.size = object.size.map(|x| x * by);
        object.thickness *= by;
        let Placement::Drop { above, height, .. } = &mut object.placement else {
            continue;
        };
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
