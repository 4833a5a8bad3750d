//! Deep samples: per pixel, front to back, what each object does to the pixel.

mod tile;

pub(crate) use tile::DeepTile;

use crate::image::Image;
use crate::pixel::{Coverage, Depth, Film, LinearRgb, Mix, ObjectId};
use std::borrow::Cow;
use std::ops::Range;

/// What one object contributes to one pixel, averaged over the pixel.
///
/// `light` and `visible` are already attenuated by what is in front, so a picture is their plain
/// sum and a label can never contradict it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeepSample {
    /// The object.
    pub object: ObjectId,
    /// Distance of the object at the pixel, metres along the optical axis; for a curved card that
    /// of the flat one.
    pub depth: Depth,
    /// Light that reaches the camera from it: held out by what is in front, exposure applied.
    pub light: LinearRgb,
    /// Its own coverage of the pixel, as if alone (amodal).
    pub alpha: f32,
    /// The part of `alpha` that is seen through what is in front.
    pub visible: f32,
}

/// The part of the photographed place in front of objects in one pixel; the default is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HoldoutSample {
    /// Share of the pixel that it fills.
    pub coverage: Coverage,
    /// Its distance, metres along the optical axis: nearer objects are in front of it. 0 is in
    /// front of everything.
    pub depth: Depth,
}

impl HoldoutSample {
    /// Whether it hides anything of an object at this distance.
    #[inline]
    pub(crate) fn hides(&self, depth: f64) -> bool {
        self.coverage.0 > 0.0 && depth > f64::from(self.depth.0)
    }
}

/// The light from behind an object in a pixel, or how much it changes where it is displaced.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SeenBehind {
    /// All the light from there.
    pub(crate) light: LinearRgb,
    /// The plate's part, before objects and shadows attenuate it.
    pub(crate) plate: LinearRgb,
}

impl Mix for SeenBehind {
    #[inline(always)]
    fn add_scaled(self, weight: f32, other: Self) -> Self {
        Self {
            light: self.light.add_scaled(weight, other.light),
            plate: self.plate.add_scaled(weight, other.plate),
        }
    }
}

/// A picture of deep samples, and the share of the surface's light that its shadows leave.
///
/// Film hides a different share in each channel: pictures with film have [`tints`](Self::tints) in
/// addition to the samples, whose `alpha` and `visible` are then the mean over channels. Pictures
/// without film have none, at no cost.
#[derive(Clone, Debug, Default)]
pub struct DeepImage {
    /// Squares of `1 << tile_bits` pixels a side, row by row; smaller ones at the right and bottom
    /// ends.
    tiles: Vec<DeepTile>,
    tile_bits: u32,
    shadow: Image<LinearRgb>,
}

impl DeepImage {
    /// Assembles a picture from its pixels' samples, row by row, each front to back.
    ///
    /// `shadow` has the picture's size: the factor on the plate, 1 where nothing casts a shadow.
    ///
    /// # Panics
    /// When the number of lists is not the number of pixels of `shadow`.
    pub fn from_pixels(
        shadow: Image<LinearRgb>,
        pixels: impl IntoIterator<Item = Vec<DeepSample>>,
    ) -> Self {
        let (width, height) = shadow.size();
        let all = DeepTile::from_pixels(width, pixels);
        assert_eq!(
            all.pixel_count(),
            width * height,
            "one list of samples per pixel"
        );
        Self {
            tiles: vec![all],
            tile_bits: width.max(height).next_power_of_two().trailing_zeros(),
            shadow,
        }
    }

    /// Assembles a picture from squares of `side` pixels, a power of two, row by row.
    ///
    /// `shadow` has the picture's size.
    ///
    /// # Panics
    /// When there is not one tile for each square.
    pub(crate) fn from_tiles(shadow: Image<LinearRgb>, side: usize, tiles: Vec<DeepTile>) -> Self {
        let (width, height) = shadow.size();
        assert!(side.is_power_of_two(), "tiles of {side} pixels");
        assert_eq!(
            tiles.len(),
            width.div_ceil(side) * height.div_ceil(side),
            "one tile per square"
        );
        Self {
            tiles,
            tile_bits: side.trailing_zeros(),
            shadow,
        }
    }

    /// The same picture with what each sample hides in each channel; `visible` is their mean.
    ///
    /// One per sample, in the order of the samples, pixel by pixel; empty for a picture without film.
    ///
    /// # Panics
    /// When `tints` is neither empty nor one per sample.
    pub fn with_tints(mut self, tints: Vec<LinearRgb>) -> Self {
        let count: usize = self.tiles.iter().map(|tile| tile.samples.len()).sum();
        assert!(
            tints.is_empty() || tints.len() == count,
            "one tint per sample"
        );
        for tile in &mut self.tiles {
            tile.tints.clear();
        }
        // Row by row is also the order within each tile.
        let mut tints = tints.into_iter();
        for y in 0..self.height() {
            for x in 0..self.width() {
                let (tile, range) = self.place(x, y);
                let own = tints.by_ref().take(range.len());
                self.tiles[tile].tints.extend(own);
            }
        }
        self
    }

    /// Number of columns.
    #[inline(always)]
    pub fn width(&self) -> usize {
        self.shadow.width()
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        self.shadow.height()
    }

    /// The samples of one pixel, front to back.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> &[DeepSample] {
        let (tile, range) = self.place(x, y);
        &self.tiles[tile].samples[range]
    }

    /// The pixels of a row that have samples, from left to right: their columns, and their samples,
    /// front to back.
    pub(crate) fn row(&self, y: usize) -> impl Iterator<Item = (usize, &[DeepSample])> {
        self.row_places(y)
            .map(|(x, tile, range)| (x, &tile.samples[range]))
    }

    /// The same pixels with the combined effect of all objects on each, as in [`flat`](Self::flat).
    pub(crate) fn row_films(&self, y: usize) -> impl Iterator<Item = (usize, Film)> {
        self.row_places(y).map(|(x, tile, range)| {
            let tints = tile.tints.get(range.clone()).unwrap_or_default();
            (x, flat_of(&tile.samples[range], tints))
        })
    }

    /// The same pixels: the tile of each, and the range of its samples there.
    fn row_places(&self, y: usize) -> impl Iterator<Item = (usize, &DeepTile, Range<usize>)> {
        let side = 1 << self.tile_bits;
        let across = self.width().div_ceil(side);
        let tiles = self.tiles.chunks(across).nth(y >> self.tile_bits);
        let tiles = tiles.unwrap_or_default().iter().enumerate();
        tiles.flat_map(move |(n, tile)| {
            let ranges = (n * side..).zip(tile.row(y & (side - 1)));
            ranges
                .filter(|(_, range)| !range.is_empty())
                .map(move |(x, range)| (x, tile, range))
        })
    }

    /// What each sample of a pixel hides of the light from behind, per channel, as far as the
    /// sample itself is visible; empty where no object of the picture is film: every channel is
    /// then the sample's `visible`.
    #[inline(always)]
    pub fn tints(&self, x: usize, y: usize) -> &[LinearRgb] {
        let (tile, range) = self.place(x, y);
        self.tiles[tile].tints.get(range).unwrap_or_default()
    }

    /// The samples of a pixel, and what each hides of the light from behind, per channel, as far as
    /// the sample itself is visible.
    pub(crate) fn hiding(
        &self,
        x: usize,
        y: usize,
    ) -> impl Iterator<Item = (&DeepSample, LinearRgb)> {
        let (tile, range) = self.place(x, y);
        self.tiles[tile].hiding(range)
    }

    /// The combined effect of all objects on one pixel: their light, and what they hide of the
    /// light from behind, per channel.
    #[inline(always)]
    pub fn flat(&self, x: usize, y: usize) -> Film {
        flat_of(self.at(x, y), self.tints(x, y))
    }

    /// The same for only the objects in front of the place's holdout sample.
    pub(crate) fn in_front(&self, x: usize, y: usize, place: &HoldoutSample) -> Film {
        let samples = self.at(x, y);
        let count = samples.partition_point(|s| !place.hides(s.depth.0.into()));
        let tints = self.tints(x, y);
        flat_of(&samples[..count], &tints[..count.min(tints.len())])
    }

    /// The tile of a pixel, and the range of its samples there.
    #[inline(always)]
    fn place(&self, x: usize, y: usize) -> (usize, Range<usize>) {
        let side = 1 << self.tile_bits;
        let across = (self.width() + side - 1) >> self.tile_bits;
        let tile = (y >> self.tile_bits) * across + (x >> self.tile_bits);
        let inside = self.tiles[tile].range_at(x & (side - 1), y & (side - 1));
        (tile, inside)
    }

    /// The same picture with other factors on the plate, computed from column, row and factor.
    pub(crate) fn map_shadow(
        self,
        f: impl Fn(usize, usize, LinearRgb) -> LinearRgb + Sync,
    ) -> Self {
        let (width, height) = self.shadow.size();
        let shadow = Image::from_fn(width, height, |x, y| f(x, y, self.shadow[(x, y)]));
        Self { shadow, ..self }
    }

    /// The same picture with the holdout in front: `alpha` of the objects is unchanged, less of
    /// them is visible, and the plate shows in their place, without the shadows on what the holdout
    /// hides.
    ///
    /// # Panics
    /// When the sizes differ.
    pub(crate) fn held_out(mut self, holdout: Option<&Image<HoldoutSample>>) -> Self {
        let Some(holdout) = holdout else {
            return self;
        };
        let size = self.shadow.size();
        assert_eq!(holdout.size(), size, "holdout and picture differ in size");
        for y in 0..self.height() {
            for x in 0..self.width() {
                self.hold_out_pixel(x, y, &holdout[(x, y)]);
            }
        }
        self
    }

    fn hold_out_pixel(&mut self, x: usize, y: usize, place: &HoldoutSample) {
        let passes = 1.0 - place.coverage.0;
        if passes >= 1.0 {
            return;
        }
        let free = self.flat(x, y).transmittance();
        let (tile, range) = self.place(x, y);
        let tile = &mut self.tiles[tile];
        for i in range {
            let sample = &mut tile.samples[i];
            if place.hides(sample.depth.0.into()) {
                sample.light = sample.light.scale(passes);
                sample.visible *= passes;
                let beside = [tile.tints.get_mut(i), tile.displaced.get_mut(i)];
                for value in beside.into_iter().flatten() {
                    *value = value.scale(passes);
                }
            }
        }
        // Less of the plate shows past the holdout than where it is in front of objects, and only
        // what shows past it is in shadow.
        let share = ratio(free, self.flat(x, y).transmittance());
        let shadow = &mut self.shadow[(x, y)];
        let mean = *shadow * share + share.map(|s| 1.0 - s);
        *shadow = mean
            .scale(passes)
            .add_scaled(place.coverage.0, LinearRgb::WHITE);
    }

    /// The light of one pixel over a plate, or over nothing.
    pub(crate) fn light_over(
        &self,
        x: usize,
        y: usize,
        plate: Option<&Image<LinearRgb>>,
    ) -> LinearRgb {
        let behind = plate.map_or(LinearRgb::BLACK, |plate| {
            self.shadow[(x, y)] * plate[(x, y)]
        });
        self.flat(x, y).over_color(behind)
    }

    /// The same picture with more or less light from behind some objects: `extra` gives it for an
    /// object at a column and row, attenuated by the object and all in front of it, within these
    /// columns and rows. No more is subtracted than is visible there, over this plate.
    ///
    /// The plate's part of it is recorded for [`displaced_plate`](Self::displaced_plate).
    pub(crate) fn with_light_from_behind(
        mut self,
        plate: Option<&Image<LinearRgb>>,
        [columns, rows]: [Range<usize>; 2],
        extra: impl Fn(ObjectId, usize, usize) -> Option<SeenBehind>,
    ) -> Self {
        for y in rows {
            for x in columns.clone() {
                let changed = |s: &DeepSample| extra(s.object, x, y).is_some();
                if self.at(x, y).iter().any(changed) {
                    self.add_from_behind([x, y], plate, |s| extra(s.object, x, y));
                }
            }
        }
        self
    }

    /// Adds light to the samples of a pixel, back to front: what a sample gains also counts as
    /// light behind the samples in front of it.
    fn add_from_behind(
        &mut self,
        [x, y]: [usize; 2],
        plate: Option<&Image<LinearRgb>>,
        extra: impl Fn(&DeepSample) -> Option<SeenBehind>,
    ) {
        let (all, share) = (self.light_over(x, y, plate), self.plate_share(x, y));
        let (tile, samples) = self.place(x, y);
        let tile = &mut self.tiles[tile];
        let backdrops = tile.backdrops(samples.clone(), all);
        tile.displaced.resize(tile.samples.len(), LinearRgb::BLACK);
        let mut gained = LinearRgb::BLACK;
        for (i, (behind, passes)) in samples.zip(backdrops).rev() {
            let sample = &mut tile.samples[i];
            if let Some(extra) = extra(sample) {
                let change = at_least_none(behind + gained, extra.light * passes);
                sample.light = sample.light + change;
                gained = gained + change;
                tile.displaced[i] = extra.plate * share;
            }
        }
    }

    /// The share of the plate that objects and their shadows leave at a pixel.
    fn plate_share(&self, x: usize, y: usize) -> LinearRgb {
        self.flat(x, y).transmittance() * self.shadow[(x, y)]
    }

    /// The plate as seen past the objects and through them: displaced where they bend light.
    ///
    /// Composed under [`undisplaced`](Self::undisplaced), it gives the same picture as `plate`
    /// under this one.
    pub(crate) fn displaced_plate<'a>(
        &self,
        plate: &'a Image<LinearRgb>,
    ) -> Cow<'a, Image<LinearRgb>> {
        if !self.displaces() {
            return Cow::Borrowed(plate);
        }
        let (width, height) = self.shadow.size();
        Cow::Owned(Image::from_fn(width, height, |x, y| {
            self.displaced_plate_at(x, y, plate)
        }))
    }

    /// The same for one pixel.
    pub(crate) fn displaced_plate_at(
        &self,
        x: usize,
        y: usize,
        plate: &Image<LinearRgb>,
    ) -> LinearRgb {
        let (tile, samples) = self.place(x, y);
        let displaced = self.tiles[tile].displaced.get(samples).unwrap_or_default();
        let change = displaced.iter().fold(LinearRgb::BLACK, |sum, &d| sum + d);
        if change.is_black() {
            return plate[(x, y)];
        }
        let seen = plate[(x, y)] + ratio(change, self.plate_share(x, y));
        seen.map(|v| v.max(0.0))
    }

    /// The same picture without displaced light of the plate; none where nothing is displaced.
    ///
    /// Lens and motion blur of objects are computed from this, since the plate is a photo and
    /// already has its blur.
    pub(crate) fn undisplaced(&self) -> Option<Self> {
        self.displaces().then(|| {
            let mut straight = self.clone();
            straight.tiles.iter_mut().for_each(DeepTile::take_displaced);
            straight
        })
    }

    fn displaces(&self) -> bool {
        self.tiles.iter().any(|tile| !tile.displaced.is_empty())
    }

    /// The factor on the plate, per channel.
    pub fn shadow(&self) -> &Image<LinearRgb> {
        &self.shadow
    }
}

/// The combined effect of all samples on a pixel, with their tints if any.
#[inline(always)]
fn flat_of(samples: &[DeepSample], tints: &[LinearRgb]) -> Film {
    // Rounding may push a sum of shares slightly above 1.
    let hidden = match tints {
        [] => LinearRgb::grey(samples.iter().map(|s| s.visible).sum()),
        tints => tints.iter().fold(LinearRgb::BLACK, |sum, &t| sum + t),
    };
    Film {
        color: samples
            .iter()
            .fold(LinearRgb::BLACK, |sum, s| sum + s.light),
        opacity: hidden.map(|o| o.min(1.0)),
    }
}

/// What is left per channel, at least 0.
pub(crate) fn less(all: LinearRgb, part: LinearRgb) -> LinearRgb {
    all.add_scaled(-1.0, part).map(|left| left.max(0.0))
}

/// `a / b` per channel; 0 where `b` is.
fn ratio(a: LinearRgb, b: LinearRgb) -> LinearRgb {
    a.zip_map(b, |a, b| if b > 0.0 { a / b } else { 0.0 })
}

/// A change of some light, limited so that no channel becomes negative.
fn at_least_none(light: LinearRgb, change: LinearRgb) -> LinearRgb {
    let left = (light + change).map(|left| left.max(0.0));
    left.add_scaled(-1.0, light)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [5, 3];

    /// As many samples as the pixel's number modulo three, each with its own depth.
    fn samples_of(x: usize, y: usize) -> Vec<DeepSample> {
        let number = y * SIZE[0] + x;
        let sample = |k| DeepSample {
            depth: Depth((10 * number + k) as f32),
            ..DeepSample::default()
        };
        (0..number % 3).map(sample).collect()
    }

    /// The samples of a tile, starting with those of its last pixel.
    fn tile(columns: Range<usize>, y: usize) -> DeepTile {
        let width = columns.len();
        let pixels = columns.enumerate().rev();
        let samples: Vec<_> = pixels
            .flat_map(|(i, x)| samples_of(x, y).into_iter().map(move |s| (i as u32, s)))
            .collect();
        let tints: Vec<_> = samples.iter().map(|(_, s)| tint_of(s)).collect();
        DeepTile::from_samples([width, 1], &samples, &tints)
    }

    fn tint_of(sample: &DeepSample) -> LinearRgb {
        LinearRgb::grey(sample.depth.0)
    }

    fn assert_holds_all(deep: &DeepImage) {
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let expected = samples_of(x, y);
                assert_eq!(deep.at(x, y), expected, "{x} {y}");
                let tints: Vec<_> = expected.iter().map(tint_of).collect();
                assert_eq!(deep.tints(x, y), tints, "{x} {y}");
            }
            let row: Vec<_> = deep.row(y).map(|(x, s)| (x, s.to_vec())).collect();
            let pixels = (0..SIZE[0]).map(|x| (x, samples_of(x, y)));
            let filled: Vec<_> = pixels.filter(|(_, s)| !s.is_empty()).collect();
            assert_eq!(row, filled, "{y}");
            assert!(deep.row_films(y).all(|(x, film)| film == deep.flat(x, y)));
        }
    }

    fn grey_sample(depth: f32, light: f32, alpha: f32, visible: f32) -> DeepSample {
        DeepSample {
            object: ObjectId(depth as u32),
            depth: Depth(depth),
            light: LinearRgb::grey(light),
            alpha,
            visible,
        }
    }

    #[test]
    fn a_pixel_on_the_rim_of_the_place_is_the_mean_of_both_sides() {
        let (plate, shadow, coverage) = (0.6, 0.5, 0.25);
        let front = grey_sample(1.0, 0.05, 0.5, 0.5);
        let behind = |through: f32| grey_sample(3.0, 0.1 * through, 0.8, 0.8 * through);
        let place = HoldoutSample {
            coverage: Coverage(coverage),
            depth: Depth(2.0),
        };
        let cases = [
            (vec![], plate, shadow * plate),
            (vec![behind(1.0)], plate, 0.1 + 0.2 * shadow * plate),
            (
                vec![front, behind(0.5)],
                0.05 + 0.5 * plate,
                0.05 + 0.05 + 0.1 * shadow * plate,
            ),
            (vec![grey_sample(3.0, 0.3, 1.0, 1.0)], plate, 0.3),
        ];
        for (samples, at_the_place, past_it) in cases {
            let shadow = Image::filled(1, 1, LinearRgb::grey(shadow));
            let deep = DeepImage::from_pixels(shadow, [samples]);
            let held = deep.held_out(Some(&Image::filled(1, 1, place)));
            let found = held.light_over(0, 0, Some(&Image::filled(1, 1, LinearRgb::grey(plate))));
            let expected = coverage * at_the_place + (1.0 - coverage) * past_it;
            assert!((found.g - expected).abs() < 1e-6, "{} {expected}", found.g);
        }
    }

    #[test]
    fn what_is_displaced_goes_from_the_light_to_the_plate() {
        let grey = |value: f32| Image::filled(1, 1, LinearRgb::grey(value));
        let (plate, shadow) = (grey(0.6), 0.8);
        let samples = vec![
            grey_sample(1.0, 0.05, 0.5, 0.5),
            grey_sample(3.0, 0.1, 0.4, 0.2),
        ];
        let straight = DeepImage::from_pixels(grey(shadow), [samples]);
        assert!(straight.undisplaced().is_none());
        // Seen through the first object, the plate is darker by 0.4, and everything there by 0.2.
        let change = SeenBehind {
            light: LinearRgb::grey(-0.2),
            plate: LinearRgb::grey(-0.4),
        };
        let bent = straight.with_light_from_behind(Some(&plate), [0..1, 0..1], |object, _, _| {
            (object == ObjectId(1)).then_some(change)
        });
        for (coverage, depth) in [(0.0, 0.0), (0.25, 0.5), (0.25, 2.0), (1.0, 0.5)] {
            let place = HoldoutSample {
                coverage: Coverage(coverage),
                depth: Depth(depth),
            };
            let held = bent.clone().held_out(Some(&Image::filled(1, 1, place)));
            let expected = held.light_over(0, 0, Some(&plate)).g;
            let displaced = held.displaced_plate(&plate);
            let found = held.undisplaced().unwrap();
            let found = found.light_over(0, 0, Some(&displaced)).g;
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
            let share = if coverage < 1.0 { -0.4 } else { 0.0 };
            let seen = displaced[(0, 0)].g - 0.6;
            assert!(coverage == 0.25 || (seen - share).abs() < 1e-6, "{seen}");
        }
        let own = bent.undisplaced().unwrap().at(0, 0)[0].light.g;
        let expected = 0.05 - 0.5 * 0.2 + 0.3 * shadow * 0.4;
        assert!((own - expected).abs() < 1e-6, "{own} {expected}");
    }

    #[test]
    fn tiles_hold_what_pixels_hold() {
        let white = Image::filled(SIZE[0], SIZE[1], LinearRgb::WHITE);
        let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
        let lists: Vec<_> = pixels.map(|(x, y)| samples_of(x, y)).collect();
        let tints = lists.iter().flatten().map(tint_of).collect();
        assert_holds_all(&DeepImage::from_pixels(white, lists).with_tints(tints));
    }

    #[test]
    fn tints_find_their_samples_in_any_tile() {
        // A single row, so that tiles of four pixels are as high as the picture.
        let row = Image::filled(SIZE[0], 1, LinearRgb::WHITE);
        let deep = DeepImage::from_tiles(row, 4, vec![tile(0..4, 0), tile(4..5, 0)]);
        let in_order = (0..SIZE[0]).flat_map(|x| samples_of(x, 0));
        let again = deep
            .clone()
            .with_tints(in_order.map(|s| tint_of(&s)).collect());
        for x in 0..SIZE[0] {
            assert_eq!(deep.at(x, 0), samples_of(x, 0), "{x}");
            assert_eq!(deep.tints(x, 0), again.tints(x, 0), "{x}");
        }
    }
}
