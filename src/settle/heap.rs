//! Heaps for measuring the stage.

use crate::error::Result;
use crate::scene::{AssetVariant, Background, CameraSource, Range, Recipe, Scene};

/// Assets in the catalog that heaps are drawn from.
const CATALOG_SIZE: usize = 20;

/// Cards of 200 x 70 and 190 x 80 mm, 2 to 11 mm thick, over a surface of 0.6 x 0.4 m: scene `k`.
pub fn heap(k: u64, cards: usize) -> Result<Scene> {
    let recipe = Recipe {
        objects: Range::fixed(cards as f64).into(),
        ..Recipe::default()
    };
    let catalog: Vec<AssetVariant> = (0..CATALOG_SIZE).map(bottle).collect();
    recipe.scene(0, k, &[tray()], &catalog)
}

fn tray() -> Background {
    let camera = CameraSource::Rectangle {
        corners_px: [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]],
        photo: [60, 40],
        focal_px: None,
    };
    Background::new("tray", [0.6, 0.4], camera)
}

/// One of ten thicknesses and masses.
fn bottle(i: usize) -> AssetVariant {
    AssetVariant {
        role: Default::default(),
        asset: format!("b{i}"),
        photo_sizes: vec![[0.2, 0.07], [0.19, 0.08]],
        photo_outlines: vec![],
        thickness: 0.002 + 0.001 * (i % 10) as f64,
        mass: 0.02 + 0.002 * (i % 10) as f64,
    }
}

/// An octagon that touches the middle half of each side of its card.
pub fn octagon([w, h]: [f64; 2]) -> Vec<[f64; 2]> {
    let (x, y) = (w / 2.0, h / 2.0);
    let half = [[x, -y / 2.0], [x, y / 2.0], [x / 2.0, y], [-x / 2.0, y]];
    half.into_iter()
        .chain(half.map(|[a, b]| [-a, -b]))
        .collect()
}
