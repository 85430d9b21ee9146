//! GPU time stamps around every pass, and the times computed from them: a sum for every pass, and optionally every span. Spans of the
//! device are converted to the host's clock.

use super::bands::{self, Work};
use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::machine::CpuTime;
use crate::passes::{PassTime, Span};
use ash::vk;
use std::sync::Arc;
use std::time::Instant;

/// Which operations are timed on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimeStamps {
    /// Nothing.
    None,
    /// Each submission as a whole: a picture, the conversion of a frame, its copy. A command buffer has two stamps, which wait for nothing,
    /// so that passes overlap as they do without stamps.
    #[default]
    Ends,
    /// Each pass. An execution barrier at every stamp keeps passes from overlapping. So the time of a pass is its own, and the sum of the
    /// times exceeds the time of a picture without these stamps.
    EachPass,
}

/// The time stamp queries of one recording, which may be several command buffers.
pub(crate) struct Stamps {
    context: Arc<Context>,
    pool: vk::QueryPool,
    capacity: u32,
    /// Number of time stamps written.
    written: u32,
    /// The stamp that the next interval begins with.
    since: Option<u32>,
    intervals: Vec<Interval>,
    /// Number of runs that were not stamped, because the capacity was used up.
    pub(super) left_out: u64,
    statistics: Option<vk::QueryPool>,
    /// Number of statistics queries used.
    counted: u32,
}

/// The work between two time stamps.
struct Interval {
    name: &'static str,
    stamps: [u32; 2],
    /// The query that counted its invocations.
    counted: Option<u32>,
    work: Vec<Work>,
    /// How many runs it counts as: none if it goes on in the next submission.
    runs: u32,
}

/// The time stamps before and after some work, in ticks of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamp {
    pub name: &'static str,
    pub from: u64,
    pub to: u64,
    /// Shader invocations of the work; None if they were not counted.
    pub invocations: Option<u64>,
    /// Number of runs that the work counts as: one for each frame of a batch, 0 if the work goes on in the next submission.
    pub runs: u32,
}

/// Time between two time stamps, ns. `valid_bits`: number of bits of the counter, which wraps around; `period`: ns per tick.
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
    /// Makes the queries for `capacity` stamps. `None` if the queue has no time stamps. With `statistics`, invocations are counted too, if the device
    /// can.
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
        let pool_of = |create: vk::QueryPoolCreateInfo, operation: &str| {
            let create = create.query_count(capacity);
            // SAFETY: the create structure is complete, and what it needs is enabled.
            let pool = unsafe { context.device.create_query_pool(&create, None) }.context(|| operation.into())?;
            // SAFETY: the pool was just made, with so many queries.
            unsafe { context.device.reset_query_pool(pool, 0, capacity) };
            Ok(pool)
        };
        let create = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP);
        let pool = pool_of(create, "create time stamps")?;
        context.name(pool, "time stamps");
        let mut stamps = Stamps {
            context: context.clone(),
            pool,
            capacity,
            written: 0,
            since: None,
            intervals: Vec::new(),
            left_out: 0,
            statistics: None,
            counted: 0,
        };
        if statistics && context.candidate.pipeline_statistics && queue.computes {
            let create = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::PIPELINE_STATISTICS)
                .pipeline_statistics(vk::QueryPipelineStatisticFlags::COMPUTE_SHADER_INVOCATIONS);
            // A failure drops `stamps`, which frees its pool.
            stamps.statistics = Some(pool_of(create, "create statistics")?);
        }
        Ok(Some(stamps))
    }

    /// Begins a recording: resets the queries that the last one used.
    pub(super) fn begin(&mut self) {
        for (pool, used) in [(Some(self.pool), self.written), (self.statistics, self.counted)] {
            if let (Some(pool), 1..) = (pool, used) {
                // SAFETY: the device is done with this pool's last use, or the command buffer could not be recorded anew.
                unsafe { self.context.device.reset_query_pool(pool, 0, used) };
            }
        }
        self.intervals.clear();
        (self.written, self.counted, self.left_out, self.since) = (0, 0, 0, None);
    }

    /// Writes the stamp at which the next interval begins.
    pub(super) fn start(&mut self, commands: vk::CommandBuffer) {
        self.since = self.stamp(commands);
    }

    /// Writes the stamp at which an interval ends: the work since the last stamp is called `name` and counts as `runs` runs. Once the capacity is
    /// used up, runs are only counted. `work`: dispatches whose expected times the measured time will update.
    pub(super) fn end_of(&mut self, commands: vk::CommandBuffer, name: &'static str, runs: u32, work: Vec<Work>) {
        let from = self.since;
        self.since = self.stamp(commands);
        match (from, self.since) {
            (Some(from), Some(to)) => {
                self.intervals.push(Interval { name, stamps: [from, to], counted: None, work, runs });
            }
            _ => self.left_out += u64::from(runs),
        }
    }

    /// Notes that the work of the last interval goes on in the next submission.
    pub(super) fn continues(&mut self) {
        self.intervals.last_mut().into_iter().for_each(|last| last.runs = 0);
    }

    /// Records a dispatch with `record`, writes a stamp, and counts invocations if enabled.
    pub(super) fn dispatch(
        &mut self,
        commands: vk::CommandBuffer,
        name: &'static str,
        runs: u32,
        work: Vec<Work>,
        record: impl FnOnce(),
    ) {
        let pool = self.statistics.filter(|_| self.counted < self.capacity);
        let (device, query) = (&self.context.device, self.counted);
        // SAFETY: the command buffer is being recorded; the query is below the capacity, was reset, and ends below.
        pool.iter()
            .for_each(|p| unsafe { device.cmd_begin_query(commands, *p, query, vk::QueryControlFlags::empty()) });
        record();
        // SAFETY: as above.
        pool.iter().for_each(|p| unsafe { device.cmd_end_query(commands, *p, query) });
        self.counted += u32::from(pool.is_some());
        let before = self.intervals.len();
        self.end_of(commands, name, runs, work);
        if let (Some(_), Some(last)) = (pool, self.intervals.get_mut(before)) {
            last.counted = Some(query);
        }
    }

    fn stamp(&mut self, commands: vk::CommandBuffer) -> Option<u32> {
        let at = self.written;
        if at >= self.capacity {
            return None;
        }
        let device = &self.context.device;
        // SAFETY: the command buffer is being recorded and the query is below the capacity.
        unsafe { device.cmd_write_timestamp2(commands, vk::PipelineStageFlags2::ALL_COMMANDS, self.pool, at) };
        self.written += 1;
        Some(at)
    }

    /// Number of runs that were stamped, or would have been if there had been room.
    pub(super) fn count(&self) -> u64 {
        self.intervals.iter().map(|interval| u64::from(interval.runs)).sum::<u64>() + self.left_out
    }

    /// Reads the stamps, one entry for each interval, and updates the expected times of its dispatches. The device must have finished the recording.
    ///
    /// # Errors
    /// The device fails.
    pub fn read(&self, valid_bits: u32, period: f32) -> Result<Vec<Stamp>, GpuError> {
        let ticks = self.results(self.pool, self.written)?;
        let counts = match self.statistics {
            Some(pool) => self.results(pool, self.counted)?,
            None => Vec::new(),
        };
        let stamp = |interval: &Interval| {
            let [from, to] = interval.stamps.map(|at| ticks.get(at as usize).copied().unwrap_or(0));
            bands::measured(&interval.work, elapsed(from, to, valid_bits, period));
            let invocations = interval.counted.and_then(|q| counts.get(q as usize).copied());
            Stamp { name: interval.name, from, to, invocations, runs: interval.runs }
        };
        Ok(self.intervals.iter().map(stamp).collect())
    }

    fn results(&self, pool: vk::QueryPool, count: u32) -> Result<Vec<u64>, GpuError> {
        let mut results = vec![0u64; count as usize];
        if results.is_empty() {
            return Ok(results);
        }
        // SAFETY: the pool is alive; every query read was written by the command buffer that has finished.
        unsafe { self.context.device.get_query_pool_results(pool, 0, &mut results, vk::QueryResultFlags::TYPE_64) }
            .context(|| "read time stamps".into())?;
        Ok(results)
    }
}

impl Drop for Stamps {
    fn drop(&mut self) {
        // SAFETY: whoever drops the stamps has waited for the device; a null handle is allowed.
        self.context.destroy(|device| unsafe {
            device.destroy_query_pool(self.pool, None);
            device.destroy_query_pool(self.statistics.unwrap_or_default(), None);
        });
    }
}

/// Times of passes, spans and CPU times that were measured since they were last taken.
pub(crate) struct Timings {
    times: Vec<PassTime>,
    /// Passes and copies that could not be timed, since this was last taken.
    pub untimed: u64,
    spans: Option<SpanLog>,
    pub cpu: Option<CpuLog>,
}

/// CPU time of each pass since it was last taken, ns.
pub(crate) struct CpuLog {
    since: CpuTime,
    passes: Vec<(&'static str, f64)>,
}

struct SpanLog {
    context: Arc<Context>,
    list: Vec<Span>,
    began: Instant,
    /// The host's monotonic clock when the run began, ns; `None` if the device's driver does not read that clock.
    monotonic: Option<u64>,
    /// A time stamp of the device, and the corresponding host time in ns since the run began.
    anchor: (u64, f64),
    /// The largest error of an anchor, ns; `None` before the first, and if the device's clock cannot be read.
    deviation: Option<u64>,
}

impl Timings {
    pub fn new(context: &Arc<Context>, spans: bool) -> Timings {
        let spans = spans.then(|| {
            let (began, monotonic) = context.clocks_now();
            SpanLog { context: context.clone(), list: Vec::new(), began, monotonic, anchor: (0, 0.0), deviation: None }
        });
        Timings { times: Vec::new(), untimed: 0, spans, cpu: None }
    }

    /// Counts CPU time too, if the system reports it.
    pub(crate) fn start_cpu(&mut self) {
        self.cpu = CpuTime::now().map(|since| CpuLog { since, passes: Vec::new() });
    }

    /// Assigns the CPU time of all threads since the last call to this pass; with None, to no pass.
    pub fn cpu_of(&mut self, pass: Option<&'static str>) {
        let Some(log) = &mut self.cpu else { return };
        let Some(now) = CpuTime::now() else { return };
        log.passes.extend(pass.map(|name| (name, now.since(&log.since))));
        log.since = now;
    }

    /// The CPU times since the last call, ns, one entry for each run.
    pub(crate) fn take_cpu(&mut self) -> Vec<(&'static str, f64)> {
        self.cpu.as_mut().map(|log| std::mem::take(&mut log.passes)).unwrap_or_default()
    }

    /// Largest error of the position of device times on the host's clock, ns. `None` without spans, before the first device span, and if the device's
    /// clock cannot be read.
    pub fn clock_deviation(&self) -> Option<u64> {
        self.spans.as_ref()?.deviation
    }

    /// Time since the run began, ns; `None` without spans.
    pub(super) fn since_began(&self) -> Option<f64> {
        self.spans.as_ref().map(|spans| spans.began.elapsed().as_nanos() as f64)
    }

    /// Records the span of host work from `begin` (as of [`Timings::since_began`]) until now, if spans are enabled.
    pub(super) fn add_host(&mut self, name: &'static str, begin: Option<f64>) {
        if let (Some(begin), Some(end), Some(spans)) = (begin, self.since_began(), &mut self.spans) {
            spans.list.push(Span { name, on_device: false, begin, end, runs: 1, invocations: None });
        }
    }

    /// Adds up the times between the stamps of one recording, by name, and their spans if those are kept. `period`: ns per tick.
    pub fn add(&mut self, stamps: &[Stamp], valid_bits: u32, period: f32) {
        if let (Some(spans), Some(first)) = (&mut self.spans, stamps.first()) {
            spans.set_anchor(first.from);
        }
        for stamp in stamps {
            let ns = elapsed(stamp.from, stamp.to, valid_bits, period);
            PassTime { name: stamp.name, runs: stamp.runs, total: ns }.add_to(&mut self.times);
            if let Some(spans) = &mut self.spans {
                let begin = spans.on_host_clock(stamp.from, valid_bits, period);
                let Stamp { name, runs, invocations, .. } = *stamp;
                spans.list.push(Span { name, on_device: true, begin, end: begin + ns, runs, invocations });
            }
        }
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
            Some(read) => {
                self.deviation = self.deviation.max(Some(read.deviation));
                let since = match (read.monotonic, self.monotonic) {
                    (Some(now), Some(began)) => now as f64 - began as f64,
                    _ => read.at.duration_since(self.began).as_nanos() as f64,
                };
                (read.ticks, since)
            }
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
        let mut timings = Timings { times: Vec::new(), untimed: 0, spans: None, cpu: None };
        let stamp = |name, from, to| Stamp { name, from, to, invocations: None, runs: 1 };
        timings.add(&[stamp("a", 0, 1), stamp("b", 1, 3)], 64, 1.0);
        timings.add(&[stamp("a", 5, 8)], 64, 1.0);
        assert_eq!(timings.take_times()[0], PassTime { name: "a", runs: 2, total: 4.0 });
        assert!(timings.take_times().is_empty() && timings.take_spans().is_empty());
        let part = Stamp { runs: 0, ..stamp("a", 0, 5) };
        timings.add(&[part, stamp("a", 6, 8)], 64, 1.0);
        assert_eq!(timings.take_times(), [PassTime { name: "a", runs: 1, total: 7.0 }], "one run in two submissions");
        timings.add(&[Stamp { runs: 4, ..stamp("a", 0, 8) }], 64, 1.0);
        assert_eq!(timings.take_times(), [PassTime { name: "a", runs: 4, total: 8.0 }], "four frames at once");
    }
}
