//! A plate and what has been measured of it.

use crate::camera::Camera;
use crate::image::Image;
use crate::light::expose::plate_white;
use crate::light::surface::{SurfaceLight, surface_light};
use crate::light::{plate_blur, plate_noise};
use crate::pixel::LinearRgb;
use crate::scene::{Blur, CameraSource, Noise, Scene};
use std::sync::OnceLock;

/// As much as a finish may have.
const MAX_BLUR_PX: f64 = 100.0;

/// What scenes ask of one plate, each measured when a scene first asks for it.
#[derive(Debug, Default)]
pub(crate) struct PlateMeasures {
    blur: OnceLock<Blur>,
    noise: OnceLock<Noise>,
    white: OnceLock<f32>,
    surface: OnceLock<(SurfaceView, Option<SurfaceLight>)>,
}

/// A plate and a cache for what was measured of it; without a cache it is measured each time.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredPlate<'a> {
    pub(super) image: &'a Image<LinearRgb>,
    kept: Option<&'a PlateMeasures>,
}

impl<'a> From<&'a Image<LinearRgb>> for MeasuredPlate<'a> {
    fn from(image: &'a Image<LinearRgb>) -> Self {
        Self { image, kept: None }
    }
}

/// Which part of a plate is the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SurfaceView {
    camera: Camera,
    size: [f64; 2],
    /// The plate's own distortion.
    k1: f64,
}

impl SurfaceView {
    fn of_scene(scene: &Scene) -> Option<Self> {
        let CameraSource::Known(camera) = scene.camera else {
            return None;
        };
        Some(Self {
            camera,
            size: scene.surface.size,
            k1: scene.lens.k1_of_plate(),
        })
    }
}

impl<'a> MeasuredPlate<'a> {
    pub(crate) fn new(image: &'a Image<LinearRgb>, measures: &'a PlateMeasures) -> Self {
        Self {
            image,
            kept: Some(measures),
        }
    }

    /// Luminance of its white.
    pub(super) fn white(&self) -> f32 {
        self.known(|kept| &kept.white, plate_white)
    }

    /// The light of a scene's surface; none where the camera is not known yet, or does not see it.
    pub(super) fn surface(&self, scene: &Scene) -> Option<SurfaceLight> {
        let view = SurfaceView::of_scene(scene)?;
        let measure = |image: &_| (view, surface_light(scene, image));
        let (of, light) = self.known(|kept| &kept.surface, measure);
        match of == view {
            true => light,
            false => measure(self.image).1,
        }
    }

    /// Turns [`Blur::MatchPlate`] and [`Noise::MatchPlate`] of a scene's finish into those of the
    /// plate; any other scene comes back as it is.
    pub(crate) fn grained(&self, mut scene: Scene) -> Scene {
        if scene.finish.blur_px == Blur::MatchPlate {
            scene.finish.blur_px = self.shown_blur(&scene);
        }
        if scene.finish.noise == Noise::MatchPlate {
            scene.finish.noise = self.known(|kept| &kept.noise, plate_noise);
        }
        scene
    }

    /// Its blur in the pixels of a scene's picture.
    fn shown_blur(&self, scene: &Scene) -> Blur {
        match self.known(|kept| &kept.blur, plate_blur) {
            Blur::Known(sigma_px) if sigma_px > 0.0 => {
                let shown_px = sigma_px * scene.plate_px(self.image);
                Blur::Known(shown_px.min(MAX_BLUR_PX))
            }
            none => none,
        }
    }

    fn known<T: Copy>(
        &self,
        cell: impl Fn(&PlateMeasures) -> &OnceLock<T>,
        measure: impl FnOnce(&Image<LinearRgb>) -> T,
    ) -> T {
        let cell = self.kept.map(cell);
        if let Some(value) = cell.and_then(OnceLock::get) {
            return *value;
        }
        // Measured before the cell is locked: the work is parallel, and a thread that waits may come
        // back here.
        let value = measure(self.image);
        cell.map_or(value, |cell| *cell.get_or_init(|| value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::blur::tests::edges;
    use crate::light::match_plate;
    use crate::light::surface::tests::scene;
    use crate::scene::{Draws, Exposure, LightTint};

    fn noisy_plate() -> Image<LinearRgb> {
        let grain = |x: usize, y: usize| Draws::new(1, (y * 160 + x) as u64).unit("grain") as f32;
        Image::from_fn(160, 120, |x, y| LinearRgb::grey(0.3 + 0.1 * grain(x, y)))
    }

    /// A scene that leaves all that can be measured to its plate.
    fn open_scene() -> Scene {
        let cast = LightTint::MatchSurface {
            share: 1.0,
            albedo: LinearRgb::new(0.8, 0.2, 0.05),
        };
        let mut scene = scene(cast);
        scene.exposure = Exposure::MatchPlate { gain_ev: 0.0 };
        scene.finish.blur_px = Blur::MatchPlate;
        scene.finish.noise = Noise::MatchPlate;
        scene
    }

    #[test]
    fn a_plate_is_measured_once() {
        let (plate, measures) = (noisy_plate(), PlateMeasures::default());
        let first = match_plate(open_scene(), MeasuredPlate::new(&plate, &measures), None);
        assert_eq!(match_plate(open_scene(), &plate, None), first);
        let expected = (plate_blur(&plate), plate_noise(&plate));
        assert_eq!((first.finish.blur_px, first.finish.noise), expected);
        // What it is asked with later is not looked at.
        let other = Image::new(40, 30);
        let again = match_plate(open_scene(), MeasuredPlate::new(&other, &measures), None);
        assert_eq!(again, first);
    }

    #[test]
    fn blur_grows_with_the_plate() {
        let plate = edges(0.8);
        let Blur::Known(of_plate) = plate_blur(&plate) else {
            panic!("nothing found")
        };
        let blur = |zoom: f64| {
            let mut scene = open_scene();
            scene.view.zoom = zoom;
            match_plate(scene, &plate, None).finish.blur_px
        };
        // The plate has four pixels for one of the picture.
        let expected = [0.25, 0.5].map(|shown| Blur::Known(shown * of_plate));
        assert_eq!([1.0, 2.0].map(blur), expected);
    }

    #[test]
    fn blur_grows_where_a_barrel_zooms_in() {
        let plate = edges(0.8);
        let blur = |scene: Scene| match match_plate(scene, &plate, None).finish.blur_px {
            Blur::Known(sigma_px) => sigma_px,
            Blur::MatchPlate => panic!("nothing found"),
        };
        let mut bent = open_scene();
        bent.lens.k1 = -0.1;
        bent.lens.bends_plate = true;
        let zoom = bent.zoom_used();
        assert!(zoom > 1.0);
        assert_eq!(blur(bent), zoom * blur(open_scene()));
    }

    #[test]
    fn another_camera_sees_another_part() {
        let plate = Image::from_fn(40, 30, |x, _| LinearRgb::grey(0.01 * (x as f32 + 0.5)));
        let measures = PlateMeasures::default();
        let kept = MeasuredPlate::new(&plate, &measures);
        let left = |mut scene: Scene| {
            if let CameraSource::Known(camera) = &mut scene.camera {
                camera.principal_px.x -= 5.0;
            }
            scene
        };
        let [first, second] = [open_scene(), left(open_scene())];
        let color = |scene: &Scene| kept.surface(scene).unwrap().color;
        assert!(color(&first).g > color(&second).g + 0.04);
        assert_eq!(color(&first), kept.surface(&first).unwrap().color);
    }
}
