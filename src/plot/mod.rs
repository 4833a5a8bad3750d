//! Tables, charts and pages: HTML and SVG that need nothing beside them.

pub(crate) mod chart;
pub(crate) mod heat;
mod histogram;
pub(crate) mod number;
mod page;
mod table;

pub use chart::{Axis, Chart, Curve};
pub use histogram::Histogram;
pub use page::{Page, base64, escaped};
pub use table::Table;
