//! The motion of a fall, to be looked at.

use crate::geom::Pose;

/// One object at one time of a fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionSample {
    /// Since the start, seconds.
    pub seconds: f64,
    /// Id: index + 1.
    pub object: usize,
    /// Where it is (`world_from_card`), metres.
    pub pose: Pose,
    /// Speed of its centre of mass, m/s.
    pub speed: f64,
    /// Angular speed, rad/s.
    pub spin: f64,
    /// Kinetic energy, joules.
    pub kinetic: f64,
    /// Potential energy over the surface, joules.
    pub potential: f64,
}

/// Samples as comma-separated values, titles first: SI units, rotation as a quaternion.
pub fn csv(samples: &[MotionSample]) -> String {
    let head = "seconds,object,x,y,z,qw,qx,qy,qz,speed,spin,kinetic,potential\n";
    let line = |s: &MotionSample| {
        let (t, q) = (s.pose.translation, s.pose.rotation);
        let numbers = [
            t.x,
            t.y,
            t.z,
            q.w,
            q.i,
            q.j,
            q.k,
            s.speed,
            s.spin,
            s.kinetic,
            s.potential,
        ];
        let cells: String = numbers.iter().map(|x| format!(",{x:.7}")).collect();
        format!("{:.6},{}{cells}\n", s.seconds, s.object)
    };
    head.to_owned() + &samples.iter().map(line).collect::<String>()
}
