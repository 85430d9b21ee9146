//! An X server, the program on it, its input and its pictures.

pub use crate::common::files::*;
pub use crate::common::program::PROGRAM;
pub use crate::common::wait::*;

use echolume::low_level::picture::Picture;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, ConfigureWindowAux, ConnectionExt, ImageFormat, InputFocus, MapState, Window, WindowClass,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

/// X keysyms of the keys that are pressed here; letters and digits are their own.
pub const TAB: u32 = 0xff09;
pub const ESCAPE: u32 = 0xff1b;
pub const F1: u32 = 0xffbe;
pub const RETURN: u32 = 0xff0d;
pub const CONTROL: u32 = 0xffe3;
pub const ALT: u32 = 0xffe9;

/// A server for one test, so that tests run in parallel, with a window manager where window shapes matter.
pub struct Desk {
    server: Child,
    manager: Option<Child>,
    display: String,
    pub connection: RustConnection,
    pub root: Window,
}

impl Desk {
    pub fn new(managed: bool) -> Desk {
        let arguments = ["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp", "-noreset"];
        let mut server = Command::new("Xvfb")
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb is installed (Debian: apt-get install xvfb)");
        let mut number = String::new();
        let said = server.stdout.as_mut().expect("piped");
        BufReader::new(said).read_line(&mut number).expect("the number of the display");
        let display = format!(":{}", number.trim());
        let (connection, screen) = RustConnection::connect(Some(&display)).expect("connect to Xvfb");
        let root = connection.setup().roots[screen].root;
        let manager = managed.then(|| {
            let mut openbox = Command::new("openbox");
            openbox.env("DISPLAY", &display).stdout(Stdio::null()).stderr(Stdio::null());
            openbox.spawn().expect("openbox is installed (Debian: apt-get install openbox)")
        });
        let desk = Desk { server, manager, display, connection, root };
        if managed {
            until("the window manager", || desk.is_managed().then_some(()));
        }
        desk
    }

    /// True if the window manager maps a new window. openbox announces itself before it is ready, and never maps windows created in
    /// between.
    fn is_managed(&self) -> bool {
        let (connection, setup) = (&self.connection, self.connection.setup());
        let window = connection.generate_id().expect("a name for a window");
        let class = WindowClass::INPUT_OUTPUT;
        let (depth, visual) = (setup.roots[0].root_depth, setup.roots[0].root_visual);
        let made =
            connection.create_window(depth, window, self.root, 0, 0, 9, 9, 0, class, visual, &Default::default());
        made.expect("a window");
        connection.map_window(window).expect("map");
        let begun = Instant::now();
        let mut framed = false;
        while !framed && begun.elapsed() < Duration::from_secs(1) {
            poll();
            let tree = connection.query_tree(window).expect("ask").reply().expect("the window is there");
            let attributes = connection.get_window_attributes(window).expect("ask").reply().expect("it is there");
            framed = tree.parent != self.root && attributes.map_state == MapState::VIEWABLE;
        }
        connection.destroy_window(window).expect("destroy");
        connection.flush().expect("flush");
        framed
    }

    /// Starts `echolume view` with these arguments and waits for its window.
    pub fn view(&self, arguments: &[&str]) -> View<'_> {
        self.view_by(&mut Command::new(PROGRAM), arguments)
    }

    /// The same by a command with an environment of its own.
    pub fn view_by(&self, command: &mut Command, arguments: &[&str]) -> View<'_> {
        command.args(["view", "--validate"]).args(arguments).env("DISPLAY", &self.display);
        command.env("ECHOLUME_RECENT", "none");
        if !command.get_envs().any(|(name, _)| name == "ECHOLUME_PRESETS") {
            command.env("ECHOLUME_PRESETS", "none");
        }
        command.env_remove("WAYLAND_DISPLAY").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut program = command.spawn().expect("start the program");
        let window = until("a window", || {
            let ended = program.try_wait().expect("look after the program");
            assert!(ended.is_none(), "{arguments:?}: it ended without a window: {}", rest(&mut program));
            self.window(self.root)
        });
        // Without a window manager nothing else gives it the keyboard focus.
        self.connection.set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME).expect("focus");
        let view = View { desk: self, program: Some(program), window };
        view.hover(20, 20);
        view
    }

    /// The first visible window named Echolume, inside any frames.
    pub fn window(&self, at: Window) -> Option<Window> {
        let tree = self.connection.query_tree(at).ok()?.reply().ok()?;
        tree.children.into_iter().find_map(|child| {
            let name = self.connection.get_property(false, child, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 32);
            let is_it = name.ok()?.reply().is_ok_and(|name| name.value == b"Echolume");
            let seen = self.connection.get_window_attributes(child).ok()?.reply();
            let seen = seen.is_ok_and(|a| a.map_state == MapState::VIEWABLE);
            if is_it && seen { Some(child) } else { self.window(child) }
        })
    }

    fn fake(&self, kind: u8, detail: u8, at: [i16; 2]) {
        self.connection.xtest_fake_input(kind, detail, 0, self.root, at[0], at[1], 0).expect("XTEST");
        self.connection.flush().expect("flush");
    }

    pub fn press(&self, keysym: u32, down: bool) {
        let setup = self.connection.setup();
        let (low, count) = (setup.min_keycode, setup.max_keycode - setup.min_keycode + 1);
        let map = self.connection.get_keyboard_mapping(low, count).expect("keys").reply().expect("keys");
        let width = map.keysyms_per_keycode as usize;
        let at = map.keysyms.chunks(width).position(|syms| syms.first() == Some(&keysym));
        let code = low + at.unwrap_or_else(|| panic!("no key for {keysym:#x}")) as u8;
        self.fake(if down { 2 } else { 3 }, code, [0, 0]);
    }

    pub fn tap(&self, keysym: impl Into<u32>) {
        let keysym = keysym.into();
        self.press(keysym, true);
        self.press(keysym, false);
    }
}

impl Desk {
    /// Presses a key while Ctrl is held.
    pub fn control(&self, key: impl Into<u32>) {
        self.press(CONTROL, true);
        self.tap(key);
        self.press(CONTROL, false);
    }

    /// Saves a workspace into this folder, which has none yet.
    pub fn save_workspace(&self, folder: &str) -> PathBuf {
        self.control('s');
        until("the workspace", || {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            entries.map(|entry| entry.path()).find(|path| path.extension().is_some_and(|end| end == "toml"))
        })
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        for child in self.manager.iter_mut().chain([&mut self.server]) {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// The output of a program that has ended.
fn rest(program: &mut Child) -> String {
    let mut said = String::new();
    for mut pipe in program
        .stdout
        .take()
        .map(|p| Box::new(p) as Box<dyn Read>)
        .into_iter()
        .chain(program.stderr.take().map(|p| Box::new(p) as Box<dyn Read>))
    {
        let _ = pipe.read_to_string(&mut said);
    }
    said
}

/// A program with its window.
pub struct View<'a> {
    pub desk: &'a Desk,
    program: Option<Child>,
    pub window: Window,
}

impl View<'_> {
    /// Position of its upper left corner, and its width and height, pixels.
    pub fn place(&self) -> ([i16; 2], [u16; 2]) {
        let connection = &self.desk.connection;
        let size = connection.get_geometry(self.window).expect("ask").reply().expect("the window is there");
        let at = connection.translate_coordinates(self.window, self.desk.root, 0, 0).expect("ask").reply();
        let at = at.expect("the window is there");
        ([at.dst_x, at.dst_y], [size.width, size.height])
    }

    /// Its present picture; none while its size changes, or if it does not exist.
    pub fn look(&self) -> Option<Picture> {
        self.look_at([0, 0], self.place().1.map(u32::from))
    }

    /// A part of its present picture, none if it is not inside: the server is asked for these pixels alone.
    pub fn look_at(&self, corner: [u32; 2], size: [u32; 2]) -> Option<Picture> {
        let ([x, y], [w, h]) = (corner.map(|n| i16::try_from(n).ok()), size.map(|n| u16::try_from(n).ok()));
        let image = self.desk.connection.get_image(ImageFormat::Z_PIXMAP, self.window, x?, y?, w?, h?, !0).ok()?;
        let mut rgba = image.reply().ok()?.data;
        // Blue first, as every server on this byte order has it at 24 bits. In place: tests look many times a second, and are not optimised.
        for pixel in rgba.chunks_exact_mut(4) {
            pixel.swap(0, 2);
            pixel[3] = 255;
        }
        Some(Picture { width: size[0], height: size[1], rgba })
    }

    /// Waits until it shows exactly this picture.
    pub fn shows(&self, wanted: &Picture, what: &str) {
        self.shows_part(wanted, [0, 0], [wanted.width, wanted.height], what);
    }

    /// Waits until a part of the window shows exactly the same part, from `from` on, of the expected picture.
    pub fn shows_part(&self, wanted: &Picture, from: [u32; 2], size: [u32; 2], what: &str) {
        self.shows_at(wanted, from, from, size, what);
    }

    /// Waits until the middle of the picture between the panels, which has no marks, equals that of a headless one.
    pub fn shows_middle(&self, wanted: &Picture, what: &str) {
        let (_, window) = self.place();
        let (corner, size) = echolume::low_level::ui::panels::picture_area(window.map(u32::from), 1.0, true);
        assert_eq!([wanted.width, wanted.height], size);
        let (from, middle) = (size.map(|n| n / 4), size.map(|n| n / 2));
        self.shows_at(wanted, [corner[0] + from[0], corner[1] + from[1]], from, middle, what);
    }

    pub fn shows_at(&self, wanted: &Picture, corner: [u32; 2], from: [u32; 2], size: [u32; 2], what: &str) {
        let wanted = crop(wanted, from, size).expect("a part of the wanted picture");
        let begun = Instant::now();
        let mut seen = None;
        while begun.elapsed() < PATIENCE {
            seen = self.look_at(corner, size);
            if seen.as_ref() == Some(&wanted) {
                return;
            }
            poll();
        }
        let folder = std::env::temp_dir();
        let save = |picture: &Picture, name: &str| drop(picture.save(&folder.join(format!("window-{name}.png"))));
        save(&wanted, "expected");
        seen.iter().for_each(|seen| save(seen, "actual"));
        panic!("{what}: the window never showed it; see window-expected.png and window-actual.png in {folder:?}");
    }

    /// Moves the pointer over a pixel of the window.
    pub fn hover(&self, x: i16, y: i16) {
        let ([left, top], _) = self.place();
        self.desk.fake(6, 0, [left + x, top + y]);
    }

    pub fn button(&self, number: u8, down: bool) {
        self.desk.fake(if down { 4 } else { 5 }, number, [0, 0]);
    }

    pub fn click(&self, x: i16, y: i16) {
        self.hover(x, y);
        self.button(1, true);
        self.button(1, false);
    }

    pub fn drag(&self, from: [i16; 2], to: [i16; 2]) {
        self.hover(from[0], from[1]);
        self.button(1, true);
        for step in 1..=10 {
            let between = |a: usize| from[a] + (to[a] - from[a]) * step / 10;
            self.hover(between(0), between(1));
            pace(Duration::from_millis(15));
        }
        self.button(1, false);
    }

    pub fn resize(&self, width: u32, height: u32) {
        let shape = ConfigureWindowAux::new().width(width).height(height);
        self.desk.connection.configure_window(self.window, &shape).expect("resize");
        self.desk.connection.flush().expect("flush");
    }

    /// Sends a signal to its process.
    pub fn signal(&self, signal: rustix::process::Signal) {
        let process = rustix::process::Pid::from_child(self.program.as_ref().expect("it runs"));
        rustix::process::kill_process(process, signal).expect("a signal");
    }

    pub fn is_running(&mut self) -> bool {
        self.program.as_mut().is_some_and(|program| program.try_wait().expect("look").is_none())
    }

    /// Waits for its end, which must be a success. Returns its output.
    pub fn ended(mut self) -> String {
        let mut program = self.program.take().expect("it ends once");
        let code = until("the end", || program.try_wait().expect("look after the program"));
        let said = rest(&mut program);
        assert!(code.success(), "{code}: {said}");
        said
    }

    /// Ends it by SIGTERM.
    pub fn terminate(mut self) {
        self.signal(rustix::process::Signal::TERM);
        let mut program = self.program.take().expect("it ends once");
        until("the end", || program.try_wait().expect("look after the program"));
    }

    /// Ends it by its key.
    pub fn leave(self) -> String {
        self.desk.tap('q');
        self.ended()
    }
}

impl Drop for View<'_> {
    fn drop(&mut self) {
        if let Some(mut program) = self.program.take() {
            let _ = program.kill();
            let _ = program.wait();
            if std::thread::panicking() {
                eprintln!("{}", rest(&mut program));
            }
        }
    }
}

/// A part of a picture; none if it is not inside.
pub fn crop(picture: &Picture, from: [u32; 2], size: [u32; 2]) -> Option<Picture> {
    if from[0] + size[0] > picture.width || from[1] + size[1] > picture.height {
        return None;
    }
    let row = |y: u32| {
        let start = 4 * ((from[1] + y) * picture.width + from[0]) as usize;
        &picture.rgba[start..start + 4 * size[0] as usize]
    };
    let rgba = (0..size[1]).flat_map(row).copied().collect();
    Some(Picture { width: size[0], height: size[1], rgba })
}

/// Volume rendering without a light volume, which takes most of the time of the default look's pictures on a CPU: for tests of anything else.
pub const PLAIN: [&str; 2] = ["--set", "light.volume=none"];

/// The picture of the sweep that `echolume render` makes. Many tests want the same one: it is drawn once.
pub fn headless(size: [u32; 2], more: &[&str]) -> Picture {
    type Drawn = BTreeMap<([u32; 2], Vec<String>), Picture>;
    static DRAWN: Mutex<Drawn> = Mutex::new(BTreeMap::new());
    let key = (size, more.iter().map(|flag| flag.to_string()).collect());
    let mut drawn = DRAWN.lock().unwrap_or_else(|e| e.into_inner());
    drawn.entry(key).or_insert_with(|| rendered(SWEEP, size, more)).clone()
}

/// The same without a light volume.
pub fn plain(size: [u32; 2], more: &[&str]) -> Picture {
    headless(size, &[&PLAIN, more].concat())
}

/// The picture of a recording or a workspace that `echolume render` makes.
pub fn rendered(source: &str, size: [u32; 2], more: &[&str]) -> Picture {
    let name = source.rsplit('/').next().unwrap_or_default();
    let folder = Folder::new(&format!("headless-{name}-{}x{}-{}", size[0], size[1], more.concat().replace('/', "")));
    let file = folder.path("picture.png");
    let size = format!("{}x{}", size[0], size[1]);
    let output = Command::new(PROGRAM).args(["render", source, "-o", &file, "--size", &size]).args(more).output();
    let output = output.expect("start the program");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Picture::load(&PathBuf::from(file)).expect("the picture")
}
