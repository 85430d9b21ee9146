//! The levels of a recording's echoes: how bright fluid and tissue are. Windows and ramps of a recording that no preset describes follow from
//! them (`default_look`).
//!
//! Speckle spreads the samples of one tissue over most of the grey scale, so that a histogram of samples shows no modes. Means over blocks of
//! about the size of the smoothing do: speckle is averaged out as the volume's own filter does it. The blocks are divided into a darker and a
//! brighter class by Otsu's threshold (Otsu 1979), which has the largest variance between the classes. In a head in fluid these are fluid
//! and tissue, in a limb soft tissue and bone.
//!
//! Everything is f64 on the CPU, summed in the order of the frames: the same samples give the same levels on every machine.

use super::Input;
use crate::probe::Geometry;

/// Bins of a histogram over 0..1.
const BINS: usize = 1024;
/// Fewest blocks that tell anything.
const FEWEST: u64 = 16;
/// Bins of the histogram of a depth.
const DEPTH_BINS: usize = 64;
/// Largest share of bright blocks in a clear layer, and least share of them in a layer that covers, and behind it.
const CLEAR: f64 = 0.1;
const COVERED: f64 = 0.5;
const BEHIND: f64 = 0.2;
/// Shares of the samples that are darker than `low`, and brighter than `high`.
const DARKEST: f64 = 0.02;
const BRIGHTEST: f64 = 0.003;

/// How dark and how bright the echoes of a volume are. All values but `start` are shares (0..1) of the samples' [`Input::range`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EchoLevels {
    /// Median of the means of the darker class of blocks (rectangles of samples of a frame): fluid, or soft tissue next to bone.
    pub dark: f64,
    /// Otsu's threshold between the darker and the brighter class of blocks.
    pub threshold: f64,
    /// Median of the means of the brighter class of blocks: tissue, or bone.
    pub bright: f64,
    /// Mean of the means of all blocks.
    pub mean: f64,
    /// The value below which two per cent of the samples lie.
    pub low: f64,
    /// The value above which three of a thousand samples lie.
    pub high: f64,
    /// Depth at which the default region of interest begins, mm below the probe's face: the middle of the first dark layer behind a bright layer next
    /// to the probe. None if there are no such layers, or nothing bright behind the dark one.
    pub start: Option<f64>,
}

/// Collects the samples of a volume, frame by frame, to find its [`EchoLevels`].
#[derive(Clone, Debug)]
pub struct EchoHistogram {
    input: Input,
    /// Samples of a line and lines, or columns and rows.
    size: [usize; 2],
    /// Samples and lines, or columns and rows, of a block.
    block: [usize; 2],
    /// Blocks of nothing but the smallest value lie outside of the sector: the frames are pictures.
    leaves_out_empty: bool,
    blocks: Vec<u64>,
    samples: Vec<u64>,
    /// By block along depth: a histogram of [`DEPTH_BINS`] bins of the blocks in the middle of the frame.
    profile: Vec<[u64; DEPTH_BINS]>,
    /// Depth of the middle of the first block, and from block to block, mm.
    depths: [f64; 2],
}

impl EchoHistogram {
    /// An empty histogram for frames of a geometry, whose samples have the type and the value range of `input`. The edges of its blocks are about
    /// `edge` mm long, and at most half a frame.
    pub fn new(geometry: &Geometry, input: Input, edge: f64) -> EchoHistogram {
        let pitch = match geometry {
            Geometry::Cartesian(grid) => [grid.spacing[0], grid.spacing[1]],
            Geometry::Sweep(probe) => {
                // Between two lines half-way along them.
                let (line, sample) = ((probe.lines.len() / 2) as f64, probe.samples as f64 / 2.0);
                let (a, b) = (probe.plane_point(sample, line), probe.plane_point(sample, line - 1.0));
                [probe.sample_pitch, (a.0 - b.0).hypot(a.1 - b.1)]
            }
        };
        let size = geometry.frame_size();
        // At most half a frame; a pitch that is not finite makes a block of one sample.
        let of = |axis: usize| ((edge / pitch[axis]).round() as usize).clamp(1, (size[axis] / 2).max(1));
        let block = [of(0), of(1)];
        let (along, first) = match geometry {
            Geometry::Cartesian(grid) => (1, grid.origin[1]),
            Geometry::Sweep(probe) => (0, probe.start_depth),
        };
        let length = block[along] as f64 * pitch[along];
        EchoHistogram {
            input,
            size,
            block,
            profile: vec![[0; DEPTH_BINS]; size[along] / block[along]],
            depths: [first + (length - pitch[along]) / 2.0, length],
            leaves_out_empty: matches!(geometry, Geometry::Cartesian(_)),
            blocks: vec![0; BINS],
            samples: vec![0; BINS],
        }
    }

    /// Adds the stored samples of a frame, block by block. Of a frame that is too short, the blocks before the first incomplete one count. Of a
    /// Cartesian volume, blocks of nothing but the lowest value do not count.
    pub fn take(&mut self, bytes: &[u8]) {
        let [low, high] = self.input.range;
        let scaled = |value: f64| ((value - low) / (high - low)).clamp(0.0, 1.0);
        let mut values = Vec::with_capacity(bytes.len() / self.input.stored.bytes());
        self.input.stored.for_each(bytes, |value| values.push(scaled(value)));
        let ([width, height], [wide, tall]) = (self.size, self.block);
        for row in (0..height - height % tall).step_by(tall) {
            for column in (0..width - width % wide).step_by(wide) {
                let rows = (row..row + tall).map(|y| y * width + column);
                let lines: Vec<&[f64]> = rows.filter_map(|from| values.get(from..from + wide)).collect();
                if lines.len() < tall {
                    return;
                }
                let all = || lines.iter().flat_map(|line| line.iter().copied());
                if self.leaves_out_empty && all().all(|v| v <= 0.0) {
                    continue;
                }
                let mean = all().sum::<f64>() / (wide * tall) as f64;
                count(&mut self.blocks, mean);
                // The middle half of the lines or columns: next to it a sector has no near field.
                let (depth, across, of) = match self.leaves_out_empty {
                    true => (row / tall, column + wide / 2, width),
                    false => (column / wide, row + tall / 2, height),
                };
                if (of / 4..=of * 3 / 4).contains(&across)
                    && let Some(bins) = self.profile.get_mut(depth)
                {
                    count(bins, mean);
                }
                all().for_each(|v| count(&mut self.samples, v));
            }
        }
    }

    /// The levels of the samples so far. None if there are fewer than 16 blocks, or if the means of all blocks differ by less than about 0.001 of the
    /// value range.
    pub fn levels(&self) -> Option<EchoLevels> {
        let all: u64 = self.blocks.iter().sum();
        if all < FEWEST {
            return None;
        }
        let split = otsu(&self.blocks)?;
        let (darker, brighter) = self.blocks.split_at(split);
        let threshold = split as f64 / BINS as f64;
        let mean = sum(&self.blocks) / all as f64;
        Some(EchoLevels {
            dark: quantile(darker, 0.5),
            threshold,
            bright: threshold + quantile(brighter, 0.5),
            mean,
            low: quantile(&self.samples, DARKEST),
            high: quantile(&self.samples, 1.0 - BRIGHTEST),
            start: self.start(threshold),
        })
    }

    /// The middle of the first clear layer that has a bright layer in front of it and something bright behind it: fluid between the wall and a
    /// face, or soft tissue between skin and bone.
    fn start(&self, threshold: f64) -> Option<f64> {
        let split = (threshold * DEPTH_BINS as f64).round() as usize;
        let share = |bins: &[u64; DEPTH_BINS]| {
            let bright: u64 = bins.iter().skip(split).sum();
            bright as f64 / bins.iter().sum::<u64>().max(1) as f64
        };
        let shares: Vec<f64> = self.profile.iter().map(share).collect();
        // Next to the probe: a layer that begins in the first quarter.
        let covered = shares.iter().take(shares.len() / 4).position(|s| *s >= COVERED)?;
        let from = covered + shares.iter().skip(covered).position(|s| *s <= CLEAR)?;
        let to = from + shares.iter().skip(from).position(|s| *s > CLEAR)?;
        shares.iter().skip(to).any(|s| *s >= BEHIND).then(|| {
            let [first, length] = self.depths;
            first + length * (from + to - 1) as f64 / 2.0
        })
    }
}

fn count(bins: &mut [u64], value: f64) {
    let bin = (value * bins.len() as f64) as usize;
    bins[bin.min(bins.len() - 1)] += 1;
}

/// The middle of a bin.
fn value_of(bin: usize) -> f64 {
    (bin as f64 + 0.5) / BINS as f64
}

fn sum(bins: &[u64]) -> f64 {
    bins.iter().enumerate().map(|(bin, n)| *n as f64 * value_of(bin)).sum()
}

/// The first bin of the brighter class. Between two modes with nothing in between, every threshold is as good: the middle one is taken. None
/// if all is in one bin.
fn otsu(bins: &[u64]) -> Option<usize> {
    let (all, total) = (bins.iter().sum::<u64>() as f64, sum(bins));
    let (mut below, mut below_total) = (0.0, 0.0);
    let (mut best, mut first, mut last) = (0.0, None, 0);
    for (bin, n) in bins.iter().enumerate().take(bins.len() - 1) {
        below += *n as f64;
        below_total += *n as f64 * value_of(bin);
        let above = all - below;
        if below == 0.0 || above == 0.0 {
            continue;
        }
        let apart = below_total / below - (total - below_total) / above;
        let between = below * above * apart * apart;
        if first.is_none() || between > best * (1.0 + 1e-12) {
            (best, first, last) = (between, Some(bin + 1), bin + 1);
        } else if *n == 0 && last == bin {
            last = bin + 1;
        }
    }
    first.map(|first| (first + last).div_ceil(2))
}

/// The value that a share of the samples of a histogram is below, linear within a bin, from the histogram's first bin on.
fn quantile(bins: &[u64], share: f64) -> f64 {
    let wanted = share * bins.iter().sum::<u64>() as f64;
    let mut before = 0.0;
    for (bin, n) in bins.iter().enumerate().filter(|(_, n)| **n > 0) {
        let n = *n as f64;
        if before + n >= wanted {
            return (bin as f64 + ((wanted - before) / n).clamp(0.0, 1.0)) / BINS as f64;
        }
        before += n;
    }
    bins.len() as f64 / BINS as f64
}
