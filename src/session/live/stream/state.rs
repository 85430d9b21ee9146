//! What a stream says of itself: what it waits for, what it shows, and its statistics.

use super::{Stream, StreamError};
use crate::gpu::Renderer;
use crate::live::feed::FeedCounts;
use crate::live::session::Session;
use crate::live::statistics::Statistics;
use crate::live::volume_pool::{VolumeCounts, VolumePool};
use crate::scene::Scene;
use crate::source::recorder::Header;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

impl Stream {
    /// True while a volume of the cine loop is being sent to the device.
    pub fn is_replaying(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.replay.is_some())
    }

    /// True while a picture is being drawn.
    pub fn is_drawing(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.phase.is_drawing())
    }

    /// True if a step has nothing to do until the picture that is being drawn makes progress.
    pub fn is_waiting(&self) -> bool {
        let Some(session) = self.session.as_ref().filter(|session| session.phase.is_drawing()) else { return false };
        // A device that fails is reported by the step.
        let is_full = session.renderer.is_paced() && !session.renderer.takes_frame().unwrap_or(true);
        is_full || self.feed.waiting() == 0 || self.is_held()
    }

    /// True while frames may arrive: the source has not ended, and is connected.
    pub fn is_connected(&self) -> bool {
        self.end.is_none() && self.feed.disconnected().is_none()
    }

    /// The reason on one line why the source is not connected at present. None while it is connected.
    pub fn disconnected(&self) -> Option<String> {
        self.feed.disconnected()
    }

    /// True if events of the source are queued. While the picture is frozen and the cine loop is full, no step takes those of a recording.
    pub fn has_waiting(&self) -> bool {
        self.feed.waiting() > 0
    }

    /// True if a step has nothing to do until the source reports an event or a pipeline is compiled.
    pub fn is_idle(&self) -> bool {
        if let Some(is_working) = self.first_pipelines.is_working() {
            return is_working;
        }
        let is_busy = self.session.as_ref().is_some_and(Session::is_busy);
        !is_busy && !self.is_replaying() && (self.feed.waiting() == 0 || self.is_held())
    }

    /// Number of dispatches on the device so far, of all renderers and windows that share it.
    pub fn dispatches(&self) -> u64 {
        self.context.counts.dispatches.load(Ordering::Relaxed)
    }

    /// Time for which the device has been busy without finishing anything; 0 if it is idle. None before the first geometry has begun.
    pub fn device_busy_for(&self) -> Option<Duration> {
        self.session.as_ref().map(|session| session.renderer.busy_for())
    }

    /// Time at which the last picture was begun, or the geometry if it has no picture yet. None before the first geometry has begun.
    pub fn last_begun(&self) -> Option<Instant> {
        self.session.as_ref().map(|session| session.begun)
    }

    /// Statistics since the stream was created. But latencies are those since the last [`Stream::take_statistics`], and times of passes and the
    /// number of untimed ones those since the last call of either.
    pub fn statistics(&mut self) -> Result<Statistics, StreamError> {
        self.statistics.time = self.began.elapsed();
        let FeedCounts { lost, unrecorded, disconnected, .. } = self.feed_counts();
        (self.statistics.lost, self.statistics.unrecorded) = (lost, unrecorded);
        self.statistics.faults.disconnected = disconnected;
        self.statistics.passes = self.session.as_mut().map_or(Vec::new(), |session| session.renderer.times_so_far());
        self.statistics.untimed = self.session.as_mut().map_or(0, |session| session.renderer.take_untimed());
        self.statistics.volumes = self.pool().map_or(VolumeCounts::default(), VolumePool::counts);
        Ok(self.statistics.clone())
    }

    /// Statistics since the previous call.
    pub fn take_statistics(&mut self) -> Result<Statistics, StreamError> {
        let total = self.statistics()?;
        let since = total.since(&self.reported);
        self.statistics.reset_latencies();
        self.reported = total;
        Ok(since)
    }

    /// Waits for all work of the device, and returns the statistics since the last [`Stream::take_statistics`] or call of this: every pass of every
    /// frame is timed or counted as not timed.
    ///
    /// # Errors
    /// The device fails.
    pub fn take_final_statistics(&mut self) -> Result<Statistics, StreamError> {
        let passes = self.session.as_mut().map_or(Ok(Vec::new()), |session| session.renderer.take_times())?;
        let mut since = self.take_statistics()?;
        since.passes = passes;
        Ok(since)
    }

    /// The counts since the stream was created as one line, as of the last time that statistics were taken.
    pub fn totals(&self) -> String {
        self.reported.totals()
    }

    /// Number of volumes that were shown or dropped so far ([`VolumeCounts`]), which is a measure of how many have arrived. None before the first
    /// header, while the display is frozen, after the source has ended, and if the source waits for pictures.
    pub fn live_volumes(&self) -> Option<u64> {
        let is_live = !self.is_frozen && self.end.is_none() && !self.feed.can_wait();
        self.pool().filter(|_| is_live).map(|pool| pool.counts().shown + pool.counts().dropped)
    }

    /// Number of volumes of all sources that were shown so far, without those that the cine loop showed again.
    pub fn volumes_shown(&self) -> u64 {
        self.pool().map_or(0, |pool| pool.counts().shown)
    }

    pub(super) fn pool(&self) -> Option<&VolumePool> {
        self.session.as_ref().map(|session| &session.pool).or(self.previous_pool.as_ref())
    }

    /// The properties that all frames have in common; None before the first geometry has begun or was refused.
    pub fn header(&self) -> Option<&Header> {
        self.header.as_ref()
    }

    /// Number of frames that were taken from the feeds of all sources so far, without those that were ignored while frozen.
    pub fn frames(&self) -> u64 {
        self.statistics.frames
    }

    /// What the feeds of all sources lost so far.
    pub fn feed_counts(&self) -> FeedCounts {
        self.earlier_feeds.plus(self.feed.counts())
    }

    /// Time that sound needs for a volume, s. None before the first geometry has begun, and for Cartesian volumes.
    pub fn acquisition_time(&self) -> Option<f64> {
        self.session.as_ref()?.views.first().probe().map(|probe| probe.acquisition_time())
    }

    /// The scene that is drawn; None before the first geometry has begun.
    pub fn scene(&self) -> Option<&Scene> {
        self.session.as_ref().map(|session| session.renderer.scene())
    }

    /// Number of the volume that the last picture shows, even if the picture is still being drawn. None without a picture.
    pub fn drawn_volume(&self) -> Option<u32> {
        self.session.as_ref().and_then(|session| session.drawn)
    }

    /// The renderer, for reading pictures and volumes back; None before the first geometry has begun.
    pub fn renderer(&mut self) -> Option<&mut Renderer> {
        self.session.as_mut().map(|session| &mut session.renderer)
    }
}
