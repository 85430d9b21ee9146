//! Frames that arrive on their own clock, and the pictures of them: what a source says goes into volume images while those before are
//! drawn. One thread listens ([`feed`]), one drives the device ([`Stream::step`]); [`turns`] says which image is whose, [`views`] in
//! which geometry a volume is seen, [`statistics`] what came of it, [`cine`] keeps the last volumes for looking back. Nothing here allocates, compiles or waits for the whole device once
//! a geometry's first frame has been taken.

pub mod cine;
pub mod feed;
mod recording;
mod replay;
mod session;
pub mod statistics;
mod status;
mod stream;
pub mod views;
pub mod volume_pool;

pub use feed::Feed;
pub use statistics::Statistics;
pub use stream::{FinishedPicture, Step, Stream, StreamError, StreamOptions};
pub use volume_pool::Update;
