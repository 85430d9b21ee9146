//! The phantom as a source: frames in order of acquisition, one volume computed at a time.

use super::phantom::Phantom;
use super::{Frame, Geometry, InputError, Source, StoredType};
use std::collections::VecDeque;

pub struct Played {
    phantom: Phantom,
    /// The volume that is computed when nothing waits.
    next: usize,
    waiting: VecDeque<Frame>,
}

impl Played {
    pub fn new(phantom: Phantom) -> Played {
        Played { phantom, next: 0, waiting: VecDeque::new() }
    }
}

impl Source for Played {
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
