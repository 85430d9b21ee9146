//! What is in a file of frames, in words.

use super::Reader;
use crate::probe::Geometry;
use crate::source::describe::{self, number};
use crate::source::{InputError, SampleType, Source};

impl Reader {
    /// What the file is, for people to read: title and value. Goes through all frames once, since only then is it known which are whole.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn description(mut self) -> Result<Vec<(String, String)>, InputError> {
        let found = self.gone_through()?;
        let mut facts: Vec<(String, String)> = Vec::new();
        let mut say = |title: &str, value: String| facts.push((title.into(), value));
        let header = self.header();
        say("format", "frames as they arrived".into());
        say("samples", SampleType::from(header.stored).to_string());
        let ([first, second], each) = (header.forward.frame_size(), header.forward.slices());
        match header.forward {
            Geometry::Sweep(_) => say("frame", format!("{second} lines of {first} samples")),
            Geometry::Cartesian(_) => say("frame", format!("{first} x {second} pixels")),
        }
        say("frames", found.frames.to_string());
        let backward = if found.backward > 0 { format!(", {} swept backwards", found.backward) } else { String::new() };
        say("volumes", format!("{} of {each} frames, {} whole{backward}", found.volumes, found.whole));
        match &header.forward {
            Geometry::Sweep(probe) => facts.extend(describe::probe(probe)),
            Geometry::Cartesian(grid) => facts.extend(describe::grid(grid)),
        }
        let mut say = |title: &str, value: String| facts.push((title.into(), value));
        let [low, high] = self.header().range.map(number);
        say("value range", format!("{low} .. {high}"));
        if let Some([first, last]) = found.times {
            say("time stamps", format!("{} .. {} s, {} of them", number(first), number(last), found.stamped));
        }
        if let Some([first, last]) = found.arrivals {
            let rate = match last - first {
                span if span > 0.0 && span.is_finite() => {
                    let (rate, gap) = ((found.frames - 1) as f64 / span, found.gap * 1e3);
                    format!("{} frames a second, at most {} ms apart", number(rate), number(gap))
                }
                _ => "all at once".into(),
            };
            say("arrival", format!("{} .. {} s, {rate}", number(first), number(last)));
        }
        say("damaged", format!("{} frames", self.damaged()));
        say("lost", format!("{} bytes at the end", self.lost()));
        say("index", if self.rebuilt() { "missing or wrong; made anew" } else { "as it was written" }.into());
        Ok(facts)
    }

    fn gone_through(&mut self) -> Result<Found, InputError> {
        self.skip_to_volume(0)?;
        let mut found = Found::default();
        let each = self.frames_per_volume();
        let (mut volume, mut of_volume) = (None, 0);
        while let Some(frame) = self.next_frame()? {
            found.frames += 1;
            if volume.replace(frame.volume) != Some(frame.volume) {
                of_volume = 0;
                found.volumes += 1;
                found.backward += usize::from(frame.backward);
            }
            of_volume += 1;
            found.whole += usize::from(of_volume == each);
            if let Some(time) = frame.time.filter(|t| t.is_finite()) {
                found.stamped += 1;
                widen(&mut found.times, time);
            }
            let arrived = self.arrived();
            if arrived.is_finite() {
                if let Some([_, last]) = found.arrivals {
                    found.gap = found.gap.max(arrived - last);
                }
                widen(&mut found.arrivals, arrived);
            }
        }
        Ok(found)
    }
}

#[derive(Default)]
struct Found {
    frames: usize,
    volumes: usize,
    /// Volumes with as many frames as they must have.
    whole: usize,
    /// Volumes.
    backward: usize,
    stamped: usize,
    /// First and last, s.
    times: Option<[f64; 2]>,
    arrivals: Option<[f64; 2]>,
    /// Longest time between the arrival of two frames, s.
    gap: f64,
}

fn widen(span: &mut Option<[f64; 2]>, time: f64) {
    let [first, last] = span.unwrap_or([time; 2]);
    *span = Some([first.min(time), last.max(time)]);
}
