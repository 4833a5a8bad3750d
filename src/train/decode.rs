//! From a network's numbers to boxes, and back.

/// A box from four numbers of a network: centre x and y, width and height, in cells of its grid.
///
/// `cell` is column and row of the grid's cell, `anchor` width and height of the anchor in cells.
///
/// # Method
/// Equation 1 of the paper: `2 sigmoid(t) - 0.5 + cell` and `anchor (2 sigmoid(t))^2`.
pub fn decode(t: [f64; 4], cell: [f64; 2], anchor: [f64; 2]) -> [f64; 4] {
    let [x, y, w, h] = t.map(|v| 2.0 * sigmoid(v));
    [
        x - 0.5 + cell[0],
        y - 0.5 + cell[1],
        anchor[0] * w * w,
        anchor[1] * h * h,
    ]
}

/// The numbers that [`decode`] takes to a box; none for a box that it cannot reach: a centre more
/// than half a cell outside its cell, a side of 0 or of 4 anchors and more.
pub fn encode(bbox: [f64; 4], cell: [f64; 2], anchor: [f64; 2]) -> Option<[f64; 4]> {
    let [x, y, w, h] = bbox;
    let shares = [
        half_offset(x, cell[0]),
        half_offset(y, cell[1]),
        half_root(w, anchor[0]),
        half_root(h, anchor[1]),
    ];
    let reachable = shares.iter().all(|s| *s > 0.0 && *s < 1.0);
    reachable.then(|| shares.map(logit))
}

fn half_offset(center: f64, cell: f64) -> f64 {
    (center - cell + 0.5) / 2.0
}

fn half_root(side: f64, anchor: f64) -> f64 {
    (side / anchor).sqrt() / 2.0
}

fn logit(share: f64) -> f64 {
    libm::log(share / (1.0 - share))
}

fn sigmoid(v: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn zeros_are_the_middle_of_the_cell_and_the_anchor_itself() {
        assert_eq!(
            decode([0.0; 4], [3.0, 5.0], [2.0, 4.0]),
            [3.5, 5.5, 2.0, 4.0]
        );
    }

    #[test]
    fn boxes_out_of_reach_have_no_numbers() {
        for bbox in [
            [2.4, 5.5, 2.0, 4.0],
            [3.5, 5.5, 0.0, 4.0],
            [3.5, 5.5, 8.0, 4.0],
            [f64::NAN, 5.5, 2.0, 4.0],
        ] {
            assert_eq!(encode(bbox, [3.0, 5.0], [2.0, 4.0]), None, "{bbox:?}");
        }
    }

    proptest! {
        #[test]
        fn decoding_undoes_encoding(t in proptest::array::uniform4(-6.0..6.0), cell in proptest::array::uniform2(0.0..80.0), anchor in proptest::array::uniform2(0.1..20.0)) {
            let back = encode(decode(t, cell, anchor), cell, anchor).expect("a decoded box is in reach");
            for (a, b) in t.into_iter().zip(back) {
                prop_assert!((a - b).abs() < 1e-8, "{a} {b}");
            }
        }
    }
}
