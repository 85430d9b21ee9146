//! Live streams: frames arrive on their own clock and go into volume images while the previous volume is drawn.
//!
//! One thread listens to the source ([`feed`]), another one drives the device ([`Stream::step`]). [`volume_pool`] assigns volume images,
//! `session` holds everything that depends on the geometry of the frames, `first_pipelines` what is compiled for the first one, `phase` its state, [`statistics`] the counts and latencies,
//! [`metrics`] what Prometheus is told, and [`cine`] the last volumes for looking back. After the first frame of a geometry nothing allocates, compiles or waits for the
//! whole device.

pub mod cine;
pub mod feed;
mod first_pipelines;
mod first_volume;
pub mod metrics;
mod options;
mod phase;
mod session;
pub mod statistics;
mod stream;
pub mod volume_pool;

pub use feed::Feed;
pub use options::{Lowered, StreamOptions};
pub use session::{FinishedPicture, Views};
pub use statistics::Statistics;
pub use stream::{StartStep, Step, Stream, StreamError};
pub use volume_pool::Update;
