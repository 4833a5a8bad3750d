//! CPU milliseconds of a labelled picture of the sample assets, by stage and number of objects: one
//! thread, process time, so that what else runs on the machine changes little.
//!
//! `cargo bench --bench picture -- pictures=20`: how many pictures each row is the mean of.

use petcomp::asset;
use petcomp::dataset::{DatasetConfig, Pipeline};
use petcomp::label::{LabelOptions, label};
use petcomp::{LinearRgb, Result, io};
use rustix::time::{ClockId, clock_gettime};
use std::hint::black_box;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Pictures that a row is the mean of.
const PICTURES: u64 = 6;
/// Quality of the JPEG: that of recipes.
const JPEG_QUALITY: u8 = 95;
/// Sizes of pictures and numbers of objects.
const ROWS: [([u32; 2], u32); 5] = [
    ([640, 480], 5),
    ([640, 480], 10),
    ([640, 480], 20),
    ([640, 480], 30),
    ([1920, 1080], 30),
];
const STAGES: [&str; 6] = [
    "settle",
    "render",
    "frame",
    "label",
    "encode",
    "labels alone",
];

fn main() -> Result<()> {
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    single.expect("one thread can be had").install(print_table)
}

fn print_table() -> Result<()> {
    let pictures = std::env::args().find_map(|arg| arg.strip_prefix("pictures=")?.parse().ok());
    let pictures = pictures.unwrap_or(PICTURES);
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/samples");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    asset::build(
        samples.join("bottles/photos.toml"),
        folder.path(),
        &|_, _| (),
        &AtomicBool::new(false),
    )?;
    println!("CPU ms per picture, mean of {pictures}; all but the last column add up to `picture`");
    println!("size         objects  picture  {}", STAGES.join("  "));
    for (image, objects) in ROWS {
        let pipeline = Pipeline::open(config(&samples, folder.path(), image, objects)?)?;
        print_row(&pipeline, pictures)?;
    }
    Ok(())
}

fn config(samples: &Path, assets: &Path, image: [u32; 2], objects: u32) -> Result<DatasetConfig> {
    let text = format!("scene.image = {image:?}\nscene.objects = [{objects}, {objects}]\n");
    Ok(DatasetConfig {
        assets: assets.into(),
        backgrounds: samples.join("backgrounds"),
        ..DatasetConfig::parse(&text, Path::new("recipe.toml"), &[])?
    })
}

fn print_row(pipeline: &Pipeline, pictures: u64) -> Result<()> {
    // Photos are read once for all pictures: now.
    for k in 0..pictures {
        pipeline.resolve(pipeline.draw(0, k)?)?;
    }
    let mut sums = [0.0; STAGES.len()];
    for k in 0..pictures {
        let took = take_picture(pipeline, k)?;
        sums.iter_mut().zip(took).for_each(|(sum, ms)| *sum += ms);
    }
    let means = sums.map(|sum| sum / pictures as f64);
    let scene = &pipeline.config().scene;
    let [w, h] = scene.image;
    let picture: f64 = means[..STAGES.len() - 1].iter().sum();
    print!(
        "{:12} {:7} {picture:8.1}",
        format!("{w} x {h}"),
        scene.objects.max()
    );
    for (stage, ms) in STAGES.iter().zip(means) {
        print!("  {ms:>width$.1}", width = stage.len());
    }
    println!();
    Ok(())
}

/// CPU milliseconds of each stage of picture `k`.
fn take_picture(pipeline: &Pipeline, k: u64) -> Result<[f64; STAGES.len()]> {
    let drawn = pipeline.draw(0, k)?;
    let (resolved, settle) = timed(|| pipeline.resolve(drawn));
    let (scene, shot) = resolved?;
    let options = &pipeline.config().render;
    let (deep, render) = timed(|| petcomp::render::render(&shot, options));
    let (frame, compose) = timed(|| petcomp::composite::frame(&deep, shot.plate.as_deref()));
    let (labels, labelling) = timed(|| label(&deep, &shot, &LabelOptions::default()));
    let (jpeg, encode) =
        timed(|| io::jpeg_bytes(&frame.map(|p| -> LinearRgb { p.color() }), JPEG_QUALITY));
    let (alone, labels_alone) = timed(|| pipeline.label(scene));
    black_box((jpeg?, labels, alone?));
    Ok([settle, render, compose, labelling, encode, labels_alone])
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let began = cpu_ms();
    let done = work();
    (done, cpu_ms() - began)
}

/// CPU time of this process so far.
fn cpu_ms() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    1e3 * now.tv_sec as f64 + 1e-6 * now.tv_nsec as f64
}
