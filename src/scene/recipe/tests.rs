use super::*;
use crate::pixel::LinearRgb;
use crate::scene::{AssetVariant, Background, CameraSource, Exposure, Object, Placement};
use std::collections::BTreeSet;
use std::f64::consts::PI;

fn tray(name: &str) -> Background {
    Background {
        name: name.into(),
        size: [0.6, 0.4],
        k1: 0.0,
        albedo: None,
        camera: CameraSource::Rectangle {
            corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
            photo: [60, 40],
            focal_px: Some(55.0),
        },
    }
}

fn catalog(n: usize) -> Vec<AssetVariant> {
    let choice = |i| AssetVariant {
        asset: format!("b{i}"),
        photo_sizes: vec![[0.2, 0.07], [0.19, 0.08]],
        photo_outlines: vec![vec![[-0.1, -0.03], [0.1, -0.03], [0.0, 0.035]], vec![]],
        thickness: 0.005,
        mass: 0.03,
    };
    (0..n).map(choice).collect()
}

fn scene(recipe: &Recipe, k: u64) -> Scene {
    recipe
        .scene(7, k, &[tray("a"), tray("b")], &catalog(10))
        .unwrap()
}

#[test]
fn a_surface_of_known_albedo_decides_the_exposure() {
    let known = Background {
        albedo: Some(0.2),
        ..tray("a")
    };
    let exposure = |recipe: Recipe| {
        let scene = recipe.scene(7, 0, std::slice::from_ref(&known), &catalog(10));
        scene.unwrap().exposure
    };
    let fixed = Recipe {
        gain_ev: Range::fixed(0.0),
        ..Recipe::default()
    };
    let matched = |albedo| Exposure::MatchSurface {
        albedo,
        gain_ev: 0.0,
    };
    assert_eq!(exposure(fixed.clone()), matched(0.2));
    let own = Recipe {
        surface_albedo: Some(0.5),
        ..fixed
    };
    assert_eq!(exposure(own), matched(0.5));
}

fn names(scene: &Scene) -> Vec<(&str, usize)> {
    scene
        .objects
        .iter()
        .map(|o| (o.asset.as_str(), o.photo))
        .collect()
}

#[test]
fn an_empty_file_is_the_default() {
    assert_eq!(toml::from_str::<Recipe>("").unwrap(), Recipe::default());
}

#[test]
fn negatives_are_empty_and_leave_the_other_scenes_as_they_are() {
    let recipe = Recipe {
        negatives: 0.25,
        ..Recipe::default()
    };
    let empty: Vec<u64> = (0..200)
        .filter(|&k| scene(&recipe, k).objects.is_empty())
        .collect();
    // Binomial: 50 +- 6.1; four standard deviations.
    assert!((26..=74).contains(&empty.len()), "{}", empty.len());
    let k = (0..200).find(|k| !empty.contains(k)).unwrap();
    assert_eq!(scene(&recipe, k), scene(&Recipe::default(), k));
    assert!(
        Recipe {
            negatives: 1.5,
            ..Recipe::default()
        }
        .check()
        .unwrap_err()
        .to_string()
        .starts_with("negatives")
    );
}

#[test]
fn a_recipe_comes_back_from_toml_as_it_was() {
    let recipe = Recipe {
        selections: Selections::Count(50),
        lights: vec![],
        ..Recipe::default()
    };
    for recipe in [recipe, Recipe::default()] {
        let text = toml::to_string(&recipe).unwrap();
        assert_eq!(toml::from_str::<Recipe>(&text).unwrap(), recipe, "{text}");
    }
}

#[test]
fn a_file_says_only_what_it_wants_otherwise() {
    let text = "objects = 3\nselections = 5\n[start]\ntilt_deg = [0, 90]\n[[lights]]\nsize = 0.1\n[settle]\nmode = 'flat'";
    let recipe: Recipe = toml::from_str(text).unwrap();
    assert_eq!(
        (recipe.objects, recipe.selections),
        (Range::fixed(3.0), Selections::Count(5))
    );
    assert_eq!(
        (recipe.lights.len(), recipe.lights[0].size),
        (1, Range::fixed(0.1))
    );
    assert_eq!(recipe.start.gap, DropRanges::default().gap);
}

#[test]
fn what_a_file_cannot_say_is_told() {
    let reported = |text| toml::from_str::<Recipe>(text).unwrap_err().to_string();
    assert!(reported("object = 3").contains("unknown field `object`"));
    assert!(reported("selections = 0").contains("expected \"unique\" or a number above 0"));
    assert!(reported("selections = 'all'").contains("expected \"unique\" or a number above 0"));
    let wrong: Recipe = toml::from_str("lights = [{ size = [-1, 1] }]").unwrap();
    assert_eq!(
        wrong.check().unwrap_err().to_string(),
        "lights[0].size: [-1, 1], expected [min, max] within 0.0001 to 1000 m (from a point to a sky)"
    );
}

#[test]
fn nothing_to_choose_from_is_told() {
    let reported = |backgrounds: &[Background], catalog: &[AssetVariant]| {
        Recipe::default()
            .scene(0, 0, backgrounds, catalog)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        reported(&[], &catalog(1)),
        "backgrounds: none, expected at least one labelled photo"
    );
    assert!(
        reported(&[tray("a")], &[]).ends_with("asked for, but there is no asset to choose from")
    );
    let bare = AssetVariant {
        photo_sizes: vec![],
        ..catalog(1).remove(0)
    };
    assert_eq!(
        reported(&[tray("a")], &[bare]),
        "assets.b0: no photo, expected at least one"
    );
}

#[test]
fn no_object_asked_for_is_an_empty_scene() {
    let recipe = Recipe {
        objects: Range::fixed(0.0),
        ..Recipe::default()
    };
    assert!(
        recipe
            .scene(0, 0, &[tray("a")], &[])
            .unwrap()
            .objects
            .is_empty()
    );
}

#[test]
fn one_more_object_re_rolls_nothing_else() {
    let with = |n| {
        scene(
            &Recipe {
                objects: Range::fixed(n),
                ..Recipe::default()
            },
            4,
        )
    };
    let (few, more) = (with(5.0), with(6.0));
    assert_eq!(more.objects[..5], few.objects);
    assert_eq!(
        Scene {
            objects: few.objects.clone(),
            ..more
        },
        few
    );
}

#[test]
fn another_range_re_rolls_nothing_else() {
    let usual = scene(&Recipe::default(), 4);
    let grade = GradeRanges {
        hue_deg: Range::new(0.0, 1.0),
        ..Default::default()
    };
    let mut other = scene(
        &Recipe {
            grade,
            lights: vec![],
            gain_ev: Range::fixed(1.0),
            ..Recipe::default()
        },
        4,
    );
    assert_ne!(other.objects, usual.objects);
    for (a, b) in other.objects.iter_mut().zip(&usual.objects) {
        a.grade.hue_deg = b.grade.hue_deg;
    }
    assert_eq!(other.objects, usual.objects);
}

#[test]
fn assets_repeat_only_when_the_stock_is_used_up() {
    for k in 0..30 {
        let all = scene(
            &Recipe {
                objects: Range::fixed(25.0),
                ..Recipe::default()
            },
            k,
        );
        let distinct = |part: &[Object]| {
            part.iter()
                .map(|o| o.asset.clone())
                .collect::<BTreeSet<_>>()
                .len()
        };
        let parts = [
            distinct(&all.objects[..10]),
            distinct(&all.objects[10..20]),
            distinct(&all.objects[20..]),
        ];
        assert_eq!(parts, [10, 10, 5]);
    }
}

#[test]
fn every_asset_photo_and_background_is_used_as_often() {
    let recipe = Recipe {
        objects: Range::fixed(2.0),
        ..Recipe::default()
    };
    let scenes: Vec<Scene> = (0..2000).map(|k| scene(&recipe, k)).collect();
    let share =
        |claim: &dyn Fn(&Object) -> bool| scenes.iter().filter(|s| claim(&s.objects[1])).count();
    // Binomial, 2000 draws: standard deviation 13 at 1/10 and 22 at 1/2.
    (0..10).for_each(|i| assert!(share(&|o| o.asset == format!("b{i}")).abs_diff(200) < 5 * 13));
    assert!(share(&|o| o.photo == 1).abs_diff(1000) < 5 * 22);
    assert!(
        scenes
            .iter()
            .filter(|s| s.plate == "a")
            .count()
            .abs_diff(1000)
            < 5 * 22
    );
}

#[test]
fn so_many_selections_are_made_as_are_asked_for() {
    let distinct = |selections| {
        let recipe = Recipe {
            selections,
            objects: Range::new(4.0, 6.0),
            ..Recipe::default()
        };
        let scenes: Vec<Scene> = (0..60).map(|k| scene(&recipe, k)).collect();
        scenes.iter().map(names).collect::<BTreeSet<_>>().len()
    };
    assert_eq!(
        (distinct(Selections::Count(7)), distinct(Selections::Unique)),
        (7, 60)
    );
}

#[test]
fn a_selection_used_again_starts_anew() {
    let recipe = Recipe {
        selections: Selections::Count(2),
        ..Recipe::default()
    };
    let (a, b) = (scene(&recipe, 1), scene(&recipe, 3));
    assert_eq!(names(&a), names(&b));
    assert!(
        a.objects
            .iter()
            .zip(&b.objects)
            .all(|(a, b)| a.placement != b.placement && a.grade != b.grade)
    );
}

#[test]
fn drawn_values_stay_in_their_ranges() {
    let recipe = Recipe::default();
    for k in 0..200 {
        let scene = scene(&recipe, k);
        assert!((4..=12).contains(&scene.objects.len()));
        for object in &scene.objects {
            let scale = object.thickness / 0.005;
            assert!(
                (0.9..=1.1).contains(&scale) && (object.mass / 0.03 - scale.powi(3)).abs() < 1e-12
            );
            assert!(object.grade.hue_deg.abs() <= 20.0);
            assert!(matches!(object.placement, Placement::Drop { .. }));
        }
        let [x, y, z] = scene.lights[0].position;
        assert!((0.8..=1.6).contains(&z) && x.hypot(y) <= 0.8 + 1e-12);
    }
}

#[test]
fn friction_and_bounce_are_drawn_for_a_scene() {
    let recipe = Recipe {
        friction: Range::new(0.2, 0.6),
        restitution: Range::new(0.0, 0.3),
        ..Recipe::default()
    };
    let drawn: Vec<Surface> = (0..50).map(|k| scene(&recipe, k).surface).collect();
    assert!(
        drawn
            .iter()
            .all(|s| (0.2..0.6).contains(&s.friction) && (0.0..0.3).contains(&s.restitution))
    );
    assert!(drawn.iter().any(|s| s.friction < 0.25) && drawn.iter().any(|s| s.friction > 0.55));
    let wrong = Recipe {
        restitution: Range::new(0.0, 1.2),
        ..Recipe::default()
    };
    assert_eq!(
        wrong.check().unwrap_err().to_string(),
        "restitution: [0, 1.2], expected [min, max] within 0 to 1 (a share)"
    );
}

#[test]
fn hulls_fall_only_where_they_are_asked_for_and_known_and_grow_with_their_card() {
    let with = |collider| {
        scene(
            &Recipe {
                collider,
                objects: Range::fixed(9.0),
                ..Recipe::default()
            },
            2,
        )
        .objects
    };
    let (boxes, hulls) = (with(Collider::Box), with(Collider::Hull));
    assert!(boxes.iter().all(|object| object.outline.is_empty()));
    assert!(
        hulls.iter().any(|object| object.photo == 0)
            && hulls.iter().any(|object| object.photo == 1)
    );
    for object in &hulls {
        let top = object.outline.last().map(|corner| corner[1]);
        assert_eq!(
            top,
            (object.photo == 0).then_some(0.035 * object.size[0] / 0.2),
            "{object:?}"
        );
    }
}

#[test]
fn the_ambient_is_a_share_of_the_light_at_the_centre() {
    // 10 W straight above at 1 m: irradiance 10 / pi; half of it from a dome of radiance L: pi L.
    let light = LightRanges {
        height: Range::fixed(1.0),
        offset: Range::fixed(0.0),
        ..LightRanges::default()
    };
    let recipe = Recipe {
        lights: vec![light],
        ambient: Range::fixed(0.5),
        ..Recipe::default()
    };
    let expected = 0.5 * (10.0 / PI) / PI;
    assert!((f64::from(scene(&recipe, 0).ambient.r) - expected).abs() < 1e-6);
    let dark = Recipe {
        lights: vec![],
        ambient: Range::fixed(0.5),
        ..Recipe::default()
    };
    assert_eq!(scene(&dark, 0).ambient, LinearRgb::grey(0.5));
}
