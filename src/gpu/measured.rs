//! What was measured: a sum for every pass, and where asked for every span, the device's on the host's clock.

use super::context::Context;
use super::timing::{Stamp, signed_ticks};
use crate::passes::{PassTime, Span};
use std::sync::Arc;
use std::time::Instant;

/// Times since they were last taken.
pub struct Measured {
    times: Vec<PassTime>,
    spans: Option<Spans>,
}

struct Spans {
    context: Arc<Context>,
    list: Vec<Span>,
    began: Instant,
    /// A time stamp of the device, and the ns since the run began that it means.
    anchor: (u64, f64),
}

impl Measured {
    pub fn new(context: &Arc<Context>, spans: bool) -> Measured {
        let spans = spans.then(|| Spans {
            context: context.clone(),
            list: Vec::new(),
            began: Instant::now(),
            anchor: (0, 0.0),
        });
        Measured { times: Vec::new(), spans }
    }

    /// Does host work under a name. Without spans it is only done.
    pub fn host<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let Some(began) = self.spans.as_ref().map(|s| s.began) else { return work() };
        let begin = began.elapsed();
        let done = work();
        let (begin, end) = (begin.as_nanos() as f64, began.elapsed().as_nanos() as f64);
        self.spans.iter_mut().for_each(|s| s.list.push(Span { name, on_device: false, begin, end, invocations: None }));
        done
    }

    /// Adds what one command buffer measured.
    pub fn add(&mut self, stamps: &[Stamp], valid_bits: u32, period: f32) {
        if let (Some(spans), Some(first)) = (&mut self.spans, stamps.first()) {
            spans.set_anchor(first.from);
        }
        for stamp in stamps {
            let ns = super::timing::elapsed(stamp.from, stamp.to, valid_bits, period);
            match self.times.iter_mut().find(|t| t.name == stamp.name) {
                Some(time) => {
                    time.runs += 1;
                    time.total += ns;
                }
                None => self.times.push(PassTime { name: stamp.name, runs: 1, total: ns }),
            }
            if let Some(spans) = &mut self.spans {
                let begin = spans.on_host_clock(stamp.from, valid_bits, period);
                let (name, invocations) = (stamp.name, stamp.invocations);
                spans.list.push(Span { name, on_device: true, begin, end: begin + ns, invocations });
            }
        }
    }

    pub fn take_times(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.times)
    }

    /// By their beginning.
    pub fn take_spans(&mut self) -> Vec<Span> {
        let mut list = self.spans.as_mut().map(|s| std::mem::take(&mut s.list)).unwrap_or_default();
        list.sort_by(|a, b| a.begin.total_cmp(&b.begin));
        list
    }
}

impl Spans {
    /// Set anew for every command buffer, so that clocks that drift apart do not add up their difference. A device whose clock
    /// cannot be read is taken to have begun when the last host span ended: the submission.
    fn set_anchor(&mut self, ticks: u64) {
        let submitted = || self.list.iter().rev().find(|s| !s.on_device).map_or(0.0, |s| s.end);
        self.anchor = match self.context.device_ticks() {
            Some((now, at)) => (now, at.duration_since(self.began).as_nanos() as f64),
            None => (ticks, submitted()),
        };
    }

    fn on_host_clock(&self, ticks: u64, valid_bits: u32, period: f32) -> f64 {
        let (anchor, at) = self.anchor;
        at + signed_ticks(anchor, ticks, valid_bits) as f64 * f64::from(period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_one_pass_are_added_up() {
        let mut measured = Measured { times: Vec::new(), spans: None };
        let stamp = |name, from, to| Stamp { name, from, to, invocations: None };
        measured.add(&[stamp("a", 0, 1), stamp("b", 1, 3)], 64, 1.0);
        measured.add(&[stamp("a", 5, 8)], 64, 1.0);
        assert_eq!(measured.take_times()[0], PassTime { name: "a", runs: 2, total: 4.0 });
        assert!(measured.take_times().is_empty() && measured.take_spans().is_empty());
    }
}
