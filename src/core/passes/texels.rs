//! Arrays of texels for the f64 references.

use super::slots::{Format, Slot};
use crate::scene::Scene;
use half::f16;
use std::borrow::Cow;
use std::ops::Range;

/// An array of texels with `channels` values each. The values of a texel are adjacent; of texels x varies fastest, then y.
#[derive(Clone, Debug, PartialEq)]
pub struct Texels {
    pub size: [usize; 3],
    pub channels: usize,
    pub values: Vec<f64>,
}

impl Texels {
    /// An array of NaN. In the outputs of a reference, texels that stay NaN are those that the pass does not write.
    pub fn untouched(size: [usize; 3], channels: usize) -> Texels {
        Texels { size, channels, values: vec![f64::NAN; size.iter().product::<usize>() * channels] }
    }

    pub fn from_fn(size: [usize; 3], channels: usize, f: impl Fn([usize; 3], usize) -> f64) -> Texels {
        let mut values = Vec::with_capacity(size.iter().product::<usize>() * channels);
        cells(size).for_each(|at| values.extend((0..channels).map(|c| f(at, c))));
        Texels { size, channels, values }
    }

    /// The places (x, y) of one layer, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        pixels([self.size[0], self.size[1]])
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        ((z * self.size[1] + y) * self.size[0] + x) * self.channels
    }

    pub fn get(&self, at: [usize; 3]) -> &[f64] {
        let i = self.index(at);
        &self.values[i..i + self.channels]
    }

    /// Value of the first channel, as a shader reads it: 0..1 in formats of 8 and 16 bits that are no floats.
    pub fn one(&self, x: usize, y: usize, z: usize) -> f64 {
        self.values[self.index([x, y, z])]
    }

    /// Value of the first channel of the texel nearest to these indices, which may lie outside.
    pub fn clamped(&self, x: i64, y: i64, z: i64) -> f64 {
        let at = |i: i64, n: usize| i.clamp(0, n as i64 - 1) as usize;
        self.one(at(x, self.size[0]), at(y, self.size[1]), at(z, self.size[2]))
    }

    pub fn set(&mut self, at: [usize; 3], value: &[f64]) {
        let i = self.index(at);
        self.values[i..i + self.channels].copy_from_slice(value);
    }

    /// Sets each texel of a single layer to what `of` makes of its column and row.
    pub(super) fn fill<V: AsRef<[f64]>>(&mut self, mut of: impl FnMut(usize, usize) -> V) {
        self.fill_slices(0..1, |[x, y, _]| of(x, y));
    }

    /// Sets each texel of these slices to what `of` makes of its column, row and slice.
    pub(super) fn fill_slices<V: AsRef<[f64]>>(&mut self, slices: Range<usize>, mut of: impl FnMut([usize; 3]) -> V) {
        for z in slices {
            self.pixels().for_each(|(x, y)| self.set([x, y, z], of([x, y, z]).as_ref()));
        }
    }

    fn part(&self, first: [usize; 3], size: [usize; 3]) -> Texels {
        let mut part = Texels::untouched(size, self.channels);
        for (y, z) in (0..size[2]).flat_map(|z| (0..size[1]).map(move |y| (y, z))) {
            let (from, to) = (self.index([first[0], first[1] + y, first[2] + z]), part.index([0, y, z]));
            let length = size[0] * self.channels;
            part.values[to..to + length].copy_from_slice(&self.values[from..from + length]);
        }
        part
    }

    /// A single layer. An array of one layer returns that one whatever `n` is.
    pub(super) fn layer(&self, n: usize) -> Texels {
        self.part([0, 0, n.min(self.size[2] - 1)], [self.size[0], self.size[1], 1])
    }

    pub(super) fn set_layer(&mut self, n: usize, layer: &Texels) {
        self.insert([0, 0, n.min(self.size[2] - 1)], layer);
    }

    fn insert(&mut self, first: [usize; 3], part: &Texels) {
        let size = part.size;
        for (y, z) in (0..size[2]).flat_map(|z| (0..size[1]).map(move |y| (y, z))) {
            let (from, to) = (part.index([0, y, z]), self.index([first[0], first[1] + y, first[2] + z]));
            let length = size[0] * self.channels;
            self.values[to..to + length].copy_from_slice(&part.values[from..from + length]);
        }
    }

    /// The part of a slot's array ([`Slot::array_size`]) that the device stores; all of it for a slot that is no volume.
    pub fn stored_part(&self, slot: Slot, scene: &Scene) -> Texels {
        if !slot.is_volume() {
            return self.clone();
        }
        self.part(slot.first_texel(scene).map(|n| n as usize), slot.shape(scene).size())
    }

    /// The opposite of [`Texels::stored_part`]: from the stored part, the slot's whole array, in which texels that the device does not store have the
    /// value `outside`.
    pub fn with_outside(self, slot: Slot, scene: &Scene, outside: f64) -> Texels {
        if self.size == slot.array_size(scene) {
            return self;
        }
        let mut array = Texels::from_fn(slot.array_size(scene), self.channels, |_, _| outside);
        array.insert(slot.first_texel(scene).map(|n| n as usize), &self);
        array
    }

    /// First channel, interpolated linearly at fractional texel indices, whole at the centres of texels. Beyond the border the nearest texel counts.
    pub fn trilinear(&self, at: [f64; 3]) -> f64 {
        let [value] = self.mixed(at);
        value
    }

    /// Up to four channels, interpolated as [`Texels::trilinear`] does the first.
    pub fn interpolated(&self, at: [f64; 3]) -> [f64; 4] {
        self.mixed(at)
    }

    fn mixed<const N: usize>(&self, at: [f64; 3]) -> [f64; N] {
        let low = at.map(f64::floor);
        let mut sum = [0.0; N];
        for corner in 0..8 {
            let mut weight = 1.0;
            let tap = std::array::from_fn(|axis| {
                let share = at[axis] - low[axis];
                let upper = corner >> axis & 1;
                weight *= if upper == 1 { share } else { 1.0 - share };
                (low[axis] as i64 + upper).clamp(0, self.size[axis] as i64 - 1) as usize
            });
            sum.iter_mut().zip(self.get(tap)).for_each(|(sum, value)| *sum += weight * value);
        }
        sum
    }

    /// First channel at fractional texel indices: bilinear within a slice, the uniform cubic B-spline (without a prefilter) across slices, as the sum
    /// of two linear fetches (Sigg and Hadwiger 2005). Beyond the border the nearest texel counts.
    pub fn bspline_across_slices(&self, [x, y, z]: [f64; 3]) -> f64 {
        let k = z.floor();
        let t = z - k;
        let weights = [
            (1.0 - t).powi(3) / 6.0,
            (4.0 - 6.0 * t.powi(2) + 3.0 * t.powi(3)) / 6.0,
            (1.0 + 3.0 * t + 3.0 * t.powi(2) - 3.0 * t.powi(3)) / 6.0,
            t.powi(3) / 6.0,
        ];
        let pair = |first: usize| {
            let both = weights[first] + weights[first + 1];
            let between = k - 1.0 + first as f64 + weights[first + 1] / both;
            both * self.trilinear([x, y, between])
        };
        pair(0) + pair(2)
    }

    /// The bytes that a slot of this format stores. Each value is rounded as a driver does it: to nearest, ties to even. Formats of unsigned integers
    /// drop the fraction.
    pub fn encode(&self, format: Format) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.values.len() * format.channel_bytes());
        for &v in &in_order(format, &self.values)[..] {
            match format {
                Format::R8 | Format::Rgba8 | Format::Bgra8 => {
                    bytes.push((v.clamp(0.0, 1.0) * 255.0).round_ties_even() as u8)
                }
                Format::R16 | Format::Rg16 => {
                    bytes.extend(((v.clamp(0.0, 1.0) * 65535.0).round_ties_even() as u16).to_le_bytes());
                }
                Format::R16f | Format::Rg16f | Format::Rgba16f => bytes.extend(f16::from_f64(v).to_le_bytes()),
                Format::R32f | Format::Rg32f | Format::Rgba32f | Format::Floats => {
                    bytes.extend((v as f32).to_le_bytes())
                }
                Format::R32u | Format::Rg32u => bytes.extend((v as u32).to_le_bytes()),
            }
        }
        bytes
    }

    pub fn decode(size: [usize; 3], format: Format, bytes: &[u8]) -> Texels {
        let two = |b: &[u8]| [b[0], b[1]];
        let values = bytes.chunks_exact(format.channel_bytes()).map(|b| match format {
            Format::R8 | Format::Rgba8 | Format::Bgra8 => f64::from(b[0]) / 255.0,
            Format::R16 | Format::Rg16 => f64::from(u16::from_le_bytes(two(b))) / 65535.0,
            Format::R16f | Format::Rg16f | Format::Rgba16f => f64::from(f16::from_le_bytes(two(b))),
            Format::R32f | Format::Rg32f | Format::Rgba32f | Format::Floats => {
                f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            }
            Format::R32u | Format::Rg32u => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        });
        let values: Vec<f64> = values.collect();
        Texels { size, channels: format.channels(), values: in_order(format, &values).into_owned() }
    }

    /// The value that a texel of this format holds after `value` was stored in it.
    pub fn stored(format: Format, value: f64) -> f64 {
        let one = Texels { size: [1; 3], channels: format.channels(), values: vec![value; format.channels()] };
        Texels::decode([1; 3], format, &one.encode(format)).values[0]
    }

    /// The distance between neighbouring values of this format near `value`. For formats of floats it is an upper bound, at most twice the distance.
    /// For those of unsigned integers, whose values are exact, it is 0.9.
    pub fn spacing(format: Format, value: f64) -> f64 {
        match format {
            Format::R8 | Format::Rgba8 | Format::Bgra8 => 1.0 / 255.0,
            // Integers are exact; the fraction of other numbers is lost.
            Format::R32u | Format::Rg32u => 0.9,
            Format::R16 | Format::Rg16 => 1.0 / 65535.0,
            Format::R16f | Format::Rg16f | Format::Rgba16f => value.abs().max(6.2e-5) / 1024.0,
            Format::R32f | Format::Rg32f | Format::Rgba32f | Format::Floats => value.abs().max(1.2e-38) / 8_388_608.0,
        }
    }
}

/// Red, green and blue from or into the order in which the format stores them.
fn in_order(format: Format, values: &[f64]) -> Cow<'_, [f64]> {
    match format {
        Format::Bgra8 => values.chunks_exact(4).flat_map(|c| [c[2], c[1], c[0], c[3]]).collect(),
        _ => Cow::Borrowed(values),
    }
}

/// The places (x, y) of an image of this width and height, row by row.
pub(super) fn pixels<T: Copy + Default>([width, height]: [T; 2]) -> impl Iterator<Item = (T, T)>
where
    Range<T>: Iterator<Item = T>,
{
    (T::default()..height).flat_map(move |y| (T::default()..width).map(move |x| (x, y)))
}

/// The places (x, y, z) of an array of this size, in the order of its texels.
pub(super) fn cells([width, height, depth]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..depth).flat_map(move |z| pixels([width, height]).map(move |(x, y)| [x, y, z]))
}

/// The arrays of one pass by the names that its shader gives them.
#[derive(Clone, Debug, Default)]
pub struct Arrays(Vec<(&'static str, Texels)>);

impl Arrays {
    pub fn insert(&mut self, name: &'static str, texels: Texels) {
        self.0.retain(|(n, _)| *n != name);
        self.0.push((name, texels));
    }

    /// The array under this name.
    ///
    /// # Panics
    /// The pass did not declare the name: its declaration and its reference disagree.
    pub fn get(&self, name: &str) -> &Texels {
        let found = self.0.iter().find(|(n, _)| *n == name);
        &found.unwrap_or_else(|| panic!("reference reads '{name}', which its pass does not declare")).1
    }

    /// The array under this name, to be changed.
    ///
    /// # Panics
    /// The pass did not declare the name: its declaration and its reference disagree.
    pub fn get_mut(&mut self, name: &str) -> &mut Texels {
        let found = self.0.iter_mut().find(|(n, _)| *n == name);
        &mut found.unwrap_or_else(|| panic!("reference writes '{name}', which its pass does not declare")).1
    }

    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Texels)> {
        self.0.iter().map(|(n, t)| (*n, t))
    }
}
