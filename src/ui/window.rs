//! The console in a window, or over all of a monitor.

use super::console::{Console, Next};
use super::input::{Button, Input, Key, Modifiers, Phase};
use super::recovery::{self, Due, Gone, Place, Recovery};
use crate::gpu::window::{PresentMode, Screen, Target};
use crate::gpu::{Context, ContextOptions, GpuError, Wake};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, TouchPhase, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key as Printed, NamedKey};
use winit::monitor::MonitorHandle;
use winit::platform::modifier_supplement::KeyEventExtModifierSupplement;
use winit::window::{Fullscreen, Window, WindowId};

pub struct Shape {
    /// Of the window, pixels.
    pub size: [u32; 2],
    pub full_screen: bool,
    /// A part of the name of the monitor to fill; the one that the window is on unless given.
    pub monitor: Option<String>,
    pub pace: PresentMode,
    /// Closing the window does not end it.
    pub stays: bool,
    /// End after so long.
    pub time: Option<Duration>,
}

/// Makes the console when the window is there, and another whenever one asks for it: the context that shows on it is given, and how many
/// pixels a point has.
pub type Make<'a> = dyn FnMut(&Arc<Context>, [u32; 2], f32, Wake) -> Console + 'a;

/// Opens a window and runs until someone leaves; the console as it was then, and the context that it ended with.
///
/// # Errors
/// No windowing system, no device that shows on it, a device that is lost again and again.
pub fn run(device: &ContextOptions, shape: Shape, make: Box<Make>) -> Result<(Console, Arc<Context>), GpuError> {
    let no_window = |e: &dyn std::fmt::Display| {
        let fault = e.to_string();
        // winit puts its own source file in front.
        let fault = fault.rsplit(": ").next().unwrap_or(&fault).trim_end_matches('.');
        GpuError::Window(format!(
            "{fault}; is there a desktop? (DISPLAY and WAYLAND_DISPLAY say where; --direct needs none)"
        ))
    };
    let events = EventLoop::<()>::with_user_event().build().map_err(|e| no_window(&e))?;
    let (proxy, is_woken) = (events.create_proxy(), Arc::new(AtomicBool::new(false)));
    let flag = is_woken.clone();
    let wake: Wake = Arc::new(move || {
        // One is as good as many, and a source may say thousands of things a second.
        if !flag.swap(true, Ordering::Relaxed) {
            let _ = proxy.send_event(());
        }
    });
    let mut running = Running {
        device,
        shape,
        make,
        wake,
        is_woken,
        window: None,
        context: None,
        console: None,
        failed: None,
        mending: Recovery::default(),
        ends: None,
    };
    events.run_app(&mut running).map_err(|e| no_window(&e))?;
    let Running { failed, console, context, .. } = running;
    match (failed, console, context) {
        (Some(error), ..) => Err(error),
        (None, Some(console), Some(context)) => Ok((console, context)),
        _ => Err(GpuError::Window("the windowing system ended before there was a window".into())),
    }
}

struct Running<'a> {
    device: &'a ContextOptions,
    shape: Shape,
    make: Box<Make<'a>>,
    wake: Wake,
    is_woken: Arc<AtomicBool>,
    // The console first: it holds what shows on the window.
    console: Option<Console>,
    context: Option<Arc<Context>>,
    window: Option<Arc<Window>>,
    failed: Option<GpuError>,
    mending: Recovery,
    ends: Option<Instant>,
}

impl Running<'_> {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), GpuError> {
        if self.window.is_some() {
            return Ok(());
        }
        let window = self.new_window(events)?;
        let context = Context::showing(self.device, &Target::Window(window.clone()))?;
        let size = size_of(&window);
        let screen = Screen::new(&context, Target::Window(window.clone()), size, self.shape.pace)?;
        let mut console = (self.make)(&context, size, window.scale_factor() as f32, self.wake.clone());
        console.set_screen(Some(screen));
        self.ends = self.shape.time.map(|time| Instant::now() + time);
        (self.window, self.context, self.console) = (Some(window), Some(context), Some(console));
        Ok(())
    }

    fn new_window(&self, events: &ActiveEventLoop) -> Result<Arc<Window>, GpuError> {
        let [width, height] = self.shape.size;
        let full = self.shape.full_screen.then(|| Fullscreen::Borderless(self.monitor(events)));
        let attributes = Window::default_attributes()
            .with_title("Echolume")
            .with_inner_size(PhysicalSize::new(width, height))
            .with_fullscreen(full);
        events.create_window(attributes).map(Arc::new).map_err(|e| GpuError::Window(e.to_string()))
    }

    fn monitor(&self, events: &ActiveEventLoop) -> Option<MonitorHandle> {
        let part = self.shape.monitor.as_ref()?.to_lowercase();
        events.available_monitors().find(|m| m.name().is_some_and(|name| name.to_lowercase().contains(&part)))
    }

    /// Has again what is gone: the window too.
    fn mend(&mut self, events: &ActiveEventLoop, gone: Gone) -> Result<(), (Gone, GpuError)> {
        if self.window.is_none() {
            self.window = Some(self.new_window(events).map_err(|fault| (gone, fault))?);
        }
        let (Some(window), Some(console), Some(context)) = (&self.window, &mut self.console, &mut self.context) else {
            return Ok(());
        };
        let place = Place { device: self.device, target: Target::Window(window.clone()), pace: self.shape.pace };
        place.mend(console, context, &|_| Ok(size_of(window)), gone).map(drop)
    }

    fn turn(&mut self, events: &ActiveEventLoop) {
        let now = Instant::now();
        self.is_woken.store(false, Ordering::Relaxed);
        let mended = match self.mending.due(now) {
            Due::Nothing => Ok(()),
            Due::At(at) => return events.set_control_flow(ControlFlow::WaitUntil(at)),
            Due::Now(gone) => self.mend(events, gone),
        };
        let Some(console) = &mut self.console else { return };
        match mended.and_then(|()| console.tick(now).map_err(recovery::gone)) {
            Ok(next) => self.follow(events, next, now),
            Err((gone, fault)) => self.try_again(events, now, gone, fault),
        }
    }

    fn try_again(&mut self, events: &ActiveEventLoop, now: Instant, gone: Gone, fault: GpuError) {
        tracing::warn!("{fault}; trying again");
        if self.mending.fault(gone, now) {
            // The next turn says when.
            events.set_control_flow(ControlFlow::Poll);
        } else {
            self.failed = Some(fault);
            events.exit();
        }
    }

    fn follow(&mut self, events: &ActiveEventLoop, next: Next, now: Instant) {
        if next.exit || self.ends.is_some_and(|end| now >= end) {
            events.exit();
            return;
        }
        if let (true, Some(window), Some(context)) = (next.renews, &self.window, &self.context) {
            let screen = self.console.take().and_then(Console::into_screen);
            let factor = window.scale_factor() as f32;
            let mut console = (self.make)(context, size_of(window), factor, self.wake.clone());
            console.set_screen(screen);
            self.console = Some(console);
        }
        if let Some(screen) = self.console.as_ref().and_then(Console::screen) {
            self.mending.shown(screen.shown());
        }
        if let (true, Some(window)) = (next.toggles_full_screen, &self.window) {
            let full = window.fullscreen().is_none().then(|| Fullscreen::Borderless(self.monitor(events)));
            window.set_fullscreen(full);
        }
        let at = next.at.into_iter().chain(self.ends).min();
        events.set_control_flow(at.map_or(ControlFlow::Wait, |at| match at <= now {
            true => ControlFlow::Poll,
            false => ControlFlow::WaitUntil(at),
        }));
    }
}

fn size_of(window: &Window) -> [u32; 2] {
    let size = window.inner_size();
    [size.width, size.height]
}

impl ApplicationHandler<()> for Running<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.open(events) {
            self.failed = Some(error);
            events.exit();
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(console) = &mut self.console else { return };
        match &event {
            WindowEvent::Destroyed if self.shape.stays => {
                console.set_screen(None);
                self.window = None;
                self.mending.fault(Gone::Screen, Instant::now());
            }
            WindowEvent::Destroyed => events.exit(),
            WindowEvent::CloseRequested if !self.shape.stays => events.exit(),
            WindowEvent::Resized(size) => console.resize([size.width, size.height]),
            WindowEvent::RedrawRequested | WindowEvent::Occluded(false) => console.expose(),
            _ => {}
        }
        if let Some(input) = input(&event) {
            console.input(&input);
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: ()) {}

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.turn(events);
    }
}

/// A window's event as what hands did; none of what is not done by hand.
fn input(event: &WindowEvent) -> Option<Input> {
    let pressed = |state: &ElementState| *state == ElementState::Pressed;
    Some(match event {
        WindowEvent::CursorMoved { position, .. } => Input::Moved([position.x, position.y]),
        WindowEvent::CursorLeft { .. } | WindowEvent::Focused(false) => Input::Left,
        WindowEvent::MouseInput { state, button, .. } => {
            let button = match button {
                MouseButton::Left => Button::Left,
                MouseButton::Right => Button::Right,
                MouseButton::Middle => Button::Middle,
                _ => return None,
            };
            Input::Button { button, pressed: pressed(state) }
        }
        WindowEvent::MouseWheel { delta, .. } => Input::Scroll(match delta {
            MouseScrollDelta::LineDelta(_, lines) => f64::from(*lines),
            // As far as most wheels go in a notch.
            MouseScrollDelta::PixelDelta(pixels) => pixels.y / 40.0,
        }),
        WindowEvent::ModifiersChanged(held) => {
            let held = held.state();
            Input::Modifiers(Modifiers { shift: held.shift_key(), control: held.control_key(), alt: held.alt_key() })
        }
        WindowEvent::KeyboardInput { event, .. } => {
            Input::Key { key: key(&event.key_without_modifiers())?, pressed: pressed(&event.state) }
        }
        WindowEvent::Touch(touch) => {
            let phase = match touch.phase {
                TouchPhase::Started => Phase::Down,
                TouchPhase::Moved => Phase::Moved,
                TouchPhase::Ended => Phase::Up,
                TouchPhase::Cancelled => Phase::Gone,
            };
            Input::Touch { finger: touch.id, phase, at: [touch.location.x, touch.location.y] }
        }
        _ => return None,
    })
}

fn key(printed: &Printed) -> Option<Key> {
    Some(match printed {
        Printed::Character(text) => match text.chars().next()? {
            ' ' => Key::Space,
            c => Key::Char(c.to_lowercase().next()?),
        },
        Printed::Named(named) => match named {
            NamedKey::Escape => Key::Escape,
            NamedKey::Enter => Key::Enter,
            NamedKey::Tab => Key::Tab,
            NamedKey::Space => Key::Space,
            NamedKey::Backspace => Key::Backspace,
            NamedKey::Delete => Key::Delete,
            NamedKey::ArrowLeft => Key::Left,
            NamedKey::ArrowRight => Key::Right,
            NamedKey::ArrowUp => Key::Up,
            NamedKey::ArrowDown => Key::Down,
            NamedKey::PageUp => Key::PageUp,
            NamedKey::PageDown => Key::PageDown,
            NamedKey::Home => Key::Home,
            NamedKey::End => Key::End,
            NamedKey::F1 => Key::Function(1),
            NamedKey::F2 => Key::Function(2),
            NamedKey::F3 => Key::Function(3),
            NamedKey::F4 => Key::Function(4),
            NamedKey::F5 => Key::Function(5),
            NamedKey::F6 => Key::Function(6),
            NamedKey::F7 => Key::Function(7),
            NamedKey::F8 => Key::Function(8),
            NamedKey::F9 => Key::Function(9),
            NamedKey::F10 => Key::Function(10),
            NamedKey::F11 => Key::Function(11),
            NamedKey::F12 => Key::Function(12),
            _ => return None,
        },
        _ => return None,
    })
}
