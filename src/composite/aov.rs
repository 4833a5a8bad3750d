//! Arbitrary output variables: everything in the deep samples besides the finished frame, as parts
//! of an EXR file.
//!
//! Each is a separate fold over the samples, done only on request.

use crate::composite::cryptomatte::cryptomatte;
use crate::composite::part::{float_part, pixels_of, plain_part};
use crate::deep::{DeepImage, DeepSample};
use crate::error::{Error, Result};
use crate::geom::{Point2, Point3};
use crate::image::Image;
use crate::io::exr::{ChannelSamples, Part};
use crate::names::by_name;
use crate::pixel::{LinearRgb, ObjectId, PremulRgba};
use crate::scene::{Card, Cylinder, Shot};
use std::str::FromStr;

/// A part of the picture that can be requested by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// `beauty`: the finished frame, `R G B A`, scene-linear, premultiplied.
    Beauty,
    /// `coverage`: share of the plate that objects hide in the pixel, `Y`.
    Coverage,
    /// `shadow`: factor on the plate, `R G B`.
    Shadow,
    /// `id`: the [`front`] object, integers, `id`; 0 if there is none.
    Id,
    /// `depth`: its distance along the optical axis, metres, `Z`; infinite if there is none.
    Depth,
    /// `position`: its point in the world, metres, `X Y Z`; NaN if there is none.
    Position,
    /// `uv`: its texture coordinates, right and down, `U V`; NaN if there is none.
    Uv,
    /// `cryptomatte`: coverage of every object, see [`cryptomatte`]; the first part of a file.
    Cryptomatte,
    /// `layers`: a part `layer.ID` for each card: its own light and what it hides, held out by what
    /// is in front, `R G B A`; if the picture contains film also `TR TG TB`, 1 minus what it hides
    /// per channel. Their sum is the picture of the sharp objects at rest, before Poisson blending,
    /// blur, depth of field, a belt's exposure and finish: with those it is not the beauty.
    Layers,
}

impl Aov {
    /// All of them with their names.
    pub const ALL: [(&'static str, Self); 9] = [
        ("beauty", Self::Beauty),
        ("coverage", Self::Coverage),
        ("shadow", Self::Shadow),
        ("id", Self::Id),
        ("depth", Self::Depth),
        ("position", Self::Position),
        ("uv", Self::Uv),
        ("cryptomatte", Self::Cryptomatte),
        ("layers", Self::Layers),
    ];
}

impl FromStr for Aov {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        by_name("aov", &Self::ALL, name)
    }
}

/// Coverage above which an object owns a pixel: that of the reference renderer.
const FRONT_ALPHA: f32 = 0.05;

/// The foremost object that covers more than `FRONT_ALPHA` of a pixel; none if it is entirely
/// behind the holdout, since everything farther away is, too.
pub fn front(samples: &[DeepSample]) -> Option<&DeepSample> {
    let front = samples.iter().find(|s| s.alpha > FRONT_ALPHA);
    front.filter(|s| s.visible > 0.0)
}

/// The requested parts, all of one size, in the requested order except for the Cryptomatte, which
/// comes first: Blender 3.4 and 4.2 look for it only in the first part.
///
/// `frame` is the finished frame of the same samples, `shot` what they were rendered from.
/// Position, texture coordinates and depth are those at the pixel's centre; for a curved card they
/// are those of the curved surface.
pub fn parts(aovs: &[Aov], deep: &DeepImage, shot: &Shot, frame: &Image<PremulRgba>) -> Vec<Part> {
    let picture = AovSource {
        deep,
        shot,
        frame,
        bent: bent_cards(shot),
    };
    let mut ordered = aovs.to_vec();
    ordered.sort_by_key(|aov| *aov != Aov::Cryptomatte);
    let ordered = ordered.into_iter();
    ordered.flat_map(|aov| picture.parts_of(aov)).collect()
}

/// The sources of all parts.
struct AovSource<'a> {
    deep: &'a DeepImage,
    shot: &'a Shot,
    frame: &'a Image<PremulRgba>,
    /// The cards that appear curved: samples have the depth of their planes.
    bent: Vec<BentCard<'a>>,
}

impl AovSource<'_> {
    fn parts_of(&self, aov: Aov) -> Vec<Part> {
        let part = match aov {
            Aov::Beauty => self.beauty_part(),
            Aov::Coverage => self.coverage_part(),
            Aov::Shadow => self.shadow_part(),
            Aov::Id => self.id_part(),
            Aov::Depth => float_part("depth", ["Z"], self.depths()),
            Aov::Position => float_part("position", ["X", "Y", "Z"], self.positions()),
            Aov::Uv => float_part("uv", ["U", "V"], self.texture_coordinates()),
            Aov::Cryptomatte => cryptomatte(self.deep, |id| format!("object.{}", id.0)),
            Aov::Layers => return self.layer_parts(),
        };
        vec![part]
    }

    fn beauty_part(&self) -> Part {
        let pixels = self.frame.pixels().iter();
        float_part(
            "beauty",
            ["R", "G", "B", "A"],
            pixels.map(|p| [p.r, p.g, p.b, p.a]),
        )
    }

    fn coverage_part(&self) -> Part {
        let values = pixels_of(self.deep).map(|(x, y)| [self.deep.flat(x, y).to_rgba().a]);
        float_part("coverage", ["Y"], values)
    }

    fn shadow_part(&self) -> Part {
        let factors = self.deep.shadow().pixels().iter();
        float_part("shadow", ["R", "G", "B"], factors.map(|&c| c.into()))
    }

    fn id_part(&self) -> Part {
        let ids = self.fronts().map(|(_, s)| s.map_or(0, |s| s.object.0));
        let ids = ChannelSamples::Integer(ids.collect());
        plain_part("id", vec![("id".into(), ids)])
    }

    fn layer_parts(&self) -> Vec<Part> {
        let tinted = pixels_of(self.deep).any(|(x, y)| !self.deep.tints(x, y).is_empty());
        let ids = self.shot.cards.iter().map(|card| card.id);
        ids.map(|id| layer_part(self.deep, id, tinted)).collect()
    }

    /// Every pixel with its foremost object.
    fn fronts(&self) -> impl Iterator<Item = ((usize, usize), Option<&DeepSample>)> {
        pixels_of(self.deep).map(|(x, y)| ((x, y), front(self.deep.at(x, y))))
    }

    fn depths(&self) -> impl Iterator<Item = [f32; 1]> {
        self.fronts()
            .map(|(at, s)| [s.map_or(f32::INFINITY, |s| self.depth_at(at, s))])
    }

    fn depth_at(&self, at: (usize, usize), sample: &DeepSample) -> f32 {
        let camera_from_world = &self.shot.camera.camera_from_world;
        self.bent_point(at, sample)
            .map_or(sample.depth.0, |p| (camera_from_world * p.world).z as f32)
    }

    fn positions(&self) -> impl Iterator<Item = [f32; 3]> {
        self.fronts()
            .map(|(at, s)| s.map_or([f32::NAN; 3], |s| self.position_at(at, s)))
    }

    /// The point in the world that a sample shows at its pixel's centre.
    fn position_at(&self, at: (usize, usize), sample: &DeepSample) -> [f32; 3] {
        let point = self
            .bent_point(at, sample)
            .map_or_else(|| self.plane_point(at, sample), |point| point.world);
        point.coords.map(|v| v as f32).into()
    }

    fn texture_coordinates(&self) -> impl Iterator<Item = [f32; 2]> {
        self.fronts()
            .map(|(at, s)| s.and_then(|s| self.uv_at(at, s)).unwrap_or([f32::NAN; 2]))
    }

    /// Texture coordinates that a sample shows at its pixel's centre.
    fn uv_at(&self, at: (usize, usize), sample: &DeepSample) -> Option<[f32; 2]> {
        let mut cards = self.shot.cards.iter();
        let quad = &cards.find(|card| card.id == sample.object)?.quad;
        let p = match self.bent_point(at, sample) {
            Some(point) => point.flat,
            None => quad
                .world_from_card
                .inverse_transform_point(&self.plane_point(at, sample))
                .xy(),
        };
        Some([
            (p.x / quad.size[0] + 0.5) as f32,
            (0.5 - p.y / quad.size[1]) as f32,
        ])
    }

    /// The point of a curved card that a sample shows at its pixel's centre; none for a flat one.
    fn bent_point(&self, at: (usize, usize), sample: &DeepSample) -> Option<BentPoint> {
        let mut bent = self.bent.iter();
        let bent = bent.find(|bent| bent.card.id == sample.object)?;
        bent.seen_at(&self.plane_point(at, sample))
    }

    /// The point of a sample's plane at its pixel's centre.
    fn plane_point(&self, (x, y): (usize, usize), sample: &DeepSample) -> Point3<f64> {
        let px = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
        let ideal = self.shot.distortion().undistort(px);
        self.shot.camera.ray(ideal).at(f64::from(sample.depth.0))
    }
}

/// A curved card as the camera sees it.
struct BentCard<'a> {
    card: &'a Card,
    cylinder: Cylinder,
    /// The camera in the frame of the card.
    eye: Point3<f64>,
}

/// A point of a curved card.
struct BentPoint {
    /// Its position on the flat card.
    flat: Point2<f64>,
    /// Its position in the world.
    world: Point3<f64>,
}

fn bent_cards(shot: &Shot) -> Vec<BentCard<'_>> {
    let eye = shot.camera.center();
    let cards = shot.cards.iter();
    cards.filter_map(|card| BentCard::new(card, &eye)).collect()
}

impl<'a> BentCard<'a> {
    /// None for a card that appears flat to the camera.
    fn new(card: &'a Card, eye: &Point3<f64>) -> Option<Self> {
        Some(Self {
            card,
            cylinder: card.cylinder_seen_from(eye)?,
            eye: card.quad.world_from_card.inverse_transform_point(eye),
        })
    }

    /// The visible point in the direction of a point of the flat card's plane; none past the
    /// cylinder.
    fn seen_at(&self, on_plane: &Point3<f64>) -> Option<BentPoint> {
        let world_from_card = &self.card.quad.world_from_card;
        let on_plane = world_from_card.inverse_transform_point(on_plane).xy();
        let flat = self.cylinder.seen_point(&self.eye, &on_plane);
        let is_met = flat.iter().all(|v| v.is_finite());
        is_met.then(|| BentPoint {
            flat,
            world: world_from_card * self.cylinder.point(&flat),
        })
    }
}

/// What one object adds to the picture; with its transmittance per channel if there is film.
fn layer_part(deep: &DeepImage, id: ObjectId, tinted: bool) -> Part {
    let name = format!("layer.{}", id.0);
    let values = pixels_of(deep).map(|at| own_light(deep, at, id));
    if !tinted {
        let values = values.map(|(p, _)| [p.r, p.g, p.b, p.a]);
        return float_part(name, ["R", "G", "B", "A"], values);
    }
    let names = ["R", "G", "B", "A", "TR", "TG", "TB"];
    float_part(name, names, values.map(tinted_values))
}

/// Light, coverage, and transmittance per channel.
fn tinted_values((p, hidden): (PremulRgba, LinearRgb)) -> [f32; 7] {
    let passes = hidden.map(|h| 1.0 - h);
    [p.r, p.g, p.b, p.a, passes.r, passes.g, passes.b]
}

/// Light and coverage of an object in one pixel, and what it hides per channel.
fn own_light(deep: &DeepImage, (x, y): (usize, usize), id: ObjectId) -> (PremulRgba, LinearRgb) {
    let (mut sum, mut hidden) = (PremulRgba::TRANSPARENT, LinearRgb::BLACK);
    for (sample, hides) in deep.hiding(x, y).filter(|(s, _)| s.object == id) {
        sum = sum.plus(seen_light(sample));
        hidden = hidden + hides;
    }
    (sum, hidden)
}

/// Light of a sample with the coverage that is visible.
fn seen_light(sample: &DeepSample) -> PremulRgba {
    let LinearRgb { r, g, b } = sample.light;
    PremulRgba::new(r, g, b, sample.visible)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::composite;
    use crate::geom::{Pose, Quad};
    use crate::render::{RenderOptions, render};
    use crate::scene::Bend;

    fn shot() -> Shot {
        let card = |id, z: f64, alpha: f32| {
            let quad = Quad {
                world_from_card: Pose::translation(0.02 * z, 0.0, z),
                size: [0.4, 0.3],
            };
            let texel = PremulRgba::new(0.3 * alpha, 0.2 * alpha, 0.1 * alpha, alpha);
            Card {
                outline_uv: [].into(),
                ..Card::new(ObjectId(id), quad, Image::filled(8, 8, texel))
            }
        };
        Shot::new(Camera::looking_down(1.0, 40.0, [32, 24]))
            .with_card(card(3, 0.1, 0.5))
            .with_card(card(7, 0.2, 0.25))
            .with_ambient(LinearRgb::WHITE)
    }

    fn plane<'a>(part: &'a Part, name: &str) -> &'a [f32] {
        match &part.channels.iter().find(|(n, _)| n == name).unwrap().1 {
            ChannelSamples::Float(samples) => samples,
            ChannelSamples::Integer(_) => panic!("integers"),
        }
    }

    fn made(shot: &Shot, names: &[&str]) -> (Image<PremulRgba>, Vec<Part>) {
        let deep = render(shot, &RenderOptions::default());
        let frame = composite::frame(&deep, None);
        let aovs: Vec<Aov> = names.iter().map(|n| n.parse().unwrap()).collect();
        let parts = parts(&aovs, &deep, shot, &frame);
        (frame, parts)
    }

    #[test]
    fn a_cryptomatte_is_the_first_part() {
        let (_, parts) = made(&shot(), &["beauty", "id", "cryptomatte", "depth"]);
        let names: Vec<_> = parts.iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names, ["CryptoObject", "beauty", "id", "depth"]);
    }

    #[test]
    fn layers_add_up_to_the_picture() {
        let (frame, layers) = made(&shot(), &["layers"]);
        assert_eq!(
            layers.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(),
            ["layer.3", "layer.7"]
        );
        for (i, p) in frame.pixels().iter().enumerate() {
            for (name, value) in [("R", p.r), ("A", p.a)] {
                let sum: f32 = layers.iter().map(|layer| plane(layer, name)[i]).sum();
                assert!((sum - value).abs() < 1e-6, "{name}: {sum} against {value}");
            }
        }
    }

    #[test]
    fn geometry_is_that_of_the_card_in_front() {
        let names = ["id", "depth", "position", "uv", "coverage"];
        let (_, parts) = made(&shot(), &names);
        let middle = 12 * 32 + 16;
        assert!(
            matches!(&parts[0].channels[0].1, ChannelSamples::Integer(ids) if ids[middle] == 7 && ids[0] == 0)
        );
        assert!(
            (plane(&parts[1], "Z")[middle] - 0.8).abs() < 1e-5
                && plane(&parts[1], "Z")[0].is_infinite()
        );
        // The pixel's centre is half a pixel right of and below the principal point: 0.01 m at
        // depth 0.8.
        let at = ["X", "Y", "Z"].map(|c| plane(&parts[2], c)[middle]);
        assert!(
            (at[0] - 0.01).abs() < 1e-5
                && (at[1] + 0.01).abs() < 1e-5
                && (at[2] - 0.2).abs() < 1e-5,
            "{at:?}"
        );
        let [u, v] = ["U", "V"].map(|c| plane(&parts[3], c)[middle]);
        assert!(
            (u - (0.5 + 0.006 / 0.4)).abs() < 1e-4 && (v - (0.5 + 0.01 / 0.3)).abs() < 1e-4,
            "{u} {v}"
        );
        assert!((plane(&parts[4], "Y")[middle] - (1.0 - 0.5 * 0.75)).abs() < 1e-6);
    }

    #[test]
    fn geometry_of_a_curved_card_is_that_of_its_points() {
        let mut shot = shot();
        shot.cards.truncate(1);
        shot.cards[0].bend = Bend {
            deg: 60.0,
            axis_deg: 30.0,
        };
        let (_, parts) = made(&shot, &["depth", "position", "uv"]);
        let [us, vs] = ["U", "V"].map(|c| plane(&parts[2], c));
        let on_card = |i: &usize| [us[*i], vs[*i]].iter().all(|c| (0.0..=1.0).contains(c));
        let pixels: Vec<_> = (0..32 * 24).filter(on_card).collect();
        assert!(pixels.len() > 100, "{}", pixels.len());
        for i in pixels {
            let point = shot.cards[0].point(us[i].into(), vs[i].into());
            let at = ["X", "Y", "Z"].map(|c| f64::from(plane(&parts[1], c)[i]));
            assert!((point - Point3::from(at)).norm() < 1e-5, "{point} {at:?}");
            let (px, depth) = shot.camera.project(point).unwrap();
            let middle = Point2::new((i % 32) as f64 + 0.5, (i / 32) as f64 + 0.5);
            assert!((px - middle).norm() < 1e-3, "{px} {middle}");
            assert!((depth - f64::from(plane(&parts[0], "Z")[i])).abs() < 1e-5);
        }
    }

    #[test]
    fn what_the_place_hides_is_in_front_of_nothing() {
        let hidden = DeepSample {
            alpha: 0.7,
            ..DeepSample::default()
        };
        let faint = DeepSample {
            alpha: 0.01,
            visible: 0.01,
            ..hidden
        };
        assert_eq!(front(&[faint, hidden]), None);
        let seen = DeepSample {
            visible: 0.1,
            ..hidden
        };
        assert_eq!(front(&[faint, seen, hidden]), Some(&seen));
    }

    #[test]
    fn an_unknown_name_is_reported_with_the_known_ones() {
        let message = "normals".parse::<Aov>().unwrap_err().to_string();
        assert!(
            message.contains("\"normals\"") && message.contains("cryptomatte"),
            "{message}"
        );
    }
}
