//! Light and shadow: the filtered form and plain samples compared with closed forms, error against
//! run time.
//!
//! One opaque card is above the surface. The share of a rectangular light that it leaves at a point
//! is Lambert's formula for the part of the light that the card does not hide: the light clipped by
//! the planes through the point and the card's sides. The share of a uniform sky is 1 less the
//! card's form factor. Neither has anything in common with the renderer's sampling.

mod shadow;

use super::clock::timed;
use super::diagram::invisible_error;
use super::{Diagram, Point};
use petcomp::DeepImage;
use petcomp::Quality;
use petcomp::Result;
use petcomp::render::{RenderOptions, render, render_reference};
use petcomp::scene::Shot;
use shadow::{CARD_HEIGHT_M, IMAGE_SIZE_PX, LightKind, exact_shares, shadow_shot};

/// Samples along each side of the light.
const LIGHT_SAMPLES: [usize; 7] = [1, 2, 3, 4, 6, 8, 12];
/// Directions of the sky.
const SKY_SAMPLES: [usize; 7] = [4, 12, 32, 64, 100, 200, 400];
const CELLS_PX: [f64; 5] = [4.0, 2.0, 1.5, 1.0, 0.33];
/// The plain form takes a thousand times as long, so it is measured with fewer samples.
const MAX_PLAIN_SAMPLES: usize = 64;
const TIMED_RUNS: usize = 5;

/// The shadow of a card under an area light, and under a uniform sky.
pub(crate) fn diagrams() -> Result<Vec<Diagram>> {
    let kinds = [LightKind::Area, LightKind::Sky];
    kinds.into_iter().map(shadow_diagram).collect()
}

fn shadow_diagram(kind: LightKind) -> Result<Diagram> {
    let shadow = Shadow::new(kind);
    let points = [
        shadow.filtered_points()?,
        shadow.cell_points()?,
        shadow.plain_points()?,
        shadow.quality_points()?,
    ];
    Ok(Diagram {
        points: points.concat(),
        ..kind.empty_diagram()
    })
}

impl LightKind {
    fn sample_counts(self) -> [usize; 7] {
        match self {
            Self::Area => LIGHT_SAMPLES,
            Self::Sky => SKY_SAMPLES,
        }
    }

    fn options(self, samples: usize) -> RenderOptions {
        let default = RenderOptions::default();
        match self {
            Self::Area => RenderOptions {
                light_samples: samples,
                ..default
            },
            Self::Sky => RenderOptions {
                ambient_samples: samples,
                ..default
            },
        }
    }

    fn setting_name(self, samples: usize) -> String {
        match self {
            Self::Area => format!("{samples} x {samples}"),
            Self::Sky => samples.to_string(),
        }
    }

    /// File, title and reference.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Area => [
                "shadow_light",
                "shadow: a card under an area light",
                "Lambert's formula for the visible part of the light (closed form)",
            ],
            Self::Sky => [
                "shadow_sky",
                "shadow: a card under an even sky",
                "form factor of the card (closed form)",
            ],
        }
    }

    fn empty_diagram(self) -> Diagram {
        let [file, title, reference] = self.words().map(String::from);
        Diagram {
            file,
            title,
            input: input_words(),
            error: "RMS error of the share of light".into(),
            cost: "CPU seconds of a picture".into(),
            reference,
            limit: invisible_error(),
            why: "Cards in piles cast many overlapping shadows, so the error of a single one should be a fraction of \
                  what is visible."
                .into(),
            ..Diagram::default()
        }
    }
}

fn input_words() -> String {
    let ([w, h], height_mm) = (IMAGE_SIZE_PX, CARD_HEIGHT_M * 1e3);
    format!("one opaque card {height_mm} mm over the surface, {w} x {h}")
}

type Renderer = fn(&Shot, &RenderOptions) -> DeepImage;

/// A card's shadow to render, and its closed form.
struct Shadow {
    kind: LightKind,
    shot: Shot,
    exact: Vec<Option<f64>>,
}

impl Shadow {
    fn new(kind: LightKind) -> Self {
        let shot = shadow_shot(kind);
        Self {
            kind,
            exact: exact_shares(&shot, kind),
            shot,
        }
    }

    fn filtered_points(&self) -> Result<Vec<Point>> {
        let counts = self.kind.sample_counts().into_iter();
        counts
            .map(|n| {
                let setting = self.kind.setting_name(n);
                self.measure(["filtered", &setting], &self.kind.options(n), render)
            })
            .collect()
    }

    fn cell_points(&self) -> Result<Vec<Point>> {
        let default = RenderOptions::default();
        let others = CELLS_PX.into_iter().filter(|px| *px != default.cell_px);
        others
            .map(|cell_px| {
                let options = RenderOptions { cell_px, ..default };
                let setting = format!("{cell_px} px");
                self.measure(["filtered, other cells", &setting], &options, render)
            })
            .collect()
    }

    fn plain_points(&self) -> Result<Vec<Point>> {
        let counts = self.kind.sample_counts().into_iter();
        counts
            .filter(|n| *n <= MAX_PLAIN_SAMPLES)
            .map(|n| self.plain_point(n))
            .collect()
    }

    fn plain_point(&self, samples: usize) -> Result<Point> {
        // One sample per pixel: shadows are smooth, and only the light is compared.
        let options = RenderOptions {
            subsamples: 1,
            ..self.kind.options(samples)
        };
        let setting = self.kind.setting_name(samples);
        self.measure(["plain samples", &setting], &options, render_reference)
    }

    fn quality_points(&self) -> Result<Vec<Point>> {
        let others = [Quality::Draft, Quality::Reference];
        others
            .into_iter()
            .map(|quality| {
                let point = self.measure(["all of a quality", ""], &quality.render(), render)?;
                Ok(point.used_where(|q| q == quality))
            })
            .collect()
    }

    /// Time and error of a setting of a curve.
    fn measure(
        &self,
        [curve, setting]: [&str; 2],
        options: &RenderOptions,
        renderer: Renderer,
    ) -> Result<Point> {
        let (deep, seconds) = timed(TIMED_RUNS, || Ok(renderer(&self.shot, options)))?;
        let is_default = *options == RenderOptions::default();
        Ok(Point::new(curve, setting, seconds, self.rms_error(&deep))
            .used_where(|q| is_default && q == Quality::default()))
    }

    /// Root mean square over the pixels for which the closed form holds.
    fn rms_error(&self, deep: &DeepImage) -> f64 {
        let shadow = deep.shadow();
        let pairs = shadow.pixels().iter().zip(&self.exact);
        let errors = pairs.filter_map(|(pixel, exact)| Some(f64::from(pixel.g) - (*exact)?));
        let (sum, count) =
            errors.fold((0.0, 0.0), |(sum, count), e| (sum + e.powi(2), count + 1.0));
        (sum / f64::max(count, 1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_samples_come_nearer_and_the_default_is_near() {
        let shadow = Shadow::new(LightKind::Area);
        let error =
            |options: RenderOptions| shadow.measure(["", ""], &options, render).unwrap().error;
        let [draft, normal, best] = Quality::ALL.map(|q| error(q.render()));
        assert!(
            draft > normal && normal > best && best < 0.005 && normal < 0.03,
            "{draft} {normal} {best}"
        );
    }
}
