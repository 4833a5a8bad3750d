use super::*;
use crate::asset::Role;
use crate::camera::{Camera, tilted_camera};
use crate::color::Albedo;
use crate::geom::{Point3, Vector2, Vector3};
use crate::light::irradiance;
use crate::pixel::LinearRgb;
use crate::scene::{
    AssetVariant, Background, Bend, CameraSource, Exposure, GradeRanges, LightShape, Object,
    Placement, Wall,
};
use std::collections::BTreeSet;
use std::f64::consts::PI;

pub(super) fn tray(name: &str) -> Background {
    let camera = CameraSource::Rectangle {
        corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
        photo: [60, 40],
        focal_px: Some(55.0),
    };
    Background::new(name, [0.6, 0.4], camera)
}

pub(super) fn catalog(n: usize) -> Vec<AssetVariant> {
    let choice = |i| AssetVariant {
        asset: format!("b{i}"),
        role: Role::Object,
        photo_sizes: vec![[0.2, 0.07], [0.19, 0.08]],
        photo_outlines: vec![vec![[-0.1, -0.03], [0.1, -0.03], [0.0, 0.035]], vec![]],
        thickness: 0.005,
        mass: 0.03,
    };
    (0..n).map(choice).collect()
}

fn of_count(objects: u32) -> Recipe {
    Recipe {
        objects: Count::fixed(objects),
        ..Recipe::default()
    }
}

fn scene(recipe: &Recipe, k: u64) -> Scene {
    recipe
        .scene(7, k, &[tray("a"), tray("b")], &catalog(10))
        .unwrap()
}

/// The same with caps as distractors among the bottles.
fn catalog_with_caps() -> Vec<AssetVariant> {
    let caps = (0..3).map(|i| AssetVariant {
        asset: format!("cap{i}"),
        role: Role::Distractor,
        photo_sizes: vec![[0.03, 0.03]],
        ..catalog(1).remove(0)
    });
    let mut all: Vec<_> = caps.collect();
    all.extend(catalog(10));
    all
}

fn with_caps(distractors: Count, k: u64) -> (Scene, Vec<Drawn>) {
    let recipe = Recipe {
        distractors,
        ..Recipe::default()
    };
    let places = [tray("a"), tray("b")];
    recipe
        .explained(7, k, &places, &catalog_with_caps())
        .unwrap()
}

fn start_height(object: &Object) -> f64 {
    match object.placement {
        Placement::Drop { height, .. } => height,
        Placement::At(_) | Placement::Gone => panic!("objects of a recipe fall"),
    }
}

/// The object without its height in the stack.
fn apart_from_height(object: &Object) -> Object {
    let mut object = object.clone();
    if let Placement::Drop { height, .. } = &mut object.placement {
        *height = 0.0;
    }
    object
}

#[test]
fn distractors_come_from_their_own_part_and_move_no_draw_of_an_object() {
    for k in 0..40 {
        let bare = scene(&Recipe::default(), k);
        let (mixed, _) = with_caps(Range::new(1.0, 5.0).into(), k);
        let (objects, caps) = mixed.objects.split_at(bare.objects.len());
        assert!(
            caps.iter()
                .all(|o| o.role == Role::Distractor && o.asset.starts_with("cap"))
        );
        assert!((1..=5).contains(&caps.len()));
        assert!(objects.iter().all(|o| o.role == Role::Object));
        let same = |objects: &[Object]| objects.iter().map(apart_from_height).collect::<Vec<_>>();
        assert_eq!(same(objects), same(&bare.objects));
        let without = Scene {
            objects: bare.objects.clone(),
            ..mixed.clone()
        };
        assert_eq!(without, bare);
    }
}

#[test]
fn where_there_are_no_distractors_nothing_is_drawn_for_them() {
    let (scene_of_default, draws) = with_caps(Count::default(), 3);
    assert_eq!(scene_of_default, scene(&Recipe::default(), 3));
    assert!(draws.iter().all(|draw| !draw.path.contains("distractor")));
    let text = toml::to_string(&Recipe::default()).unwrap();
    assert!(!text.contains("distractors"), "{text}");
}

#[test]
fn distractors_fall_among_the_objects_none_touching_another() {
    let (mut lowest, mut highest) = (0, 0);
    for k in 0..60 {
        let (scene, _) = with_caps(Count::fixed(1), k);
        let heights: Vec<f64> = scene.objects.iter().map(start_height).collect();
        let (cap, bottles) = heights.split_last().unwrap();
        lowest += usize::from(bottles.iter().all(|height| height > cap));
        highest += usize::from(bottles.iter().all(|height| height < cap));
        let mut sorted = heights.clone();
        sorted.sort_by(f64::total_cmp);
        assert!(sorted.windows(2).all(|pair| pair[1] - pair[0] > 0.005));
    }
    // 4 to 12 bottles: one place of 5 to 13 is the lowest, one the highest.
    assert!(
        (1..30).contains(&lowest) && (1..30).contains(&highest),
        "{lowest} {highest}"
    );
}

#[test]
fn distractors_that_no_asset_is_are_told() {
    let recipe = Recipe {
        distractors: Count::fixed(2),
        ..Recipe::default()
    };
    let told = recipe.scene(7, 0, &[tray("a")], &catalog(10)).unwrap_err();
    assert_eq!(
        told.to_string(),
        "distractors: 2 requested, but no asset has the role \"distractor\""
    );
    // And before the first picture, however rarely they are drawn.
    let seldom = Recipe {
        distractors: Range::new(0.0, 1.0).into(),
        ..Recipe::default()
    };
    let told = seldom.check_room(&[tray("a")], &catalog(10)).unwrap_err();
    assert!(
        told.to_string().starts_with("distractors: 1 requested"),
        "{told}"
    );
    // An asset that is never drawn may have any size.
    let mut huge = catalog_with_caps();
    huge[0].photo_sizes = vec![[3.0, 3.0]];
    assert!(Recipe::default().check_room(&[tray("a")], &huge).is_ok());
    let told = recipe.check_room(&[tray("a")], &huge).unwrap_err();
    assert!(told.to_string().contains("cap0"), "{told}");
}

#[test]
fn negatives_come_from_all_backgrounds_whatever_the_viewpoints() {
    let recipe = Recipe {
        negatives: 0.5,
        viewpoints: Take::First(1),
        ..Recipe::default()
    };
    let scenes: Vec<Scene> = (0..200).map(|k| scene(&recipe, k)).collect();
    let (empty, full): (Vec<_>, Vec<_>) = scenes.iter().partition(|s| s.objects.is_empty());
    assert!(full.iter().all(|s| s.plate == "a"));
    // Binomial, about 100 draws: 50 +- 5.
    let on_second = empty.iter().filter(|s| s.plate == "b").count();
    assert!(on_second.abs_diff(empty.len() / 2) < 25, "{on_second}");
    // Except in the ablation, where negatives use only the first background, too.
    let off = Recipe {
        off: vec![Variation::Viewpoint],
        ..recipe
    };
    assert!((0..200).all(|k| scene(&off, k).plate == "a"));
}

#[test]
fn a_lens_must_not_fold_the_pictures_of_negatives_over_either() {
    let seen = Background {
        camera: CameraSource::Known(Camera {
            focal_px: Vector2::new(150.0, 152.0),
            ..tilted_camera()
        }),
        ..tray("b")
    };
    let mut recipe = Recipe {
        viewpoints: Take::First(1),
        negatives: 0.1,
        ..Recipe::default()
    };
    recipe.lens.k1 = Range::new(-1.5, 0.0);
    let places = [tray("a"), seen];
    let told = recipe.check_room(&places, &catalog(10)).unwrap_err();
    let told = told.to_string();
    assert!(
        told.starts_with("lens.k1: -1.5,") && told.ends_with("(background b)"),
        "{told}"
    );
    recipe.negatives = 0.0;
    assert!(recipe.check_room(&places, &catalog(10)).is_ok());
}

#[test]
fn at_most_once_is_an_error_where_there_are_too_few_assets() {
    let once = |objects: Range| Recipe {
        objects: objects.into(),
        at_most_once: true,
        ..Recipe::default()
    };
    let told = |recipe: &Recipe| {
        let e = recipe.check_room(&[tray("a")], &catalog(10)).unwrap_err();
        e.to_string()
    };
    let expected = "objects: 12 requested, but there are 10 assets of role \"object\" and \
                    at_most_once is true; expected objects up to 10";
    assert_eq!(told(&once(Range::new(4.0, 12.0))), expected);
    let fixed = once(Range::fixed(12.0));
    let drawn = fixed.scene(7, 0, &[tray("a")], &catalog(10)).unwrap_err();
    assert_eq!(drawn.to_string(), expected);
    let few = once(Range::new(4.0, 10.0));
    assert!(few.check_room(&[tray("a")], &catalog(10)).is_ok());
    // Scenes without repeated assets are unchanged.
    let usual = Recipe {
        at_most_once: false,
        ..few.clone()
    };
    assert!((0..20).all(|k| scene(&few, k) == scene(&usual, k)));
}

#[test]
fn counts_are_drawn_from_a_histogram() {
    let text = "objects = { values = [2, 7], weights = [1, 3] }";
    let recipe: Recipe = toml::from_str(text).unwrap();
    let counts: Vec<usize> = (0..400).map(|k| scene(&recipe, k).objects.len()).collect();
    let sevens = counts.iter().filter(|count| **count == 7).count();
    assert!(counts.iter().all(|count| [2, 7].contains(count)));
    // Binomial: 300 +- 8.7; four standard deviations.
    assert!(sevens.abs_diff(300) < 35, "{sevens}");
}

#[test]
fn a_surface_of_known_albedo_decides_the_exposure() {
    let known = Background {
        albedo: Some(Albedo::Luminance(0.2)),
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
        albedo: Albedo::Luminance(albedo),
        gain_ev: 0.0,
    };
    assert_eq!(exposure(fixed.clone()), matched(0.2));
    let own = Recipe {
        surface_albedo: Some(Albedo::Luminance(0.5)),
        ..fixed
    };
    assert_eq!(exposure(own), matched(0.5));
}

#[test]
fn a_surface_reflects_at_most_all_of_the_light() {
    let checked = |albedo: &str| {
        let recipe: Recipe = toml::from_str(&format!("surface_albedo = {albedo}")).unwrap();
        recipe.check().map_err(|e| e.to_string())
    };
    for (albedo, told) in [("2", "2"), ("[0.1, 0.5, 4]", "4")] {
        let expected = "expected 0.001 to 1 (a share of the light)";
        assert_eq!(
            checked(albedo),
            Err(format!("surface_albedo: {told}, {expected}"))
        );
    }
    assert_eq!(checked("1"), Ok(()));
}

#[test]
fn a_surface_of_known_colour_tells_that_of_the_light_too() {
    let albedo = LinearRgb::new(0.1, 0.2, 0.4);
    let blue = Background {
        albedo: Some(Albedo::Color(albedo)),
        ..tray("a")
    };
    let cast = |cast| {
        let recipe = Recipe {
            cast,
            ..Recipe::default()
        };
        let scene = recipe.scene(7, 0, std::slice::from_ref(&blue), &catalog(10));
        scene.unwrap().cast
    };
    let matched = |share, albedo| LightTint::MatchSurface { share, albedo };
    assert_eq!(cast(LightTint::default()), matched(1.0, albedo));
    assert_eq!(cast(matched(0.5, LinearRgb::WHITE)), matched(0.5, albedo));
    assert_eq!(cast(matched(0.0, LinearRgb::WHITE)), matched(0.0, albedo));
    let own = LightTint::Known(LinearRgb::new(2.0, 1.0, 0.5));
    assert_eq!(cast(own), own);
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
    let wrong = Recipe {
        negatives: 1.5,
        ..Recipe::default()
    };
    let told = wrong.check().unwrap_err().to_string();
    assert!(told.starts_with("negatives"));
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
        (Count::fixed(3), Selections::Count(5))
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
        reported(&[tray("a")], &[]).ends_with("requested, but there is no asset to choose from")
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
    let drawn = of_count(0).scene(0, 0, &[tray("a")], &[]).unwrap();
    assert!(drawn.objects.is_empty());
}

#[test]
fn one_more_object_re_rolls_nothing_else() {
    let [few, more] = [5, 6].map(|n| scene(&of_count(n), 4));
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
    let recipe = Recipe {
        grade,
        lights: vec![],
        gain_ev: Range::fixed(1.0),
        ..Recipe::default()
    };
    let mut other = scene(&recipe, 4);
    assert_ne!(other.objects, usual.objects);
    for (a, b) in other.objects.iter_mut().zip(&usual.objects) {
        a.grade.hue_deg = b.grade.hue_deg;
    }
    assert_eq!(other.objects, usual.objects);
}

#[test]
fn assets_repeat_only_when_the_stock_is_used_up() {
    for k in 0..30 {
        let all = scene(&of_count(25), k);
        let distinct = |part: &[Object]| {
            let assets: BTreeSet<_> = part.iter().map(|o| &o.asset).collect();
            assets.len()
        };
        let parts: Vec<usize> = all.objects.chunks(10).map(distinct).collect();
        assert_eq!(parts, [10, 10, 5]);
    }
}

#[test]
fn every_asset_photo_and_background_is_used_as_often() {
    let scenes: Vec<Scene> = (0..2000).map(|k| scene(&of_count(2), k)).collect();
    let share =
        |claim: &dyn Fn(&Object) -> bool| scenes.iter().filter(|s| claim(&s.objects[1])).count();
    // Binomial, 2000 draws: standard deviation 13 at 1/10 and 22 at 1/2.
    (0..10).for_each(|i| assert!(share(&|o| o.asset == format!("b{i}")).abs_diff(200) < 5 * 13));
    assert!(share(&|o| o.photo == 1).abs_diff(1000) < 5 * 22);
    let on_first = scenes.iter().filter(|s| s.plate == "a").count();
    assert!(on_first.abs_diff(1000) < 5 * 22);
}

#[test]
fn sequences_have_so_many_selections_as_are_asked_for() {
    let distinct = |frames: u64, recipe: Recipe| {
        let belt = toml::from_str(&format!("frames = {frames}\nframe_rate = 10\nspeed = 0.1"));
        let recipe = Recipe {
            belt: Some(belt.unwrap()),
            ..recipe
        };
        let scenes: Vec<Scene> = (0..60).map(|n| scene(&recipe, n * frames)).collect();
        scenes.iter().map(names).collect::<BTreeSet<_>>().len()
    };
    let counted = |n| Recipe {
        selections: Selections::Count(n),
        ..Recipe::default()
    };
    // Frames that share a divisor with the number of selections, and that are a multiple of it.
    assert_eq!(
        [2, 3, 7, 14].map(|frames| distinct(frames, counted(7))),
        [7; 4]
    );
    assert_eq!(distinct(10, counted(50)), 50);
    let off = Recipe {
        off: vec![Variation::Selection],
        ..Recipe::default()
    };
    assert_eq!(
        (distinct(50, off), distinct(50, Recipe::default())),
        (50, 60)
    );
}

#[test]
fn so_many_selections_are_made_as_are_asked_for() {
    let distinct = |selections| {
        let recipe = Recipe {
            selections,
            objects: Range::new(4.0, 6.0).into(),
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
    let (a, b) = (scene(&recipe, 1), scene(&recipe, 2));
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
fn an_object_may_weigh_what_any_asset_does_at_any_scale() {
    for (mass, scale) in [(1e-6, 0.01), (1e6, 2.0)] {
        let recipe = Recipe {
            scale: Range::fixed(scale),
            ..Recipe::default()
        };
        let asset = AssetVariant {
            mass,
            ..catalog(1).remove(0)
        };
        let scene = recipe.scene(7, 0, &[tray("a")], &[asset]).unwrap();
        let object = &scene.objects[0];
        assert!((object.mass / (mass * scale.powi(3)) - 1.0).abs() < 1e-12);
        scene.check().unwrap();
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
        let recipe = Recipe {
            collider,
            ..of_count(9)
        };
        scene(&recipe, 2).objects
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
    for (shape, size) in [
        (LightShape::Ellipse, 0.05),
        (LightShape::Ellipse, 2.0),
        (LightShape::Rectangle, 0.6),
    ] {
        let light = LightRanges {
            shape,
            height: Range::fixed(0.8),
            offset: Range::fixed(0.3),
            size: Range::fixed(size),
            ..LightRanges::default()
        };
        let recipe = Recipe {
            lights: vec![light],
            ambient: Range::fixed(0.5),
            ..Recipe::default()
        };
        let scene = scene(&recipe, 0);
        let lit = irradiance(&scene.lights[0], Point3::origin(), Vector3::z());
        // A dome of radiance L gives pi L.
        let share = PI * f64::from(scene.ambient.r / lit.r);
        assert!(
            (share / 0.5 - 1.0).abs() < 0.01,
            "{shape:?} {size}: {share}"
        );
    }
    let dark = Recipe {
        lights: vec![],
        ambient: Range::fixed(0.5),
        ..Recipe::default()
    };
    assert_eq!(scene(&dark, 0).ambient, LinearRgb::grey(0.5));
}

/// Where the objects of a scene start.
fn starts(scene: &mut Scene) -> Vec<&mut [f64; 2]> {
    let starts = scene
        .objects
        .iter_mut()
        .map(|object| match &mut object.placement {
            Placement::Drop { above, .. } => above,
            _ => panic!("not dropped"),
        });
    starts.collect()
}

#[test]
fn walls_and_places_move_no_other_draw() {
    let read = |text: &str| toml::from_str::<Recipe>(text).unwrap();
    let walls = read("walls = { height = [0.02, 0.1], slope_deg = [0, 20] }");
    let even = read("start = { spread = [0.5, 1] }");
    let by_cells = read("start = { positions = [[1, 0, 1]] }");
    for k in 0..20 {
        let plain = scene(&Recipe::default(), k);
        assert_eq!(plain.surface.wall, None);
        let mut walled = scene(&walls, k);
        let wall = walled.surface.wall.take().unwrap();
        assert!((0.02..0.1).contains(&wall.height) && (0.0..20.0).contains(&wall.slope_deg));
        assert_eq!(walled, plain);
        for recipe in [&even, &by_cells] {
            let mut moved = scene(recipe, k);
            assert_ne!(moved, plain);
            let mut plain = plain.clone();
            for (moved, plain) in starts(&mut moved).into_iter().zip(starts(&mut plain)) {
                *moved = *plain;
            }
            assert_eq!(moved, plain);
        }
    }
}

#[test]
fn labelled_walls_are_those_of_the_scene() {
    let wall = Wall::new([0.6, 0.4], Some(0.07), None);
    let labelled = Background {
        wall: Some(wall),
        ..tray("a")
    };
    let scene = Recipe::default().scene(7, 0, &[labelled], &catalog(10));
    assert_eq!(scene.unwrap().surface.wall, Some(wall));
}

/// A recipe that uses everything derived from a photo beyond its cut-out.
fn retouching() -> Recipe {
    let text = "bend_deg = [-20, 20]\nedges = ['as_is', 'soft', 'eroded', 'poisson']\n\
                [grade]\nhue_deg = 0\nglints = [0.2, 0.9]\npalette = ['clear', 'light_blue', 'green', 'brown']";
    toml::from_str(text).unwrap()
}

#[test]
fn what_retouches_photos_is_drawn_for_each_object_and_changes_nothing_else() {
    let plain = Recipe {
        grade: GradeRanges {
            hue_deg: Range::fixed(0.0),
            ..GradeRanges::default()
        },
        ..Recipe::default()
    };
    let (mut tints, mut edges) = (BTreeSet::new(), BTreeSet::new());
    for k in 0..40 {
        let mut retouched = scene(&retouching(), k);
        edges.insert(format!("{:?}", std::mem::take(&mut retouched.edges)));
        for object in &mut retouched.objects {
            let grade = &mut object.grade;
            tints.insert(grade.tint.channels().map(f32::to_bits));
            assert!((0.2..0.9).contains(&grade.glints) && grade.hue_deg == 0.0);
            assert!(object.bend.deg.abs() <= 20.0 && !object.bend.is_flat());
            (grade.tint, grade.glints) = (LinearRgb::WHITE, 1.0);
            object.bend = Bend::default();
        }
        assert_eq!(retouched, scene(&plain, k));
    }
    assert_eq!((tints.len(), edges.len()), (4, 4));
}

#[test]
fn nothing_is_drawn_or_written_of_retouching_where_it_is_not_asked_for() {
    let (drawn, draws) = Recipe::default()
        .explained(7, 3, &[tray("a")], &catalog(10))
        .unwrap();
    let new = ["palette", "glints", "bend", "edges"];
    assert!(
        draws
            .iter()
            .all(|d| !new.iter().any(|name| d.path.contains(name)))
    );
    let written = toml::to_string(&drawn).unwrap();
    assert!(!written.contains("tint") && !new.iter().any(|name| written.contains(name)));
    let text = toml::to_string(&scene(&retouching(), 3)).unwrap();
    assert_eq!(
        toml::from_str::<Scene>(&text).unwrap(),
        scene(&retouching(), 3)
    );
}

#[test]
fn objects_and_distractors_are_no_more_than_a_scene_holds() {
    let recipe: Recipe = toml::from_str("objects = [1, 800]\ndistractors = [0, 800]").unwrap();
    let told = recipe.check_room(&[tray("a")], &catalog(10));
    let message = told.unwrap_err().to_string();
    assert!(
        message.starts_with("objects and distractors: 1600, expected at most 1000"),
        "{message}"
    );
}

#[test]
fn retouching_that_no_photo_bears_is_refused() {
    let refused = |text: &str| {
        let recipe: Recipe = toml::from_str(text).unwrap();
        recipe.check().unwrap_err().to_string()
    };
    assert!(refused("bend_deg = [0, 90]").starts_with("bend_deg: [0, 90], expected"));
    assert!(refused("grade.glints = -1").starts_with("grade.glints: -1, expected"));
    assert!(
        refused("grade.palette = [[2, 0, 0]]").starts_with("grade.palette[0]: [2.0, 0.0, 0.0]")
    );
    let unknown = toml::from_str::<Recipe>("edges = ['sharp']").unwrap_err();
    assert!(unknown.to_string().contains("as_is"), "{unknown}");
    let mut bad = scene(&retouching(), 0);
    bad.objects[0].bend.deg = f64::NAN;
    let reported = bad.check().unwrap_err().to_string();
    assert!(
        reported.starts_with("objects[0].bend.deg: NaN"),
        "{reported}"
    );
}
