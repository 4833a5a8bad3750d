//! The motion of a fall, for inspection.

use crate::geom::Pose;

/// One object at one time of a fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionSample {
    /// Time since the start, seconds.
    pub seconds: f64,
    /// Id: index + 1.
    pub object: usize,
    /// Pose (`world_from_card`), metres.
    pub pose: Pose,
    /// Speed of its centre of mass, m/s.
    pub speed: f64,
    /// Angular speed, rad/s.
    pub spin: f64,
    /// Kinetic energy, joules.
    pub kinetic: f64,
    /// Potential energy relative to the surface, joules.
    pub potential: f64,
}

const CSV_HEADER: &str = "seconds,object,x,y,z,qw,qx,qy,qz,speed,spin,kinetic,potential\n";

/// Samples as comma-separated values with a header: SI units, rotation as a quaternion.
pub fn csv(samples: &[MotionSample]) -> String {
    let lines: String = samples.iter().map(csv_line).collect();
    CSV_HEADER.to_owned() + &lines
}

fn csv_line(sample: &MotionSample) -> String {
    let cells = sample.values().map(|x| format!(",{x:.7}")).concat();
    format!("{:.6},{}{cells}\n", sample.seconds, sample.object)
}

impl MotionSample {
    /// Its pose and motion, in the order of [`CSV_HEADER`].
    fn values(&self) -> [f64; 11] {
        let (t, q) = (self.pose.translation, self.pose.rotation);
        let (speed, spin) = (self.speed, self.spin);
        let (kinetic, potential) = (self.kinetic, self.potential);
        [
            t.x, t.y, t.z, q.w, q.i, q.j, q.k, speed, spin, kinetic, potential,
        ]
    }
}
