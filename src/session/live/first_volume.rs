//! Settings of a stream that nobody chose, derived from its geometry and its first complete volume. They are then kept: if they followed
//! each volume, the brightness of the picture would pump.

use crate::scene::default_look::{Defaults, block_edge};
use crate::scene::load::Layers;
use crate::scene::{EchoHistogram, EchoLevels, Input};
use crate::source::Frame;
use crate::source::recorder::Header;

/// Finds the levels of echoes in the first complete volume of a stream, from which default settings are derived.
pub(super) struct FirstVolume {
    layers: Layers,
    header: Option<Header>,
    /// None when the levels are known, or not needed.
    collected: Option<Collected>,
}

/// The volume that is being collected.
struct Collected {
    histogram: EchoHistogram,
    volume: Option<u32>,
    /// By slice: it was taken.
    seen: Vec<bool>,
}

impl FirstVolume {
    pub fn new(layers: Layers) -> FirstVolume {
        FirstVolume { layers, header: None, collected: None }
    }

    /// Notes a new header. Returns what the default settings are derived from before any frame has arrived. None if the header is the previous
    /// one, whose settings stay.
    pub fn begin(&mut self, header: &Header) -> Option<Defaults> {
        let begun = self.at_begin(header)?;
        self.collected = self.layers.needs_levels().then(|| Collected::new(header));
        self.header = Some(header.clone());
        Some(begun)
    }

    /// What the default settings for this header are derived from before any frame has arrived. None if the header is the previous one. Unlike
    /// [`FirstVolume::begin`] it notes nothing.
    pub(crate) fn at_begin(&self, header: &Header) -> Option<Defaults> {
        (self.header.as_ref() != Some(header)).then(|| self.defaults(header, None))
    }

    fn defaults(&self, header: &Header, levels: Option<EchoLevels>) -> Defaults {
        Defaults { layers: self.layers.clone(), geometry: header.forward.clone(), levels }
    }

    /// Evaluates a frame. If it completes the first volume that has echoes, returns what the default settings are derived from; otherwise None.
    pub fn frame(&mut self, frame: &Frame) -> Option<Defaults> {
        let (header, collected) = (self.header.as_ref()?, self.collected.as_mut()?);
        if !collected.take(header, frame) {
            return None;
        }
        let levels = collected.histogram.levels();
        // A volume without echoes, as of a probe in air, tells nothing: the next one is tried.
        if levels.is_none() {
            self.collected = Some(Collected::new(header));
            return None;
        }
        self.collected = None;
        Some(self.defaults(self.header.as_ref()?, levels))
    }
}

impl Collected {
    fn new(header: &Header) -> Collected {
        let input = Input { stored: header.stored, range: header.range };
        Collected {
            histogram: EchoHistogram::new(&header.forward, input, block_edge(&header.forward)),
            volume: None,
            seen: vec![false; header.forward.slices()],
        }
    }

    /// Takes a frame. True if all frames of its volume were taken.
    fn take(&mut self, header: &Header, frame: &Frame) -> bool {
        if self.volume.replace(frame.volume) != Some(frame.volume) {
            // The volume before was not whole.
            *self = Collected { volume: Some(frame.volume), ..Collected::new(header) };
        }
        match self.seen.get_mut(frame.slice) {
            Some(seen) if !*seen => *seen = true,
            _ => return false,
        }
        self.histogram.take(&frame.bytes);
        self.seen.iter().all(|seen| *seen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::{Geometry, Grid};
    use crate::scene::{Mode, Settings};
    use crate::source::StoredType;

    fn header() -> Header {
        let grid = Geometry::Cartesian(Grid { origin: [0.0; 3], spacing: [1.0; 3], size: [32, 32, 2] });
        Header {
            forward: grid.clone(),
            backward: grid,
            stored: StoredType::U8,
            range: [0.0, 255.0],
            posed: false,
            synthetic: false,
        }
    }

    fn frame(volume: u32, slice: usize, tissue: u8) -> Frame {
        let bytes = (0..32 * 32).map(|n| if n % 32 < 12 { 20 } else { tissue }).collect();
        Frame::of_slice(volume, slice, bytes)
    }

    #[test]
    fn the_first_whole_volume_decides_and_no_later_one() {
        let mut first = FirstVolume::new(Layers::default());
        let settings = |found: Option<Defaults>| -> Option<Settings> { Some(found?.settings().expect("settings")) };
        let begun = settings(first.begin(&header())).expect("by geometry");
        assert_eq!(begun.mode, Mode::Volume);
        assert!(first.frame(&frame(0, 1, 240)).is_none());
        // Volume 0 lacks a slice.
        assert!(first.frame(&frame(1, 0, 120)).is_none());
        assert!(first.frame(&frame(1, 0, 120)).is_none(), "the same slice again");
        let found = settings(first.frame(&frame(1, 1, 120))).expect("whole");
        assert_ne!(found.volume.transfer, begun.volume.transfer);
        let points = crate::scene::transfer::resolved(&found.volume.transfer);
        assert!((points[points.len() - 1].at - 120.0 / 255.0).abs() < 0.01, "{points:?}");
        assert!(first.frame(&frame(2, 0, 250)).is_none());
        assert!(first.frame(&frame(2, 1, 250)).is_none(), "the picture does not pump");
        assert!(first.begin(&header()).is_none());
    }
}
