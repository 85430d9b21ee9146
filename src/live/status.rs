//! What a stream tells of itself: whether it has something to do, what it shows, and what came of everything so far.

use super::statistics::Statistics;
use super::stream::{Stream, StreamError};
use super::volume_pool::{VolumeCounts, VolumePool};
use crate::gpu::Renderer;
use crate::scene::Scene;
use crate::source::recorder::Header;
use std::sync::atomic::Ordering;
use std::time::Instant;

impl Stream {
    /// A volume of the cine loop is on its way to the device.
    pub fn is_replaying(&self) -> bool {
        self.replay.is_some()
    }

    /// A picture is on its way.
    pub fn is_drawing(&self) -> bool {
        self.now.as_ref().is_some_and(|now| now.drawing.is_some())
    }

    /// The source has said something that was not looked at.
    pub fn has_waiting(&self) -> bool {
        self.feed.waiting() > 0
    }

    /// Dispatches of the device so far, by whomever.
    pub fn dispatches(&self) -> u64 {
        self.context.counts.dispatches.load(Ordering::Relaxed)
    }

    /// When the last picture was begun.
    pub fn last_begun(&self) -> Option<Instant> {
        self.now.as_ref().map(|now| now.begun)
    }

    /// Whether there is nothing to do until something comes.
    pub fn is_idle(&self) -> bool {
        let busy = self.now.as_ref().is_some_and(|now| now.is_busy());
        !busy && self.replay.is_none() && self.feed.waiting() == 0
    }

    /// Of the whole stream; latencies and passes since they were taken last.
    pub fn statistics(&mut self) -> Result<Statistics, StreamError> {
        self.statistics.time = self.began.elapsed();
        self.statistics.lost = self.feed.lost();
        self.statistics.passes = self.now.as_mut().map_or(Vec::new(), |now| now.renderer.times_so_far());
        self.statistics.volumes = self.turns().map_or(VolumeCounts::default(), VolumePool::counts);
        Ok(self.statistics.clone())
    }

    /// What happened since this was asked last.
    pub fn take_statistics(&mut self) -> Result<Statistics, StreamError> {
        let now = self.statistics()?;
        let since = now.since(&self.taken);
        self.statistics.latency.reset();
        self.taken = now;
        Ok(since)
    }

    /// Volumes that were shown so far.
    pub fn volumes_shown(&self) -> u64 {
        self.turns().map_or(0, |turns| turns.counts().shown)
    }

    fn turns(&self) -> Option<&VolumePool> {
        self.now.as_ref().map(|now| &now.turns).or(self.before.as_ref())
    }

    /// What frames are of now; none before the first.
    pub fn header(&self) -> Option<&Header> {
        self.header.as_ref()
    }

    /// Frames that came and were looked at.
    pub fn frames(&self) -> u64 {
        self.statistics.frames
    }

    /// What could not be recorded, frames as a rule.
    pub fn unrecorded(&self) -> u64 {
        self.feed.unrecorded()
    }

    /// The time that sound needs for a volume, s; none before the first frame and of what is not swept.
    pub fn acquisition_time(&self) -> Option<f64> {
        self.now.as_ref()?.views.first().probe().map(|p| p.acquisition_time())
    }

    pub fn scene(&self) -> Option<&Scene> {
        self.now.as_ref().map(|now| now.renderer.scene())
    }

    /// For looking at what is there.
    pub fn renderer(&mut self) -> Option<&mut Renderer> {
        self.now.as_mut().map(|now| &mut now.renderer)
    }
}
