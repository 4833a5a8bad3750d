//! Which cells and anchors are to find which object.

use super::network::{ANCHORS_PER_LEVEL, Description};
use super::sample::Labelled;
use crate::train::anchors::in_reach;

/// A centre this near to a neighbour's edge is within the reach of equation 1 from there, cells.
const NEAR: f64 = 0.5;

/// An object that a row of a head's output is to tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Match {
    /// Row of the output.
    pub(super) row: usize,
    /// Width and height of the row's anchor, cells.
    pub(super) anchor: [f64; 2],
    /// Centre, from the cell's corner, and size, cells.
    pub(super) bbox: [f64; 4],
    pub(super) class: u32,
}

/// Matches of a head: every anchor that an object fits ([`THRESHOLD`](crate::train::THRESHOLD)), in the cell of its
/// centre and in the nearest neighbour across and along.
///
/// # Method
/// YOLOv5: up to three cells an anchor, so that more cells learn an object; equation 1 reaches half a cell beyond.
pub(super) fn matches(objects: &[Vec<Labelled>], description: &Description, level: usize) -> Vec<Match> {
    let cells = description.cells(level);
    let stride = (description.side / cells) as f64;
    let anchors = description.anchors_in_cells(level);
    let mut all = Vec::new();
    for (image, object) in objects.iter().enumerate().flat_map(|(i, list)| list.iter().map(move |o| (i, o))) {
        let center = object.bbox.center();
        let (center, size) =
            ([center.x, center.y].map(|v| v / stride), [object.bbox.width(), object.bbox.height()].map(|v| v / stride));
        let fitting = anchors.iter().enumerate().filter(|(_, anchor)| in_reach(&size, anchor));
        for (a, &anchor) in fitting {
            for [x, y] in cells_around(center, cells) {
                let row = ((image * ANCHORS_PER_LEVEL + a) * cells + y) * cells + x;
                let bbox = [center[0] - x as f64, center[1] - y as f64, size[0], size[1]];
                all.push(Match { row, anchor, bbox, class: object.class });
            }
        }
    }
    all
}

/// The cell that holds a point and its nearest neighbours, across and along, that exist.
fn cells_around(center: [f64; 2], cells: usize) -> Vec<[usize; 2]> {
    let own = center.map(|v| (v.max(0.0) as usize).min(cells - 1));
    let mut around = vec![own];
    for axis in 0..2 {
        let part = center[axis] - own[axis] as f64;
        let mut neighbour = own;
        if part < NEAR && own[axis] > 0 {
            neighbour[axis] -= 1;
        } else if part > 1.0 - NEAR && own[axis] + 1 < cells {
            neighbour[axis] += 1;
        } else {
            continue;
        }
        around.push(neighbour);
    }
    around
}

#[cfg(test)]
mod tests {
    use super::super::tests::description;
    use super::*;
    use crate::label::BBox;
    use crate::train::{decode, encode};

    #[test]
    fn an_object_goes_to_its_cell_and_the_two_nearest() {
        assert_eq!(cells_around([3.3, 5.8], 12), [[3, 5], [2, 5], [3, 6]]);
        assert_eq!(cells_around([3.5, 5.5], 12), [[3, 5]]);
        assert_eq!(cells_around([0.1, 11.9], 12), [[0, 11]]);
        assert_eq!(cells_around([12.0, -0.1], 12), [[11, 0]]);
    }

    #[test]
    fn every_match_is_within_the_reach_of_equation_1() {
        let description = description(96);
        let object =
            |x: f64, y: f64, w: f64| Labelled { class: 0, bbox: BBox { x0: x, y0: y, x1: x + w, y1: y + 20.0 } };
        let objects = [vec![object(3.0, 7.0, 14.0)], vec![], vec![object(40.0, 50.0, 31.0), object(70.0, 1.0, 9.0)]];
        let all: Vec<Match> = (0..3).flat_map(|level| matches(&objects, &description, level)).collect();
        assert!(all.len() > 6, "{all:?}");
        for m in all {
            let numbers = encode(m.bbox, [0.0; 2], m.anchor).expect("in reach");
            let back = decode(numbers, [0.0; 2], m.anchor);
            assert!(back.iter().zip(m.bbox).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
}
