//! Live streams: frames arrive at times of their own and go into volume images while the previous volume is drawn.
//!
//! One thread reads the source ([`feed`]), another one drives the device ([`Stream::step`]). [`volume_pool`] assigns volume images.
//! `session` holds everything that depends on the geometry of the frames, `first_pipelines` compiles the pipelines of the first geometry,
//! and `phase` is the state of the stream. [`statistics`] has the counts and latencies, [`metrics`] writes them for Prometheus, and
//! [`cine`] keeps the last volumes for review. After the first frame of a geometry nothing allocates, compiles or waits for the whole
//! device.

mod asked;
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
