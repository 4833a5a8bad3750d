//! The camera solver's steps: error against run time.

use super::{Cell, Lens, Method, Row};
use crate::report::{Diagram, Point};

/// Noise of the corners and angles from straight above that are shown.
const NOISE_PX: f64 = 0.5;
const TILTS: [f64; 3] = [5.0, 20.0, 45.0];

/// Error of the focal length against time, a curve per tilt and a point per method; `views` of each.
pub fn diagrams(views: u64) -> Vec<Diagram> {
    let mut points = Vec::new();
    for tilt_deg in TILTS {
        let cell = Cell { lens: Lens::Realistic, noise_px: NOISE_PX, tilt_deg };
        let photos: Vec<_> = (0..views).map(|k| cell.photos(k)).collect();
        points.extend(Method::ALL.map(|method| point(&cell.row(method, &photos))));
    }
    vec![Diagram {
        file: "camera_time".into(),
        title: "camera: from four corners".into(),
        input: format!(
            "{views} simulated views per tilt, corners to {NOISE_PX} px, lens and tape measure as uncertain as usual"
        ),
        error: "focal length, median error, %".into(),
        cost: "microseconds per photo".into(),
        reference: "the cameras that the views were drawn with (closed form)".into(),
        points,
        limit: None,
        why:
            "The whole refinement is the default at every quality: it alone tells its own uncertainty and tries every \
              start, and costs less than a thousandth of what rendering a picture does."
                .into(),
    }]
}

fn point(row: &Row) -> Point {
    let curve = format!("tilt {} degrees", row.tilt_deg);
    Point::new(curve, row.method.name(), row.time_us, row.focal_percent[0]).used_where(|_| row.method == Method::Whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tilt_has_every_method_and_a_default() {
        let found = &diagrams(3)[0];
        assert_eq!(found.points.len(), TILTS.len() * Method::ALL.len());
        assert_eq!(found.points.iter().filter(|p| p.is_default()).count(), TILTS.len());
    }
}
