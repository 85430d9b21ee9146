//! From pictures to a window, without the host in between.

use super::*;
use crate::gpu::window::{Panels, PresentOutcome, Screen};

impl Renderer {
    /// Shows the last picture with its upper left corner `at` a pixel of the window, and panels over it. A picture that is on its way
    /// comes first: it is what is shown.
    ///
    /// # Errors
    /// A device that fails, a surface that cannot be had anew.
    pub fn present(
        &mut self,
        screen: &mut Screen,
        at: [u32; 2],
        panels: Option<Panels>,
    ) -> Result<PresentOutcome, GpuError> {
        self.check(self.shown)?;
        let drawn = self.slots.image(Slot::Screen, 0).map(|image| crate::gpu::window::Drawn {
            image,
            order: &mut self.order,
            timelines: &mut self.timelines,
            at,
        });
        let seen = screen.show_with(drawn, panels);
        self.presented = self.timelines.of(0).submitted;
        seen
    }
}
