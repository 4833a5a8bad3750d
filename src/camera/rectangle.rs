//! The camera from one rectangle of known size, in closed form.

/// Why no camera could be found.
#[non_exhaustive]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// A number is NaN or infinite.
    #[error("{0} is not finite")]
    NonFinite(&'static str),
}
