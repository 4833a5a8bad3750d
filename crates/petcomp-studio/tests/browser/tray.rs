//! A folder as a person has it after an afternoon: assets, photos of a tray, a recipe, a dataset.

use super::studio::{copy_files, samples};
use petcomp::dataset::{DatasetConfig, Pipeline, generate};
use petcomp::{asset, io};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// The recipe: what its author wrote must stay.
pub(crate) const RECIPE: &str = "# My tray.\nassets = \"assets\"\nbackgrounds = \"backgrounds\" # from above\n\n\
    [scene]\n# As many as fit.\nobjects = [3, 6] # counted\nimage = [640, 480]\n";

/// Fills a folder with everything but a dataset: `recipe.toml`, `assets`, `backgrounds`.
pub(crate) fn fill(folder: &Path) {
    let lists = ["b0000_0.png", "b0001_0.png", "b0002_0.png"];
    copy_files(&samples("bottles"), &folder.join("bottles"), |name| {
        lists.contains(&name)
    });
    copy_files(
        &samples("backgrounds"),
        &folder.join("backgrounds"),
        |name| name.starts_with("bg000"),
    );
    let list = format!(
        "classes = [\"cap_label\", \"cap\", \"label\"]\n{}",
        photos()
    );
    io::write_text(folder.join("bottles/photos.toml"), &list).unwrap();
    io::write_text(folder.join("recipe.toml"), RECIPE).unwrap();
    asset::build(
        folder.join("bottles/photos.toml"),
        folder.join("assets"),
        &|_, _| {},
        &AtomicBool::new(false),
    )
    .unwrap();
}

fn photos() -> String {
    let photos = [
        ("b0000", "cap_label", 1966.712),
        ("b0001", "cap", 2997.924),
        ("b0002", "label", 2600.0),
    ];
    photos
        .iter()
        .map(|(asset, class, scale)| {
            format!("[[photos]]\nfile = \"{asset}_0.png\"\nasset = \"{asset}\"\nclass = \"{class}\"\npx_per_metre = {scale}\n")
        })
        .collect()
}

/// A filled folder with a dataset of so many small pictures in `dataset`.
pub(crate) fn with_dataset(folder: &Path, count: u64) -> PathBuf {
    fill(folder);
    let small = [
        "scene.image=[320,240]",
        "render.subsamples=1",
        "pictures.format=jpg",
    ];
    let small: Vec<_> = small.iter().map(|text| text.parse().unwrap()).collect();
    let config = DatasetConfig::read(folder.join("recipe.toml"), &small).unwrap();
    let pipeline = Pipeline::open(config).unwrap();
    let plan = pipeline.plan(count, 0, folder.join("dataset")).unwrap();
    let make = |k| pipeline.sample(0, k);
    generate(&plan, make, &|_| {}, &AtomicBool::new(false)).unwrap();
    folder.join("dataset")
}
