//! How well boxes agree, as something to climb.

use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// Keeps ratios defined.
const EPSILON: f64 = 1e-7;

/// Complete intersection over union of boxes in pairs, `[pair, 4]` as centre and size; 1 for equal boxes.
///
/// # Method
/// [Zheng et al. 2020], equations 6 to 11: overlap, distance of the centres against the diagonal of the box around
/// both, difference of the aspect ratios. The trade-off factor takes no part in the gradient, as there.
///
/// [Zheng et al. 2020]: https://arxiv.org/abs/1911.08287
pub(super) fn ciou<B: Backend>(a: Tensor<B, 2>, b: Tensor<B, 2>) -> Tensor<B, 2> {
    let column = |t: &Tensor<B, 2>, i: usize| t.clone().narrow(1, i, 1);
    let [ax, ay, aw, ah] = [0, 1, 2, 3].map(|i| column(&a, i));
    let [bx, by, bw, bh] = [0, 1, 2, 3].map(|i| column(&b, i));
    let (across, along) = (spans(&ax, &aw, &bx, &bw), spans(&ay, &ah, &by, &bh));
    let shared = across.shared * along.shared;
    let union = aw.clone() * ah.clone() + bw.clone() * bh.clone() - shared.clone() + EPSILON;
    let iou = shared / union;
    let diagonal = square(across.around) + square(along.around) + EPSILON;
    let distance = (square(ax - bx) + square(ay - by)) / diagonal;
    let angle = |w: Tensor<B, 2>, h: Tensor<B, 2>| (w / (h + EPSILON)).atan();
    let quarter_turns = (angle(bw, bh) - angle(aw, ah)) * (2.0 / std::f64::consts::PI);
    let aspect = square(quarter_turns);
    // Rounding may take the overlap of equal boxes beyond 1.
    let apart = (-iou.clone() + 1.0).clamp_min(0.0);
    let trade_off = (aspect.clone() / (aspect.clone() + apart + EPSILON)).detach();
    iou - distance - aspect * trade_off
}

/// Two intervals of a line.
struct Spans<B: Backend> {
    shared: Tensor<B, 2>,
    /// Length of the interval around both.
    around: Tensor<B, 2>,
}

fn spans<B: Backend>(a: &Tensor<B, 2>, wide_a: &Tensor<B, 2>, b: &Tensor<B, 2>, wide_b: &Tensor<B, 2>) -> Spans<B> {
    let ends = |middle: &Tensor<B, 2>, width: &Tensor<B, 2>| {
        let half = width.clone() * 0.5;
        (middle.clone() - half.clone(), middle.clone() + half)
    };
    let ((a0, a1), (b0, b1)) = (ends(a, wide_a), ends(b, wide_b));
    let shared = (a1.clone().min_pair(b1.clone()) - a0.clone().max_pair(b0.clone())).clamp_min(0.0);
    Spans { shared, around: a1.max_pair(b1) - a0.min_pair(b0) }
}

fn square<B: Backend>(t: Tensor<B, 2>) -> Tensor<B, 2> {
    t.clone() * t
}

#[cfg(test)]
mod tests {
    use super::super::Cpu;
    use super::*;

    fn one(a: [f32; 4], b: [f32; 4]) -> f32 {
        let device = Default::default();
        ciou::<Cpu>(Tensor::from_data([a], &device), Tensor::from_data([b], &device)).into_scalar()
    }

    /// By the paper's equations, in plain numbers.
    fn reference(a: [f32; 4], b: [f32; 4]) -> f64 {
        let (a, b) = (a.map(f64::from), b.map(f64::from));
        let edge = |b: [f64; 4], i: usize, sign: f64| b[i] + sign * b[2 + i] / 2.0;
        let shared = |i| (edge(a, i, 1.0).min(edge(b, i, 1.0)) - edge(a, i, -1.0).max(edge(b, i, -1.0))).max(0.0);
        let around = |i| edge(a, i, 1.0).max(edge(b, i, 1.0)) - edge(a, i, -1.0).min(edge(b, i, -1.0));
        let inter = shared(0) * shared(1);
        let iou = inter / (a[2] * a[3] + b[2] * b[3] - inter);
        let distance = ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)) / (around(0).powi(2) + around(1).powi(2));
        let v = 4.0 / std::f64::consts::PI.powi(2) * ((b[2] / b[3]).atan() - (a[2] / a[3]).atan()).powi(2);
        let alpha = if v == 0.0 { 0.0 } else { v / (1.0 - iou + v) };
        iou - distance - alpha * v
    }

    #[test]
    fn equal_boxes_agree_fully_and_others_as_the_paper_says() {
        assert!((one([3.0, 4.0, 2.0, 5.0], [3.0, 4.0, 2.0, 5.0]) - 1.0).abs() < 1e-5);
        for (a, b) in [
            ([3.0, 4.0, 2.0, 5.0], [3.5, 4.2, 3.0, 1.0]),
            ([0.0, 0.0, 1.0, 1.0], [5.0, 0.0, 1.0, 2.0]),
            ([1.0, 1.0, 4.0, 4.0], [1.5, 0.5, 1.0, 1.0]),
        ] {
            assert!((f64::from(one(a, b)) - reference(a, b)).abs() < 1e-5, "{a:?} {b:?}");
        }
    }

    #[test]
    fn boxes_apart_are_still_drawn_together() {
        let device = Default::default();
        let a = Tensor::<Cpu, 2>::from_data([[0.0, 0.0, 1.0, 1.0]], &device).require_grad();
        let gradients = ciou(a.clone(), Tensor::from_data([[5.0, 0.0, 1.0, 1.0]], &device)).sum().backward();
        let toward = a.grad(&gradients).expect("a gradient").into_data().to_vec::<f32>().expect("numbers");
        assert!(toward[0] > 0.0 && toward.iter().all(|v| v.is_finite()), "{toward:?}");
    }
}
