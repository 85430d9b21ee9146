//! Shared code of the commands that draw pictures of a recording: sending frames, and repeating after a loss of the device.

use crate::args::{InputArgs, gpu_failure};
use crate::gpu::{Context, GpuError, Losses, Renderer, RendererOptions};
use crate::source::{Frame, Source, VolumeFrames};
use crate::terminal::{Failure, input};
use std::path::Path;
use std::sync::Arc;

/// The arguments of `render` that say how pictures are drawn and where they are written.
pub struct Job<'a> {
    pub input: &'a InputArgs,
    pub output: &'a Path,
    pub options: RendererOptions,
    pub validate: bool,
    pub timings: bool,
    /// True if the shaders come from a folder of the user. A shader that does not compile is then an error of the input.
    pub own_shaders: bool,
}

impl<'a> Job<'a> {
    pub fn open_device(&self) -> Result<DrawingDevice<'a>, Failure> {
        DrawingDevice::open(self.input, self.validate, self.own_shaders, self.options.clone())
    }
}

/// Why a picture could not be drawn.
pub enum DrawFault {
    Gpu(GpuError),
    Source(Failure),
}

impl From<GpuError> for DrawFault {
    fn from(error: GpuError) -> DrawFault {
        DrawFault::Gpu(error)
    }
}

impl From<Failure> for DrawFault {
    fn from(failure: Failure) -> DrawFault {
        DrawFault::Source(failure)
    }
}

impl DrawFault {
    /// The failure of a command that does not draw again after the device was lost, such as one that measures times.
    pub fn failed(self) -> Failure {
        self.failure(false)
    }

    fn failure(self, own_shaders: bool) -> Failure {
        match self {
            DrawFault::Gpu(fault) => gpu_failure(fault, own_shaders),
            DrawFault::Source(failure) => failure,
        }
    }
}

/// The device that pictures are drawn on, which is opened again when it is lost.
pub struct DrawingDevice<'a> {
    input: &'a InputArgs,
    validate: bool,
    own_shaders: bool,
    pub context: Arc<Context>,
    /// Options of renderers. After a loss their bands are smaller.
    pub options: RendererOptions,
}

impl<'a> DrawingDevice<'a> {
    /// Opens the device that the arguments choose. `own_shaders`: true if the shaders of `options` are the user's, so that one that does not
    /// compile is an error of the input.
    pub fn open(
        input: &'a InputArgs,
        validate: bool,
        own_shaders: bool,
        options: RendererOptions,
    ) -> Result<DrawingDevice<'a>, Failure> {
        Ok(DrawingDevice { input, validate, own_shaders, context: input.open_device(validate)?, options })
    }

    /// Draws. If the device is lost, it is opened again and `draw` is called again, with smaller bands, until it was lost too often in a row
    /// ([`Losses`]). A device that did not finish in time is not opened again. `progress` returns how many of several pictures are finished; a further
    /// one begins the count of losses anew. The last argument of `draw` is true if it is called again: then a part of the source may have been read.
    ///
    /// # Errors
    /// The error of `draw`, or the device cannot be opened again.
    pub fn draw<T>(
        &mut self,
        progress: impl Fn() -> usize,
        mut draw: impl FnMut(&Arc<Context>, &RendererOptions, bool) -> Result<T, DrawFault>,
    ) -> Result<T, Failure> {
        let (mut losses, mut reached) = (Losses::default(), 0);
        loop {
            let drawn = draw(&self.context, &self.options, losses.any());
            // What was finished since the last loss begins another row of them.
            if progress() > reached {
                (losses, reached) = (Losses::default(), progress());
            }
            match drawn {
                Err(DrawFault::Gpu(error)) if losses.allow_after(&error) => {
                    self.options.bands = losses.bands();
                    self.context = self.input.open_device(self.validate)?;
                }
                drawn => return drawn.map_err(|fault| fault.failure(self.own_shaders)),
            }
        }
    }
}

/// Sends every frame of the volume with this index to volume image 0 of the renderer. `each` is called with each frame before it is sent.
///
/// # Errors
/// The source cannot be read, `each` fails, or the device fails. An error of the device, such as its loss, is a variant of its own
/// ([`DrawFault::Gpu`]), so that the caller can try again.
pub fn send_volume(
    renderer: &mut Renderer,
    source: &mut dyn Source,
    volume: usize,
    mut each: impl FnMut(&Frame) -> Result<(), Failure>,
) -> Result<(), DrawFault> {
    let mut frames = VolumeFrames::of(source, volume).map_err(input)?;
    while let Some(frame) = frames.read().map_err(input)? {
        each(&frame)?;
        renderer.frame(frame.slice as u32, &frame.bytes, 0)?;
    }
    frames.count().map_err(input)?;
    Ok(())
}
