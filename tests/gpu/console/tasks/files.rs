//! Tasks of files: results, pictures, exports, workspaces and several recordings.

use super::*;

/// On a desktop the text is on its clipboard; without one it is in a file.
pub(super) fn results(user: &mut User) -> String {
    user.has_caliper(10.0);
    user.control('c');
    if user.shown(Role::Status, "The results are copied as CSV").is_none() {
        let text = std::fs::read_to_string(user.saved("csv")).expect("a table");
        assert!(text.contains("10.0000"), "{text}");
    }
    user.count()
}

pub(super) fn picture(user: &mut User) -> String {
    user.has_caliper(10.0);
    user.control('i');
    let file = user.saved("png");
    let saved = user.until("whole picture", |_| Picture::load(&file).ok());
    let size = picture_area(WINDOW, 1.0, true).1;
    assert!(saved.width == size[0] && saved.height > size[1], "with its bar: {} x {}", saved.width, saved.height);
    // The middle of the caliper is yellow.
    let at = user.place(5.0, 0.0);
    let [x, y] = user.on_tile(at);
    let [left, top] = picture_area(WINDOW, 1.0, true).0.map(f64::from);
    let pixel = |x: f64, y: f64| &saved.rgba[4 * ((y as u32 * saved.width + x as u32) as usize)..][..3];
    let near = (-1..=1).map(|dy| pixel(x - left, y - top + f64::from(dy)));
    assert!(near.into_iter().any(|p| p[0] > 200 && p[1] > 150 && p[2] < 150), "no line at {x}, {y}");
    user.count()
}

/// The number that the menu has for this format; the key would start the program that this test is. tests/window/panels.rs presses it.
pub(super) fn export(user: &mut User, number: char, name: &str) -> String {
    let test = std::fs::read_to_string(repository("tests/window/panels.rs")).expect("tests/window/panels.rs");
    let is_made = [format!("('{number}', "), format!("export('{number}')")].iter().any(|made| test.contains(made));
    assert!(is_made, "tests/window/panels.rs makes no export {number}");
    user.control('e');
    // All entries are as wide.
    let place = |node: &Node| node.bounds().unwrap_or_default();
    let is_it = |node: &&Node| node.role() == Role::Button && node.label() == Some(name);
    let own = user.tree.iter().find(is_it).map(place).unwrap_or_else(|| panic!("{name} is not in the menu"));
    let is_above = |node: &&Node| (place(node).x0, place(node).x1) == (own.x0, own.x1) && place(node).y0 <= own.y0;
    let above = user.tree.iter().filter(|node| node.role() == Role::Button).filter(is_above).count();
    assert_eq!(above, number as usize - '0' as usize, "{name} has another number");
    let count = user.actions + 1;
    user.key(Key::Escape);
    count.to_string()
}

pub(super) fn tomorrow(user: &mut User) -> String {
    user.has_caliper(10.0);
    user.control('s');
    let file = user.saved("toml");
    user.until("note of the saved file", |user| user.shown(Role::Status, "Saved"));
    // Tomorrow.
    user.control('o');
    user.actions += 1;
    user.console.input(&Input::Key { key: Key::Char('1'), pressed: true });
    user.console.input(&Input::Key { key: Key::Char('1'), pressed: false });
    user.until("file that is opened", |user| user.request.restart.then_some(()));
    assert_eq!(*user.opened.lock().expect("lock"), [file], "the workspace is the first of the list");
    user.opened.lock().expect("lock").clear();
    user.count()
}

/// As the window hands it on.
pub(super) fn another(user: &mut User) -> String {
    let dropped = PathBuf::from("/data/other.mha");
    user.actions += 1;
    user.console.open_path(&dropped);
    user.until("file that is opened", |user| user.request.restart.then_some(()));
    assert_eq!(*user.opened.lock().expect("lock"), [dropped]);
    user.count()
}

pub(super) fn by_path(user: &mut User) -> String {
    let file = user.folder.0.join("path.mha");
    std::fs::write(&file, b"header").expect("a file");
    user.control('o');
    user.types(file.to_str().expect("a path"));
    user.actions += 1;
    user.console.input(&Input::Key { key: Key::Enter, pressed: true });
    user.console.input(&Input::Key { key: Key::Enter, pressed: false });
    user.opens(&file);
    std::fs::remove_file(&file).expect("the file");
    user.count()
}

impl User {
    /// Waits until the console asks to be replaced, as a window would do at once, by one that shows this.
    fn opens(&mut self, path: &Path) {
        self.until("file that is opened", |user| user.request.restart.then_some(()));
        self.request.restart = false;
        assert_eq!(self.opened.lock().expect("lock").drain(..).next_back().as_deref(), Some(path));
    }
}

pub(super) fn in_turn(user: &mut User) -> String {
    user.actions += 1;
    for path in ["/data/before.mha", "/data/after.mha"] {
        user.console.drop_file(Path::new(path));
    }
    user.opens(Path::new("/data/before.mha"));
    user.actions += 1;
    user.press(Modifiers { control: true, ..Modifiers::default() }, Key::PageDown);
    user.opens(Path::new("/data/after.mha"));
    user.count()
}

/// tests/gpu/console/recordings.rs holds that it comes back as it was left.
pub(super) fn first_again(user: &mut User) -> String {
    user.actions += 1;
    user.press(Modifiers { control: true, ..Modifiers::default() }, Key::PageUp);
    user.opens(Path::new("/data/before.mha"));
    user.count()
}
