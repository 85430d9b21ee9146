//! Connects the panels with the desktop's screen readers: their tree is sent, and requests for controls are received. Without the feature
//! `screen-reader` nothing listens, and no tree is made.

use super::console::Console;
use crate::gpu::Wake;
use winit::event::WindowEvent;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

#[cfg(feature = "screen-reader")]
pub(super) use self::served::ScreenReader;

/// Stands for the connection with screen readers in a program that is built without it.
#[cfg(not(feature = "screen-reader"))]
pub(super) struct ScreenReader;

#[cfg(not(feature = "screen-reader"))]
impl ScreenReader {
    pub(super) const IS_SERVED: bool = false;

    pub(super) fn new(_: &ActiveEventLoop, _: &Window, _: Wake) -> ScreenReader {
        ScreenReader
    }

    pub(super) fn event(&mut self, _: &Window, _: &WindowEvent) {}

    pub(super) fn listen(&mut self, _: &mut Console) {}

    pub(super) fn tell(&mut self, _: &mut Console) {}
}

#[cfg(feature = "screen-reader")]
mod served {
    use super::{ActiveEventLoop, Console, Wake, Window, WindowEvent};
    use crate::panels::accesskit::{ActionHandler, ActionRequest, ActivationHandler, DeactivationHandler, TreeUpdate};
    use accesskit_winit::Adapter;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// The connection of one window with the screen readers.
    pub(crate) struct ScreenReader {
        adapter: Adapter,
        heard: Receiver<Heard>,
        is_listening: bool,
    }

    enum Heard {
        Listens(bool),
        Asks(ActionRequest),
    }

    impl ScreenReader {
        pub(crate) const IS_SERVED: bool = true;

        /// `window` must not have been visible yet. `wake` is called, on any thread, when there are requests for [`ScreenReader::listen`].
        pub fn new(events: &ActiveEventLoop, window: &Window, wake: Wake) -> ScreenReader {
            let (sender, heard) = channel();
            let ear = Ear { sender, wake };
            let adapter = Adapter::with_direct_handlers(events, window, ear.clone(), ear.clone(), ear);
            ScreenReader { adapter, heard, is_listening: false }
        }

        /// Passes an event of the window to the connection, which uses those about its position and focus.
        pub fn event(&mut self, window: &Window, event: &WindowEvent) {
            self.adapter.process_event(window, event);
        }

        /// Passes the requests of screen readers to the console.
        pub fn listen(&mut self, console: &mut Console) {
            for heard in self.heard.try_iter() {
                match heard {
                    Heard::Listens(is_listening) => self.is_listening = is_listening,
                    Heard::Asks(request) => console.act(request),
                }
            }
            // The console may be another one than before.
            if console.is_described() != self.is_listening {
                console.describe(self.is_listening);
            }
        }

        /// Sends the accessibility tree of the panels to screen readers, if the panels were laid out since the last call.
        pub fn tell(&mut self, console: &mut Console) {
            if let Some(tree) = console.take_tree() {
                self.adapter.update_if_active(|| tree);
            }
        }
    }

    /// Receives requests; called by threads of the desktop's interface.
    #[derive(Clone)]
    struct Ear {
        sender: Sender<Heard>,
        wake: Wake,
    }

    impl Ear {
        fn hear(&self, heard: Heard) {
            let _ = self.sender.send(heard);
            (self.wake)();
        }
    }

    impl ActivationHandler for Ear {
        /// The tree follows with the next layout.
        fn request_initial_tree(&mut self) -> Option<TreeUpdate> {
            self.hear(Heard::Listens(true));
            None
        }
    }

    impl ActionHandler for Ear {
        fn do_action(&mut self, request: ActionRequest) {
            self.hear(Heard::Asks(request));
        }
    }

    impl DeactivationHandler for Ear {
        fn deactivate_accessibility(&mut self) {
            self.hear(Heard::Listens(false));
        }
    }
}
