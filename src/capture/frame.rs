//! The frames that a display shows.

/// Corners of a display, each with a marker.
pub(super) const CORNERS: usize = 4;
/// Shifts of stripes, a quarter of a period each.
pub(super) const SHIFTS: usize = 4;

/// One picture that the display shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Frame {
    /// No light except that of the markers.
    Black,
    /// Full light.
    White,
    /// Light that oscillates along one axis.
    Stripes(Stripes),
}

/// A sinusoid along one axis of the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stripes {
    /// The axis along which the light changes: 0 is to the right, 1 is down.
    pub axis: usize,
    /// Of the short period.
    pub is_fine: bool,
    /// Quarters of a period by which it is shifted, 0 to 3.
    pub shift: usize,
}

impl Stripes {
    /// How many there are.
    pub(super) const COUNT: usize = 4 * SHIFTS;

    /// All of them, in the order in which they are shown: coarse ones first; of a period those
    /// along x first.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).map(|i| Self {
            axis: i / SHIFTS % 2,
            is_fine: i >= 2 * SHIFTS,
            shift: i % SHIFTS,
        })
    }

    fn number(self) -> usize {
        SHIFTS * (2 * self.is_fine as usize + self.axis) + self.shift
    }
}

impl Frame {
    /// Those that are shown, in their order.
    pub fn all(with_stripes: bool) -> impl Iterator<Item = Self> {
        let stripes = Stripes::all().filter(move |_| with_stripes);
        [Self::Black, Self::White]
            .into_iter()
            .chain(stripes.map(Self::Stripes))
    }

    /// Its place among all frames.
    pub fn number(self) -> usize {
        match self {
            Self::Black => 0,
            Self::White => 1,
            Self::Stripes(stripes) => 2 + stripes.number(),
        }
    }
}

impl std::fmt::Display for Frame {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Black => f.write_str("black"),
            Self::White => f.write_str("white"),
            Self::Stripes(Stripes {
                axis,
                is_fine,
                shift,
            }) => {
                let period = if *is_fine { "fine" } else { "coarse" };
                write!(f, "stripes_{}_{period}_{}", ["x", "y"][*axis], shift + 1)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_in_their_order() {
        let all: Vec<_> = Frame::all(true).collect();
        assert_eq!((all.len(), Frame::all(false).count()), (18, 2));
        for (i, frame) in all.iter().enumerate() {
            assert_eq!(frame.number(), i);
        }
        assert_eq!(all[5].to_string(), "stripes_x_coarse_4");
    }
}
