//! A small world of valid files: photos, assets, a label, a recipe, a scene, a dataset and its
//! shards.

use petcomp::asset::{self, PhotoEntry, Scale};
use petcomp::dataset::{DatasetConfig, Pipeline, SampleRange, Shard, generate};
use petcomp::scene::cycles;
use petcomp::{Image, LinearRgb, io};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

pub(crate) const LABEL: &str = r#"{"format": "plane-label", "version": 1,
    "image": {"file": "a.png", "width": 96, "height": 72, "cropped": false,
              "crop": {"offset_px": [0.0, 0.0], "width": 96, "height": 72}},
    "pixel_origin": "corner",
    "surface": {"id": "tray", "width_m": 0.56, "height_m": 0.37, "dimension_sigma_m": 0.002, "source": "hand",
                "corners_px": [[15.0, 17.0], [75.0, 16.0], [76.0, 55.0], [16.0, 56.0]], "corner_sigma_px": 1.0},
    "camera": {"id": "phone", "focal_px": 100.0, "focal_sigma": 0.05, "focal_fixed": false,
               "principal_point_px": [48.0, 36.0], "principal_point_sigma_px": 1.0, "k1": 0.001,
               "height_m": 0.9, "height_sigma_m": 0.1},
    "points": [{"xyz_m": [0.1, 0.1, 0.0], "px": [56.0, 25.0], "sigma_px": 1.0, "note": "rim"}],
    "markers": {"family": "DICT_4X4_50", "artwork": "apriltag", "size_m": 0.06, "map": {"0": [-0.2, 0.1, 0.0]}}}"#;

pub(crate) const LIST: &str = "classes = [\"cap\", \"none\"]\n[cut_out]\nmargin_px = 4\n\
    [[photos]]\nfile = \"slab.png\"\nasset = \"a\"\nclass = \"cap\"\nlength = 0.2\nwidth = 0.1\nthickness = 0.005\n\
    mass = 0.02\nscreen = \"auto\"\n\
    [[photos]]\nfile = \"two.png\"\nasset = \"b\"\nclass = \"none\"\npx_per_metre = 300.0\n";

pub(crate) struct World {
    folder: PathBuf,
    /// Gone when it is dropped, where this process has made it.
    _own: Option<tempfile::TempDir>,
}

impl World {
    pub(crate) fn new() -> Self {
        let own = tempfile::tempdir().unwrap();
        let world = Self {
            folder: own.path().into(),
            _own: Some(own),
        };
        let slab = Image::from_fn(120, 80, |x, y| {
            let inside = (30..90).contains(&x) && (25..55).contains(&y);
            if inside {
                LinearRgb::new(0.6, 0.05, 0.05)
            } else {
                LinearRgb::new(0.04, 0.4, 0.08)
            }
        });
        for name in ["slab.png", "two.png"] {
            io::write(world.path(name), &slab).unwrap();
        }
        for (name, length) in [("a", 0.2), ("b", 0.15)] {
            let entry = PhotoEntry::new(world.path("slab.png"), name, "cap", Scale::Length(length));
            asset::add_photo(world.path("assets"), &entry, &[], &Default::default()).unwrap();
        }
        let place = Image::from_fn(96, 72, |x, y| {
            LinearRgb::grey(0.2 + 0.01 * ((7 * x + 13 * y) % 11) as f32)
        });
        io::create_folder(world.path("backgrounds")).unwrap();
        io::write(world.path("backgrounds/a.png"), &place).unwrap();
        world.write("backgrounds/a.label.json", LABEL);
        world.write(
            "recipe.toml",
            "[scene]\nimage = [64, 48]\nobjects = [1, 3]\n",
        );
        world.write("scene.toml", "");
        world.dataset();
        world
    }

    /// The world that another process has made.
    pub(crate) fn at(folder: &str) -> Self {
        Self {
            folder: folder.into(),
            _own: None,
        }
    }

    /// A dataset in all formats, another to train on beside it, the shards of a third, and a scene
    /// of it for the reference renderer.
    fn dataset(&self) {
        let formats = "labels.formats=[\"yolo\", \"coco\"]".parse().unwrap();
        let setup = DatasetConfig::read(self.path("recipe.toml"), &[formats]).unwrap();
        let pipeline = Pipeline::open(setup).unwrap();
        let make = |folder: &str, range: SampleRange| {
            let mut plan = pipeline.plan(3, 0, self.path(folder)).unwrap();
            plan.range = range;
            generate(
                &plan,
                |k| pipeline.sample(0, k),
                &|_| {},
                &AtomicBool::new(false),
            )
            .unwrap();
        };
        make("dataset", SampleRange::All);
        make("made", SampleRange::All);
        for index in [1, 2] {
            make(
                &format!("shard-{index}"),
                SampleRange::Shard(Shard::new(index, 2).unwrap()),
            );
        }
        let sample = pipeline.sample(0, 1).unwrap().provenance.unwrap();
        io::write_toml(self.path("scene.toml"), &sample.drawn).unwrap();
        io::write_json(self.path("rest.json"), &sample.scene).unwrap();
        let (scene, shot) = pipeline.resolve(sample.scene).unwrap();
        cycles::export(&shot, scene.surface.size, self.path("cycles")).unwrap();
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    pub(crate) fn root(&self) -> &Path {
        &self.folder
    }
}
