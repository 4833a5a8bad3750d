//! What training makes small.

use super::assign::{Match, matches};
use super::ciou::ciou;
use super::network::{BOX_NUMBERS, Description, LEVELS};
use super::sample::Labelled;
use burn::tensor::activation::{relu, sigmoid};
use burn::tensor::backend::Backend;
use burn::tensor::{Int, Tensor, TensorData};

/// Weights of the objectness of the heads, fine to coarse: a fine head has more cells without an object. YOLOv5's.
const BALANCE: [f64; LEVELS] = [4.0, 1.0, 0.4];
/// Gains of box, objectness and class: YOLOv5's for 80 classes and images of 640 pixels, to which they are scaled.
const BOX_GAIN: f64 = 0.05;
const OBJECT_GAIN: f64 = 1.0;
const CLASS_GAIN: f64 = 0.5;
const GAIN_CLASSES: f64 = 80.0;
const GAIN_SIDE: f64 = 640.0;

/// The loss of a batch, per image.
pub(super) struct Loss<B: Backend> {
    pub(super) total: Tensor<B, 1>,
    /// Box, objectness, class: their shares of the total.
    pub(super) parts: [f64; 3],
}

/// The loss of a network's output against what is in the images: 1 - CIoU of the matched boxes, binary cross entropy of
/// objectness (against the boxes' CIoU) and of the classes.
pub(super) fn loss<B: Backend>(
    output: [Tensor<B, 2>; LEVELS],
    objects: &[Vec<Labelled>],
    description: &Description,
) -> Loss<B> {
    let classes = description.classes.len();
    let gains = [
        BOX_GAIN,
        OBJECT_GAIN * (description.side as f64 / GAIN_SIDE).powi(2),
        CLASS_GAIN * classes as f64 / GAIN_CLASSES,
    ];
    let device = output[0].device();
    let mut sums = [(); 3].map(|()| Tensor::<B, 1>::zeros([1], &device));
    for (level, rows) in output.into_iter().enumerate() {
        let all = matches(objects, description, level);
        let mut goal = vec![0.0_f32; rows.dims()[0]];
        if !all.is_empty() {
            let told = rows.clone().select(0, indices(&all, &device));
            let agreement = ciou(boxes(told.clone(), &all), targets(&all, &device));
            for (m, value) in all.iter().zip(numbers(agreement.clone())) {
                // Of several objects in a row the best told counts.
                goal[m.row] = goal[m.row].max(value);
            }
            sums[0] = sums[0].clone() + (-agreement + 1.0).mean();
            if classes > 1 {
                let told = told.narrow(1, BOX_NUMBERS, classes);
                sums[2] = sums[2].clone() + cross_entropy(told, one_hot(&all, classes, &device));
            }
        }
        let count = goal.len();
        let goal = Tensor::from_data(TensorData::new(goal, [count, 1]), &device);
        sums[1] = sums[1].clone() + cross_entropy(rows.narrow(1, BOX_NUMBERS - 1, 1), goal) * BALANCE[level];
    }
    let parts = std::array::from_fn::<_, 3, _>(|i| sums[i].clone() * gains[i]);
    let total = parts[0].clone() + parts[1].clone() + parts[2].clone();
    Loss { total, parts: parts.map(|t| f64::from(numbers(t)[0])) }
}

/// Mean over all entries, from logits, in the form that does not overflow.
fn cross_entropy<B: Backend>(logits: Tensor<B, 2>, goal: Tensor<B, 2>) -> Tensor<B, 1> {
    let tail = (-logits.clone().abs()).exp().log1p();
    (relu(logits.clone()) - logits * goal + tail).mean()
}

/// Boxes from a network's numbers, in cells from the cell's corner (equation 1).
fn boxes<B: Backend>(told: Tensor<B, 2>, all: &[Match]) -> Tensor<B, 2> {
    let device = told.device();
    let twice = sigmoid(told.narrow(1, 0, 4)) * 2.0;
    let size = twice.clone().narrow(1, 2, 2);
    let anchors = table(all.iter().flat_map(|m| m.anchor), 2, &device);
    Tensor::cat(vec![twice.narrow(1, 0, 2) - 0.5, size.clone() * size * anchors], 1)
}

fn targets<B: Backend>(all: &[Match], device: &B::Device) -> Tensor<B, 2> {
    table(all.iter().flat_map(|m| m.bbox), 4, device)
}

fn one_hot<B: Backend>(all: &[Match], classes: usize, device: &B::Device) -> Tensor<B, 2> {
    let row = |m: &Match| {
        let class = m.class as usize;
        (0..classes).map(move |i| if i == class { 1.0 } else { 0.0 })
    };
    table(all.iter().flat_map(row), classes, device)
}

fn indices<B: Backend>(all: &[Match], device: &B::Device) -> Tensor<B, 1, Int> {
    let rows: Vec<i64> = all.iter().map(|m| m.row as i64).collect();
    Tensor::from_data(TensorData::new(rows, [all.len()]), device)
}

fn table<B: Backend>(values: impl Iterator<Item = f64>, columns: usize, device: &B::Device) -> Tensor<B, 2> {
    let values: Vec<f32> = values.map(|v| v as f32).collect();
    let rows = values.len() / columns;
    Tensor::from_data(TensorData::new(values, [rows, columns]), device)
}

/// The values of a tensor, row by row.
pub(super) fn numbers<B: Backend, const D: usize>(tensor: Tensor<B, D>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}

#[cfg(test)]
mod tests {
    use super::super::Cpu;
    use super::super::tests::description;
    use super::*;
    use crate::label::BBox;
    use crate::train::encode;

    const SIDE: usize = 64;

    /// Output of a network that knows the objects to `sureness`, as logits.
    fn output(objects: &[Vec<Labelled>], sureness: f32) -> [Tensor<Cpu, 2>; LEVELS] {
        let d = description(SIDE);
        std::array::from_fn(|level| {
            let rows = objects.len() * 3 * d.cells(level).pow(2);
            let mut values = vec![-sureness; rows * d.numbers()];
            for m in matches(objects, &d, level) {
                let numbers = encode(m.bbox, [0.0; 2], m.anchor).expect("in reach");
                let row = &mut values[m.row * d.numbers()..][..d.numbers()];
                row[..4].copy_from_slice(&numbers.map(|v| v as f32));
                row[4] = sureness;
                row[BOX_NUMBERS + m.class as usize] = sureness;
            }
            Tensor::from_data(TensorData::new(values, [rows, d.numbers()]), &Default::default())
        })
    }

    fn objects() -> Vec<Vec<Labelled>> {
        let object = |class, x: f64, w: f64| Labelled { class, bbox: BBox { x0: x, y0: 8.5, x1: x + w, y1: 30.5 } };
        vec![vec![object(0, 3.3, 20.0)], vec![], vec![object(1, 30.2, 25.0)]]
    }

    #[test]
    fn knowing_everything_costs_nothing() {
        let all = loss(output(&objects(), 20.0), &objects(), &description(SIDE));
        assert!(all.parts.iter().all(|part| part.abs() < 1e-5), "{:?}", all.parts);
    }

    #[test]
    fn doubt_costs_what_cross_entropy_says() {
        let d = description(SIDE);
        let all = loss(output(&[vec![]], 0.0), &[vec![]], &d);
        let expected = std::f64::consts::LN_2 * BALANCE.iter().sum::<f64>() * (SIDE as f64 / GAIN_SIDE).powi(2);
        assert!(
            (all.parts[1] - expected).abs() < 1e-6 && all.parts[0] == 0.0 && all.parts[2] == 0.0,
            "{:?}",
            all.parts
        );
    }

    #[test]
    fn one_step_down_the_gradient_lowers_the_loss() {
        let d = description(SIDE);
        let start = output(&objects(), 0.3).map(|t| t.mul_scalar(0.5).require_grad());
        let before = loss(start.clone(), &objects(), &d);
        let gradients = before.total.clone().backward();
        let next = start.map(|t| {
            let slope = t.grad(&gradients).expect("a gradient");
            t - Tensor::from_inner(slope) * 0.5
        });
        let after = loss(next, &objects(), &d);
        assert!(numbers(after.total)[0] < numbers(before.total)[0]);
    }
}
