//! A source with random behaviour.

use super::*;
use crate::common::gpu::{Noise, linear};
use crate::common::wait;
use echolume::low_level::probe::Geometry;
use echolume::low_level::source::recorder::Header;
use std::collections::VecDeque;

/// Volumes of a body, sometimes of another probe, with missing or wrong frames; it ends after some.
pub struct Wild {
    noise: Noise,
    said: VecDeque<Event>,
    volume: u32,
    last: u32,
    is_other: bool,
    calm: Arc<AtomicBool>,
}

impl Wild {
    /// It ends at once if `calm` is set.
    pub fn new(seed: u64, calm: Arc<AtomicBool>) -> Wild {
        let mut noise = Noise(seed);
        let last = noise.range(2.0, 60.0) as u32;
        let said = VecDeque::from([Event::Begin(Box::new(header(0.3)))]);
        Wild { noise, said, volume: 0, last, is_other: false, calm }
    }

    fn more(&mut self) {
        if self.noise.next() < 0.06 {
            self.is_other = !self.is_other;
            let geometry = Geometry::Sweep(linear());
            let other = Header { forward: geometry.clone(), backward: geometry, ..header(0.0) };
            self.said.push_back(Event::Begin(Box::new(if self.is_other { other } else { header(0.3) })));
        }
        let mut frames = body(self.volume);
        if self.is_other {
            frames.retain(|frame| frame.slice < 7);
            frames.iter_mut().for_each(|frame| frame.bytes.truncate(48 * 20));
        }
        self.volume += 1;
        for mut frame in frames {
            let whole = frame.bytes.len();
            match (self.noise.next() * 200.0) as u32 {
                0 => frame.bytes.truncate(7),
                1 => frame.slice = usize::MAX,
                2 => continue,
                3 => self.said.push_back(Event::Fault("the cable is bent".into())),
                4 => self.said.push_back(Event::Frame(frame.clone())),
                5 => {
                    // In two parts of lines.
                    let line = if self.is_other { 48 } else { 64 };
                    let rest = frame.bytes.split_off(whole / line / 2 * line);
                    self.said.push_back(Event::Lines { frame: frame.clone(), first: 0 });
                    let first = whole / line / 2;
                    self.said.push_back(Event::Lines { frame: Frame { bytes: rest, ..frame }, first });
                    continue;
                }
                _ => {}
            }
            self.said.push_back(Event::Frame(frame));
        }
    }
}

impl Live for Wild {
    fn next(&mut self, _: Duration) -> Event {
        if self.calm.load(Ordering::Relaxed) {
            return Event::End(None);
        }
        if self.said.is_empty() {
            if self.volume == self.last {
                return Event::End((self.noise.next() < 0.5).then(|| "cut".into()));
            }
            self.more();
        }
        wait::pace(Duration::from_millis(1));
        self.said.pop_front().unwrap_or(Event::Idle)
    }

    fn can_wait(&self) -> bool {
        self.last.is_multiple_of(2)
    }
}
