//! Command-line arguments that several commands share.

mod input;
mod labels;
mod motor;
mod number;
mod picture_file;
mod picture_series;
mod recording;
mod shaders;
mod source;
mod time;
mod user_files;

#[cfg(feature = "verify")]
pub use input::open_device_until;
pub use input::recorded;
pub use input::{
    InputArgs, Output, SceneArgs, check_messages, check_outputs, check_volume, device_failure, frames_of, make_folder,
};
#[cfg(feature = "lab")]
pub use input::{Opened, open_device, open_device_for_statistics, write_if_asked, write_report};
pub use motor::{SerialArgs, motor_failure, motor_table};
pub use number::check_number;
pub use picture_file::PictureFile;
pub use picture_series::{PictureSeries, SeriesTarget};
pub use recording::{GeometryArgs, open_recording, recording_help};
pub use shaders::{ShaderArgs, gpu_failure};
pub use source::{SourceArgs, StreamArgs};
pub use time::parse_nanoseconds;
#[cfg(feature = "view")]
pub use user_files::{first_steps, pipeline_folder, presets_file, recent_list};
