//! The console on a monitor that nothing else uses, with input straight from the kernel: for a cart without a windowing system.

use super::console::Console;
use super::devices::{Devices, Told};
use super::input::Input;
use super::recovery::{self, Due, Gone, Place, Recovery};
use super::window::Make;
use crate::gpu::window::{PresentMode, Screen, Target, display};
use crate::gpu::{Context, ContextOptions, GpuError};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// So long the pointer is seen after the mouse was moved.
const SEEN: Duration = Duration::from_secs(3);

pub struct Shape {
    /// Which monitor, and how.
    pub wanted: display::Wanted,
    pub pace: PresentMode,
    /// Nobody else gets what keys and mice say, such as the text console behind.
    pub grab: bool,
    /// End after so long.
    pub time: Option<Duration>,
}

/// Takes a monitor and runs until someone leaves; the console as it was then, and the context that it ended with.
///
/// # Errors
/// No device with such a monitor, or another program holds it; a device or a monitor that is lost again and again.
pub fn run(device: &ContextOptions, shape: Shape, mut make: Box<Make>) -> Result<(Console, Arc<Context>), GpuError> {
    let place = Place { device, target: Target::Monitor(shape.wanted.clone()), pace: shape.pace };
    let context = Context::showing(device, &place.target)?;
    let size = display::size(&context, &shape.wanted)?;
    let screen = Screen::new(&context, place.target.clone(), size, shape.pace)?;
    let devices = Devices::listen(size, shape.grab)
        .map_err(|e| GpuError::Window(format!("input devices cannot be read: {e}")))?;
    // How far away the monitor is nobody knows: letters are as large as on a desk.
    let mut console = make(&context, size, 1.0, devices.wake());
    console.set_screen(Some(screen));
    let (mending, arrow, has_shown) = (Recovery::default(), Arrow::default(), false);
    let ends = shape.time.map(|time| Instant::now() + time);
    let wanted = shape.wanted;
    let mut running = Running { place, wanted, context, console, make, devices, size, mending, arrow, has_shown, ends };
    running.run()?;
    // The devices go first: keys are the text console's again.
    let Running { console, context, .. } = running;
    Ok((console, context))
}

struct Running<'a> {
    place: Place<'a>,
    wanted: display::Wanted,
    devices: Devices,
    // The console before its context: it holds what shows on the monitor.
    console: Console,
    make: Box<Make<'a>>,
    context: Arc<Context>,
    /// Of the monitor, pixels.
    size: [u32; 2],
    mending: Recovery,
    arrow: Arrow,
    /// It has worked once.
    has_shown: bool,
    ends: Option<Instant>,
}

/// What comes after a turn.
enum Then {
    Exit,
    /// Another, when something comes or it is that time.
    Wait(Option<Instant>),
}

impl Running<'_> {
    fn run(&mut self) -> Result<(), GpuError> {
        loop {
            let now = Instant::now();
            let Then::Wait(until) = self.turn(now)? else { return Ok(()) };
            if self.ends.is_some_and(|end| now >= end) {
                return Ok(());
            }
            let until = [until, self.ends, self.arrow.goes(now)].into_iter().flatten().min();
            for told in self.devices.wait(until) {
                match told {
                    Told::Input(input) => {
                        self.arrow.input(&input, Instant::now());
                        self.console.input(&input);
                    }
                    Told::Note(text) => self.console.say(&text, true),
                    Told::Woken => {}
                }
            }
            self.console.point(self.arrow.seen(Instant::now()));
        }
    }

    fn turn(&mut self, now: Instant) -> Result<Then, GpuError> {
        let mended = match self.mending.due(now) {
            Due::Nothing => Ok(()),
            Due::At(at) => return Ok(Then::Wait(Some(at))),
            Due::Now(gone) => self.mend(gone),
        };
        match mended.and_then(|()| self.console.tick(now).map_err(recovery::gone)) {
            Ok(next) if next.exit => Ok(Then::Exit),
            Ok(next) => {
                if next.renews {
                    let console = (self.make)(&self.context, self.size, 1.0, self.devices.wake());
                    let before = std::mem::replace(&mut self.console, console);
                    self.console.set_screen(before.into_screen());
                }
                self.follow();
                Ok(Then::Wait(next.at))
            }
            // Drivers list monitors that they cannot take.
            Err((Gone::Screen, fault)) if !self.has_shown => {
                Err(GpuError::Window(format!("{fault}; does a desktop hold the monitor?")))
            }
            Err((gone, fault)) => {
                tracing::warn!("{fault}; trying again");
                if self.mending.fault(gone, now) { Ok(Then::Wait(Some(now))) } else { Err(fault) }
            }
        }
    }

    /// Has again what is gone: another monitor may be there by now, or the same one in another mode.
    fn mend(&mut self, gone: Gone) -> Result<(), (Gone, GpuError)> {
        let wanted = &self.wanted;
        let size = |context: &Context| display::size(context, wanted);
        let size = self.place.mend(&mut self.console, &mut self.context, &size, gone)?;
        self.fit(size);
        Ok(())
    }

    fn follow(&mut self) {
        let Some(screen) = self.console.screen() else { return };
        self.mending.shown(screen.shown());
        self.has_shown |= screen.shown() > 0;
        // The surface has the last word, once there is one.
        let size = screen.size();
        if !size.contains(&0) {
            self.fit(size);
        }
    }

    fn fit(&mut self, size: [u32; 2]) {
        if size != self.size {
            self.size = size;
            self.console.resize(size);
            self.devices.resize(size);
        }
    }
}

/// Where the pointer is to be seen: while a mouse moves it, not while fingers point for themselves.
#[derive(Clone, Copy, Debug, Default)]
struct Arrow {
    moved: Option<(Instant, [f64; 2])>,
}

impl Arrow {
    fn input(&mut self, input: &Input, now: Instant) {
        match *input {
            Input::Moved(at) => self.moved = Some((now, at)),
            Input::Touch { .. } => self.moved = None,
            _ => {}
        }
    }

    fn seen(&self, now: Instant) -> Option<[f64; 2]> {
        self.moved.filter(|(when, _)| now < *when + SEEN).map(|(_, at)| at)
    }

    /// When it is no longer seen.
    fn goes(&self, now: Instant) -> Option<Instant> {
        self.moved.map(|(when, _)| when + SEEN).filter(|at| *at > now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ui::input::Phase;

    #[test]
    fn the_pointer_is_seen_for_a_while_and_hidden_by_a_finger() {
        let (mut arrow, now) = (Arrow::default(), Instant::now());
        assert_eq!((arrow.seen(now), arrow.goes(now)), (None, None));
        arrow.input(&Input::Moved([3.0, 4.0]), now);
        arrow.input(&Input::Scroll(1.0), now + SEEN);
        let late = now + SEEN - Duration::from_millis(1);
        assert_eq!((arrow.seen(late), arrow.goes(late)), (Some([3.0, 4.0]), Some(now + SEEN)));
        assert_eq!((arrow.seen(now + SEEN), arrow.goes(now + SEEN)), (None, None));
        arrow.input(&Input::Moved([5.0, 6.0]), now);
        arrow.input(&Input::Touch { finger: 1, phase: Phase::Down, at: [0.0, 0.0] }, now);
        assert_eq!(arrow.seen(now), None);
    }
}
