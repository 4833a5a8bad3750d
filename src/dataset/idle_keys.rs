//! Keys of a recipe that have no effect.

use crate::asset::Asset;
use crate::dataset::{
    Coco, CocoMask, Format, LabelConfig, Layers, Mot, Pipeline, Voc, WebDataset, Yolo, YoloTask,
};
use crate::scene::{Background, EnvironmentRanges, LensRanges, Recipe, Take, Wall};

/// Maximum number of names in a message.
const MAX_SHOWN_NAMES: usize = 5;

impl Pipeline {
    /// The recipe's keys that have no effect on the dataset, and why.
    #[doc(hidden)]
    pub fn idle_keys(&self) -> Vec<String> {
        let recipe = &self.config().scene;
        let places = recipe.narrowed().viewpoints.slice_of(self.places());
        let backgrounds = places.iter().map(|place| &place.background);
        let mut idle = idle_labels(&self.config().labels);
        idle.extend(idle_takes(recipe, self.places(), &self.library().assets));
        idle.extend(idle_light_direction(recipe, backgrounds));
        idle.extend(idle_partners(recipe));
        idle
    }
}

/// Settings of layouts that are not written, and of polygons that no layout has.
fn idle_labels(labels: &LabelConfig) -> Vec<String> {
    if labels.formats.is_empty() {
        // A preview of archives has none.
        return Vec::new();
    }
    let formats = serde_json::json!(labels.formats);
    let tables = [
        (Format::Yolo, labels.yolo != Yolo::default()),
        (Format::Coco, labels.coco != Coco::default()),
        (Format::Voc, labels.voc != Voc::default()),
        (Format::Mot, labels.mot != Mot::default()),
        (
            Format::WebDataset,
            labels.webdataset != WebDataset::default(),
        ),
        (Format::Layers, labels.layers != Layers::default()),
    ];
    let idle = tables
        .into_iter()
        .filter(|(format, is_set)| *is_set && !labels.formats.contains(format));
    let mut told: Vec<String> = idle
        .map(|(format, _)| {
            let name = serde_json::json!(format);
            let table = name.as_str().unwrap_or_default();
            format!(
                "labels.{table}: has no effect on the dataset, as {name} is not in labels.formats: {formats}"
            )
        })
        .collect();
    if labels.simplify > 0.0 && !has_polygons(labels) {
        told.push(format!(
            "labels.simplify: {}, but no layout in labels.formats: {formats} writes polygons, expected \
             labels.yolo.task = \"segment\" or labels.coco.masks = \"polygon\"",
            labels.simplify
        ));
    }
    told
}

fn has_polygons(labels: &LabelConfig) -> bool {
    labels.formats.iter().any(|format| match format {
        Format::Yolo => labels.yolo.task == YoloTask::Segment,
        Format::Coco => labels.coco.masks == CocoMask::Polygon,
        Format::Voc | Format::Mot | Format::Layers | Format::WebDataset => false,
    })
}

/// Numbers of labelled photos, or of photos of each asset, that are larger than what is there.
fn idle_takes<B, P>(recipe: &Recipe, places: &[B], assets: &[Asset<P>]) -> Vec<String> {
    let told = |key: &str, take, there, found: &str| match take {
        Take::First(n) if n > there => Some(format!("scene.{key}: {n}, but {found} {there}")),
        _ => None,
    };
    let viewpoints = told(
        "viewpoints",
        recipe.viewpoints,
        places.len(),
        "the number of labelled photos is",
    );
    let most = assets.iter().map(|asset| asset.photos.len()).max();
    let photos = told(
        "photos",
        recipe.photos,
        most.unwrap_or(0),
        "no asset has more than",
    );
    viewpoints.into_iter().chain(photos).collect()
}

/// Settings of a depth of field or an environment map that is not used.
fn idle_partners(recipe: &Recipe) -> Vec<String> {
    let mut idle = Vec::new();
    if recipe.lens.f_number.is_none() {
        idle.extend(idle_focus(&recipe.lens));
    }
    if recipe.environment.files.is_empty() {
        idle.extend(idle_surroundings(&recipe.environment));
    }
    idle
}

fn idle_focus(lens: &LensRanges) -> Vec<String> {
    let told = |key: &str, value: String| {
        format!("scene.lens.{key}: {value}, but without scene.lens.f_number everything is sharp")
    };
    let focus = lens.focus_m;
    let focus = focus.map(|metres| told("focus_m", serde_json::json!(metres).to_string()));
    let is_set = lens.sensor_mm != LensRanges::default().sensor_mm;
    let sensor = is_set.then(|| told("sensor_mm", lens.sensor_mm.to_string()));
    focus.into_iter().chain(sensor).collect()
}

fn idle_surroundings(environment: &EnvironmentRanges) -> Vec<String> {
    let default = EnvironmentRanges::default();
    let keys = [
        (
            "rotation_deg",
            environment.rotation_deg,
            default.rotation_deg,
        ),
        ("strength", environment.strength, default.strength),
    ];
    let set = keys
        .into_iter()
        .filter(|(_, range, default)| range != default);
    set.map(|(key, range, _)| {
        let value = serde_json::json!(range);
        format!("scene.environment.{key}: {value}, but scene.environment.files names no picture")
    })
    .collect()
}

/// Why the recipe's `scene.light_direction` does not change the drawn light, and in which places;
/// none if it does.
fn idle_light_direction<'a>(
    recipe: &Recipe,
    backgrounds: impl Iterator<Item = &'a Background>,
) -> Option<String> {
    let direction = recipe.light_direction;
    if direction.is_drawn() {
        return None;
    }
    let key = format!("scene.light_direction: {}", serde_json::json!(direction));
    if recipe.lights.is_empty() {
        return Some(format!("{key}, but scene.lights has no light to turn"));
    }
    let flat = backgrounds.filter(|background| !has_walls(recipe, background.wall));
    let flat: Vec<&str> = flat.map(|background| background.name.as_str()).collect();
    (!flat.is_empty()).then(|| {
        let names = some_of(&flat);
        format!(
            "{key}, but neither scene.walls nor the label gives walls in {names}: lights stay as drawn there"
        )
    })
}

/// Whether a surface has any walls or lip, given its label's wall.
fn has_walls(recipe: &Recipe, labelled: Option<Wall>) -> bool {
    let labelled = labelled.map(|wall| wall.height);
    match recipe.walls {
        None => labelled.is_some_and(|height| height > 0.0),
        // Without a height they have a lip.
        Some(own) => {
            let height = own.height.map(|height| height.max).or(labelled);
            height.is_none_or(|height| height > 0.0)
        }
    }
}

fn some_of(names: &[&str]) -> String {
    let shown = names[..names.len().min(MAX_SHOWN_NAMES)].join(", ");
    match names.len().saturating_sub(MAX_SHOWN_NAMES) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::Role;
    use crate::camera::tilted_camera;
    use crate::scene::{CameraSource, LightDirectionSource, WallRanges};

    fn place(name: &str, wall: Option<f64>) -> Background {
        Background {
            wall: wall.map(|height| Wall {
                height,
                slope_deg: 0.0,
            }),
            ..Background::new(name, [0.6, 0.4], CameraSource::Known(tilted_camera()))
        }
    }

    #[test]
    fn settings_of_layouts_that_are_not_written_are_named() {
        let told = |recipe: &str| idle_labels(&toml::from_str(recipe).unwrap());
        assert_eq!(
            told("formats = ['yolo']\ncoco = { masks = 'polygon' }\nlayers = { cards = true }"),
            [
                r#"labels.coco: has no effect on the dataset, as "coco" is not in labels.formats: ["yolo"]"#,
                r#"labels.layers: has no effect on the dataset, as "layers" is not in labels.formats: ["yolo"]"#,
            ]
        );
        let polygons = "formats = ['coco']\nsimplify = 1\ncoco = { masks = 'polygon' }";
        assert_eq!(told(polygons), [""; 0]);
        assert_eq!(told("coco = { masks = 'rle' }"), [""; 0]);
        let simplified = told("simplify = 1");
        assert!(simplified[0].starts_with("labels.simplify: 1, but no layout in labels.formats: "));
    }

    #[test]
    fn settings_of_what_is_not_there_are_named() {
        let told = |recipe: &str| idle_partners(&toml::from_str(recipe).unwrap());
        assert_eq!(
            told("lens = { focus_m = [0.5, 0.8], sensor_mm = 6 }"),
            [
                "scene.lens.focus_m: [0.5,0.8], but without scene.lens.f_number everything is sharp",
                "scene.lens.sensor_mm: 6, but without scene.lens.f_number everything is sharp",
            ]
        );
        assert_eq!(
            told("environment = { rotation_deg = 30, strength = 2 }"),
            [
                "scene.environment.rotation_deg: 30.0, but scene.environment.files names no picture",
                "scene.environment.strength: 2.0, but scene.environment.files names no picture",
            ]
        );
        let complete = "lens = { f_number = 2.8, focus_m = 0.5 }\nenvironment = { files = ['a.exr'], strength = 2 }";
        assert_eq!(told(complete), [""; 0]);
        assert_eq!(told(""), [""; 0]);
    }

    #[test]
    fn more_photos_than_there_are_is_named() {
        let asset = |photos| Asset {
            name: "a".into(),
            role: Role::Object,
            class: "bottle".into(),
            thickness: 0.01,
            mass: 0.1,
            photos,
        };
        let assets = [asset(vec![(); 2]), asset(vec![(); 3])];
        let told = |recipe: &str| idle_takes(&toml::from_str(recipe).unwrap(), &[(); 4], &assets);
        assert_eq!(
            told("viewpoints = 5\nphotos = 4"),
            [
                "scene.viewpoints: 5, but the number of labelled photos is 4",
                "scene.photos: 4, but no asset has more than 3",
            ]
        );
        assert_eq!(told("viewpoints = 4\nphotos = 3"), [""; 0]);
        assert_eq!(told(""), [""; 0]);
    }

    #[test]
    fn what_turns_no_light_is_named() {
        let places = [
            place("tray", Some(0.06)),
            place("table", Some(0.0)),
            place("room", None),
        ];
        let told = |recipe: &Recipe| idle_light_direction(recipe, places.iter());
        let drawn = Recipe::default();
        let matched = Recipe {
            light_direction: LightDirectionSource::MatchWalls,
            ..Recipe::default()
        };
        let walled = Recipe {
            walls: Some(WallRanges::default()),
            ..matched.clone()
        };
        let dark = Recipe {
            lights: Vec::new(),
            ..matched.clone()
        };
        assert_eq!(told(&drawn), None);
        assert_eq!(
            told(&matched).unwrap(),
            "scene.light_direction: \"match_walls\", but neither scene.walls nor the label gives walls in table, room: lights stay as drawn there"
        );
        assert!(told(&walled).unwrap().contains("walls in table: "));
        assert!(
            told(&dark)
                .unwrap()
                .ends_with("scene.lights has no light to turn")
        );
        assert_eq!(some_of(&["a"; 7]), "a, a, a, a, a and 2 more");
    }
}
