//! Spatio-temporal image correlation (STIC): one slow sweep over a beating heart becomes volumes of one cycle. `rhythm` finds the cycles in
//! the frames themselves or from the times of an ECG's R waves; `cycle` sorts the frames by their phase.

mod cycle;
mod rhythm;

pub use cycle::{Cycle, CycleOptions};
pub use rhythm::{Motion, Rhythm};
