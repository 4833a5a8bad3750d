//! Far from the sample bottles: every end must be right or told.

use super::tests::{dropped, falling};
use super::*;
use crate::geom::UnitQuaternion;
use std::time::Instant;

/// Settles, prints a line of a table (`--nocapture`), and checks what a verdict promises.
fn end(name: &str, scene: Scene, options: &SettleOptions) -> Settled {
    let (cards, start) = (scene.objects.len(), Instant::now());
    let typical = world::typical_length(&scene);
    let settled = settle(scene, options).unwrap();
    let ms = start.elapsed().as_secs_f64() * 1e3;
    println!(
        "{name:34} {cards:4} cards {ms:8.1} ms {:6.2} s  overlap {:8.5} of a card  {:?} {:?}",
        settled.seconds,
        settled.overlap / typical,
        settled.verdict,
        settled.rejected
    );
    let falls = settled.scene.objects.iter().any(|object| matches!(object.placement, Placement::Drop { .. }));
    assert_eq!(falls, settled.verdict != Verdict::Rested, "{name}");
    if settled.verdict == Verdict::Rested {
        assert!(settled.overlap <= options.max_overlap * typical, "{name}");
        settled.scene.check().unwrap();
    }
    settled
}

fn rests(name: &str, scene: Scene) {
    let settled = end(name, scene, &SettleOptions::default());
    assert_eq!(settled.verdict, Verdict::Rested, "{name}");
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

#[test]
fn cards_of_any_thickness_rest() {
    for mm in [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0] {
        let scene = changed(dropped(1, 12), mm / 1e3, |_, object| object.thickness = mm / 1e3);
        rests(&format!("{mm} mm thick"), scene);
    }
}

#[test]
fn heaps_of_any_number_rest() {
    for cards in [1, 2, 5, 20, 60, 120] {
        rests("heap", dropped(2, cards));
    }
}

#[test]
fn scenes_of_any_scale_rest() {
    for by in [1e-4, 0.02, 1.0, 30.0, 1e4] {
        rests(&format!("{by} times as large"), scaled(dropped(3, 12), by));
    }
}

#[test]
fn masses_far_apart_rest() {
    for ratio in [10.0, 1e3, 1e6] {
        let scene =
            changed(dropped(4, 20), 0.0, |i, object| object.mass = if i % 2 == 0 { 0.03 } else { 0.03 * ratio });
        rests(&format!("masses 1 : {ratio}"), scene);
    }
}

#[test]
fn equal_cards_exactly_aligned_rest() {
    let upright = |_: usize, object: &mut Object| {
        let Placement::Drop { rotation, .. } = &mut object.placement else { return };
        *rotation = UnitQuaternion::identity();
    };
    let starts: Vec<([f64; 2], f64)> = (1..=20).map(|i| ([0.0, 0.0], 0.01 * f64::from(i))).collect();
    rests("aligned", changed(falling(&starts), 0.0, upright));
}

#[test]
fn cards_on_edge_rest() {
    let on_edge = |i: usize, object: &mut Object| {
        let Placement::Drop { rotation, .. } = &mut object.placement else { return };
        *rotation = UnitQuaternion::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, i as f64);
    };
    rests("on edge", changed(dropped(5, 12), 0.1, on_edge));
}

#[test]
fn a_card_as_long_as_the_box_is_wide_rests() {
    let scene = changed(falling(&[([0.0, 0.0], 0.1), ([0.0, 0.0], 0.2)]), 0.0, |i, object| {
        if i == 0 {
            object.size = [0.58, 0.08];
        }
    });
    rests("nearly as long as the box", Scene { surface: crate::scene::Surface { size: [0.6, 0.2] }, ..scene });
}

/// Nothing promises that these rest; that the end is right or told is checked in [`end`].
#[test]
fn what_may_not_rest_is_told() {
    let scene = || dropped(6, 20);
    let with = |name: &str, options: SettleOptions| end(name, scene(), &SettleOptions { attempts: 2, ..options });
    let usual = SettleOptions::default();
    with("no friction", SettleOptions { friction: 0.0, time_limit: 10.0, ..usual });
    with("all speed given back", SettleOptions { restitution: 1.0, time_limit: 10.0, ..usual });
    for times in [2.0, 4.0, 8.0, 16.0] {
        with(&format!("steps {times} times as long"), SettleOptions { step: usual.step * times, ..usual });
    }
    let larger = |_: usize, object: &mut Object| object.size = [0.9, 0.7];
    end("larger than the box", changed(dropped(6, 3), 0.3, larger), &usual);
    let overlapping = |_: usize, object: &mut Object| {
        let Placement::Drop { above, height, .. } = &mut object.placement else { return };
        (*above, *height) = ([0.0; 2], 0.1);
    };
    end("started in one place", changed(dropped(6, 12), 0.0, overlapping), &usual);
}
