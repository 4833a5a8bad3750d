//! Axis-parallel boxes.

use crate::geom::Point2;
use serde::{Deserialize, Serialize};

/// An axis-parallel box in pixels, `[x0, x1) x [y0, y1)`; the default is empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BBox {
    /// Left edge.
    pub x0: f64,
    /// Top edge.
    pub y0: f64,
    /// Right edge.
    pub x1: f64,
    /// Bottom edge.
    pub y1: f64,
}

impl BBox {
    /// Whether nothing is inside.
    pub fn is_empty(&self) -> bool {
        self.width() <= 0.0 || self.height() <= 0.0
    }

    /// From left to right edge, pixels.
    pub fn width(&self) -> f64 {
        self.x1 - self.x0
    }

    /// From top to bottom edge, pixels.
    pub fn height(&self) -> f64 {
        self.y1 - self.y0
    }

    /// The middle.
    pub fn center(&self) -> Point2<f64> {
        Point2::new(0.5 * (self.x0 + self.x1), 0.5 * (self.y0 + self.y1))
    }

    /// Whether `other` lies inside, edges included; an empty box lies inside every box.
    pub fn contains(&self, other: &Self) -> bool {
        let inside = self.x0 <= other.x0
            && self.y0 <= other.y0
            && self.x1 >= other.x1
            && self.y1 >= other.y1;
        other.is_empty() || inside
    }

    /// Whether the two share more than an edge.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.x0 < other.x1 && other.x0 < self.x1 && self.y0 < other.y1 && other.y0 < self.y1
    }

    /// The smallest box around points; empty around none.
    pub fn around(points: impl IntoIterator<Item = Point2<f64>>) -> Self {
        let dots = points.into_iter().map(|p| Self {
            x0: p.x,
            y0: p.y,
            x1: p.x,
            y1: p.y,
        });
        dots.reduce(Self::hull).unwrap_or_default()
    }

    /// The smallest box around two; neither is empty.
    pub(crate) fn hull(self, o: Self) -> Self {
        Self {
            x0: self.x0.min(o.x0),
            y0: self.y0.min(o.y0),
            x1: self.x1.max(o.x1),
            y1: self.y1.max(o.y1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_box_is_empty_and_lies_in_every_box() {
        let somewhere = BBox {
            x0: 3.0,
            y0: 4.0,
            x1: 5.0,
            y1: 6.0,
        };
        assert!(BBox::default().is_empty() && somewhere.contains(&BBox::default()));
        assert!(!BBox::default().contains(&somewhere));
    }

    #[test]
    fn boxes_that_share_an_edge_do_not_overlap() {
        let a = BBox {
            x0: 0.0,
            y0: 0.0,
            x1: 2.0,
            y1: 2.0,
        };
        let b = BBox {
            x0: 2.0,
            y0: 0.0,
            x1: 4.0,
            y1: 2.0,
        };
        assert!(!a.overlaps(&b) && a.overlaps(&a));
    }

    #[test]
    fn a_box_around_nothing_is_empty() {
        assert!(BBox::around([]).is_empty());
    }
}
