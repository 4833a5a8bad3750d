//! A light sample as one receiver sees it, with the shadows in between.

use crate::render::light_samples::{LightGroup, LightSample, LightSampleKind};
use crate::render::occluders::Occluders;
use crate::render::shadow::{ProjectedShadow, ShadowProjection, ShadowedReceiver};

/// One light sample as one receiver sees it.
#[derive(Debug)]
pub(super) struct ShadowRay {
    sample: LightSample,
    /// Height of the sample above the receiver's plane, metres (a cosine for a direction).
    height: f64,
    /// Shadows of what may be in its way.
    pub(super) shadows: Vec<ProjectedShadow>,
}

/// The rays to a group of light samples that reach a receiver from above, with what may be in their
/// way.
pub(super) fn shadow_rays(
    occluders: &Occluders<'_>,
    receiver: &ShadowedReceiver<'_>,
    group: &LightGroup,
) -> Vec<ShadowRay> {
    let above = receiver.cards_above(occluders);
    group
        .samples
        .iter()
        .filter_map(|sample| ShadowRay::new(occluders, &above, receiver, sample))
        .collect()
}

impl ShadowRay {
    /// None for a sample that is not above the receiver; `above` are the cards that are.
    fn new(
        occluders: &Occluders<'_>,
        above: &[usize],
        receiver: &ShadowedReceiver<'_>,
        sample: &LightSample,
    ) -> Option<Self> {
        let projection = ShadowProjection::new(receiver, sample)?;
        let surface = projection
            .comes_from_below()
            .then(|| projection.project_surface(&occluders.surface));
        let cards = above
            .iter()
            .filter_map(|&k| projection.project_card(&occluders.cards[k]));
        Some(Self {
            sample: *sample,
            height: projection.height,
            shadows: surface.into_iter().chain(cards).collect(),
        })
    }

    /// Whether it comes from an area light, not from the sky.
    pub(super) fn is_face(&self) -> bool {
        matches!(self.sample.kind, LightSampleKind::Face { .. })
    }

    /// Irradiance for the receiver that it was created for.
    pub(super) fn unit_irradiance(&self) -> UnitIrradiance {
        match self.sample.kind {
            LightSampleKind::Sky { share } => UnitIrradiance::Even(share as f32),
            // All points of a plane have the same height below a light.
            LightSampleKind::Face { normal, area } => UnitIrradiance::Face(FaceIrradiance {
                at: self.sample.at.xyz().map(|c| c as f32).into(),
                normal: normal.map(|c| c as f32).into(),
                scale: (area * self.height) as f32,
            }),
        }
    }
}

/// Irradiance for unit radiance of one light sample, at any point of a plane.
#[derive(Clone, Copy, Debug)]
pub(super) enum UnitIrradiance {
    /// The same everywhere.
    Even(f32),
    /// From a piece of a light's face.
    Face(FaceIrradiance),
}

/// Irradiance for unit radiance of a piece of a light's face.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceIrradiance {
    /// Where it is.
    at: [f32; 3],
    /// Unit normal.
    normal: [f32; 3],
    /// Area times height over the plane.
    scale: f32,
}

impl FaceIrradiance {
    /// Cosines over squared distance times area, at points of the plane.
    pub(super) fn fill(&self, points: [&[f32]; 3], out: &mut [f32]) {
        fill_face(self.at, self.normal, self.scale, points, out);
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn fill_face(at: [f32; 3], normal: [f32; 3], scale: f32, [x, y, z]: [&[f32]; 3], out: &mut [f32]) {
    for (((e, &x), &y), &z) in out.iter_mut().zip(x).zip(y).zip(z) {
        let (x, y, z) = (x - at[0], y - at[1], z - at[2]);
        let r2 = x * x + y * y + z * z;
        let face = (normal[0] * x + normal[1] * y + normal[2] * z).max(0.0);
        *e = scale * face / (r2 * r2).max(f32::MIN_POSITIVE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::geom::{Point2, Pose, Quad, UnitQuaternion, Vector2, Vector3};
    use crate::image::Image;
    use crate::pixel::{LinearRgb, ObjectId, PremulRgba};
    use crate::render::RenderOptions;
    use crate::render::float4::Float4;
    use crate::render::light_samples::{LightSamples, LitPatch};
    use crate::render::ranges::integer_range;
    use crate::render::view::{
        CameraView, LatticeArea, ProjectedPlane, ScenePlane, visible_planes,
    };
    use crate::scene::{AreaLight, Card, Shot};

    fn camera() -> Camera {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 2.6);
        Camera {
            image: [200, 150],
            focal_px: Vector2::new(240.0, 240.0),
            principal_px: Point2::new(100.0, 75.0),
            camera_from_world: Pose::from_parts(Vector3::new(0.0, 0.0, 1.0).into(), down),
        }
    }

    fn light() -> AreaLight {
        AreaLight::new([0.4, 0.3, 0.8], [0.3; 2], 9.0)
    }

    /// A card of odd size, rotated about all axes.
    fn shot(tilt: f64) -> Shot {
        let turn = UnitQuaternion::from_euler_angles(tilt, 0.2, 0.7);
        let quad = Quad {
            world_from_card: Pose::from_parts(Vector3::new(0.02, 0.0, 0.12).into(), turn),
            size: [0.3, 0.2],
        };
        let texture = Image::filled(301, 203, PremulRgba::new(0.5, 0.5, 0.5, 1.0));
        let card = Card {
            outline_uv: [].into(),
            ..Card::new(ObjectId(1), quad, texture)
        };
        Shot::new(camera())
            .with_light(light())
            .with_ambient(LinearRgb::WHITE)
            .with_card(card)
    }

    /// The light on the surface.
    fn samples(shot: &Shot, occluders: &Occluders<'_>, seen: &ProjectedPlane) -> LightSamples {
        let patch = LitPatch {
            center: occluders.surface.center,
            normal: seen.normal,
            reach: 0.15,
            spread: 0.15,
            occluded: 0.3,
            cell: 0.0,
        };
        LightSamples::above(shot, &RenderOptions::default(), &patch)
    }

    #[test]
    fn the_inside_of_an_opaque_card_is_as_dark_as_if_it_were_read() {
        for tilt in [0.0, 0.3, 1.2] {
            let shot = shot(tilt);
            let view = CameraView::from_camera(&shot.camera);
            let occluders = Occluders::new(
                &visible_planes(&shot),
                ScenePlane::shadow_catcher(shot.catcher),
            );
            let seen = ProjectedPlane::new(&occluders.surface, &view).unwrap();
            let LightSamples { sharp, soft } = samples(&shot, &occluders, &seen);
            let receiver = ShadowedReceiver {
                plane: &seen,
                area: &view.whole_area(),
                view: &view,
                own: None,
                cell_m: 0.0,
            };
            let (mut edges, mut all) = (0, 0);
            // Fine and coarse levels of the texture.
            for (group, cell) in sharp
                .iter()
                .chain(&soft)
                .flat_map(|group| [(group, 1e-4), (group, 5e-3)])
            {
                let receiver = ShadowedReceiver {
                    cell_m: cell,
                    ..receiver
                };
                let shadows = shadow_rays(&occluders, &receiver, group)
                    .into_iter()
                    .flat_map(|ray| ray.shadows);
                for mut shadow in shadows {
                    for j in shadow.rows.clone() {
                        let ([low], [high]) = shadow.row_spans(j);
                        let nodes = integer_range(low, high, &(0..view.width));
                        let inside = shadow.inside;
                        let [mut quick, mut read] = [0, 1].map(|_| vec![Float4::ONE; nodes.len()]);
                        edges += shadow.attenuate(j, &nodes, &mut quick).edges;
                        shadow.inside = None;
                        all += shadow.attenuate(j, &nodes, &mut read).see_through;
                        shadow.inside = inside;
                        assert_eq!(quick, read, "tilt {tilt}, row {j}");
                    }
                }
            }
            assert!(all > 10_000 && edges < all / 3, "{edges} of {all} read");
        }
    }

    #[test]
    fn shadows_that_miss_the_receiver_are_left_out() {
        let shot = shot(0.0);
        let view = CameraView::from_camera(&shot.camera);
        let occluders = Occluders::new(
            &visible_planes(&shot),
            ScenePlane::shadow_catcher(shot.catcher),
        );
        let seen = ProjectedPlane::new(&occluders.surface, &view).unwrap();
        let groups = samples(&shot, &occluders, &seen).sharp;
        let shadows = |area: LatticeArea| {
            let receiver = ShadowedReceiver {
                plane: &seen,
                area: &area,
                view: &view,
                own: None,
                cell_m: 1e-3,
            };
            let rays = shadow_rays(&occluders, &receiver, &groups[0]);
            rays.iter().map(|ray| ray.shadows.len()).sum::<usize>()
        };
        assert_eq!(shadows((0..2, 0..2)), 0);
        assert!(shadows(view.whole_area()) > 0);
    }
}
