//! Bounds of the matte: garbage and core mattes, and the robust profile's range.

use super::model::Behaviour;
use super::robust::is_usable_matte;
use super::rows::{Rows, Source};
use crate::image::Image;
use crate::pixel::Coverage;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A value of a matte; in the robust profile 0 where it is not usable.
fn usable_value(m: Coverage, careful: bool) -> f32 {
    if careful && !is_usable_matte(m) {
        0.0
    } else {
        m.0
    }
}

/// The matte, at most `1 - garbage`.
pub(super) struct Garbage<'a> {
    pub(super) source: Source<'a>,
    pub(super) garbage: &'a Image<Coverage>,
    pub(super) behaviour: Behaviour,
    /// NaN counts as 0.
    pub(super) careful: bool,
}

impl Rows for Garbage<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.source.row(y, out);
        // Both ways of writing a minimum are Blender's; they differ where one side is NaN.
        for (m, g) in out.iter_mut().zip(self.garbage.row(y)) {
            let most = 1.0 - usable_value(*g, self.careful);
            *m = match self.behaviour {
                Behaviour::V34 | Behaviour::V45 => lesser(most, *m),
                Behaviour::V42 => lesser(*m, most),
            };
        }
    }
}

/// The first where it is less, or else the second.
#[inline(always)]
pub(in crate::matte) fn lesser(first: f32, second: f32) -> f32 {
    if first < second { first } else { second }
}

/// The matte, at least the core matte.
pub(super) struct Core<'a> {
    pub(super) source: Source<'a>,
    /// The core matte; none stands for 0 everywhere.
    pub(super) core: Option<&'a Image<Coverage>>,
    pub(super) behaviour: Behaviour,
    /// NaN counts as 0.
    pub(super) careful: bool,
}

impl Rows for Core<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.source.row(y, out);
        match self.core {
            Some(core) => out
                .iter_mut()
                .zip(core.row(y))
                .for_each(|(m, c)| *m = self.larger_value(*m, usable_value(*c, self.careful))),
            None => out.iter_mut().for_each(|m| *m = self.larger_value(*m, 0.0)),
        }
    }
}

impl Core<'_> {
    #[inline(always)]
    fn larger_value(&self, m: f32, c: f32) -> f32 {
        match self.behaviour {
            Behaviour::V34 | Behaviour::V45 => greater(c, m),
            Behaviour::V42 => greater(m, c),
        }
    }
}

/// The first where it is greater, or else the second.
#[inline(always)]
fn greater(first: f32, second: f32) -> f32 {
    if second < first { first } else { second }
}

/// The finished matte held between 0 and 1, counting what lay outside.
pub(super) struct Clamp<'a> {
    pub(super) source: Source<'a>,
    pub(super) clamped: &'a AtomicUsize,
}

impl Rows for Clamp<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.source.row(y, out);
        let outside = out.iter().filter(|m| !(0.0..=1.0).contains(*m)).count();
        out.iter_mut()
            .for_each(|m| *m = if *m > 0.0 { m.min(1.0) } else { 0.0 });
        self.clamped.fetch_add(outside, Ordering::Relaxed);
    }
}
