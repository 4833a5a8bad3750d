//! What is known about the body of an object that falls.

/// Thickness and mass, where they are known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct KnownBody {
    /// Metres.
    pub(super) thickness: Option<f64>,
    /// Kilograms.
    pub(super) mass: Option<f64>,
}

impl KnownBody {
    /// What is not known from another one.
    pub(super) fn or(self, other: Self) -> Self {
        Self {
            thickness: self.thickness.or(other.thickness),
            mass: self.mass.or(other.mass),
        }
    }
}
