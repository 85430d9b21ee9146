//! Stage 1: frames become slices of the volume. Polar frames are conditioned and scan converted, slices of a Cartesian volume scaled;
//! texels are packed with their neighbours where that makes rays faster.

use crate::passes::lookup_tables::scan_index;
use crate::passes::pass::*;
use crate::passes::slots::Format;
use crate::probe::StoredType;
use crate::scene::{Conditioning, Scene, VolumeFormat, gaussian_radius};

/// Converts each polar frame into a slice, through the look-up table (thesis 4.3, Fig. 31).
pub(crate) const SCAN_CONVERT: Pass = Pass {
    name: "scan_convert",
    shader: |_, _| "preprocess/scan_convert",
    needed: |s| s.probe().map(|_| "frames are polar").ok_or("the volume is Cartesian already"),
    reads: |s, _| {
        let frames = if s.conditions() { slices("frames", Slot::Conditioned) } else { layers("frames", Slot::Frames) };
        vec![frames, whole("scan_lut", Slot::ScanLut)]
    },
    params: scaling_params,
    tolerance: Tolerance::absolute(1e-3).because(
        "a table entry near 3640 has 2.4e-4 samples of rounding in f32, times a step of at most 1 between samples, \
         twice over two interpolations; R16F stores 1 to 4.9e-4",
    ),
    reference: |scene, args, reads, writes| {
        let Some(probe) = scene.probe() else { return };
        let frames = reads.get("frames");
        let (target, z) = target_of(writes, args);
        let (gain, offset) = scale(scene);
        for (column, row) in target.pixels() {
            let (x, y) = scene.grid.place(column as f64, row as f64);
            let Some((sample, line)) = scan_index(scene, probe, x, y) else {
                // The volume's own texels there are never written; filters must not see what an earlier frame left.
                if !args.writes_volume() {
                    target.set([column, row, z], &[0.0]);
                }
                continue;
            };
            let value = bilinear(frames, sample, line) * gain + offset;
            target.set([column, row, z], &[value.clamp(0.0, 1.0)]);
        }
    },
    ..Pass::OF_SLICES
};

/// Scan conversion for the section volume. It is done again because a filter may have overwritten the result of the first one.
pub(crate) const SECTION_SCAN_CONVERT: Pass = Pass {
    name: "section_scan_convert",
    link: Link::Filter(Filter::of(Chain::Sections)),
    needed: |s| of_sections(s, (SCAN_CONVERT.needed)(s)),
    ..SCAN_CONVERT
};

pub(crate) const SECTION_LOAD_SLICE: Pass = Pass {
    name: "section_load_slice",
    link: Link::Filter(Filter { is_identity: is_unscaled, ..Filter::of(Chain::Sections) }),
    needed: |s| of_sections(s, (LOAD_SLICE.needed)(s)),
    ..LOAD_SLICE
};

fn bilinear(frames: &Texels, sample: f64, line: f64) -> f64 {
    let (i, j) = (sample.floor() as i64, line.floor() as i64);
    let (u, v) = (sample - i as f64, line - j as f64);
    let at = |di, dj| frames.clamped(i + di, j + dj, 0);
    (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
}

/// Of what is converted: conditioned frames are scaled already.
fn scale(scene: &Scene) -> (f64, f64) {
    if scene.conditions() { (1.0, 0.0) } else { normalisation(scene) }
}

/// Conditions the lines of polar frames before scan conversion (thesis 4.3): time gain compensation, Gaussian low pass and decimation along the
/// lines, log compression. With the decimation factor M, sample j of the result is centred on sample j M of the frame.
pub(crate) const CONDITION: Pass = Pass {
    name: "condition",
    link: Link::None,
    shader: |_, _| "preprocess/condition",
    needed: |s| match s.probe() {
        None => Err("the volume is Cartesian already: it has no lines"),
        Some(_) if s.conditions() => Ok("asked for, or lines are longer than asked for"),
        Some(_) => Err("not asked for, and no line is longer than asked for"),
    },
    reads: |s, _| {
        let mut reads = vec![layers("frames", Slot::Frames)];
        reads.extend((!s.settings.conditioning.tgc.is_empty()).then_some(whole("tgc", Slot::Tgc)));
        reads
    },
    writes: |_, _| vec![slices("conditioned", Slot::Conditioned)],
    extent: |s, t| {
        let [samples, lines] = s.line_lattice();
        [samples, lines, t.slices]
    },
    params: |s, _| {
        let (gain, offset) = normalisation(s);
        let deviation = s.conditioning.deviation(s.decimation());
        let range = s.settings.conditioning.dynamic_range.unwrap_or(1.0);
        Params::default()
            .f32("gain", gain)
            .f32("offset", offset)
            .f32("narrowness", if deviation > 0.0 { 0.5 / (deviation * deviation) } else { 0.0 })
            .f32("per_octave", 20.0 * 2f64.log10() / range)
    },
    constants: |s, _| {
        let c = &s.conditioning;
        vec![
            ("RADIUS", gaussian_radius(c.deviation(s.decimation())) as i32),
            ("FACTOR", s.decimation() as i32),
            ("LOG", c.dynamic_range.is_some() as i32),
            ("GAINED", !c.tgc.is_empty() as i32),
        ]
    },
    tolerance: Tolerance::absolute(5e-5).because(
        "a positive sum in f32 is good to 2e-6 of its value, log2 to 5e-7, both 6 dB an octave over a range of at \
         least 20 dB; one level of u16 above the darkest loses 1e-4 of itself in the offset",
    ),
    reference: |scene, _, reads, writes| {
        let frames = reads.get("frames");
        let target = writes.get_mut("conditioned");
        let (c, factor) = (&scene.conditioning, scene.decimation() as usize);
        let kernel = low_pass(c.deviation(scene.decimation()));
        for y in 0..target.size[1] {
            let line: Vec<f64> = (0..frames.size[0]).map(|i| gained(scene, c, i, frames.one(i, y, 0))).collect();
            for x in 0..target.size[0] {
                // (place, weight) of the taps that lie on the line.
                let taps = kernel.iter().filter_map(|(i, w)| {
                    (x * factor).checked_add_signed(*i as isize).filter(|i| *i < line.len()).map(|i| (i, *w))
                });
                let (sum, weight) = taps.fold((0.0, 0.0), |(sum, weight), (i, w)| (sum + w * line[i], weight + w));
                target.set([x, y, 0], &[compressed(c, sum / weight)]);
            }
        }
    },
    ..Pass::OF_SLICES
};

/// A stored sample as 0..1 times, or plus, its depth's gain.
fn gained(scene: &Scene, c: &Conditioning, sample: usize, stored: f64) -> f64 {
    let (gain, offset) = normalisation(scene);
    let value = (stored * gain + offset).clamp(0.0, 1.0);
    let gain = scene.probe().map_or(0.0, |p| c.gain(p.start_depth + p.sample_pitch * sample as f64));
    match c.dynamic_range {
        Some(_) => value * 10f64.powf(gain / 20.0),
        None => value + gain / c.compressed_range,
    }
}

/// Offsets and weights of a sampled Gaussian out to three deviations.
fn low_pass(deviation: f64) -> Vec<(i64, f64)> {
    if deviation <= 0.0 {
        return vec![(0, 1.0)];
    }
    let radius = i64::from(gaussian_radius(deviation));
    (-radius..=radius).map(|i| (i, (-0.5 * (i as f64 / deviation).powi(2)).exp())).collect()
}

/// v' = clamp(1 + 20 log10(v) / DR); f64 has a logarithm of 0, and it clamps to 0.
fn compressed(c: &Conditioning, value: f64) -> f64 {
    match c.dynamic_range {
        Some(range) => (1.0 + 20.0 * value.log10() / range).clamp(0.0, 1.0),
        None => value.clamp(0.0, 1.0),
    }
}

/// Loads the slices of a Cartesian volume and scales them to 0..1.
pub(crate) const LOAD_SLICE: Pass = Pass {
    name: "load_slice",
    link: Link::Filter(Filter { copies: stores_without_loss, is_identity: is_unscaled, ..Filter::of(Chain::Slices) }),
    shader: |_, _| "preprocess/load_slice",
    needed: |s| match s.probe() {
        None => Ok("the volume is Cartesian already: its slices are only scaled"),
        Some(_) => Err("frames are polar"),
    },
    reads: |_, _| vec![layers("frames", Slot::Frames)],
    params: scaling_params,
    tolerance: Tolerance::absolute(5e-4).because("one multiplication and addition in f32; R16F stores 1 to 4.9e-4"),
    reference: |scene, args, reads, writes| {
        let frames = reads.get("frames");
        let (target, z) = target_of(writes, args);
        let (gain, offset) = normalisation(scene);
        target.fill_slices(z..z + 1, |[x, y, _]| [(frames.one(x, y, 0) * gain + offset).clamp(0.0, 1.0)]);
    },
    ..Pass::OF_SLICES
};

/// True if the volume's format holds every value that frames may hold, unscaled. On their way to the device integers become those of a wider
/// format or floats, and floats that may be beyond 0..1 are clamped. 16-bit floats hold few of the 255ths exactly.
fn stores_without_loss(scene: &Scene) -> bool {
    let format = Slot::Volume.format(scene);
    match scene.input.stored {
        StoredType::U8 => format != Format::R16f && scene.input.range == [0.0, 255.0],
        StoredType::U16 => matches!(format, Format::R16 | Format::R32f) && scene.input.range == [0.0, 65535.0],
        StoredType::F32 => format == Format::R32f && scene.input.range == [0.0, 1.0],
    }
}

/// True if a texture of the frames yields what this pass would make of them. Floats may be beyond 0..1 and are clamped.
fn is_unscaled(scene: &Scene) -> bool {
    scene.input.stored != StoredType::F32 && normalisation(scene) == (1.0, 0.0)
}

/// A Cartesian volume is never conditioned: its scale is that of the samples.
fn scaling_params(scene: &Scene, args: &DispatchArgs) -> Params {
    let (gain, offset) = scale(scene);
    Params::default().f32("gain", gain).f32("offset", offset).i32("slice", args.slice)
}

/// Stores every texel of a slice together with its neighbours one column and one row on, so that an interpolated sample takes two loads, one a slice.
/// Of bytes it has the neighbours in the next slice as well, so that one load is enough. This needs 8 bytes a texel in addition, and one more pass over
/// every new slice.
pub const PACKED_NEIGHBOURS: Pass = Pass {
    name: "packed_neighbours",
    shader: |_, _| "preprocess/packed_neighbours",
    needed: |s| match s.packs() {
        true => Ok("rays load the four neighbours of a slice at once"),
        false => Err("no ray is cast, or samples are taken in another way"),
    },
    // A slice changes with the frames that are smoothed into it, and of bytes with the next slice.
    reads: |s, _| {
        let reach = s.reach_to_frames() + u32::from(packs_two_slices(s));
        vec![Bind { part: Part::Around(reach), ..whole("volume", Slot::of_rays(s)) }]
    },
    writes: |_, _| vec![Bind { part: Part::Around(0), ..whole("packed_neighbours", Slot::PackedNeighbours) }],
    extent: |s, t| in_runs(slice_extent(s, t), 0),
    params: |_, t| Params::default().i32("slice", t.slice),
    constants: |s, _| vec![("RUN", RUN as i32), ("STORED", packed_format(s))],
    tolerance: Tolerance::exact("copies of what is stored"),
    reference: |scene, args, reads, writes| {
        let volume = reads.get("volume");
        let target = writes.get_mut("packed_neighbours");
        let [width, height, depth] = target.size;
        // Beyond the stored part of the volume its border repeats. No sample needs what is there.
        let first = Slot::PackedNeighbours.first_texel(scene).map(|n| n as usize);
        for z in args.written().filter(|z| (first[2]..first[2] + depth).contains(z)) {
            for (column, row) in pixels([width, height]) {
                let (x, y) = (column + first[0], row + first[1]);
                let (right, below) = ((x + 1).min(first[0] + width - 1), (y + 1).min(first[1] + height - 1));
                let slices = [z, (z + 1).min(first[2] + depth - 1)];
                let slices = &slices[..1 + usize::from(packs_two_slices(scene))];
                let place = [(x, y), (right, y), (x, below), (right, below)];
                let of = slices.iter().flat_map(|z| place.map(|(x, y)| volume.one(x, y, *z)));
                let packed = Texels { size: [4 * slices.len(), 1, 1], channels: 1, values: of.collect() };
                let bytes = packed.encode(Slot::Volume.format(scene));
                let words = bytes.chunks_exact(4).map(|b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
                target.set([column, row, z - first[2]], &words.collect::<Vec<_>>());
            }
        }
    },
    ..Pass::AFTER_SLICES
};

/// True if packed neighbours are those of two slices.
fn packs_two_slices(scene: &Scene) -> bool {
    packed_format(scene) == 0
}

/// STORED of packed_neighbours.comp.
fn packed_format(scene: &Scene) -> i32 {
    match scene.volume_format() {
        VolumeFormat::R8 => 0,
        VolumeFormat::R16 => 1,
        VolumeFormat::Auto | VolumeFormat::R16f | VolumeFormat::R32f => 2,
    }
}

/// The value of the constant SAMPLING of ray.glsl for rays that load packed neighbours.
pub(in crate::passes) fn packed_sampling(scene: &Scene) -> i32 {
    2 + packed_format(scene)
}

/// Gain and offset from what the frame's texture yields to 0..1.
fn normalisation(scene: &Scene) -> (f64, f64) {
    let [low, high] = scene.input.range;
    let full = match scene.input.stored {
        StoredType::U8 => 255.0,
        StoredType::U16 => 65535.0,
        StoredType::F32 => 1.0,
    };
    (full / (high - low), -low / (high - low))
}
