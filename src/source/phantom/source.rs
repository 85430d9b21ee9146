//! The phantom as a source: frames in order of acquisition, computed one volume at a time or in advance.

use super::Phantom;
use crate::files::InputError;
use crate::frame::{Frame, Source, check_volume};
use crate::probe::{Geometry, StoredType};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

/// A [`Source`] that delivers the volumes of a phantom.
pub struct PhantomSource {
    phantom: Arc<Phantom>,
    /// The volumes in their order, if a thread computes them in advance.
    arriving: Option<Receiver<Vec<Frame>>>,
    /// Frames by volume, in order of acquisition: of the volumes of the thread that were asked for, or of the last one.
    volumes: BTreeMap<usize, Vec<Frame>>,
    next: (usize, usize),
}

impl PhantomSource {
    /// Computes each volume when its frames are requested, and keeps only that one.
    pub fn new(phantom: Phantom) -> PhantomSource {
        PhantomSource { phantom: Arc::new(phantom), arriving: None, volumes: BTreeMap::new(), next: (0, 0) }
    }

    /// Computes all volumes once, on a thread, ahead of requests, so that callers wait only for the first ones. They take one byte a sample.
    pub fn cached(phantom: Phantom) -> PhantomSource {
        let mut source = PhantomSource::new(phantom);
        let (send, arriving) = channel();
        let computed = source.phantom.clone();
        let compute = move || {
            // Until nobody asks any more.
            let _ = (0..computed.volumes()).try_for_each(|volume| send.send(computed.volume(volume)));
        };
        if let Err(fault) = std::thread::Builder::new().name("phantom".into()).spawn(compute) {
            tracing::debug!("the phantom is computed as it is asked for: {fault}");
        }
        source.arriving = Some(arriving);
        source
    }

    /// The frames of a volume; none beyond the last one.
    fn frames(&mut self, volume: usize) -> Option<&[Frame]> {
        if volume >= self.phantom.volumes() {
            return None;
        }
        if let Some(arriving) = &self.arriving {
            while self.volumes.len() <= volume {
                let (number, computed) = (self.volumes.len(), arriving.recv());
                // Without the thread.
                self.volumes.insert(number, computed.unwrap_or_else(|_| self.phantom.volume(number)));
            }
        } else if !self.volumes.contains_key(&volume) {
            self.volumes = BTreeMap::from([(volume, self.phantom.volume(volume))]);
        }
        self.volumes.get(&volume).map(Vec::as_slice)
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

    fn is_synthetic(&self) -> bool {
        true
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        check_volume(Path::new("phantom"), volume, self.phantom.volumes())?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Header;
    use crate::phantom::PhantomOptions;
    use crate::recorder::Writer;
    use crate::sequence::Sequence;

    fn all(source: &mut dyn Source) -> Vec<Frame> {
        std::iter::from_fn(|| source.next_frame().expect("frames")).collect()
    }

    /// Computed in advance or not: the same frames, also from a later volume on, and again.
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
        let (mut plain, mut cached) = (PhantomSource::new(phantom()), PhantomSource::cached(phantom()));
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

    /// Prevents recordings of the phantom that pass for a patient's, and bytes of other recordings that change.
    #[test]
    fn recordings_of_the_phantom_say_so() {
        let folder = crate::files::WorkFolder::new(&std::env::temp_dir(), "echolume-test-").expect("a folder");
        let [sweep, copy, frames, other] =
            ["sweep.mha", "copy.mha", "sweep.frames", "other.frames"].map(|name| folder.path().join(name));
        let options = PhantomOptions { frames: 4, lines: 8, samples: 64, ..PhantomOptions::default() };
        let phantom = Phantom::new(options).expect("options");
        phantom.write(&sweep).expect("written");
        let text = String::from_utf8_lossy(&std::fs::read(&sweep).expect("the file")).into_owned();
        assert!(text.contains("\nComment = Demo data (phantom)\n"));
        let opened = |path: &std::path::Path| crate::open(path, None).expect("a recording");
        assert!(opened(&sweep).is_synthetic());
        // Frames as they arrive, of the phantom and of what is the same but for its origin.
        let mut source = PhantomSource::new(phantom);
        let kept = all(&mut source);
        let write = |path: &std::path::Path, header: Header| {
            let mut writer = Writer::create(path, header).expect("created");
            kept.iter().for_each(|frame| writer.frame(frame, 0.0).expect("appended"));
            writer.finish().expect("finished");
        };
        write(&frames, source.header());
        write(&other, Header { synthetic: false, ..source.header() });
        assert_eq!([opened(&frames), opened(&other)].map(|source| source.is_synthetic()), [true, false]);
        assert_eq!(opened(&frames).header(), source.header());
        let same = all(&mut *opened(&frames)) == all(&mut *opened(&other));
        assert!(same, "the frames are the same");
        // And as a sequence again.
        let mut recorded = opened(&frames);
        let sequence = Sequence::of(&mut *recorded, &frames).expect("a sequence");
        sequence.write(&mut *recorded, &copy, || ()).expect("written");
        assert!(opened(&copy).is_synthetic());
        // Other comments say nothing of the kind, and may be there twice.
        let mut bytes = std::fs::read(&sweep).expect("the file");
        let at = text.find("Demo data (phantom)").expect("the comment");
        bytes.splice(at..at + 19, *b"Frame 3\nComment = x");
        std::fs::write(&copy, bytes).expect("written");
        assert!(!opened(&copy).is_synthetic());
    }
}
