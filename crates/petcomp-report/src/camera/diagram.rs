//! The steps of the camera solver: error against run time.

use super::{CameraRow, Lens, SolveMethod, ViewKind};
use crate::{Diagram, Point};

/// Noise of the corners.
const CORNER_NOISE_PX: f64 = 0.5;
/// Angles from straight above: a typical one, and one that hardly constrains the focal length.
const DRAWN_TILTS_DEG: [f64; 2] = [20.0, 5.0];

/// Error of the focal length against time, one diagram per tilt and one point per method, each with
/// this many views.
pub(crate) fn diagrams(views: u64) -> Vec<Diagram> {
    DRAWN_TILTS_DEG
        .map(|tilt_deg| tilt_diagram(tilt_deg, views))
        .into()
}

fn tilt_diagram(tilt_deg: f64, views: u64) -> Diagram {
    Diagram {
        file: format!("camera_{tilt_deg}_degrees"),
        title: format!("camera: four corners, {tilt_deg} degrees from straight above"),
        input: format!(
            "{views} simulated views, corner noise {CORNER_NOISE_PX} px, lens and tape measure with typical \
             uncertainty"
        ),
        error: "focal length, median error, %".into(),
        cost: "CPU microseconds per photo".into(),
        reference: "the cameras of the simulated views (closed form)".into(),
        points: points(tilt_deg, views),
        why: "Full refinement is the default at every quality: only it reports its uncertainty and tries every \
              starting point, and it takes less than a hundredth of the time of rendering a picture."
            .into(),
        ..Diagram::default()
    }
}

/// A point per method.
fn points(tilt_deg: f64, views: u64) -> Vec<Point> {
    let kind = ViewKind {
        lens: Lens::Realistic,
        noise_px: CORNER_NOISE_PX,
        tilt_deg,
    };
    let rows = kind.rows(&SolveMethod::ALL, views);
    rows.iter().map(CameraRow::point).collect()
}

impl CameraRow {
    fn point(&self) -> Point {
        let curve = if self.method == SolveMethod::Joint {
            "several photos"
        } else {
            "one photo"
        };
        let (cost, error) = (self.time_us, self.focal_percent[0]);
        Point::new(curve, self.method.name(), cost, error)
            .used_where(|_| self.method == SolveMethod::Whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tilt_has_every_method_and_one_default() {
        for found in diagrams(3) {
            assert_eq!(found.points.len(), SolveMethod::ALL.len());
            assert_eq!(found.points.iter().filter(|p| p.is_default()).count(), 1);
        }
    }
}
