//! `--glsl`: shaders of the user instead of the embedded ones.

use crate::gpu::shader_reload::ShaderFolder;
use crate::gpu::{GpuError, RendererOptions, Shaders};
use crate::terminal::{Failure, failed, input};
use std::path::PathBuf;
use std::sync::Arc;

#[derive(clap::Args)]
pub struct ShaderArgs {
    /// Compile the shaders from this folder instead of using the built-in ones (needs glslc or glslangValidator)
    #[arg(long, value_name = "DIR")]
    glsl: Option<PathBuf>,
}

impl ShaderArgs {
    /// Loads the shaders of the given folder, or the embedded ones. A shader of a folder is compiled when a pipeline needs it.
    ///
    /// # Errors
    /// With a folder only: there is no compiler, the folder cannot be read or holds no shader, or an include does not exist.
    pub fn open(&self) -> Result<Arc<Shaders>, Failure> {
        Ok(match &self.glsl {
            Some(folder) => ShaderFolder::open(folder).map_err(input)?.shaders(),
            None => RendererOptions::default().shaders,
        })
    }

    /// True if a folder of shaders was given.
    pub fn are_given(&self) -> bool {
        self.glsl.is_some()
    }

    /// The failure with which a command ends after a GPU error, see [`gpu_failure`].
    #[cfg(feature = "lab")]
    pub fn failure(&self, fault: GpuError) -> Failure {
        gpu_failure(fault, self.are_given())
    }
}

/// The failure with which a command ends after a GPU error. If the shaders are the user's (`own_shaders`), one that does not compile is an error
/// of the input.
pub fn gpu_failure(fault: GpuError, own_shaders: bool) -> Failure {
    match fault {
        fault @ GpuError::Shader { .. } if own_shaders => input(fault),
        fault => failed(fault),
    }
}
