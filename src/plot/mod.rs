//! Tables, charts and pages: HTML and SVG that need nothing beside them.

mod chart;
pub(crate) mod heat;
mod histogram;
pub(crate) mod markup;
mod number;
mod page;
mod table;

#[doc(hidden)]
pub use chart::Beside;
pub use chart::{Axis, Chart, Curve};
pub use histogram::Histogram;
pub(crate) use markup::clipped;
pub use markup::escaped;
#[doc(hidden)]
pub use number::three;
pub use page::{Page, base64};
pub use table::Table;
