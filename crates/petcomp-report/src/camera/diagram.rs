//! The camera solver's steps: error against run time.

use super::{CameraRow, Lens, SolveMethod, ViewKind};
use crate::{Diagram, Point};

/// Noise of the corners.
const NOISE_PX: f64 = 0.5;
/// Angles from straight above: a usual one, and one that hardly tells the focal length.
const TILTS: [f64; 2] = [20.0, 5.0];

/// Error of the focal length against time, a diagram per tilt and a point per method; `views` of each.
pub fn diagrams(views: u64) -> Vec<Diagram> {
    TILTS.map(|tilt_deg| diagram(tilt_deg, views)).into()
}

fn diagram(tilt_deg: f64, views: u64) -> Diagram {
    let cell = ViewKind {
        lens: Lens::Realistic,
        noise_px: NOISE_PX,
        tilt_deg,
    };
    let photos: Vec<_> = (0..views).map(|k| cell.photos(k)).collect();
    Diagram {
        file: format!("camera_{tilt_deg}_degrees"),
        title: format!("camera: four corners, {tilt_deg} degrees from straight above"),
        input: format!("{views} simulated views, corners to {NOISE_PX} px, lens and tape measure as uncertain as usual"),
        error: "focal length, median error, %".into(),
        cost: "CPU microseconds per photo".into(),
        reference: "the cameras that the views were drawn with (closed form)".into(),
        points: SolveMethod::ALL.map(|method| point(&cell.row(method, &photos))).into(),
        why: "The whole refinement is the default at every quality: it alone tells its own uncertainty and tries every start, \
              and it takes less than a hundredth of the time that rendering a picture does."
            .into(),
        ..Diagram::default()
    }
}

fn point(row: &CameraRow) -> Point {
    let curve = if row.method == SolveMethod::Joint {
        "several photos"
    } else {
        "one photo"
    };
    Point::new(curve, row.method.name(), row.time_us, row.focal_percent[0])
        .used_where(|_| row.method == SolveMethod::Whole)
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
