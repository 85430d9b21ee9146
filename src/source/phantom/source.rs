//! The phantom as a source: frames in order of acquisition, computed one volume at a time or all in advance.

use super::Phantom;
use crate::files::InputError;
use crate::probe::Geometry;
use crate::source::frame::{Frame, Header, Source};
use crate::source::samples::StoredType;
use std::collections::VecDeque;

/// A source that computes the phantom one volume at a time.
pub struct PhantomSource {
    phantom: Phantom,
    /// The volume that is computed next.
    next: usize,
    waiting: VecDeque<Frame>,
}

impl PhantomSource {
    pub fn new(phantom: Phantom) -> PhantomSource {
        PhantomSource { phantom, next: 0, waiting: VecDeque::new() }
    }
}

/// A source of phantom volumes that are computed once, in advance, so that no frame is ever late.
pub struct CachedPhantom {
    header: Header,
    /// By volume, in order of acquisition.
    volumes: Vec<Vec<Frame>>,
    next: (usize, usize),
}

impl CachedPhantom {
    /// Computes all volumes of the phantom. Takes one byte a sample.
    pub fn new(phantom: Phantom) -> CachedPhantom {
        let volumes = (0..phantom.volumes()).map(|v| phantom.volume(v)).collect();
        CachedPhantom { header: PhantomSource::new(phantom).header(), volumes, next: (0, 0) }
    }
}

impl Source for CachedPhantom {
    fn geometry(&self, volume: usize) -> Geometry {
        let backward = self.volumes.get(volume).and_then(|v| v.first()).is_some_and(|frame| frame.backward);
        if backward { self.header.backward.clone() } else { self.header.forward.clone() }
    }

    fn stored_type(&self) -> StoredType {
        self.header.stored
    }

    fn range(&self) -> [f64; 2] {
        self.header.range
    }

    fn volumes(&self) -> usize {
        self.volumes.len()
    }

    fn frames_per_volume(&self) -> usize {
        self.header.forward.slices()
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        self.next = (volume, 0);
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        let (volume, number) = self.next;
        let Some(frames) = self.volumes.get(volume) else { return Ok(None) };
        self.next = if number + 1 < frames.len() { (volume, number + 1) } else { (volume + 1, 0) };
        Ok(frames.get(number).cloned())
    }
}

impl Source for PhantomSource {
    fn geometry(&self, volume: usize) -> Geometry {
        Geometry::Sweep(self.phantom.probe(volume))
    }

    fn stored_type(&self) -> StoredType {
        StoredType::U8
    }

    fn range(&self) -> [f64; 2] {
        [0.0, 255.0]
    }

    fn volumes(&self) -> usize {
        self.phantom.volumes()
    }

    fn frames_per_volume(&self) -> usize {
        self.phantom.options().frames
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        self.waiting.clear();
        self.next = volume;
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        if self.waiting.is_empty() && self.next < self.volumes() {
            self.waiting = self.phantom.volume(self.next).into();
            self.next += 1;
        }
        Ok(self.waiting.pop_front())
    }
}
