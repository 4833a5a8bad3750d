//! An open pipeline keeps its files when the working folder changes, which is that of the whole
//! process: no other test runs beside this one.
#![expect(unsafe_code, reason = "calls what C calls")]

use petcomp::asset::{self, Library, PhotoEntry, Scale};
use petcomp::{Image, LinearRgb, io};
use petcomp_c::*;
use std::ffi::CString;
use std::path::Path;
use std::ptr::null;

const LABEL: &str = r#"{"format": "plane-label", "version": 1,
    "image": {"file": "a.png", "width": 64, "height": 48}, "camera": {"focal_px": 80},
    "surface": {"id": "tray", "width_m": 0.6, "height_m": 0.4,
                "corners_px": [[10, 10], [50, 11], [51, 40], [9, 39]]}}"#;

/// A recipe for pictures of a place so bright, with the files that it names.
fn write_project(folder: &Path, brightness: f32) {
    let slab = Image::from_fn(120, 80, |x, y| {
        match (30..90).contains(&x) && (25..55).contains(&y) {
            true => LinearRgb::new(0.6, 0.05, 0.05),
            false => LinearRgb::new(0.04, 0.4, 0.08),
        }
    });
    let place = Image::filled(64, 48, LinearRgb::grey(brightness));
    io::create_folder(folder.join("backgrounds")).unwrap();
    io::write(folder.join("slab.png"), &slab).unwrap();
    io::write(folder.join("backgrounds/a.png"), &place).unwrap();
    io::write_text(folder.join("backgrounds/a.label.json"), LABEL).unwrap();
    let recipe = "[scene]\nimage = [64, 48]\nobjects = 1\n";
    io::write_text(folder.join("recipe.toml"), recipe).unwrap();
    let entry = PhotoEntry::new(folder.join("slab.png"), "slab", "slab", Scale::Length(0.2));
    asset::add_photo(folder.join("assets"), &entry, &[], &Default::default()).unwrap();
}

fn open(recipe: &Path) -> PipelineHandle {
    let recipe = CString::new(recipe.to_str().unwrap()).unwrap();
    let mut pipeline = PipelineHandle { id: 0 };
    // SAFETY: a text and a place.
    let status = unsafe { petcomp_pipeline_open(recipe.as_ptr(), null(), 0, &mut pipeline) };
    assert_eq!(status, Status::Ok);
    pipeline
}

fn picture(pipeline: PipelineHandle) -> Vec<u8> {
    let (mut sample, mut rgb) = (SampleHandle { id: 0 }, vec![0; 3 * 64 * 48]);
    // SAFETY: a place.
    let made = unsafe { petcomp_sample_make(pipeline, 1, 0, &mut sample) };
    // SAFETY: as much room as is said.
    let copied = unsafe { petcomp_sample_srgb8(sample, rgb.as_mut_ptr(), rgb.len()) };
    assert_eq!((made, copied), (Status::Ok, Status::Ok));
    rgb
}

#[test]
fn an_open_pipeline_does_not_follow_the_working_folder() {
    let folder = tempfile::tempdir().unwrap();
    let [own, other] = ["own", "other"].map(|name| folder.path().join(name));
    write_project(&own, 0.2);
    write_project(&other, 0.8);
    std::env::set_current_dir(&own).unwrap();
    let pipeline = open(Path::new("recipe.toml"));
    let library = Library::open("assets").unwrap();
    std::env::set_current_dir(&other).unwrap();
    let [own, other] = [own, other].map(|folder| picture(open(&folder.join("recipe.toml"))));
    assert!(own != other && picture(pipeline) == own);
    std::env::set_current_dir(folder.path()).unwrap();
    assert!(library.assets[0].photos[0].pixels().is_ok());
}
