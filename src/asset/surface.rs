//! What the texels of a cut-out show: body, or what is next to it; and how much of their light is
//! glints.

use crate::asset::Texture;
use crate::filter::{Pyramid, depth};
use crate::image::{Image, Mask};
use crate::pixel::{Film, Mix};
use std::collections::VecDeque;
use std::sync::{Arc, OnceLock, Weak};

/// Opacity up to which a texel may be beside the object.
const EMPTY_OPACITY: f32 = 0.02;
/// Opacity from which a texel at the border of an object is taken for covered by it: less than the
/// rims of clear bottles have.
const RIM_OPACITY: f32 = 0.25;
/// Texels from the border at which every texel is covered: photos are sharp to about this.
const RIM_TEXELS: f32 = 4.0;
/// Half the width of the widest glint, as a share of the cut-out's longer side: the streaks along
/// the bottles of `tests/samples` are up to 17 of 526 texels wide.
const GLINT_RADIUS_RATIO: f64 = 0.02;

/// What a texel of a cut-out is of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceTexel {
    /// Share of it that the object covers, see-through or not, 0 to 1.
    pub body: f32,
    /// Light of glints in each of its channels.
    pub glint: f32,
}

impl Mix for SurfaceTexel {
    #[inline(always)]
    fn add_scaled(self, w: f32, o: Self) -> Self {
        Self {
            body: self.body + w * o.body,
            glint: self.glint + w * o.glint,
        }
    }
}

/// The surface map of a texture, computed on first use and shared by all that show it.
#[derive(Clone, Debug, Default)]
pub struct SurfaceCache(Arc<OnceLock<Pyramid<SurfaceTexel>>>);

/// A map while somebody uses it.
pub(super) type WeakSurface = Weak<OnceLock<Pyramid<SurfaceTexel>>>;

impl SurfaceCache {
    pub(super) fn downgrade(&self) -> WeakSurface {
        Arc::downgrade(&self.0)
    }

    pub(super) fn upgrade(weak: &WeakSurface) -> Option<Self> {
        weak.upgrade().map(Self)
    }

    /// The map; `texture` is the same at every call.
    pub fn of(&self, texture: &Texture) -> &Pyramid<SurfaceTexel> {
        if let Some(map) = self.0.get() {
            return map;
        }
        // Made outside of the lock, since it may be made in parallel.
        let map = Pyramid::new(surface_map(&texture.to_film()));
        self.0.get_or_init(|| map)
    }
}

/// What the texels of a cut-out are of, at full detail.
///
/// # Method
/// The object is what cannot be reached from the border over empty texels. Glints of dielectrics
/// have the colour of the light, which a photo's white balance makes grey, and are small: of the
/// least channel, what exceeds its opening by a square ([Meyer 1979]'s top hat) where the texel is
/// see-through, since a bright structure of paint is opaque; and whatever exceeds the opacity, for
/// no body reflects more than it holds back.
///
/// [Meyer 1979]: https://doi.org/10.1007/978-94-009-7772-4
pub(super) fn surface_map(cut_out: &Image<Film>) -> Image<SurfaceTexel> {
    let body = body_coverage(cut_out);
    let neutral = cut_out.map(|film| least_channel(film).max(0.0));
    let level = diffuse_level(&neutral, &body);
    let glints = neutral.zip_map(&level, |light, level| (light - level).max(0.0));
    let glints = glints.zip_map(cut_out, glint);
    body.zip_map(&glints, |body, glint| SurfaceTexel { body, glint })
}

fn least_channel(film: Film) -> f32 {
    film.color.r.min(film.color.g).min(film.color.b)
}

fn most_opacity(film: Film) -> f32 {
    film.opacity.max_channel()
}

/// Light of glints in a texel whose light exceeds the level around it by so much.
fn glint(excess: f32, film: Film) -> f32 {
    let opacity = most_opacity(film);
    let beyond = (least_channel(film) - opacity).max(0.0);
    beyond.max(excess * (1.0 - opacity))
}

/// Share of every texel that the object covers.
fn body_coverage(cut_out: &Image<Film>) -> Image<f32> {
    let empty = cut_out.map(|film| most_opacity(film) <= EMPTY_OPACITY);
    let inside = depth(&outside(&empty).complement());
    inside.zip_map(cut_out, |texels, film| {
        if texels > 0.0 {
            (most_opacity(film) / RIM_OPACITY)
                .max(texels / RIM_TEXELS)
                .min(1.0)
        } else {
            0.0
        }
    })
}

/// The empty texels that are reached from the border over empty ones.
fn outside(empty: &Image<bool>) -> Mask {
    let (width, height) = empty.size();
    let mut found = Mask::filled(width, height, false);
    let mut open: VecDeque<(usize, usize)> = border(width, height).collect();
    while let Some((x, y)) = open.pop_front() {
        if !empty[(x, y)] || found[(x, y)] {
            continue;
        }
        found[(x, y)] = true;
        open.extend(neighbors(x, y).filter(|&(x, y)| x < width && y < height));
    }
    found
}

fn border(width: usize, height: usize) -> impl Iterator<Item = (usize, usize)> {
    let (right, bottom) = (width.saturating_sub(1), height.saturating_sub(1));
    let rows = (0..width).flat_map(move |x| [(x, 0), (x, bottom)]);
    let columns = (0..height).flat_map(move |y| [(0, y), (right, y)]);
    rows.chain(columns).filter(move |_| width * height > 0)
}

/// Left, right, above and below; wrapped around where there is none.
fn neighbors(x: usize, y: usize) -> impl Iterator<Item = (usize, usize)> {
    [
        (x.wrapping_sub(1), y),
        (x + 1, y),
        (x, y.wrapping_sub(1)),
        (x, y + 1),
    ]
    .into_iter()
}

/// What is left of the light where structures narrower than glints are taken away: the opening by a
/// square, within the object.
fn diffuse_level(neutral: &Image<f32>, body: &Image<f32>) -> Image<f32> {
    let longest = neutral.width().max(neutral.height());
    let radius = (GLINT_RADIUS_RATIO * longest as f64).ceil() as usize;
    let within = neutral.zip_map(
        body,
        |light, body| {
            if body >= 1.0 { light } else { f32::INFINITY }
        },
    );
    let least = square_minimum(&within, radius);
    let least = least.zip_map(body, |least, body| if body >= 1.0 { least } else { 0.0 });
    square_minimum(&least.map(|v| -v), radius).map(|v| -v)
}

/// The least value in the square around each pixel.
fn square_minimum(image: &Image<f32>, radius: usize) -> Image<f32> {
    let along_rows = row_minimum(image, radius);
    transposed(&row_minimum(&transposed(&along_rows), radius))
}

fn transposed(image: &Image<f32>) -> Image<f32> {
    Image::from_fn(image.height(), image.width(), |x, y| image[(y, x)])
}

fn row_minimum(image: &Image<f32>, radius: usize) -> Image<f32> {
    let rows = image.rows().flat_map(|row| running_minimum(row, radius));
    Image::from_vec(image.width(), image.height(), rows.collect())
}

/// The least value within `radius` of each place, in linear time: what waits in the queue grows
/// from front to back (Lemire 2006).
fn running_minimum(values: &[f32], radius: usize) -> Vec<f32> {
    let mut waiting: VecDeque<usize> = VecDeque::new();
    let mut next = 0;
    let mut least = Vec::with_capacity(values.len());
    for i in 0..values.len() {
        while next < values.len().min(i + radius + 1) {
            while waiting.back().is_some_and(|&k| values[k] >= values[next]) {
                waiting.pop_back();
            }
            waiting.push_back(next);
            next += 1;
        }
        while waiting[0] + radius < i {
            waiting.pop_front();
        }
        least.push(values[waiting[0]]);
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::LinearRgb;

    #[test]
    fn a_running_minimum_is_the_least_of_its_window() {
        let values: Vec<f32> = (0..50).map(|k| ((k * 37) % 23) as f32).collect();
        for radius in [0, 1, 4, 70] {
            let found = running_minimum(&values, radius);
            for (i, found) in found.iter().enumerate() {
                let window = &values[i.saturating_sub(radius)..(i + radius + 1).min(50)];
                assert_eq!(*found, window.iter().copied().fold(f32::MAX, f32::min));
            }
        }
    }

    /// A clear bottle from 20 to 180 with a streak of light, a wide sheen, white print on an opaque
    /// label, and a hole that is as clear as the outside.
    fn bottle() -> Image<Film> {
        Image::from_fn(200, 100, |x, y| {
            let film = |light: f32, opacity: f32| Film {
                color: LinearRgb::grey(light),
                opacity: LinearRgb::grey(opacity),
            };
            match (x, y) {
                (0..20 | 180.., _) | (_, 0..20 | 80..) => Film::default(),
                (30..80, 40..43) => film(0.6, 0.3),
                (30..80, _) => film(0.05, 0.3),
                (80..100, 60..70) => Film::default(),
                (80..120, _) => film(0.2, 0.3),
                (130..160, 50..52) => film(0.9, 1.0),
                (130..160, 60..62) => film(1.7, 1.0),
                (130..160, _) => film(0.1, 1.0),
                _ => film(0.05, 0.3),
            }
        })
    }

    #[test]
    fn glints_are_narrow_and_no_paint() {
        let map = surface_map(&bottle());
        let glint = |x, y| map[(x, y)].glint;
        assert!(
            (glint(50, 41) - 0.7 * 0.55).abs() < 1e-6,
            "{}",
            glint(50, 41)
        );
        assert_eq!([glint(50, 50), glint(100, 50), glint(140, 40)], [0.0; 3]);
        // White print reflects no more than it holds back; what does is a glint.
        assert_eq!(glint(140, 51), 0.0);
        assert!((glint(140, 61) - 0.7).abs() < 1e-6);
    }

    #[test]
    fn a_clear_part_inside_is_covered_and_the_outside_is_not() {
        let map = surface_map(&bottle());
        assert_eq!(map[(90, 65)].body, 1.0);
        assert_eq!([map[(50, 50)].body, map[(20, 50)].body], [1.0; 2]);
        assert_eq!([map[(19, 50)].body, map[(100, 90)].body], [0.0; 2]);
    }

    #[test]
    fn strange_pictures_have_a_map() {
        for size in [(0, 0), (1, 1), (0, 4), (3, 1)] {
            let map = surface_map(&Image::filled(size.0, size.1, Film::default()));
            assert_eq!(map.size(), size);
        }
        let full = Image::filled(3, 3, Film::new(LinearRgb::BLACK, LinearRgb::BLACK));
        assert!(surface_map(&full).pixels().iter().all(|t| t.body == 1.0));
    }
}
