//! Labels and cameras as a person meets them: the real program in an empty folder.

mod desk;

use desk::{Desk, SAMPLES, text, words};
use petcomp::camera::CameraFile;
use petcomp::camera::simulate::{Scenario, View};
use petcomp::{Camera, Image, LinearRgb, Srgb8, io};
use serde_json::{Value, json};
use std::path::Path;

/// Picture size and rectangle of all photos here.
const IMAGE: [u32; 2] = [640, 480];
const SIZE: [f64; 2] = [0.56, 0.37];

impl Desk {
    /// With a class, and a recipe of empty scenes whose backgrounds are in `bg`.
    fn with_recipe() -> Self {
        let desk = Self::new();
        desk.write("assets/assets.toml", "classes = [\"cap\"]");
        desk.write(
            "recipe.toml",
            "backgrounds = \"bg\"\n[scene]\nobjects = 0\nimage = [320, 240]\n",
        );
        desk
    }

    /// What a run that must succeed prints: results and messages.
    fn ok(&self, args: &[&str]) -> [String; 2] {
        let output = self.run(args);
        let said = [text(&output.stdout), text(&output.stderr)];
        assert!(
            output.status.success(),
            "petcomp {args:?}\n{}{}",
            said[0],
            said[1]
        );
        said
    }

    /// The last line of a run that must fail.
    fn refused(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let err = text(&output.stderr);
        let code = output.status.code();
        assert!(
            code.is_some_and(|code| code != 0 && code != 101),
            "petcomp {args:?}: {err}"
        );
        err
    }

    /// A photo of a rectangle, and its label.
    fn photo(&self, name: &str, image: [u32; 2]) -> Value {
        let view = view_of(image);
        let [w, h] = image.map(|side| side as usize);
        std::fs::create_dir_all(self.path("bg")).unwrap();
        let [r, g, b] = [90; 3];
        let grey = Image::filled(w, h, Srgb8 { r, g, b });
        io::write(self.path(format!("bg/{name}.png")), &grey).unwrap();
        json!({
            "format": "plane-label", "version": 1,
            "image": { "file": format!("{name}.png"), "width": image[0], "height": image[1] },
            "surface": { "id": "tray", "width_m": SIZE[0], "height_m": SIZE[1],
                         "corners_px": view.label.surface.corners_px.unwrap() }
        })
    }

    fn label(&self, name: &str, label: &Value) {
        self.write(format!("bg/{name}.label.json"), label.to_string());
    }

    /// The camera of scene 0 and what was said.
    fn scene(&self, more: &[&str]) -> (Camera, String) {
        let args = ["scene", "draw", "recipe.toml", "-o", "scene.json"];
        let [_, said] = self.ok(&[&args[..], more].concat());
        let scene: Value = io::read_json(self.path("scene.json")).unwrap();
        (
            serde_json::from_value(scene["camera"]["known"].clone()).unwrap(),
            said,
        )
    }
}

/// The view that photos are of.
fn view_of(image: [u32; 2]) -> View {
    let scenario = Scenario {
        image,
        focal_px: 0.8 * f64::from(image[0]),
        size: SIZE,
        ..Scenario::default()
    };
    scenario.tilted(30.0).view(4, 1)
}

/// 30 points of the rectangle, each coordinate 2 px off to either side.
fn noisy_points() -> Vec<Value> {
    const SIDES: [u32; 2] = [0x2b7e_1516, 0x28ae_d2a6];
    let camera = view_of(IMAGE).camera;
    let point = |k: u32| {
        let [column, row] = [k % 6, k / 6].map(f64::from);
        let [x, y] = [0.1 * column - 0.25, 0.08 * row - 0.16];
        let (seen, _) = camera.project([x, y, 0.0].into()).unwrap();
        let [dx, dy] = SIDES.map(|bits| 4.0 * f64::from((bits >> k) & 1) - 2.0);
        json!({ "xyz_m": [x, y, 0.0], "px": [seen.x + dx, seen.y + dy], "sigma_px": 2.0 })
    };
    (0..30).map(point).collect()
}

fn exchanged(mut label: Value) -> Value {
    let surface = &mut label["surface"];
    (surface["width_m"], surface["height_m"]) = (json!(SIZE[1]), json!(SIZE[0]));
    label
}

#[test]
fn a_label_with_its_sides_exchanged_is_refused_by_every_command() {
    let desk = Desk::with_recipe();
    desk.label("a", &exchanged(desk.photo("a", IMAGE)));
    let generate = ["dataset", "generate", "recipe.toml", "-n", "1", "-o", "out"];
    for args in [
        &["camera", "solve", "bg/a.label.json"][..],
        &["camera", "joint", "bg/a.label.json"],
        &["camera", "doctor", "bg/a.label.json"],
        &words("camera rectify bg/a.png bg/a.label.json -o top.png")[..],
        &["scene", "draw", "recipe.toml", "-o", "scene.json"],
        &generate,
    ] {
        desk.refused(args);
        let said = text(&desk.run(args).stderr);
        assert!(
            said.contains("no camera fits") && said.contains("swap width_m and height_m"),
            "{args:?}: {said}"
        );
    }
    assert!(!desk.path("bg/a.camera.json").exists() && !desk.path("out/images").exists());
    desk.scene(&["--set", "force_cameras=true"]);
    // One that was forced where it was solved is wanted.
    desk.ok(&["camera", "solve", "--force", "bg/a.label.json"]);
    desk.scene(&[]);
    desk.ok(&generate);
}

#[test]
fn of_points_alone_is_said_how_far_those_are_off() {
    let desk = Desk::with_recipe();
    let mut label = desk.photo("a", IMAGE);
    label["image"]["cropped"] = json!(false);
    label["surface"]["corners_px"] = Value::Null;
    label["points"] = json!(noisy_points());
    desk.label("a", &label);
    let said = ["solve", "doctor"].map(|verb| desk.ok(&["camera", verb, "bg/a.label.json"]));
    let said = said.concat().concat();
    assert!(
        said.contains("points to ") && !said.contains("corners to"),
        "{said}"
    );
    let file: CameraFile = io::read_json(desk.path("bg/a.camera.json")).unwrap();
    let fit = file.found.fit;
    assert!(fit.per_corner_px.is_none() && (1.5..3.5).contains(&fit.rms_px));
}

#[test]
fn a_camera_beside_its_label_is_used_and_decides_the_dataset() {
    let desk = Desk::with_recipe();
    let label = desk.photo("a", IMAGE);
    desk.label("a", &label);
    let (alone, _) = desk.scene(&[]);
    desk.ok(&["camera", "solve", "bg/a.label.json"]);
    let generate = ["dataset", "generate", "recipe.toml", "-n", "1", "-o", "out"];
    desk.ok(&generate);
    assert_eq!(desk.scene(&[]).0, alone);
    // As `camera joint` would have found it.
    let path = desk.path("bg/a.camera.json");
    let mut file: CameraFile = io::read_json(&path).unwrap();
    file.found.model.f_px *= 1.1;
    io::write_json(&path, &file).unwrap();
    let (used, said) = desk.scene(&[]);
    assert!(
        (used.focal_px.x / alone.focal_px.x - 1.1).abs() < 1e-12 && said.is_empty(),
        "{said}"
    );
    assert!(
        desk.refused(&generate).contains("out"),
        "another camera is another dataset"
    );
    let mut changed = label.clone();
    changed["surface"]["corners_px"][0][0] =
        json!(changed["surface"]["corners_px"][0][0].as_f64().unwrap() + 0.5);
    desk.label("a", &changed);
    let (again, said) = desk.scene(&[]);
    assert!((again.focal_px.x / alone.focal_px.x - 1.0).abs() < 0.05);
    assert!(
        said.contains("a.camera.json: solved from another version of its label")
            && said.lines().count() <= 2,
        "{said}"
    );
    desk.write("bg/a.camera.json", "{\"format\": \"plane-camera\"}");
    let broken = desk.refused(&["scene", "draw", "recipe.toml", "-o", "scene.json"]);
    assert!(
        broken.contains("a.camera.json: line 1: missing key")
            && broken.contains("run `petcomp camera solve` again"),
        "{broken}"
    );
}

#[test]
fn photos_solved_together_are_used_together() {
    let desk = Desk::with_recipe();
    for (name, k) in [("a", 0), ("b", 1), ("c", 2)] {
        let scenario = Scenario {
            image: IMAGE,
            focal_px: 512.0,
            size: SIZE,
            corner_sigma_px: 0.5,
            ..Scenario::default()
        };
        let view = &scenario.views(9, 1, 3, [3.0, 35.0])[k];
        let mut label = desk.photo(name, IMAGE);
        label["surface"]["corners_px"] = json!(view.label.surface.corners_px);
        label["camera"] = json!({ "id": "phone" });
        desk.label(name, &label);
    }
    let labels = ["bg/a.label.json", "bg/b.label.json", "bg/c.label.json"];
    desk.ok(&[&["camera", "joint"][..], &labels].concat());
    let focal = |name: &str| {
        io::read_json::<CameraFile>(desk.path(format!("bg/{name}.camera.json")))
            .unwrap()
            .found
            .model
            .f_px
    };
    assert!(focal("a") == focal("b") && focal("b") == focal("c"));
    assert_eq!(desk.scene(&[]).0.focal_px.x, focal("a") / 2.0);
    // A label of the three that changes makes the others' cameras old.
    let mut label: Value = io::read_json(desk.path("bg/b.label.json")).unwrap();
    label["surface"]["corner_sigma_px"] = json!(3.0);
    desk.label("b", &label);
    let (_, said) = desk.scene(&[]);
    assert!(
        said.contains("solved together with another version of b"),
        "{said}"
    );
}

#[test]
fn labels_that_are_solved_alone_are_named() {
    let desk = Desk::with_recipe();
    let joint = ["camera", "joint", "bg/a.label.json", "bg/b.label.json"];
    let alone = |id: Value| {
        for name in ["a", "b"] {
            let mut label = desk.photo(name, IMAGE);
            label["camera"] = json!({ "id": id });
            desk.label(name, &label);
        }
        let [_, said] = desk.ok(&joint);
        said.matches("label.json: solved alone: no other label has the same camera.id")
            .count()
    };
    assert_eq!(alone(Value::Null), 2);
    assert_eq!(alone(json!("phone")), 0);
}

#[test]
fn a_camera_that_cannot_be_solved_stops_no_other_one() {
    let desk = Desk::with_recipe();
    for (name, id) in [("a", "bad"), ("b", "good"), ("c", "good")] {
        let mut label = desk.photo(name, IMAGE);
        label["camera"] = json!({ "id": id });
        if id == "bad" {
            label["surface"]["corners_px"] = Value::from(vec![vec![0.0; 2]; 4]);
        }
        desk.label(name, &label);
    }
    let labels = ["bg/a.label.json", "bg/b.label.json", "bg/c.label.json"];
    let said = desk.refused(&[&["camera", "joint"][..], &labels].concat());
    assert!(said.contains("failed: bg/a.label.json: surface"), "{said}");
    assert!(
        ["b", "c"]
            .iter()
            .all(|name| desk.path(format!("bg/{name}.camera.json")).exists())
    );
}

#[test]
fn cameras_of_an_earlier_run_are_no_labels() {
    let desk = Desk::with_recipe();
    for name in ["a", "b"] {
        desk.label(name, &desk.photo(name, IMAGE));
    }
    let labels = ["bg/a.label.json", "bg/b.label.json"];
    let cameras = ["bg/a.camera.json", "bg/b.camera.json"];
    desk.ok(&[&["camera", "solve"][..], &labels].concat());
    for command in ["solve", "joint", "doctor"] {
        desk.ok(&[&["camera", command][..], &cameras, &labels].concat());
    }
    let said = desk.refused(&["camera", "solve", "bg/a.camera.json"]);
    let expected = "a.camera.json: a solved camera (plane-camera), expected a label (plane-label)";
    assert!(said.contains(expected), "{said}");
}

#[test]
fn a_camera_too_far_away_is_refused_however_it_is_solved() {
    let desk = Desk::with_recipe();
    let mut label = desk.photo("a", IMAGE);
    let surface = &mut label["surface"];
    (surface["width_m"], surface["height_m"]) = (json!(20.0 * SIZE[0]), json!(20.0 * SIZE[1]));
    label["camera"] = json!({ "focal_px": 5120.0, "focal_fixed": true });
    desk.label("a", &label);
    for command in ["solve", "joint"] {
        let said = desk.refused(&["camera", command, "--force", "bg/a.label.json"]);
        assert!(
            said.contains("surface: the camera would be"),
            "{command}: {said}"
        );
    }
}

#[test]
fn corners_on_a_line_are_wrong_data_and_not_an_unusable_file() {
    let desk = Desk::with_recipe();
    let mut label = desk.photo("a", IMAGE);
    label["surface"]["corners_px"] = json!([[10, 10], [20, 10], [30, 10], [40, 10]]);
    desk.label("a", &label);
    let args = ["camera", "solve", "bg/a.label.json"];
    let said = desk.refused(&args);
    assert!(said.contains("surface.corners_px: the "), "{said}");
    assert_eq!(desk.run(&args).status.code(), Some(3), "{said}");
}

#[test]
fn a_lens_that_folds_the_photo_over_is_refused_wherever_its_label_is_read() {
    let desk = Desk::with_recipe();
    let mut label = desk.photo("a", [1280, 960]);
    label["surface"]["corners_px"] = json!([
        [235.8, 239.2],
        [1019.7, 215.7],
        [1008.9, 701.2],
        [275.6, 738.8]
    ]);
    label["image"]["cropped"] = json!(false);
    label["camera"] = json!({ "k1": -5 });
    desk.label("a", &label);
    for args in [
        &["camera", "solve", "bg/a.label.json"][..],
        &["scene", "draw", "recipe.toml", "-o", "scene.json"],
    ] {
        let said = desk.refused(args);
        assert!(
            said.contains("a.label.json: camera.k1: -5, expected at least -1.4"),
            "{args:?}: {said}"
        );
        assert_eq!(desk.run(args).status.code(), Some(3), "{args:?}: {said}");
    }
}

#[test]
fn an_impossible_value_of_a_label_is_data_and_not_a_file_that_cannot_be_used() {
    let desk = Desk::with_recipe();
    let mut label = desk.photo("a", IMAGE);
    for (camera, message) in [
        (json!({ "focal_px": 5.0 }), "camera.focal_px: 5, expected"),
        (json!({ "height_m": -1.0 }), "camera.height_m: -1, expected"),
    ] {
        label["camera"] = camera;
        desk.label("a", &label);
        for args in [
            &["camera", "solve", "bg/a.label.json"][..],
            &["scene", "draw", "recipe.toml", "-o", "scene.json"],
        ] {
            let output = desk.run(args);
            let said = text(&output.stderr);
            assert!(said.contains(&format!("a.label.json: {message}")), "{said}");
            assert_eq!(output.status.code(), Some(3), "{args:?}: {said}");
        }
    }
}

#[test]
fn a_photo_that_is_not_the_label_s_is_noticed() {
    let desk = Desk::with_recipe();
    let mut label = desk.photo("a", IMAGE);
    desk.label("a", &label);
    desk.photo("upright", [480, 640]);
    let rectify = words("camera rectify bg/upright.png bg/a.label.json -o top.png");
    let said = desk.refused(&rectify);
    assert!(
        said.contains("480 x 640 pixels, expected the shape"),
        "{said}"
    );
    label["image"]["file"] = json!("typo.png");
    desk.label("a", &label);
    let [_, said] = desk.ok(&["camera", "solve", "bg/a.label.json"]);
    assert!(said.contains("\"typo.png\" is missing"), "{said}");
}

#[test]
fn a_picture_that_is_projected_back_has_no_scale_of_its_own() {
    let desk = Desk::with_recipe();
    let rectify = "camera rectify a.png a.label.json -o b.png --back c.png --px-per-metre 9";
    let said = desk.refused(&words(rectify));
    assert!(
        said.contains("'--back <PICTURE>' cannot be used with '--px-per-metre"),
        "{said}"
    );
}

#[test]
fn corners_outside_of_the_picture_can_be_given() {
    let desk = Desk::with_recipe();
    desk.photo("a", IMAGE);
    let init = ["camera", "init", "bg/a.png", "--size", "0.56x0.37"];
    let corners = ["--corners", "-300,-200 1000,0 900,700 -250,600"];
    desk.ok(&[&init[..], &corners].concat());
    let label: Value = io::read_json(desk.path("bg/a.label.json")).unwrap();
    assert_eq!(
        label["surface"]["corners_px"],
        json!([
            [-300.0, -200.0],
            [1000.0, 0.0],
            [900.0, 700.0],
            [-250.0, 600.0]
        ])
    );
}

/// A photo of marker 0 of `DICT_4X4_50` on white paper, its black square at 200 to 260 and 150 to
/// 210 pixels.
fn photo_of_a_marker() -> Image<LinearRgb> {
    const CODE: u16 = 0xb532;
    Image::from_fn(IMAGE[0] as usize, IMAGE[1] as usize, |x, y| {
        let (column, row) = (
            (x as i32 - 200).div_euclid(10),
            (y as i32 - 150).div_euclid(10),
        );
        let is_within =
            |cells: std::ops::Range<i32>| cells.contains(&column) && cells.contains(&row);
        let is_white = is_within(1..5) && CODE >> (15 - (4 * (row - 1) + column - 1)) & 1 == 1;
        match (is_within(-1..7), is_within(0..6) && !is_white) {
            (_, true) => LinearRgb::grey(0.04),
            (true, false) => LinearRgb::grey(0.8),
            (false, false) => LinearRgb::grey(0.3),
        }
    })
}

#[test]
fn the_corners_of_a_marker_are_added_to_a_label() {
    let desk = Desk::with_recipe();
    io::write(desk.path("a.png"), &photo_of_a_marker()).unwrap();
    let mut map = desk.photo("a", IMAGE);
    map["surface"]["corners_px"] = Value::Null;
    map["markers"] =
        json!({ "family": "DICT_4X4_50", "size_m": 0.06, "map": { "0": [0.1, 0.0, 0.0] } });
    desk.write("map.json", map.to_string());
    let markers = words("camera markers a.png --map map.json -o a.label.json");
    let [said, _] = desk.ok(&markers);
    assert!(said.contains("4 marker corners"), "{said}");
    let label: Value = io::read_json(desk.path("a.label.json")).unwrap();
    let truth = [
        ([0.07, 0.03], [200.0, 150.0]),
        ([0.13, 0.03], [260.0, 150.0]),
        ([0.13, -0.03], [260.0, 210.0]),
        ([0.07, -0.03], [200.0, 210.0]),
    ];
    for (point, (xy_m, px)) in label["points"].as_array().unwrap().iter().zip(truth) {
        for i in 0..2 {
            let off = |key: &str, truth: f64| (point[key][i].as_f64().unwrap() - truth).abs();
            assert!(
                off("xyz_m", xy_m[i]) < 1e-9 && off("px", px[i]) < 0.1,
                "{point}"
            );
        }
    }
    // A label of the photo keeps all that it says; one of another photo lends what photos share.
    let mut own = label;
    own["camera"]["height_m"] = json!(0.64);
    desk.write("a.label.json", own.to_string());
    io::write(desk.path("b.png"), &photo_of_a_marker()).unwrap();
    for (name, map, height) in [
        ("a", "a", json!(0.64)),
        ("b", "a", json!(null)),
        ("b", "b", json!(null)),
    ] {
        let photo = format!("{name}.png");
        let [map, output] = [map, name].map(|name| format!("{name}.label.json"));
        desk.ok(&["camera", "markers", &photo, "--map", &map, "-o", &output]);
        let label: Value = io::read_json(desk.path(output)).unwrap();
        let found = (&label["image"]["file"], &label["camera"]["height_m"]);
        assert_eq!(found, (&json!(photo), &height));
        assert_eq!(label["points"].as_array().unwrap().len(), 4);
    }
}

#[test]
fn corners_that_are_given_stand_in_for_markers_that_are_not_found() {
    let desk = Desk::with_recipe();
    let mut like = desk.photo("a", IMAGE);
    like["markers"] =
        json!({ "family": "DICT_4X4_50", "size_m": 0.06, "map": { "0": [0.1, 0.0, 0.0] } });
    desk.label("a", &like);
    desk.photo("b", IMAGE);
    let init = ["camera", "init", "bg/b.png", "--like", "bg/a.label.json"];
    let refusal = desk.refused(&init);
    assert!(
        refusal.contains("none of them was found") && refusal.contains("--corners"),
        "{refusal}"
    );
    let corners = ["--corners", "100,100 500,100 500,400 100,400"];
    let [said, warned] = desk.ok(&[&init[..], &corners].concat());
    assert!(said.contains("corners as given"), "{said}");
    assert!(warned.contains("none of them was found"), "{warned}");
    assert!(desk.path("bg/b.label.json").is_file());
}

#[test]
fn corners_of_a_larger_size_of_the_photo_are_asked_about() {
    let desk = Desk::with_recipe();
    desk.photo("a b", IMAGE);
    let init = ["camera", "init", "bg/a b.png", "--size", "0.56x0.37"];
    let corners = ["--corners", "300,200 1200,210 1190,900 290,890"];
    let said = desk.ok(&[&init[..], &corners].concat()).concat();
    let question = "3 of 4 corners lie outside the 640 x 480 picture";
    assert!(said.contains(question), "{said}");
    // The command that is proposed is one for the shell.
    let command = "then `petcomp camera solve 'bg/a b.label.json'`";
    assert!(said.contains(command), "{said}");
    let solved = desk.run(&["camera", "solve", "bg/a b.label.json"]);
    let told = text(&solved.stderr);
    assert!(told.contains(question), "{told}");
}

#[test]
fn no_camera_and_no_overlay_takes_the_place_of_the_photo() {
    let desk = Desk::with_recipe();
    for (photo, output) in [("a", "bg/a.png"), ("b.overlay", "bg/b.camera.json")] {
        desk.label("a", &desk.photo(photo, IMAGE));
        let path = desk.path(format!("bg/{photo}.png"));
        let before = std::fs::read(&path).unwrap();
        let told = desk.refused(&["camera", "solve", "bg/a.label.json", "-o", output]);
        assert!(
            told.contains("is an input and would be overwritten"),
            "{told}"
        );
        assert_eq!(std::fs::read(&path).unwrap(), before);
    }
}

#[test]
fn a_label_comes_from_nothing() {
    let desk = Desk::with_recipe();
    let label = desk.photo("a", IMAGE);
    let missing = desk.refused(&["camera", "solve", "bg/a.png"]);
    assert!(
        missing.contains("a picture, expected a label")
            && missing.contains("petcomp camera init bg/a.png"),
        "{missing}"
    );
    let [said, _] = desk.ok(&["camera", "init", "bg/a.png", "--size", "0.56x0.37"]);
    assert!(said.contains("fill in surface.corners_px"), "{said}");
    let again = ["camera", "init", "bg/a.png", "--size", "1x1"];
    for (args, why) in [
        (&again[..], "already exists; --force replaces it"),
        (
            &["camera", "solve", "bg/a.label.json"],
            "corners_px is missing or not filled in",
        ),
        (
            &["camera", "solve", "bg/a.png"],
            "its label is bg/a.label.json",
        ),
    ] {
        let told = desk.refused(args);
        assert!(told.contains(why), "{told}");
    }
    assert_eq!(desk.run(&again).status.code(), Some(4));
    let corners = corners_of(&label)
        .map(|[x, y]| format!("{x},{y}"))
        .join(" ");
    let init = ["camera", "init", "bg/a.png", "--size", "0.56x0.37"];
    let more = ["--force", "--corners", &corners];
    desk.ok(&[&init[..], &more].concat());
    let [said, _] = desk.ok(&["camera", "solve", "bg/a.label.json"]);
    assert!(said.contains("tilt 30."), "{said}");
    assert!(desk.path("bg/a.overlay.png").is_file());
    let empty = desk.path("bg/b.label.json");
    std::fs::write(&empty, "{\"image\": {\"file\": \"b.png\"}}").unwrap();
    let error = desk.refused(&["camera", "solve", "bg/b.label.json"]);
    for key in [
        "format",
        "version",
        "image.width",
        "image.height",
        "surface.id",
        "corners_px",
        "width_m",
    ] {
        assert!(error.contains(key), "{key}: {error}");
    }
    assert!(
        desk.refused(&["camera", "init", "bg/a.png", "--size", "0.56"])
            .contains("WIDTHxHEIGHT")
    );
}

#[test]
fn a_size_in_millimetres_is_asked_about_before_a_label_is_written() {
    let desk = Desk::with_recipe();
    desk.photo("a", IMAGE);
    let said = desk.refused(&["camera", "init", "bg/a.png", "--size", "560x370"]);
    assert!(
        said.contains("surface.width_m: 560, expected") && said.contains("is it in millimetres?"),
        "{said}"
    );
    assert!(!desk.path("bg/a.label.json").exists());
}

fn corners_of(label: &Value) -> [[f64; 2]; 4] {
    serde_json::from_value(label["surface"]["corners_px"].clone()).unwrap()
}

/// The same four corners as other programs write them.
fn drawn(label: &Value) -> [(&'static str, String); 3] {
    let corners = corners_of(label);
    let [w, h] = IMAGE;
    let labelme = json!({ "version": "5.4.1", "imagePath": "a.png", "imageData": null, "imageWidth": w, "imageHeight": h,
        "shapes": corners.map(|p| json!({ "label": "tray", "points": [p], "shape_type": "point" })) });
    let points = corners.map(|[x, y]| format!("{x},{y}")).join(";");
    let cvat = format!(
        "<?xml version=\"1.0\"?><annotations><version>1.1</version><image id=\"0\" name=\"a.png\" width=\"{w}\" \
         height=\"{h}\"><polygon label=\"tray\" points=\"{points}\"/></image></annotations>"
    );
    let percent = corners.map(|[x, y]| [100.0 * x / f64::from(w), 100.0 * y / f64::from(h)]);
    let studio = json!([{ "id": 1, "data": { "image": "/data/upload/1/01234567-a.png" }, "annotations": [{ "result": [{
        "original_width": w, "original_height": h, "image_rotation": 0, "type": "polygonlabels",
        "value": { "points": percent, "closed": true, "polygonlabels": ["tray"] } }] }] }]);
    [
        ("a.json", labelme.to_string()),
        ("annotations.xml", cvat),
        ("export.json", studio.to_string()),
    ]
}

#[test]
fn labels_of_other_programs_are_labels_everywhere() {
    for (file, text) in drawn(&Desk::with_recipe().photo("a", IMAGE)) {
        let desk = Desk::with_recipe();
        desk.photo("a", IMAGE);
        desk.write(format!("bg/{file}"), text);
        let error = desk.refused(&["scene", "draw", "recipe.toml", "-o", "scene.json"]);
        assert!(
            error.contains("surface_size") && error.contains("--size"),
            "{file}: {error}"
        );
        let (given, _) = desk.scene(&["--set", "surface_size=[0.56,0.37]"]);
        let path = format!("bg/{file}");
        let [said, _] = desk.ok(&["camera", "solve", &path, "--size", "0.56x0.37"]);
        assert!(said.contains("tilt 30."), "{file}: {said}");
        let [said, _] = desk.ok(&["camera", "doctor", &path, "--size", "0.56x0.37"]);
        let advice = "`petcomp camera init PHOTO --size WxH --corners";
        assert!(said.contains(advice), "{file}: {said}");
        desk.ok(&["camera", "joint", &path, "--size", "0.56x0.37"]);
        assert!(desk.path("bg/a.camera.json").is_file(), "{file}");
        // Where it was solved its size is known.
        let (stored, said) = desk.scene(&[]);
        assert!(
            (stored.focal_px.x / given.focal_px.x - 1.0).abs() < 1e-9 && said.is_empty(),
            "{file}: {said}"
        );
        desk.ok(&["dataset", "generate", "recipe.toml", "-n", "1", "-o", "out"]);
    }
}

#[test]
fn an_image_beyond_the_dataset_is_refused() {
    let desk = Desk::with_recipe();
    desk.label("a", &desk.photo("a", IMAGE));
    let generate = "dataset generate recipe.toml -n 60 -o out --only";
    let told = desk.refused(&words(&format!("{generate} 60")));
    assert!(
        told.contains("only: 60, expected a number below the number of images, 60"),
        "{told}"
    );
    assert!(!desk.path("out").exists());
    desk.ok(&words(&format!("{generate} 59")));
}

#[test]
fn the_part_of_one_of_consecutive_images_needs_their_number() {
    let desk = Desk::with_recipe();
    desk.label("a", &desk.photo("a", IMAGE));
    let generate = "dataset generate recipe.toml -o out --set split.order=\"consecutive\" --only 3";
    let told = desk.refused(&words(generate));
    assert!(told.contains("--count: missing, expected"), "{told}");
    assert!(!desk.path("out").exists());
    desk.ok(&words(&format!("{generate} -n 20")));
    assert!(desk.path("out/images/train/000003.png").is_file());
}

#[test]
fn a_recipe_is_fitted_to_its_photos() {
    let desk = Desk::with_recipe();
    desk.label("a", &desk.photo("a", IMAGE));
    let recipe = || std::fs::read_to_string(desk.path("recipe.toml")).unwrap();
    let before = recipe();
    let fit = ["dataset", "fit", "--recipe", "recipe.toml", "-o"];
    let [said, _] = desk.ok(&[&fit[..], &["fitted.toml"]].concat());
    assert!(
        said.contains("scene.finish.exposure_ev stays: fewer than 3 photos"),
        "{said}"
    );
    let fitted = std::fs::read_to_string(desk.path("fitted.toml")).unwrap();
    assert!(
        fitted.starts_with(&before) && recipe() == before,
        "{fitted}"
    );
    assert!(desk.path("fitted.html").is_file());
}

#[test]
fn other_files_beside_the_photos_are_left_alone() {
    let desk = Desk::with_recipe();
    desk.label("a", &desk.photo("a", IMAGE));
    desk.write("bg/notes.json", "{\"camera\": \"mine\"}");
    desk.write("bg/broken.json", "{");
    desk.write("bg/page.xml", "<html></html>");
    let [labelme, ..] = drawn(&desk.photo("a", IMAGE));
    desk.write("bg/a.json", labelme.1.replace("0.", "1."));
    desk.scene(&[]);
    desk.write("bg/b.json", "{\"shapes\": [], \"imagePath\": \"a.png\"}");
    assert!(
        desk.refused(&["scene", "draw", "recipe.toml", "-o", "scene.json"])
            .contains("b.json")
    );
}

#[test]
fn warnings_about_a_background_are_said_where_it_is_solved_and_in_the_report() {
    let desk = Desk::with_recipe();
    // Nothing says that the picture is whole.
    desk.label("a", &desk.photo("a", IMAGE));
    let (_, unsolved) = desk.scene(&[]);
    assert_eq!(unsolved.lines().count(), 1, "{unsolved}");
    assert!(
        unsolved.contains("petcomp camera doctor") && unsolved.split_whitespace().count() < 20,
        "{unsolved}"
    );
    let [_, solved] = desk.ok(&["camera", "solve", "bg/a.label.json"]);
    assert!(solved.contains("known"), "{solved}");
    assert_eq!(desk.scene(&[]).1, "");
    desk.ok(&words("dataset generate -q recipe.toml -n 1 -o out"));
    desk.ok(&["dataset", "report", "out"]);
    let page = std::fs::read_to_string(desk.path("out/report.html")).unwrap();
    assert!(
        page.contains("above the surface is known"),
        "not in the report"
    );
}

#[test]
fn a_portrait_photo_is_not_cropped_in_silence() {
    let desk = Desk::with_recipe();
    desk.label("p", &desk.photo("p", [480, 640]));
    let (_, said) = desk.scene(&[]);
    let line = said
        .lines()
        .find(|line| line.contains("differ in aspect ratio"))
        .unwrap_or_default();
    assert!(
        line.contains("1 of 1 backgrounds") && line.contains("the middle 480 x 360"),
        "{said}"
    );
    assert!(
        !desk
            .scene(&["--set", "scene.image=[240,320]"])
            .1
            .contains("differ in aspect ratio")
    );
}

#[test]
fn a_camera_is_exported_with_its_lens() {
    let desk = Desk::with_recipe();
    let mut label = desk.photo("a", IMAGE);
    label["camera"] = json!({ "k1": -0.01 });
    desk.label("a", &label);
    desk.ok(&["camera", "solve", "bg/a.label.json"]);
    let export = ["camera", "export", "bg/a.camera.json", "--to"];
    let [opencv, _] = desk.ok(&[&export[..], &["opencv"]].concat());
    let opencv: Value = serde_json::from_str(&opencv).unwrap();
    assert!((opencv["dist"][0].as_f64().unwrap() + 0.01).abs() < 1e-9);
    desk.ok(&[&export[..], &["colmap", "-o", "model"]].concat());
    let cameras = std::fs::read_to_string(desk.path("model/cameras.txt")).unwrap();
    assert!(cameras.starts_with("1 OPENCV 640 480 "), "{cameras}");
    let [_, said] = desk.ok(&[&export[..], &["blender"]].concat());
    assert!(said.contains("a.camera.json: k1 = -0.0100"), "{said}");
}

#[test]
fn colmap_is_given_no_picture_without_a_name_of_its_own() {
    let desk = Desk::with_recipe();
    desk.label("a", &desk.photo("a", IMAGE));
    desk.ok(&["camera", "solve", "bg/a.label.json"]);
    let mut camera: Value = io::read_json(desk.path("bg/a.camera.json")).unwrap();
    desk.write("other.camera.json", camera.to_string());
    let export = ["camera", "export", "bg/a.camera.json", "other.camera.json"];
    let export = [&export[..], &["--to", "colmap", "-o", "model"]].concat();
    let said = desk.refused(&export);
    assert!(
        said.contains("other.camera.json: image.file: \"a.png\", which bg/a.camera.json also has"),
        "{said}"
    );
    camera["image"]["file"] = json!("");
    desk.write("other.camera.json", camera.to_string());
    let said = desk.refused(&export);
    assert!(
        said.contains("other.camera.json: image.file: empty"),
        "{said}"
    );
    assert!(!desk.path("model").exists());
    camera["image"]["file"] = json!("b.png");
    desk.write("other.camera.json", camera.to_string());
    desk.ok(&export);
}

#[test]
fn the_top_view_of_a_reduced_photo_is_as_reduced() {
    let desk = Desk::with_recipe();
    desk.label("a", &desk.photo("a", IMAGE));
    desk.photo("small", IMAGE.map(|side| side / 4));
    let width = |name: &str| {
        let rectify = format!("camera rectify bg/{name}.png bg/a.label.json -o top.png");
        desk.ok(&words(&rectify));
        io::read_header(desk.path("top.png")).unwrap().width
    };
    assert!(width("a").abs_diff(4 * width("small")) <= 4);
}

#[test]
fn the_overlay_has_a_legend_below_the_photo() {
    let desk = Desk::with_recipe();
    desk.label("a", &desk.photo("a", IMAGE));
    desk.ok(&["camera", "solve", "bg/a.label.json"]);
    let overlay: Image<LinearRgb> = io::read(desk.path("bg/a.overlay.png")).unwrap();
    assert!(
        overlay.width() == 640 && overlay.height() > 480 + 5 * 16,
        "{:?}",
        overlay.size()
    );
}

#[test]
fn the_samples_are_taken_with_their_cameras() {
    // The label of a sample, its sides exchanged: the case that was reported.
    let desk = Desk::with_recipe();
    let samples = Path::new(SAMPLES).join("backgrounds");
    std::fs::create_dir_all(desk.path("bg")).unwrap();
    std::fs::copy(samples.join("bg0000.jpg"), desk.path("bg/bg0000.jpg")).unwrap();
    let label: Value = io::read_json(samples.join("bg0000.label.json")).unwrap();
    desk.label("bg0000", &exchanged(label.clone()));
    let error = desk.refused(&["camera", "solve", "bg/bg0000.label.json"]);
    assert!(
        error.contains("swap width_m and height_m (chi squared 11"),
        "{error}"
    );
    desk.label("bg0000", &label);
    desk.ok(&["camera", "solve", "bg/bg0000.label.json"]);
}
