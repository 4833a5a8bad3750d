//! What a scene's finish leaves to its plate: blur and noise.

use crate::image::Image;
use crate::light::{plate_blur, plate_noise};
use crate::pixel::LinearRgb;
use crate::scene::{Blur, Noise, Scene};
use std::sync::OnceLock;

/// Blur and noise of one plate, each measured when a scene first asks for it.
#[derive(Debug, Default)]
pub(crate) struct PlateGrain {
    blur: OnceLock<Blur>,
    noise: OnceLock<Noise>,
}

impl PlateGrain {
    /// Turns [`Blur::MatchPlate`] and [`Noise::MatchPlate`] of a scene's finish into those of its
    /// plate, which is the same every time; any other scene comes back as it is.
    pub(crate) fn matched(&self, mut scene: Scene, plate: &Image<LinearRgb>) -> Scene {
        let finish = &mut scene.finish;
        if finish.blur_px == Blur::MatchPlate {
            finish.blur_px = known(&self.blur, || plate_blur(plate));
        }
        if finish.noise == Noise::MatchPlate {
            finish.noise = known(&self.noise, || plate_noise(plate));
        }
        scene
    }
}

fn known<T: Copy>(cell: &OnceLock<T>, measure: impl FnOnce() -> T) -> T {
    if let Some(value) = cell.get() {
        return *value;
    }
    // Measured before the cell is locked: the work is parallel, and a thread that waits may come
    // back here.
    let value = measure();
    *cell.get_or_init(|| value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Draws;

    #[test]
    fn a_plate_is_measured_once() {
        let grain = |x: usize, y: usize| Draws::new(1, (y * 160 + x) as u64).unit("grain") as f32;
        let plate = Image::from_fn(160, 120, |x, y| LinearRgb::grey(0.3 + 0.1 * grain(x, y)));
        let mut scene = crate::light::surface::tests::scene(Default::default());
        scene.finish.blur_px = Blur::MatchPlate;
        scene.finish.noise = Noise::MatchPlate;
        let measured = PlateGrain::default();
        let first = measured.matched(scene.clone(), &plate);
        let expected = (plate_blur(&plate), plate_noise(&plate));
        assert_eq!((first.finish.blur_px, first.finish.noise), expected);
        // What it is asked with later is not looked at.
        assert_eq!(measured.matched(scene, &Image::new(2, 2)), first);
    }
}
