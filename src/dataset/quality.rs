//! What each [`Quality`] stands for, stage by stage.
//!
//! Each stage has settings on its own curve of error against time (`petcomp-report all` measures
//! them); a [`Quality`] selects one point on every curve. [`Quality::table`] lists them. What is
//! not in it is exact, or so fast that nothing would be gained: colour transfer, the keyer, labels
//! (masks and boxes), and the camera, which is solved to convergence in a fifth of a millisecond.

use crate::dataset::{DatasetConfig, Pictures};
use crate::error::{Error, Result};
use crate::io::Override;
use crate::matte::{CutOutOptions, SegmentOptions};
use crate::plot::Table;
use crate::quality::Quality;
use crate::render::RenderOptions;
use crate::scene::SettleOptions;

impl Quality {
    /// How finely pictures, their light and their shadows are sampled.
    pub fn render(self) -> RenderOptions {
        self.into()
    }

    /// Settle options with the solver's steps changed; what a fall is, and when it ends, stay the
    /// same.
    pub fn settle(self, options: SettleOptions) -> SettleOptions {
        let default = SettleOptions::default();
        let step = self.of([1.0 / 240.0, default.step, 1.0 / 1920.0]);
        let iterations = self.of([4, default.iterations, 8]);
        SettleOptions {
            step,
            iterations,
            ccd: default.ccd,
            ..options
        }
    }

    /// Cut-out options with the sizes of the searched photo and of the cut-out changed.
    pub fn cut_out(self, options: CutOutOptions) -> CutOutOptions {
        let default = CutOutOptions::default();
        let working_size = self.of([320, default.segment.working_size, 1280]);
        let longest_side = self.of([1024, default.longest_side, 4096]);
        CutOutOptions {
            segment: SegmentOptions {
                working_size,
                ..options.segment
            },
            longest_side,
            ..options
        }
    }

    /// Picture options: a reference also keeps the scene-linear picture, which 8 bits cannot hold.
    pub fn pictures(self, pictures: Pictures) -> Pictures {
        Pictures {
            exr: pictures.exr || self == Self::Reference,
            ..pictures
        }
    }

    /// A dataset's config with every approximate stage of a run at this quality.
    pub fn config(self, mut config: DatasetConfig) -> DatasetConfig {
        config.render = self.render();
        config.scene.settle = self.settle(config.scene.settle);
        config.pictures = self.pictures(config.pictures);
        config
    }

    /// The recipe values that a quality replaces, if one is given, followed by those that are
    /// replaced by name, which take precedence.
    pub fn overrides_at(
        quality: Option<Self>,
        named: impl IntoIterator<Item = Override>,
    ) -> Vec<Override> {
        let overrides = quality.map_or_else(Vec::new, Self::overrides);
        overrides.into_iter().chain(named).collect()
    }

    /// The values that [`config`](Self::config) replaces.
    fn overrides(self) -> Vec<Override> {
        let (render, settle) = (self.render(), self.settle(SettleOptions::default()));
        let values = [
            format!("render.subsamples={}", render.subsamples),
            format!("render.light_samples={}", render.light_samples),
            format!("render.ambient_samples={}", render.ambient_samples),
            format!("render.cell_px={}", render.cell_px),
            format!("render.refraction={}", render.refraction),
            format!("scene.settle.step={}", settle.step),
            format!("scene.settle.iterations={}", settle.iterations),
            format!("scene.settle.ccd={}", settle.ccd),
        ];
        let exr = (self == Self::Reference).then(|| "pictures.exr=true".to_owned());
        let values = values.into_iter().chain(exr);
        values
            .map(|value| value.parse().expect("a key and a value"))
            .collect()
    }

    /// The settings of all stages: one row per setting, one column per quality.
    pub fn table() -> Table {
        let mut table = Table::new([
            "stage",
            "setting",
            "draft",
            "normal (the default)",
            "reference",
        ]);
        for (stage, setting, value) in SETTINGS {
            let values = Self::ALL.map(|quality| value(&StageSettings::new(quality)));
            table.push([stage, setting].map(String::from).into_iter().chain(values));
        }
        table
    }
}

/// The options of every approximate stage at one quality.
struct StageSettings {
    cut_out: CutOutOptions,
    settle: SettleOptions,
    render: RenderOptions,
    pictures: Pictures,
}

impl StageSettings {
    fn new(quality: Quality) -> Self {
        Self {
            cut_out: quality.cut_out(CutOutOptions::default()),
            settle: quality.settle(SettleOptions::default()),
            render: quality.render(),
            pictures: quality.pictures(Pictures::default()),
        }
    }
}

/// Stage, name and value of a setting.
type Setting = (&'static str, &'static str, fn(&StageSettings) -> String);

const SETTINGS: [Setting; 9] = [
    ("matte", "longer side of the searched image, px", |s| {
        s.cut_out.segment.working_size.to_string()
    }),
    ("matte", "longer side of a cut-out, px", |s| {
        s.cut_out.longest_side.to_string()
    }),
    ("settle", "time step, s", |s| {
        format!("1/{}", libm::round(1.0 / s.settle.step))
    }),
    ("settle", "iterations per step", |s| {
        s.settle.iterations.to_string()
    }),
    ("light, shadow", "samples per light", |s| {
        square(s.render.light_samples)
    }),
    ("light, shadow", "directions of the sky", |s| {
        s.render.ambient_samples.to_string()
    }),
    ("light, shadow", "distance of irradiance samples, px", |s| {
        s.render.cell_px.to_string()
    }),
    ("render", "samples per pixel", |s| {
        square(s.render.subsamples)
    }),
    ("encode", "output files", |s| {
        if s.pictures.exr {
            "PNG of 8 bits, EXR of half floats".into()
        } else {
            "PNG of 8 bits".into()
        }
    }),
];

fn square(side: usize) -> String {
    format!("{side} x {side}")
}

impl std::fmt::Display for Quality {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Quality {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let known = Self::ALL.into_iter().find(|q| q.name() == name);
        known.ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::value("quality", format!("\"{name}\", expected one of {names}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_is_the_default_of_every_stage() {
        assert_eq!(Quality::default(), Quality::Normal);
        assert_eq!(
            Quality::Normal.config(DatasetConfig::default()),
            DatasetConfig::default()
        );
        assert_eq!(
            Quality::Normal.cut_out(CutOutOptions::default()),
            CutOutOptions::default()
        );
    }

    #[test]
    fn only_what_is_approximate_changes() {
        let odd = SettleOptions {
            gravity: [1.0, 0.0, -9.0],
            attempts: 3,
            ..SettleOptions::default()
        };
        let settled = Quality::Reference.settle(odd);
        assert_eq!(
            (settled.gravity, settled.attempts),
            (odd.gravity, odd.attempts)
        );
        let mut config = DatasetConfig::default();
        config.scene.objects = crate::scene::Count::fixed(3);
        config.pictures.exr = true;
        let draft = Quality::Draft.config(config.clone());
        assert_eq!(
            (
                draft.scene.objects.clone(),
                draft.labels.clone(),
                draft.pictures
            ),
            (config.scene.objects, config.labels, config.pictures)
        );
        assert_eq!(draft.render, Quality::Draft.render());
    }

    #[test]
    fn its_overrides_give_its_config_and_those_behind_them_stay() {
        let odd = "render = { subsamples = 7, refraction = false }\nscene.settle.ccd = 3";
        let read = |overrides: &[Override]| {
            DatasetConfig::parse(odd, "recipe.toml".as_ref(), overrides).unwrap()
        };
        for quality in Quality::ALL {
            let mut expected = quality.config(read(&[]));
            assert_eq!(read(&Quality::overrides_at(Some(quality), [])), expected);
            let named = ["render.subsamples=5".parse().unwrap()];
            expected.render.subsamples = 5;
            let overrides = Quality::overrides_at(Some(quality), named);
            assert_eq!(read(&overrides), expected);
        }
    }

    #[test]
    fn better_qualities_do_more_work_and_are_accepted() {
        for [low, high] in [
            [Quality::Draft, Quality::Normal],
            [Quality::Normal, Quality::Reference],
        ] {
            let [a, b] = [low, high].map(Quality::render);
            assert!(a.subsamples < b.subsamples && a.light_samples < b.light_samples);
            assert!(a.ambient_samples < b.ambient_samples && a.cell_px > b.cell_px);
            let [a, b] = [low, high].map(|q| q.settle(SettleOptions::default()));
            assert!(a.step > b.step && a.iterations <= b.iterations);
            assert!(a.check().is_ok() && b.check().is_ok());
        }
    }

    #[test]
    fn the_table_tells_the_settings_that_the_stages_get() {
        let table = Quality::table();
        let cell = |setting: &str, quality: usize| {
            table
                .rows
                .iter()
                .find(|row| row[1] == setting)
                .map(|row| row[2 + quality].clone())
        };
        for (i, quality) in Quality::ALL.into_iter().enumerate() {
            let config = quality.config(DatasetConfig::default());
            let sides = config.render.subsamples;
            assert_eq!(
                cell("samples per pixel", i),
                Some(format!("{sides} x {sides}"))
            );
            assert_eq!(
                cell("iterations per step", i),
                Some(config.scene.settle.iterations.to_string())
            );
            assert_eq!(
                cell("output files", i).map(|t| t.contains("EXR")),
                Some(config.pictures.exr)
            );
        }
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        assert!(
            Quality::ALL
                .iter()
                .all(|q| q.name().parse::<Quality>().is_ok_and(|read| read == *q))
        );
        assert!(
            "fast"
                .parse::<Quality>()
                .unwrap_err()
                .to_string()
                .contains("draft, normal, reference")
        );
    }
}
