//! Keys of a recipe that change nothing.

use crate::dataset::Pipeline;
use crate::scene::{Background, Recipe, Wall};

/// Most names in a message.
const MAX_SHOWN_NAMES: usize = 5;

impl Pipeline {
    /// Why the recipe's `scene.light_direction` leaves light where it is drawn, and in which places;
    /// none where it does not.
    #[doc(hidden)]
    pub fn idle_light_direction(&self) -> Option<String> {
        let recipe = &self.config().scene;
        let places = recipe.narrowed().viewpoints.slice_of(self.places());
        idle_light_direction(recipe, places.iter().map(|place| &place.background))
    }
}

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
            "{key}, but neither scene.walls nor the label tells of walls in {names}: light stands there as it is drawn"
        )
    })
}

/// Whether there is anything on the edges of a surface whose label says `labelled`.
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
    use crate::scene::{CameraSource, LightDirectionSource, WallRanges};

    fn place(name: &str, wall: Option<f64>) -> Background {
        Background {
            name: name.into(),
            size: [0.6, 0.4],
            k1: 0.0,
            shown_share: 1.0,
            albedo: None,
            wall: wall.map(|height| Wall {
                height,
                slope_deg: 0.0,
            }),
            camera: CameraSource::Rectangle {
                corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
                photo: [60, 40],
                focal_px: Some(55.0),
            },
        }
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
            "scene.light_direction: \"match_walls\", but neither scene.walls nor the label tells of walls in table, room: \
             light stands there as it is drawn"
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
