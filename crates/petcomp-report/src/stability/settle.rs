//! Falls that are hard to settle: very thin and thick cards, very many, very small and large, of
//! very different masses, badly started.

use super::{HardCase, Outcome};
use petcomp::Result;
use petcomp::geom::{UnitQuaternion, Vector3};
use petcomp::scene::{Object, Placement, Scene, SettleOptions};
use petcomp::settle::{SettleVerdict, Settled, heap, octagon, settle, typical_length};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

/// More cards than this take seconds.
const MAX_TEST_CARDS: usize = 100;

/// The expected end of a fall.
#[derive(Clone, Copy)]
enum ExpectedEnd {
    /// [`SettleVerdict::Rested`].
    Rests,
    /// Any other verdict, or an error: the scene or its options are invalid.
    IsRefused,
    /// Either of these; only an end is expected.
    Ends,
}

/// A fall and what is expected of it.
struct HardFall {
    name: String,
    scene: Scene,
    options: SettleOptions,
    expectation: ExpectedEnd,
}

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let groups = [
        thicknesses()?,
        card_counts()?,
        box_sizes()?,
        mass_ratios()?,
        gravities()?,
        arrangements()?,
        frictionless_and_bouncing()?,
        impossible_falls()?,
    ];
    let falls = groups.into_iter().flatten().map(HardFall::into_case);
    Ok(falls.chain([empty_scene(), scene_at_rest()?]).collect())
}

fn empty_scene() -> HardCase {
    HardCase::new(
        "empty scene",
        "no card",
        "the scene as it is, after 0 s",
        || {
            let mut scene = heap(0, 1)?;
            scene.objects.clear();
            settle_settled(&scene)
        },
    )
}

fn scene_at_rest() -> Result<HardCase> {
    let scene = settle(heap(0, 5)?, &SettleOptions::default())?.into_scene()?;
    Ok(HardCase::new(
        "everything at rest",
        "5 cards that have come to rest",
        "the scene as it is, after 0 s",
        move || settle_settled(&scene),
    ))
}

fn settle_settled(scene: &Scene) -> Result<Outcome> {
    let end = settle(scene.clone(), &SettleOptions::default())?;
    let is_same = end.scene == *scene;
    let same = if is_same { "the same" } else { "another" };
    Ok(Outcome::new(
        format!("{:.2} s, {same}", end.seconds),
        is_same && end.seconds == 0.0,
    ))
}

impl HardFall {
    fn into_case(self) -> HardCase {
        let cards = self.scene.objects.len();
        let input = format!("{cards} card{}", if cards == 1 { "" } else { "s" });
        let Self {
            name,
            scene,
            options,
            expectation,
        } = self;
        let case = HardCase::new(name, input, expectation.description(&options), move || {
            Ok(expectation.outcome(&scene, &options))
        });
        if cards > MAX_TEST_CARDS {
            case.for_the_report()
        } else {
            case
        }
    }

    /// The same, with only an end expected.
    fn that_ends(self) -> Self {
        Self {
            expectation: ExpectedEnd::Ends,
            ..self
        }
    }

    /// The same, with other options, to be rejected.
    fn that_is_refused(self, options: SettleOptions) -> Self {
        Self {
            expectation: ExpectedEnd::IsRefused,
            options,
            ..self
        }
    }
}

impl ExpectedEnd {
    fn description(self, options: &SettleOptions) -> String {
        let [overlap, rise] =
            [options.max_overlap, options.max_energy_rise].map(|share| share * 100.0);
        match self {
            Self::Rests => format!(
                "rests; overlap at most {overlap} % of a card, energy rise at most {rise} %"
            ),
            Self::IsRefused => "rejected: it cannot be right".into(),
            Self::Ends => "ends in time, with a correct verdict".into(),
        }
    }

    fn outcome(self, scene: &Scene, options: &SettleOptions) -> Outcome {
        match settle(scene.clone(), options) {
            Ok(end) => {
                let passed = self.is_met(&end.verdict);
                Outcome::new(end_in_words(&end, typical_length(scene)), passed)
            }
            Err(error) => Outcome::new(error, matches!(self, Self::IsRefused)),
        }
    }

    fn is_met(self, verdict: &SettleVerdict) -> bool {
        let rested = *verdict == SettleVerdict::Rested;
        match self {
            Self::Rests => rested,
            Self::IsRefused => !rested,
            Self::Ends => true,
        }
    }
}

/// The end of a fall in words and numbers; `typical` is the length of a card, metres.
fn end_in_words(end: &Settled, typical: f64) -> String {
    let verdict = verdict_in_words(&end.verdict);
    let [overlap, rise] = [end.overlap / typical, end.energy_rise].map(|share| share * 100.0);
    let attempt = end.rejected.len() + 1;
    let seconds = end.seconds;
    format!(
        "{verdict} after {seconds:.2} s at attempt {attempt}; overlap {overlap:.4} %, energy rise {rise:.4} %"
    )
}

fn verdict_in_words(verdict: &SettleVerdict) -> String {
    match verdict {
        SettleVerdict::Rested => "rests".into(),
        SettleVerdict::TimedOut => "still moving".into(),
        SettleVerdict::Escaped(ids) => format!("{} escaped", ids.len()),
        SettleVerdict::Penetrating(_) => "sinks in".into(),
        SettleVerdict::Exploded(_) => "gains energy".into(),
        SettleVerdict::Hanging(ids) => format!("{} hanging", ids.len()),
    }
}

fn resting_fall(name: impl Into<String>, scene: Scene) -> HardFall {
    HardFall {
        name: name.into(),
        scene,
        options: SettleOptions::default(),
        expectation: ExpectedEnd::Rests,
    }
}

fn thicknesses() -> Result<Vec<HardFall>> {
    let all = [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
    all.into_iter().map(heap_of_thickness).collect()
}

fn heap_of_thickness(mm: f64) -> Result<HardFall> {
    let scene = changed(heap(1, 12)?, mm / 1e3, |_, object| {
        object.thickness = mm / 1e3
    });
    Ok(resting_fall(format!("{mm} mm thick"), scene))
}

fn card_counts() -> Result<Vec<HardFall>> {
    [1, 20, 60, 300].into_iter().map(heap_of_cards).collect()
}

fn heap_of_cards(n: usize) -> Result<HardFall> {
    let mut fall = resting_fall(format!("heap of {n}"), heap(2, n)?);
    if n > MAX_TEST_CARDS {
        // An attempt with many cards takes ten seconds.
        fall.options.attempts = 1;
    }
    Ok(fall)
}

/// With a box 0.6 m long.
fn box_sizes() -> Result<Vec<HardFall>> {
    [
        ("box of 0.06 mm", 1e-4),
        ("box of 1 cm", 1.0 / 60.0),
        ("box of 10 m", 10.0 / 0.6),
        ("box of 6 km", 1e4),
    ]
    .into_iter()
    .map(|(name, by)| Ok(resting_fall(name, scaled(heap(3, 12)?, by))))
    .collect()
}

fn mass_ratios() -> Result<Vec<HardFall>> {
    [10.0, 1e3, 1e6]
        .into_iter()
        .map(heap_of_mass_ratio)
        .collect()
}

/// Every other card is heavier.
fn heap_of_mass_ratio(ratio: f64) -> Result<HardFall> {
    let scene = changed(heap(4, 20)?, 0.0, |i, object| {
        object.mass = 0.03 * if i.is_multiple_of(2) { 1.0 } else { ratio }
    });
    Ok(resting_fall(format!("masses 1 : {ratio}"), scene))
}

fn gravities() -> Result<Vec<HardFall>> {
    let mut all = Vec::new();
    for factor in [0.1, 1.0, 10.0, 100.0] {
        let name = format!("gravity times {factor}");
        all.push(heap_under_gravity(name, [0.0, 0.0, -factor])?);
    }
    let tilted = [libm::sin(FRAC_PI_6), 0.0, -libm::cos(FRAC_PI_6)];
    all.push(heap_under_gravity(
        "box tilted by 30 degrees".into(),
        tilted,
    )?);
    Ok(all)
}

/// Gravity in multiples of that of the Earth.
fn heap_under_gravity(name: String, gravity: [f64; 3]) -> Result<HardFall> {
    let mut fall = resting_fall(name, heap(3, 12)?);
    fall.options.gravity = gravity.map(|x| 9.81 * x);
    Ok(fall)
}

fn arrangements() -> Result<Vec<HardFall>> {
    let aligned = changed(heap(0, 20)?, 0.0, align);
    let on_edge = changed(heap(5, 12)?, 0.1, set_on_edge);
    let long = changed(heap(0, 2)?, 0.0, align_long);
    let octagons = changed(heap(7, 20)?, 0.0, |_, object| {
        object.outline = octagon(object.size)
    });
    Ok(vec![
        resting_fall("equal and exactly aligned", aligned),
        resting_fall("on edge", on_edge),
        resting_fall("nearly as long as the box", long),
        resting_fall("octagons", octagons),
    ])
}

/// Equal cards, one exactly above another.
fn align(i: usize, object: &mut Object) {
    (object.size, object.thickness, object.mass) = ([0.2, 0.08], 0.005, 0.03);
    object.placement = Placement::Drop {
        above: [0.0; 2],
        height: 0.01 * (i + 1) as f64,
        rotation: UnitQuaternion::identity(),
    };
}

/// Aligned cards, the first of them as long as the box.
fn align_long(i: usize, object: &mut Object) {
    align(i, object);
    object.size[0] = if i == 0 { 0.58 } else { 0.2 };
}

fn set_on_edge(i: usize, object: &mut Object) {
    if let Placement::Drop { rotation, .. } = &mut object.placement {
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), i as f64);
        *rotation = yaw * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
    }
}

fn frictionless_and_bouncing() -> Result<Vec<HardFall>> {
    let mut slippery = resting_fall("no friction", heap(6, 20)?);
    slippery.scene.surface.friction = 0.0;
    let mut bouncing = resting_fall("no speed lost in a bounce", heap(6, 20)?);
    bouncing.scene.surface.restitution = 1.0;
    Ok([slippery, bouncing].map(shortened).into())
}

/// The same with fewer attempts; only an end is expected.
fn shortened(mut fall: HardFall) -> HardFall {
    (fall.options.time_limit, fall.options.attempts) = (10.0, 2);
    fall.that_ends()
}

fn impossible_falls() -> Result<Vec<HardFall>> {
    let larger = changed(heap(6, 3)?, 0.3, |_, object| object.size = [0.9, 0.7]);
    let in_one_place = changed(heap(6, 12)?, 0.0, drop_in_one_place);
    let mut longer_steps = resting_fall("steps 1.5 times as long", heap(6, 20)?).that_ends();
    longer_steps.options = with_step_times(1.5);
    let longest_steps = resting_fall("steps 4 times too long", heap(6, 20)?);
    Ok(vec![
        resting_fall("larger than the box", larger).that_is_refused(with_step_times(1.0)),
        resting_fall("started at the same position", in_one_place).that_ends(),
        longer_steps,
        longest_steps.that_is_refused(with_step_times(4.0)),
    ])
}

fn drop_in_one_place(_: usize, object: &mut Object) {
    if let Placement::Drop { above, height, .. } = &mut object.placement {
        (*above, *height) = ([0.0; 2], 0.1);
    }
}

fn with_step_times(factor: f64) -> SettleOptions {
    let mut options = SettleOptions {
        attempts: 2,
        ..SettleOptions::default()
    };
    options.step *= factor;
    options
}

/// The same cards, `by` times as large, with everything around them scaled, too.
fn scaled(mut scene: Scene, by: f64) -> Scene {
    scene.surface.size = scene.surface.size.map(|x| x * by);
    for object in &mut scene.objects {
        enlarge(object, by);
    }
    scene
}

fn enlarge(object: &mut Object, by: f64) {
    object.size = object.size.map(|x| x * by);
    object.thickness *= by;
    if let Placement::Drop { above, height, .. } = &mut object.placement {
        (*above, *height) = (above.map(|x| x * by), *height * by);
    }
}

/// The scene with each object changed; heights grow with `gap` so that thicker bodies still start
/// apart.
fn changed(mut scene: Scene, gap: f64, change: impl Fn(usize, &mut Object)) -> Scene {
    for (i, object) in scene.objects.iter_mut().enumerate() {
        change(i, object);
        if let Placement::Drop { height, .. } = &mut object.placement {
            *height += gap * (i + 1) as f64;
        }
    }
    scene
}
