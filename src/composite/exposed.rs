//! A shot as lens and shutter show it, and as labels use it.
//!
//! The holdout belongs to the photo, which has its own blur: it hides objects after they have been
//! defocused and moved, not before. Parts of the photo that are displaced by objects that bend
//! light stay as sharp as the rest of it.

use crate::composite::defocus::defocus;
use crate::composite::effect::Effect;
use crate::composite::finish::finish_exposed;
use crate::composite::motion::moved;
use crate::deep::DeepImage;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, PremulRgba};
use crate::render::RenderOptions;
use crate::scene::{PostProcess, Shot};
use std::borrow::Cow;

/// The deep samples of a shot behind the holdout.
pub(crate) struct Exposed {
    deep: DeepImage,
    /// Out of focus, and without the displaced light of the plate; none if all is sharp and nothing
    /// bends light.
    seen: Option<DeepImage>,
    /// Their mean effect on the plate while the shutter is open; none if nothing moves.
    moved: Option<Image<Film>>,
}

impl Exposed {
    /// From samples before the holdout is applied. What spreads into the picture from beyond its
    /// border is rendered with the same `options`.
    pub(crate) fn new(free: DeepImage, shot: &Shot, options: &RenderOptions) -> Self {
        let straight = free.undisplaced();
        let soft = defocus(straight.as_ref().unwrap_or(&free), shot, options);
        let seen = soft.or(straight);
        let moved = moved(seen.as_ref().unwrap_or(&free), shot, options);
        let holdout = shot.holdout.as_deref();
        Self {
            deep: free.held_out(holdout),
            seen: seen.map(|seen| seen.held_out(holdout)),
            moved,
        }
    }

    /// The frame over the shot's plate, scene-linear, premultiplied.
    ///
    /// # Panics
    /// If the plate's size is not the picture's.
    pub(crate) fn frame(&self, shot: &Shot) -> Image<PremulRgba> {
        self.effect().frame(self.plate(shot).as_deref())
    }

    /// The same, finished, with objects blended into the plate if the shot's edges are set to that.
    pub(crate) fn finished(&self, shot: &Shot, finish: &PostProcess) -> Image<PremulRgba> {
        let plate = self.plate(shot);
        let (effect, seen) = (self.effect(), self.seen());
        finish_exposed(&effect, seen, plate.as_deref(), shot.edges, finish)
    }

    /// The source of labels: sharp and at rest.
    pub(crate) fn into_deep(self) -> DeepImage {
        self.deep
    }

    fn seen(&self) -> &DeepImage {
        self.seen.as_ref().unwrap_or(&self.deep)
    }

    /// A shot's plate as seen through the objects.
    fn plate<'a>(&self, shot: &'a Shot) -> Option<Cow<'a, Image<LinearRgb>>> {
        let plate = shot.plate.as_deref();
        plate.map(|plate| self.deep.displaced_plate(plate))
    }

    fn effect(&self) -> Effect<'_> {
        self.moved
            .as_ref()
            .map_or(Effect::Still(self.seen()), Effect::Moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::deep::{DeepSample, HoldoutSample};
    use crate::pixel::{Coverage, Depth, LinearRgb, ObjectId};
    use crate::scene::ThinLens;
    use std::sync::Arc;

    const PLATE: f32 = 0.25;
    const LIGHT: f32 = 0.5;

    /// A striped object in focus over a half covered by an out-of-focus one, and above row 24 one
    /// in front of all.
    fn free() -> DeepImage {
        let sample = |object: u32, depth: f32, visible: f32| DeepSample {
            object: ObjectId(object),
            depth: Depth(depth),
            light: LinearRgb::grey(LIGHT * visible),
            alpha: 1.0,
            visible,
        };
        let pixel = |i: usize| {
            let mut objects = Vec::new();
            if i / 64 < 24 {
                objects.push((1, 0.2));
            }
            if i % 64 < 40 {
                objects.push((2, 0.4));
            }
            if i % 8 < 6 {
                objects.push((3, 0.5));
            }
            let seen = |k: usize| if k == 0 { 1.0 } else { 0.0 };
            let objects = objects.iter().enumerate();
            objects.map(|(k, o)| sample(o.0, o.1, seen(k))).collect()
        };
        let shadow = Image::filled(64, 48, LinearRgb::WHITE);
        DeepImage::from_pixels(shadow, (0..64 * 48).map(pixel))
    }

    /// A wall hides the left half of what is farther away than 0.3 m.
    fn shot(thin_lens: Option<ThinLens>, motion_m: [f64; 2]) -> Shot {
        let wall = |x: usize| HoldoutSample {
            coverage: Coverage(f32::from(x < 32)),
            depth: Depth(0.3),
        };
        Shot {
            holdout: Some(Arc::new(Image::from_fn(64, 48, |x, _| wall(x)))),
            thin_lens,
            motion_m,
            ..Shot::new(Camera::looking_down(0.5, 400.0, [64, 48]))
                .with_plate(Arc::new(Image::filled(64, 48, LinearRgb::grey(PLATE))))
        }
    }

    #[test]
    fn a_wall_hides_what_is_blurred_and_blurs_nothing_else() {
        let lens = ThinLens {
            aperture_m: 0.015,
            focus_m: 0.5,
        };
        for (lens, motion_m) in [
            (None, [0.0; 2]),
            (Some(lens), [0.0; 2]),
            (None, [0.01, 0.0]),
            (Some(lens), [0.01, 0.0]),
        ] {
            let walled = shot(lens, motion_m);
            let open = Shot {
                holdout: None,
                ..walled.clone()
            };
            let [walled, open] = [walled, open]
                .map(|shot| Exposed::new(free(), &shot, &RenderOptions::default()).frame(&shot));
            for x in 16..48 {
                let expected = if x < 32 { PLATE } else { open[(x, 40)].g };
                assert_eq!(walled[(x, 40)].g, expected, "{motion_m:?} {x}");
                let front = walled[(x, 11)].g;
                assert!((front - LIGHT).abs() < 1e-3, "{motion_m:?} {x}: {front}");
            }
        }
    }
}
