//! The phantom as a source: frames in order of acquisition, computed one volume at a time or in advance.

use super::Phantom;
use crate::files::InputError;
use crate::probe::Geometry;
use crate::source::frame::{Frame, Source};
use crate::source::samples::StoredType;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

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

/// A source of phantom volumes that are computed once, each on a thread before it is asked for: only the first ones are waited for.
pub struct CachedPhantom {
    phantom: Arc<Phantom>,
    arriving: Receiver<Vec<Frame>>,
    /// By volume, in order of acquisition: those that were asked for.
    volumes: Vec<Vec<Frame>>,
    next: (usize, usize),
}

impl CachedPhantom {
    /// Begins to compute the volumes of the phantom. They take one byte a sample.
    pub fn new(phantom: Phantom) -> CachedPhantom {
        let phantom = Arc::new(phantom);
        let (send, arriving) = channel();
        let computed = phantom.clone();
        let compute = move || {
            // Until nobody asks any more.
            let _ = (0..computed.volumes()).try_for_each(|volume| send.send(computed.volume(volume)));
        };
        if let Err(fault) = std::thread::Builder::new().name("phantom".into()).spawn(compute) {
            tracing::debug!("the phantom is computed as it is asked for: {fault}");
        }
        CachedPhantom { phantom, arriving, volumes: Vec::new(), next: (0, 0) }
    }

    /// The frames of a volume; none beyond the last one.
    fn frames(&mut self, volume: usize) -> Option<&[Frame]> {
        while self.volumes.len() <= volume.min(self.phantom.volumes() - 1) {
            let computed = self.arriving.recv();
            // Without the thread.
            self.volumes.push(computed.unwrap_or_else(|_| self.phantom.volume(self.volumes.len())));
        }
        self.volumes.get(volume).map(Vec::as_slice)
    }
}

impl Source for CachedPhantom {
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
        self.next = (volume, 0);
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        let (volume, number) = self.next;
        let Some(frames) = self.frames(volume) else { return Ok(None) };
        let (frame, count) = (frames.get(number).cloned(), frames.len());
        self.next = if number + 1 < count { (volume, number + 1) } else { (volume + 1, 0) };
        Ok(frame)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::phantom::PhantomOptions;

    fn all(source: &mut dyn Source) -> Vec<Frame> {
        std::iter::from_fn(|| source.next_frame().expect("frames")).collect()
    }

    /// Computed in advance or not: the same frames and geometry, also from a later volume on, and again.
    #[test]
    fn what_is_computed_in_advance_is_what_is_computed_when_it_is_asked_for() {
        let options = PhantomOptions {
            volumes: 4,
            both_ways: true,
            frames: 4,
            lines: 8,
            samples: 64,
            ..PhantomOptions::default()
        };
        let phantom = || Phantom::new(options.clone()).expect("phantom");
        let (mut plain, mut cached) = (PhantomSource::new(phantom()), CachedPhantom::new(phantom()));
        for volume in 0..4 {
            assert_eq!(cached.geometry(volume), plain.geometry(volume));
        }
        let header = (plain.header(), cached.header());
        assert_eq!((header.0.forward, header.0.backward), (header.1.forward, header.1.backward));
        cached.skip_to_volume(2).expect("there");
        plain.skip_to_volume(2).expect("there");
        assert!(all(&mut cached) == all(&mut plain) && cached.next_frame().expect("no fault").is_none());
        for _ in 0..2 {
            cached.skip_to_volume(0).expect("there");
            plain.skip_to_volume(0).expect("there");
            let (a, b) = (all(&mut cached), all(&mut plain));
            assert!(a == b && a.len() == 16);
        }
    }
}
