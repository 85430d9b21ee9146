//! The console in a window of the desktop, which may be full-screen.

use super::console::{Console, LoopRequest};
use super::input::{Button, Input, Key, Modifiers, Phase};
use super::recovery::{self, Lost, Output, Recovery, RecoveryStep};
use super::screen_reader::ScreenReader;
use crate::gpu::window::{PresentMode, Screen, Target};
use crate::gpu::{Context, ContextOptions, GpuError, Wake};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, TouchPhase, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key as LogicalKey, NamedKey};
use winit::monitor::MonitorHandle;
use winit::platform::modifier_supplement::KeyEventExtModifierSupplement;
use winit::window::{Fullscreen, Window, WindowId};

/// How the window is opened.
#[derive(Default)]
pub struct WindowOptions {
    /// Width and height of the window, pixels.
    pub size: [u32; 2],
    pub full_screen: bool,
    /// Part of the name of the monitor on which full screen is shown; `None`: the monitor of the window.
    pub monitor: Option<String>,
    pub present_mode: PresentMode,
    /// True if a request to close the window is ignored, and a window that is destroyed is opened again, as in a kiosk.
    pub stays_open: bool,
    /// The console ends after this time; None: it does not end by itself.
    pub time: Option<Duration>,
}

/// A function that creates the console when the window is open, and again whenever the console asks to be replaced. Arguments: the context, the
/// size of the window in pixels, its pixels per point, and the function that wakes the event loop.
pub type MakeConsole<'a> = dyn FnMut(&Arc<Context>, [u32; 2], f32, Wake) -> Console + 'a;

/// Opens a window and runs the console that `make` creates, until the user leaves or `options.time` is over. Returns the console and its last
/// context.
///
/// # Errors
/// There is no window system, no device can present on it, or the device or the window is lost repeatedly.
pub fn run(
    device: &ContextOptions,
    options: WindowOptions,
    make: Box<MakeConsole>,
) -> Result<(Console, Arc<Context>), GpuError> {
    let no_window = |e: &dyn std::fmt::Display| {
        let fault = e.to_string();
        // winit prefixes the message with its source file.
        let fault = fault.rsplit(": ").next().unwrap_or(&fault).trim_end_matches('.');
        GpuError::Window(format!(
            "{fault}; is there a desktop? (DISPLAY and WAYLAND_DISPLAY say where; --direct needs none)"
        ))
    };
    let events = EventLoop::<()>::with_user_event().build().map_err(|e| no_window(&e))?;
    let (proxy, wake_pending) = (events.create_proxy(), Arc::new(AtomicBool::new(false)));
    let flag = wake_pending.clone();
    let wake: Wake = Arc::new(move || {
        // One event is enough; a source may wake thousands of times a second.
        if !flag.swap(true, Ordering::Relaxed) {
            let _ = proxy.send_event(());
        }
    });
    let mut window_loop = WindowLoop {
        device,
        options,
        make,
        wake,
        wake_pending,
        window: None,
        size: [0; 2],
        context: None,
        console: None,
        screen_reader: None,
        failed: None,
        recovery: Recovery::default(),
        ends: None,
    };
    events.run_app(&mut window_loop).map_err(|e| no_window(&e))?;
    let WindowLoop { failed, console, context, .. } = window_loop;
    match (failed, console, context) {
        (Some(error), ..) => Err(error),
        (None, Some(console), Some(context)) => Ok((console, context)),
        _ => Err(GpuError::Window("the windowing system ended before there was a window".into())),
    }
}

struct WindowLoop<'a> {
    device: &'a ContextOptions,
    options: WindowOptions,
    make: Box<MakeConsole<'a>>,
    wake: Wake,
    wake_pending: Arc<AtomicBool>,
    // The console is dropped first: it holds the surface of the window.
    console: Option<Console>,
    context: Option<Arc<Context>>,
    screen_reader: Option<ScreenReader>,
    window: Option<Arc<Window>>,
    /// Size by the last event, pixels. Asking the window would panic inside winit if the X server has destroyed it before the event arrives.
    size: [u32; 2],
    failed: Option<GpuError>,
    recovery: Recovery,
    ends: Option<Instant>,
}

impl WindowLoop<'_> {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), GpuError> {
        if self.window.is_some() {
            return Ok(());
        }
        let window = self.new_window(events)?;
        let context = Context::for_presentation(self.device, &Target::Window(window.clone()))?;
        let size = self.size;
        let screen = Screen::new(&context, Target::Window(window.clone()), size, self.options.present_mode)?;
        let mut console = (self.make)(&context, size, window.scale_factor() as f32, self.wake.clone());
        console.set_screen(Some(screen));
        console.set_full_screen(self.options.full_screen);
        self.ends = self.options.time.map(|time| Instant::now() + time);
        (self.window, self.context, self.console) = (Some(window), Some(context), Some(console));
        Ok(())
    }

    fn new_window(&mut self, events: &ActiveEventLoop) -> Result<Arc<Window>, GpuError> {
        self.size = self.options.size;
        let [width, height] = self.size;
        let full = self.options.full_screen.then(|| Fullscreen::Borderless(self.monitor(events)));
        let attributes = Window::default_attributes()
            .with_title("Echolume")
            .with_inner_size(PhysicalSize::new(width, height))
            .with_fullscreen(full);
        // A screen reader knows a window before it is seen. The window of a kiosk may be destroyed at any time; to be asked for its place then would
        // end the program.
        let is_read = ScreenReader::IS_SERVED && !self.options.stays_open;
        let window = events.create_window(attributes.with_visible(!is_read));
        let window = window.map_err(|e| GpuError::Window(e.to_string()))?;
        self.screen_reader = is_read.then(|| ScreenReader::new(events, &window, self.wake.clone()));
        if is_read {
            window.set_visible(true);
        }
        Ok(Arc::new(window))
    }

    fn monitor(&self, events: &ActiveEventLoop) -> Option<MonitorHandle> {
        let part = self.options.monitor.as_ref()?.to_lowercase();
        events.available_monitors().find(|m| m.name().is_some_and(|name| name.to_lowercase().contains(&part)))
    }

    /// Restores what is lost, including the window.
    fn restore(&mut self, events: &ActiveEventLoop, lost: Lost) -> Result<(), (Lost, GpuError)> {
        // A device that was given up keeps its surface, and a window has one surface at a time.
        if self.context.as_ref().is_some_and(|context| context.is_given_up())
            && let Some(window) = self.window.take()
        {
            window.set_visible(false);
        }
        if self.window.is_none() {
            self.window = Some(self.new_window(events).map_err(|fault| (lost, fault))?);
        }
        let size = self.size;
        let (Some(window), Some(console), Some(context)) = (&self.window, &mut self.console, &mut self.context) else {
            return Ok(());
        };
        let output = Output {
            device: self.device,
            target: Target::Window(window.clone()),
            present_mode: self.options.present_mode,
        };
        output.restore(console, context, &|_| Ok(size), lost).map(drop)
    }

    fn update(&mut self, events: &ActiveEventLoop) {
        // A hidden window may never take a picture.
        if events.exiting() {
            return;
        }
        let now = Instant::now();
        self.wake_pending.store(false, Ordering::Relaxed);
        let restored = match self.recovery.poll(now) {
            RecoveryStep::Idle => Ok(()),
            RecoveryStep::WaitUntil(at) => return events.set_control_flow(ControlFlow::WaitUntil(at)),
            RecoveryStep::Restore(lost) => self.restore(events, lost),
        };
        let Some(console) = &mut self.console else { return };
        self.screen_reader.iter_mut().for_each(|reader| reader.listen(console));
        match restored.and_then(|()| console.update(now).map_err(recovery::lost_by)) {
            Ok(next) => self.after_update(events, next, now),
            Err((lost, fault)) => self.schedule_recovery(events, now, lost, fault),
        }
    }

    fn schedule_recovery(&mut self, events: &ActiveEventLoop, now: Instant, lost: Lost, fault: GpuError) {
        tracing::warn!("{fault}; trying again");
        if self.recovery.lost(lost, now) {
            // The next update decides when to try.
            events.set_control_flow(ControlFlow::Poll);
        } else {
            self.failed = Some(fault);
            events.exit();
        }
    }

    fn after_update(&mut self, events: &ActiveEventLoop, next: LoopRequest, now: Instant) {
        if let (Some(reader), Some(console)) = (&mut self.screen_reader, &mut self.console) {
            reader.tell(console);
        }
        if next.exit || self.ends.is_some_and(|end| now >= end) {
            leave(self.window.as_deref(), events);
            return;
        }
        if let (true, Some(window), Some(context)) = (next.restart, &self.window, &self.context) {
            let screen = self.console.take().and_then(Console::into_screen);
            let factor = window.scale_factor() as f32;
            let mut console = (self.make)(context, self.size, factor, self.wake.clone());
            console.set_screen(screen);
            console.set_full_screen(window.fullscreen().is_some());
            self.console = Some(console);
        }
        if let Some(screen) = self.console.as_ref().and_then(Console::screen) {
            self.recovery.presented(screen.shown());
        }
        if let (true, Some(window)) = (next.toggle_full_screen, &self.window) {
            let full = window.fullscreen().is_none().then(|| Fullscreen::Borderless(self.monitor(events)));
            let is_full_screen = full.is_some();
            window.set_fullscreen(full);
            self.console.iter_mut().for_each(|console| console.set_full_screen(is_full_screen));
        }
        let at = next.wake_at.into_iter().chain(self.ends).min();
        events.set_control_flow(at.map_or(ControlFlow::Wait, |at| match at <= now {
            true => ControlFlow::Poll,
            false => ControlFlow::WaitUntil(at),
        }));
    }
}

impl ApplicationHandler<()> for WindowLoop<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.open(events) {
            self.failed = Some(error);
            events.exit();
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, window: WindowId, event: WindowEvent) {
        // Another one was hidden when its device was given up.
        if self.window.as_ref().is_some_and(|current| current.id() != window) {
            return;
        }
        if let (Some(reader), Some(window)) = (&mut self.screen_reader, &self.window) {
            reader.event(window, &event);
        }
        let Some(console) = &mut self.console else { return };
        match &event {
            WindowEvent::Destroyed if self.options.stays_open => {
                console.set_screen(None);
                self.window = None;
                self.recovery.lost(Lost::Screen, Instant::now());
            }
            WindowEvent::Destroyed => events.exit(),
            WindowEvent::CloseRequested if self.options.stays_open || console.asks_before_closing() => {}
            WindowEvent::CloseRequested => leave(self.window.as_deref(), events),
            WindowEvent::Resized(size) => {
                self.size = (*size).into();
                console.resize(self.size);
            }
            WindowEvent::RedrawRequested | WindowEvent::Occluded(false) => console.redraw(),
            _ => {}
        }
        if let WindowEvent::DroppedFile(file) = &event {
            console.drop_file(file);
        }
        if let Some(input) = input(&event) {
            console.input(&input);
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: ()) {}

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.update(events);
    }
}

/// Hides the window at once: to end what the console does may take longer, as pipelines in the making are waited for.
fn leave(window: Option<&Window>, events: &ActiveEventLoop) {
    window.iter().for_each(|window| window.set_visible(false));
    events.exit();
}

/// Converts an event of the window to an input; none if it is not one.
fn input(event: &WindowEvent) -> Option<Input> {
    let pressed = |state: &ElementState| *state == ElementState::Pressed;
    Some(match event {
        WindowEvent::CursorMoved { position, .. } => Input::Moved([position.x, position.y]),
        WindowEvent::CursorLeft { .. } => Input::PointerLeft,
        WindowEvent::Focused(false) => Input::FocusLost,
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
            // Most wheels report 40 pixels per notch.
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
                TouchPhase::Cancelled => Phase::Cancelled,
            };
            Input::Touch { finger: touch.id, phase, at: [touch.location.x, touch.location.y] }
        }
        _ => return None,
    })
}

fn key(logical: &LogicalKey) -> Option<Key> {
    Some(match logical {
        LogicalKey::Character(text) => match text.chars().next()? {
            ' ' => Key::Space,
            c => Key::Char(c.to_lowercase().next()?),
        },
        LogicalKey::Named(named) => match named {
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
            named => {
                use NamedKey::{F1, F2, F3, F4, F5, F6, F7, F8, F9, F10, F11, F12};
                let before = [F1, F2, F3, F4, F5, F6, F7, F8, F9, F10, F11, F12].iter().position(|f| f == named)?;
                Key::Function(before as u8 + 1)
            }
        },
        _ => return None,
    })
}
