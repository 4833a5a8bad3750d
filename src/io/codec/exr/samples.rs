//! Samples of EXR channels: bytes, halves and floats.

use bytemuck::pod_collect_to_vec;
use exr::meta::attribute::SampleType;
use exr::prelude::FlatSamples;
use half::f16;
use half::slice::HalfFloatSliceExt;

/// A row of samples of one channel of the part.
pub(super) struct SampleLine {
    pub(super) channel: usize,
    pub(super) y: usize,
    pub(super) samples: Vec<f32>,
}

/// Converts native bytes of samples to floats. Halves are converted together: one by one takes five
/// times as long.
pub(super) fn to_floats(bytes: &[u8], kind: SampleType, floats: &mut Vec<f32>) {
    match kind {
        SampleType::F16 => {
            let halves: Vec<f16> = pod_collect_to_vec(bytes);
            floats.resize(halves.len(), 0.0);
            halves.convert_to_f32_slice(floats);
        }
        SampleType::F32 => *floats = pod_collect_to_vec(bytes),
        SampleType::U32 => {
            let integers: Vec<u32> = pod_collect_to_vec(bytes);
            floats.clear();
            floats.extend(integers.into_iter().map(|v| v as f32));
        }
    }
}

/// Floats for storage as halves, rounded to nearest; finite values stay finite, at most 65504:
/// programs blur and scale what they read, and one infinite pixel would spoil its neighbours.
pub(crate) fn half_samples(samples: &[f32]) -> FlatSamples {
    let mut out = vec![f16::ZERO; samples.len()];
    out.as_mut_slice().convert_from_f32_slice(samples);
    for (half, v) in out.iter_mut().zip(samples) {
        if half.is_infinite() && v.is_finite() {
            *half = f16::MAX.copysign(*half);
        }
    }
    FlatSamples::F16(out)
}
