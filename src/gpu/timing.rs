//! GPU time stamps around every pass, and the times that follow from them: a sum for every pass, and optionally every span, the
//! device's on the host's clock.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use crate::passes::{PassTime, Span};
use ash::vk;
use std::sync::Arc;
use std::time::Instant;

/// The time stamps of one command buffer.
pub struct Stamps {
    context: Arc<Context>,
    pool: vk::QueryPool,
    capacity: u32,
    /// The name of the work between stamp i and i + 1, and the query that counted its invocations.
    between: Vec<(&'static str, Option<u32>)>,
    statistics: Option<vk::QueryPool>,
    /// Number of statistics queries used.
    counted: u32,
}

/// The work between two time stamps, in ticks of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamp {
    pub name: &'static str,
    pub from: u64,
    pub to: u64,
    pub invocations: Option<u64>,
}

/// Time between two stamps, ns. The counter has `valid_bits` bits and wraps; `period` is ns per tick.
pub fn elapsed(from: u64, to: u64, valid_bits: u32, period: f32) -> f64 {
    let mask = if valid_bits >= 64 { u64::MAX } else { (1 << valid_bits) - 1 };
    (to.wrapping_sub(from) & mask) as f64 * f64::from(period)
}

/// Ticks from one stamp to another, which may be earlier: the shorter distance modulo the counter's range.
fn signed_ticks(from: u64, to: u64, valid_bits: u32) -> i64 {
    let unused = 64 - valid_bits.clamp(1, 64);
    // Moves the counter's highest bit into the sign bit of the result.
    (to.wrapping_sub(from) << unused) as i64 >> unused
}

impl Stamps {
    /// `None` if the queue has no time stamps. With `statistics`, invocations are counted too, if the device can.
    pub fn new(
        context: &Arc<Context>,
        queue: usize,
        capacity: u32,
        statistics: bool,
    ) -> Result<Option<Stamps>, GpuError> {
        let queue = context.queue(queue);
        if queue.valid_bits == 0 {
            return Ok(None);
        }
        let create = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(capacity);
        // SAFETY: the create structure is complete.
        let pool =
            unsafe { context.device.create_query_pool(&create, None) }.context(|| "create time stamps".into())?;
        context.name(pool, "time stamps");
        let mut stamps =
            Stamps { context: context.clone(), pool, capacity, between: Vec::new(), statistics: None, counted: 0 };
        if statistics && context.candidate.pipeline_statistics && queue.computes {
            let create = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::PIPELINE_STATISTICS)
                .pipeline_statistics(vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS)
                .query_count(capacity);
            // SAFETY: the create structure is complete and the feature enabled; a failure drops `stamps`, which frees its pool.
            let pool = unsafe { context.device.create_query_pool(&create, None) };
            stamps.statistics = Some(pool.context(|| "create statistics".into())?);
        }
        Ok(Some(stamps))
    }

    /// Resets all queries and writes the first stamp.
    pub(super) fn begin(&mut self, commands: vk::CommandBuffer) {
        self.between.clear();
        self.counted = 0;
        for pool in [Some(self.pool), self.statistics].into_iter().flatten() {
            // SAFETY: the device is done with this pool's last use, or the command buffer could not be recorded anew.
            unsafe { self.context.device.reset_query_pool(pool, 0, self.capacity) };
        }
        self.stamp(commands, 0);
    }

    /// Writes a stamp; the work since the last one is called `name`. Does nothing once the capacity is used up.
    pub(super) fn end_of(&mut self, commands: vk::CommandBuffer, name: &'static str) {
        let at = self.between.len() as u32 + 1;
        if at < self.capacity {
            self.between.push((name, None));
            self.stamp(commands, at);
        }
    }

    /// Records a dispatch with `record`, writes a stamp, and counts invocations if enabled.
    pub(super) fn dispatch(&mut self, commands: vk::CommandBuffer, name: &'static str, record: impl FnOnce()) {
        let pool = self.statistics.filter(|_| self.counted < self.capacity);
        let (device, query) = (&self.context.device, self.counted);
        // SAFETY: the command buffer is being recorded; the query is below the capacity, was reset, and ends below.
        pool.iter()
            .for_each(|p| unsafe { device.cmd_begin_query(commands, *p, query, vk::QueryControlFlags::empty()) });
        record();
        // SAFETY: as above.
        pool.iter().for_each(|p| unsafe { device.cmd_end_query(commands, *p, query) });
        self.counted += u32::from(pool.is_some());
        self.end_of(commands, name);
        if let (Some(_), Some(last)) = (pool, self.between.last_mut()) {
            last.1 = Some(query);
        }
    }

    fn stamp(&self, commands: vk::CommandBuffer, at: u32) {
        let device = &self.context.device;
        // SAFETY: the command buffer is being recorded and the query is below the capacity.
        unsafe { device.cmd_write_timestamp2(commands, vk::PipelineStageFlags2::ALL_COMMANDS, self.pool, at) };
    }

    /// Number of pieces of work that were stamped.
    pub(super) fn count(&self) -> u64 {
        self.between.len() as u64
    }

    /// The measured work. The device must be done with the command buffer.
    pub fn read(&self) -> Result<Vec<Stamp>, GpuError> {
        let ticks = self.results(self.pool, self.between.len() as u32 + 1)?;
        let counts = match self.statistics {
            Some(pool) => self.results(pool, self.counted)?,
            None => Vec::new(),
        };
        let pairs = self.between.iter().zip(ticks.windows(2));
        Ok(pairs
            .map(|((name, query), w)| {
                let invocations = query.and_then(|q| counts.get(q as usize).copied());
                Stamp { name, from: w[0], to: w[1], invocations }
            })
            .collect())
    }

    fn results(&self, pool: vk::QueryPool, count: u32) -> Result<Vec<u64>, GpuError> {
        let mut results = vec![0u64; count as usize];
        if self.between.is_empty() || count == 0 {
            return Ok(Vec::new());
        }
        // SAFETY: the pool is alive; every query read was written by the command buffer that has finished.
        unsafe { self.context.device.get_query_pool_results(pool, 0, &mut results, vk::QueryResultFlags::TYPE_64) }
            .context(|| "read time stamps".into())?;
        Ok(results)
    }
}

impl Drop for Stamps {
    fn drop(&mut self) {
        if self.context.is_given_up() {
            return;
        }
        for pool in [Some(self.pool), self.statistics].into_iter().flatten() {
            // SAFETY: whoever drops the stamps has waited for the device.
            unsafe { self.context.device.destroy_query_pool(pool, None) };
        }
    }
}

/// Times measured since they were last taken.
pub struct Timings {
    times: Vec<PassTime>,
    /// Passes and copies that could not be timed.
    untimed: u64,
    spans: Option<SpanLog>,
}

struct SpanLog {
    context: Arc<Context>,
    list: Vec<Span>,
    began: Instant,
    /// A time stamp of the device, and the corresponding host time in ns since the run began.
    anchor: (u64, f64),
}

impl Timings {
    pub fn new(context: &Arc<Context>, spans: bool) -> Timings {
        let spans = spans.then(|| SpanLog {
            context: context.clone(),
            list: Vec::new(),
            began: Instant::now(),
            anchor: (0, 0.0),
        });
        Timings { times: Vec::new(), untimed: 0, spans }
    }

    /// Runs host work, and records its span if spans are enabled.
    pub fn host<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let Some(began) = self.spans.as_ref().map(|s| s.began) else { return work() };
        let begin = began.elapsed();
        let done = work();
        let (begin, end) = (begin.as_nanos() as f64, began.elapsed().as_nanos() as f64);
        self.spans.iter_mut().for_each(|s| s.list.push(Span { name, on_device: false, begin, end, invocations: None }));
        done
    }

    /// Adds the stamps of one command buffer.
    pub fn add(&mut self, stamps: &[Stamp], valid_bits: u32, period: f32) {
        if let (Some(spans), Some(first)) = (&mut self.spans, stamps.first()) {
            spans.set_anchor(first.from);
        }
        for stamp in stamps {
            let ns = elapsed(stamp.from, stamp.to, valid_bits, period);
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

    /// Counts work that cannot be timed.
    pub fn leave_out(&mut self, count: u64) {
        self.untimed += count;
    }

    /// Number of passes and copies since the last call that could not be timed.
    pub fn take_untimed(&mut self) -> u64 {
        std::mem::take(&mut self.untimed)
    }

    pub fn take_times(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.times)
    }

    /// All spans since the last call, sorted by their beginning.
    pub fn take_spans(&mut self) -> Vec<Span> {
        let mut list = self.spans.as_mut().map(|s| std::mem::take(&mut s.list)).unwrap_or_default();
        list.sort_by(|a, b| a.begin.total_cmp(&b.begin));
        list
    }
}

impl SpanLog {
    /// Relates the device's clock to the host's. This is repeated for every command buffer, so that drift does not accumulate. If the
    /// device's clock cannot be read, its work is assumed to begin at the end of the last host span, the submission.
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
    fn a_36_bit_counter_may_wrap() {
        let top = (1u64 << 36) - 1;
        assert_eq!(elapsed(top - 9, 10, 36, 1.0), 20.0);
        // Bits above the valid ones are undefined.
        assert_eq!(elapsed((7 << 36) | 5, (3 << 36) | 25, 36, 1.0), 20.0);
    }

    #[test]
    fn ticks_are_scaled_by_their_period() {
        assert_eq!(elapsed(100, 300, 64, 52.08), f64::from(52.08f32) * 200.0);
        assert_eq!(elapsed(u64::MAX, 1, 64, 1.0), 2.0);
    }

    #[test]
    fn signed_ticks_of_an_earlier_stamp_are_negative() {
        assert_eq!(signed_ticks(100, 90, 64), -10);
        assert_eq!(signed_ticks(5, (1 << 36) - 5, 36), -10);
        assert_eq!(signed_ticks((1 << 36) - 5, (9 << 36) | 5, 36), 10);
    }

    #[test]
    fn runs_of_one_pass_are_added_up() {
        let mut timings = Timings { times: Vec::new(), untimed: 0, spans: None };
        let stamp = |name, from, to| Stamp { name, from, to, invocations: None };
        timings.add(&[stamp("a", 0, 1), stamp("b", 1, 3)], 64, 1.0);
        timings.add(&[stamp("a", 5, 8)], 64, 1.0);
        assert_eq!(timings.take_times()[0], PassTime { name: "a", runs: 2, total: 4.0 });
        assert!(timings.take_times().is_empty() && timings.take_spans().is_empty());
    }
}
