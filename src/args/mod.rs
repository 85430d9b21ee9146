//! Command-line arguments that several commands share.

mod input;
mod motor;
mod source;

pub use input::{InputArgs, Output, SceneArgs, check_outputs, open_device, write_report};
pub use motor::{SerialArgs, motor_failure, motor_table};
pub use source::{SourceArgs, StreamArgs};
