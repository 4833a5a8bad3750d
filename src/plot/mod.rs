//! Tables, charts and pages: self-contained HTML and SVG.

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
