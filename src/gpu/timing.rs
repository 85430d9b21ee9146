//! Time stamps around every pass, and what is known when a device has none.

use super::GpuError;
use super::context::Context;
use super::error::Doing;
use crate::passes::PassTime;
use ash::vk;
use std::sync::Arc;

/// One pool of stamps, for one command buffer.
pub struct Stamps {
    context: Arc<Context>,
    pool: vk::QueryPool,
    capacity: u32,
    /// What lies between stamp i and i + 1.
    between: Vec<&'static str>,
}

/// Time from one stamp to the next in ns; the counter has `valid_bits` bits and wraps.
pub fn elapsed(from: u64, to: u64, valid_bits: u32, period: f32) -> f64 {
    let mask = if valid_bits >= 64 { u64::MAX } else { (1 << valid_bits) - 1 };
    (to.wrapping_sub(from) & mask) as f64 * f64::from(period)
}

impl Stamps {
    /// None where the device's queue has no time stamps.
    pub fn new(context: &Arc<Context>, capacity: u32) -> Result<Option<Stamps>, GpuError> {
        if context.candidate.valid_bits == 0 {
            return Ok(None);
        }
        let create = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(capacity);
        // SAFETY: the create structure is complete.
        let pool = unsafe { context.device.create_query_pool(&create, None) }.doing(|| "create time stamps".into())?;
        context.name(pool, "time stamps");
        Ok(Some(Stamps { context: context.clone(), pool, capacity, between: Vec::new() }))
    }

    /// Starts anew: the first stamp.
    pub(super) fn begin(&mut self, commands: vk::CommandBuffer) {
        self.between.clear();
        // SAFETY: the device is done with this pool's last use, or the command buffer could not be recorded anew.
        unsafe { self.context.device.reset_query_pool(self.pool, 0, self.capacity) };
        self.stamp(commands, 0);
    }

    /// What was recorded since the last stamp is called `name`. Beyond the capacity nothing is stamped.
    pub(super) fn end_of(&mut self, commands: vk::CommandBuffer, name: &'static str) {
        let at = self.between.len() as u32 + 1;
        if at < self.capacity {
            self.between.push(name);
            self.stamp(commands, at);
        }
    }

    fn stamp(&self, commands: vk::CommandBuffer, at: u32) {
        let device = &self.context.device;
        // SAFETY: the command buffer is being recorded and the query is below the capacity.
        unsafe { device.cmd_write_timestamp2(commands, vk::PipelineStageFlags2::ALL_COMMANDS, self.pool, at) };
    }

    /// Names and times in ns, once the device is done.
    pub fn read(&self) -> Result<Vec<(&'static str, f64)>, GpuError> {
        let mut stamps = vec![0u64; self.between.len() + 1];
        if self.between.is_empty() {
            return Ok(Vec::new());
        }
        // SAFETY: the pool is alive; every query read was written by the command buffer that has finished.
        unsafe { self.context.device.get_query_pool_results(self.pool, 0, &mut stamps, vk::QueryResultFlags::TYPE_64) }
            .doing(|| "read time stamps".into())?;
        let (bits, period) = (self.context.candidate.valid_bits, self.context.limits.timestamp_period);
        let times = stamps.windows(2).map(|w| elapsed(w[0], w[1], bits, period));
        Ok(self.between.iter().copied().zip(times).collect())
    }
}

impl Drop for Stamps {
    fn drop(&mut self) {
        // SAFETY: whoever drops the stamps has waited for the device.
        unsafe { self.context.device.destroy_query_pool(self.pool, None) };
    }
}

/// Adds what one command buffer measured.
pub fn add(times: &mut Vec<PassTime>, measured: &[(&'static str, f64)]) {
    for &(name, ns) in measured {
        match times.iter_mut().find(|t| t.name == name) {
            Some(time) => {
                time.runs += 1;
                time.total += ns;
            }
            None => times.push(PassTime { name, runs: 1, total: ns }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_of_36_bits_that_wraps_still_runs_forwards() {
        let top = (1u64 << 36) - 1;
        assert_eq!(elapsed(top - 9, 10, 36, 1.0), 20.0);
        // Bits above the valid ones are undefined.
        assert_eq!(elapsed((7 << 36) | 5, (3 << 36) | 25, 36, 1.0), 20.0);
    }

    #[test]
    fn a_period_other_than_one_nanosecond_is_counted() {
        assert_eq!(elapsed(100, 300, 64, 52.08), f64::from(52.08f32) * 200.0);
        assert_eq!(elapsed(u64::MAX, 1, 64, 1.0), 2.0);
    }

    #[test]
    fn runs_of_one_pass_are_added_up() {
        let mut times = Vec::new();
        add(&mut times, &[("a", 1.0), ("b", 2.0)]);
        add(&mut times, &[("a", 3.0)]);
        assert_eq!(times[0], PassTime { name: "a", runs: 2, total: 4.0 });
    }
}
