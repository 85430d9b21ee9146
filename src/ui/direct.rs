//! The console without a windowing system: directly on a monitor (VK_KHR_display), with input from the kernel, for a cart; or on a surface that
//! nobody sees, without input, to measure a machine without a monitor.

use super::console::Console;
use super::devices::{DeviceMessage, Devices};
use super::input::Input;
use super::recovery::{self, Lost, Output, Recovery, RecoveryStep};
use super::window::MakeConsole;
use crate::gpu::window::{PresentMode, Screen, Target, fixed_size};
use crate::gpu::{Context, ContextOptions, GpuError};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the cursor is visible after the mouse moved.
const CURSOR_TIME: Duration = Duration::from_secs(3);

/// How the console is shown without a window system.
pub struct DirectOptions {
    /// A monitor, or the surface that nobody sees.
    pub target: Target,
    pub present_mode: PresentMode,
    /// The console ends after this time; None: it does not end by itself.
    pub time: Option<Duration>,
}

/// Takes over a monitor and all input devices, and runs the console that `make` creates, until the user leaves or `options.time` is over. A surface
/// that nobody sees has no input. Returns the console and its last context.
///
/// # Errors
/// No device has such a monitor, or another program uses it; the input devices cannot be read; or the device or the monitor is lost repeatedly.
pub fn run(
    device: &ContextOptions,
    options: DirectOptions,
    mut make: Box<MakeConsole>,
) -> Result<(Console, Arc<Context>), GpuError> {
    let output = Output { device, target: options.target, present_mode: options.present_mode };
    let context = Context::for_presentation(device, &output.target)?;
    let size = fixed_size(&context, &output.target)?;
    let screen = Screen::new(&context, output.target.clone(), size, options.present_mode)?;
    // The keyboard is grabbed: otherwise the shell of the terminal would run what is typed.
    let devices = match output.target {
        Target::Unseen(_) => Devices::none(),
        _ => Devices::open(size, true),
    };
    let devices = devices.map_err(|e| GpuError::Window(format!("input devices cannot be read: {e}")))?;
    // The distance of the monitor is unknown: text has the size for a desk.
    let mut console = make(&context, size, 1.0, devices.wake());
    console.set_screen(Some(screen));
    let (recovery, cursor, has_presented) = (Recovery::default(), CursorTimer::default(), false);
    let ends = options.time.map(|time| Instant::now() + time);
    let mut direct_loop =
        DirectLoop { output, context, console, make, devices, size, recovery, cursor, has_presented, ends };
    direct_loop.run()?;
    // Drop the devices first, so that the text console gets the keys again.
    let DirectLoop { console, context, .. } = direct_loop;
    Ok((console, context))
}

struct DirectLoop<'a> {
    output: Output<'a>,
    devices: Devices,
    // The console is dropped before its context: it holds the screen.
    console: Console,
    make: Box<MakeConsole<'a>>,
    context: Arc<Context>,
    /// Size of the monitor or surface, pixels.
    size: [u32; 2],
    recovery: Recovery,
    cursor: CursorTimer,
    /// Whether a frame was presented.
    has_presented: bool,
    ends: Option<Instant>,
}

impl DirectLoop<'_> {
    fn run(&mut self) -> Result<(), GpuError> {
        loop {
            let now = Instant::now();
            let ControlFlow::Continue(until) = self.update(now)? else { return Ok(()) };
            if self.ends.is_some_and(|end| now >= end) {
                return Ok(());
            }
            let until = [until, self.ends, self.cursor.hides_at(now)].into_iter().flatten().min();
            for message in self.devices.wait(until) {
                match message {
                    DeviceMessage::Input(input) => {
                        self.cursor.input(&input, Instant::now());
                        self.console.input(&input);
                    }
                    DeviceMessage::Warning(text) => self.console.notify(&text, true),
                    DeviceMessage::Woken => {}
                }
            }
            self.console.set_pointer(self.cursor.position(Instant::now()));
        }
    }

    /// Updates the console. Breaks when that ends; otherwise continues at the next event, or at this time.
    fn update(&mut self, now: Instant) -> Result<ControlFlow<(), Option<Instant>>, GpuError> {
        let restored = match self.recovery.poll(now) {
            RecoveryStep::Idle => Ok(()),
            RecoveryStep::WaitUntil(at) => return Ok(ControlFlow::Continue(Some(at))),
            RecoveryStep::Restore(lost) => self.restore(lost),
        };
        match restored.and_then(|()| self.console.update(now).map_err(recovery::lost_by)) {
            Ok(next) if next.exit => Ok(ControlFlow::Break(())),
            Ok(next) => {
                if next.restart {
                    let console = (self.make)(&self.context, self.size, 1.0, self.devices.wake());
                    let before = std::mem::replace(&mut self.console, console);
                    self.console.set_screen(before.into_screen());
                }
                self.after_update();
                Ok(ControlFlow::Continue(next.wake_at))
            }
            // Drivers list monitors that they cannot use.
            Err((Lost::Screen, fault)) if !self.has_presented => match self.output.target {
                Target::Monitor(_) => Err(GpuError::Window(format!("{fault}; does a desktop hold the monitor?"))),
                _ => Err(fault),
            },
            Err((lost, fault)) => {
                tracing::warn!("{fault}; trying again");
                if self.recovery.lost(lost, now) { Ok(ControlFlow::Continue(Some(now))) } else { Err(fault) }
            }
        }
    }

    /// Restores what is lost. By then the monitor may be another one, or in another mode.
    fn restore(&mut self, lost: Lost) -> Result<(), (Lost, GpuError)> {
        let target = self.output.target.clone();
        let size = |context: &Context| fixed_size(context, &target);
        let size = self.output.restore(&mut self.console, &mut self.context, &size, lost)?;
        self.resize(size);
        Ok(())
    }

    fn after_update(&mut self) {
        let Some(screen) = self.console.screen() else { return };
        self.recovery.presented(screen.shown());
        self.has_presented |= screen.shown() > 0;
        // Once there is a surface, its size applies.
        let size = screen.size();
        if !size.contains(&0) {
            self.resize(size);
        }
    }

    fn resize(&mut self, size: [u32; 2]) {
        if size != self.size {
            self.size = size;
            self.console.resize(size);
            self.devices.resize(size);
        }
    }
}

/// Shows the cursor while a mouse moves it, and hides it while the user touches the screen.
#[derive(Clone, Copy, Debug, Default)]
struct CursorTimer {
    moved: Option<(Instant, [f64; 2])>,
}

impl CursorTimer {
    fn input(&mut self, input: &Input, now: Instant) {
        match *input {
            Input::Moved(at) => self.moved = Some((now, at)),
            Input::Touch { .. } => self.moved = None,
            _ => {}
        }
    }

    fn position(&self, now: Instant) -> Option<[f64; 2]> {
        self.moved.filter(|(when, _)| now < *when + CURSOR_TIME).map(|(_, at)| at)
    }

    /// When the cursor disappears.
    fn hides_at(&self, now: Instant) -> Option<Instant> {
        self.moved.map(|(when, _)| when + CURSOR_TIME).filter(|at| *at > now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Phase;

    #[test]
    fn the_cursor_is_visible_for_a_while_and_hidden_by_a_finger() {
        let (mut cursor, now) = (CursorTimer::default(), Instant::now());
        assert_eq!((cursor.position(now), cursor.hides_at(now)), (None, None));
        cursor.input(&Input::Moved([3.0, 4.0]), now);
        cursor.input(&Input::Scroll(1.0), now + CURSOR_TIME);
        let late = now + CURSOR_TIME - Duration::from_millis(1);
        assert_eq!((cursor.position(late), cursor.hides_at(late)), (Some([3.0, 4.0]), Some(now + CURSOR_TIME)));
        assert_eq!((cursor.position(now + CURSOR_TIME), cursor.hides_at(now + CURSOR_TIME)), (None, None));
        cursor.input(&Input::Moved([5.0, 6.0]), now);
        cursor.input(&Input::Touch { finger: 1, phase: Phase::Down, at: [0.0, 0.0] }, now);
        assert_eq!(cursor.position(now), None);
    }
}
