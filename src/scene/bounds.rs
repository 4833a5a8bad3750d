//! Bounds of the numbers in recipes and scenes, with the reasons: all in one place.
//!
//! The bounds of a recipe are those of real photographs; a scene may come from any program and is
//! only bounded by what the arithmetic of the stages can handle.

use crate::bounds::Bounds;

/// Maximum number of objects in a scene: heaps of some hundreds still come to rest.
pub(crate) const MAX_OBJECTS: usize = 1_000;
/// Maximum number of lights in a scene: each needs a shadow from every card.
pub(crate) const MAX_LIGHTS: usize = 64;

pub(super) const SHARE: Bounds = Bounds::new(0.0, 1.0, "a share");
pub(super) const SCALE: Bounds = Bounds::new(0.01, 100.0, "a factor on objects of 5 mm to 5 m");
/// That of an asset times the cube of [`SCALE`].
pub(super) const MASS: Bounds = Bounds::new(1e-12, 1e12, "kilograms");
pub(super) const EV: Bounds = Bounds::new(-32.0, 32.0, "the range of 32-bit pictures");
/// Exposure of a scene, which is solved from light of any brightness: a wider range than for typed
/// values.
pub(super) const SOLVED_EV: Bounds = Bounds::new(-100.0, 100.0, "the range of single precision");
pub(super) const TURN: Bounds = Bounds::new(-3600.0, 3600.0, "degrees; a turn is 360");
pub(super) const TILT: Bounds = Bounds::new(-180.0, 180.0, "degrees");
pub(super) const ACROSS: Bounds = Bounds::new(-1.0, 1.0, "the walls");
pub(super) const SHIFT: Bounds = Bounds::new(-1.0, 1.0, "the photo's edges");
pub(super) const GAP: Bounds = Bounds::metres(1e-6, 1.0, "objects are stacked before they fall");
pub(super) const GRADE: Bounds = Bounds::new(0.0, 100.0, "a factor");
pub(super) const WEIGHT: Bounds = Bounds::new(0.0, 1e6, "likelihood relative to the others");
/// Degrees between the ends of a card. Beyond 60 it hides parts of itself from a camera that looks
/// down at 45 degrees, and its body would no longer fall like a flat one.
pub(super) const BEND: Bounds = Bounds::new(-60.0, 60.0, "degrees from end to end");
pub(super) const LIGHT_HEIGHT: Bounds =
    Bounds::metres(0.001, 1000.0, "a light farther away is a sun");
pub(super) const LIGHT_OFFSET: Bounds =
    Bounds::metres(0.0, 1000.0, "a light farther away is a sun");
pub(super) const LIGHT_SIZE: Bounds = Bounds::metres(1e-4, 1000.0, "from a point to a sky");
pub(super) const RADIANCE: Bounds = Bounds::new(0.0, 1e9, "what single precision can sum");
/// Temperatures supported by [`planckian`](crate::color::planckian).
pub(super) const KELVIN: Bounds =
    Bounds::new(1667.0, 25_000.0, "kelvin, from a candle to a blue sky");
/// White points of a camera: below, the light has hardly any blue for a gain to bring back.
pub(super) const WHITE: Bounds =
    Bounds::new(2000.0, 25_000.0, "kelvin, from a sunset to a blue sky");
pub(super) const GAIN: Bounds = Bounds::new(1e-6, 1e6, "a factor");
pub(super) const FRICTION: Bounds =
    Bounds::new(0.0, 100.0, "a coefficient; plastics have 0.2 to 0.6");
pub(super) const CAST_SHARE: Bounds = Bounds::new(
    -10.0,
    10.0,
    "0 is white light, 1 treats the surface as grey",
);
pub(super) const ZOOM: Bounds = Bounds::new(1.0, 100.0, "a factor; 1 shows all of the photo");
pub(super) const K1: Bounds = Bounds::new(-10.0, 10.0, "OpenCV's k1, negative for a barrel");
pub(super) const F_NUMBER: Bounds = Bounds::new(
    0.5,
    1000.0,
    "focal length over aperture; photo lenses have 1 to 32",
);
pub(super) const FOCUS: Bounds = Bounds::metres(0.001, 1e6, "anything farther is at infinity");
pub(super) const WAY: Bounds = Bounds::new(-1e6, 1e6, "metres on a belt");
pub(super) const FRAMES: Bounds = Bounds::new(1.0, 1e6, "pictures per sequence");
pub(super) const FRAME_RATE: Bounds = Bounds::new(1e-3, 1e5, "pictures per second");
pub(super) const BELT_SPEED: Bounds = Bounds::new(
    0.0,
    100.0,
    "metres per second; sorting belts run at 0.3 to 4",
);
pub(super) const EXPOSURE_TIME: Bounds =
    Bounds::new(0.0, 10.0, "seconds; cameras over belts take 0.0001 to 0.01");
pub(super) const SENSOR: Bounds = Bounds::new(
    0.1,
    1000.0,
    "millimetres; phones have 5 to 10, a 35 mm camera 36",
);
pub(super) const CHROMATIC: Bounds =
    Bounds::new(-50.0, 50.0, "pixels; cheap lenses have 1 in the corners");
pub(super) const BLUR: Bounds = Bounds::new(0.0, 100.0, "pixels; a sharp photo has 0.3 to 0.7");
pub(super) const SHARPENING: Bounds =
    Bounds::new(0.0, 100.0, "a share of the detail that a blur removes");
pub(super) const NOISE: Bounds = Bounds::new(0.0, 1e3, "scene-linear; 1 is white");

/// Time step of a fall, seconds. Of 150 heaps of 5 to 30 cards, 81 failed at 1/120 s (cards that
/// had passed through each other, 23 mm deep), and none overlapped by more than 0.3 mm at 1/240 s;
/// at 1/10000 s nothing visible changes any more.
pub(super) const STEP: Bounds = Bounds::new(
    1e-4,
    0.0042,
    "seconds; longer steps let cards pass through each other, shorter ones only take longer",
);
pub(super) const TIME_LIMIT: Bounds = Bounds::new(0.01, 600.0, "seconds; heaps rest within a few");
pub(super) const ATTEMPTS: Bounds =
    Bounds::new(1.0, 100.0, "what fails this often will not come to rest");
pub(super) const ITERATIONS: Bounds = Bounds::new(1.0, 100.0, "contacts are exact with fewer");
pub(super) const WORK: Bounds = Bounds::new(1.0, 1e12, "objects and pairs, summed over time steps");
pub(super) const CCD: Bounds = Bounds::new(0.0, 100.0, "stops within a step");
pub(super) const THINNEST: Bounds = Bounds::new(1e-4, 1.0, "a share of the longer side");
pub(super) const ROUNDING: Bounds = Bounds::new(0.0, 0.9, "a share of half the thickness");
pub(super) const OVERLAP: Bounds = Bounds::new(1e-6, 1.0, "a share of the longer side");
pub(super) const ENERGY: Bounds = Bounds::new(1e-6, 1e3, "a share of the drop's");
pub(super) const GRAVITY: Bounds = Bounds::new(0.01, 1e4, "m/s^2; the Earth's is 9.81");

/// Lengths in a scene, metres: what the stages' arithmetic can handle, from dust to a town.
pub(super) const LENGTH: Bounds = Bounds::new(1e-9, 1e6, "metres");
/// Positions in a scene, metres.
pub(super) const PLACE: Bounds = Bounds::new(-1e6, 1e6, "metres");
/// Positions and focal lengths in a picture, pixels.
pub(super) const PIXEL: Bounds = Bounds::new(-1e9, 1e9, "pixels");
/// Sides of a photo, pixels.
pub(super) const PHOTO_SIDE: Bounds = Bounds::new(1.0, 1e6, "pixels");
pub(super) const FOCAL: Bounds = Bounds::new(1e-3, 1e9, "pixels");
