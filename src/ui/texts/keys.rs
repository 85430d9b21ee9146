//! The keys: what they do, as the help and the search say it, and their names.

use crate::command::{Command, CompareView, InspectorTab, Link, Tool, Viewpoint};
use crate::input::{Key, Modifiers};
use crate::scene::{ColourMap, Layout, MeasureKind, Mode, PlaneName, TransferName};
use crate::{sliders, texts};
use Key::{Char, Function};

// What several keys do.
const LAYOUT_FOUR: &str = "three planes and the rendering, of one size";
const LAYOUT_SINGLE: &str = "one picture";
const ROTATE: &str = "rotate";
const ROLL: &str = "roll";
const CLOSER: &str = "closer";
const REDO: &str = "redo";
const STEP_PLANE: &str = "plane by 1 mm";
const STEP_PLANE_FAR: &str = "plane by 5 mm";
const THRESHOLD: &str = "threshold";
const GAIN: &str = "gain";
const STEP_LOOP: &str = "previous, next volume";
const MARK_LOOP: &str = "the loop begins, ends here";
const LOOP_SPEED: &str = "loop slower, faster";
const STEP_RECORDING: &str = "previous, next open recording";
const THIS_HELP: &str = "this help";
const FIND: &str = "find a command or a control";

/// A key combination, its command and its description.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    pub key: Key,
    pub modifiers: Modifiers,
    pub(crate) description: &'static str,
    pub command: Command,
    /// True if the command repeats while the key is held.
    pub(crate) repeats: bool,
}

const NONE: Modifiers = Modifiers { shift: false, control: false, alt: false };
const SHIFT: Modifiers = Modifiers { shift: true, ..NONE };
const CONTROL: Modifiers = Modifiers { control: true, ..NONE };

/// A binding of a key that is pressed with these modifiers.
const fn with(modifiers: Modifiers, key: Key, description: &'static str, command: Command) -> Binding {
    Binding { key, modifiers, description, command, repeats: false }
}

const fn on(key: Key, description: &'static str, command: Command) -> Binding {
    with(NONE, key, description, command)
}

const fn control(key: Key, description: &'static str, command: Command) -> Binding {
    with(CONTROL, key, description, command)
}

const fn shift(key: Key, description: &'static str, command: Command) -> Binding {
    with(SHIFT, key, description, command)
}

impl Binding {
    const fn repeating(self) -> Binding {
        Binding { repeats: true, ..self }
    }
}

/// A distance beyond any volume, mm.
const BEYOND_ANY_VOLUME_MM: f64 = 1e5;

/// All key bindings, in groups. Consecutive bindings with the same description share a line of the help.
pub const KEY_BINDINGS: &[Binding] = &[
    on(Char('1'), "surface", Command::Mode(Mode::Surface)),
    on(Char('2'), "volume", Command::Mode(Mode::Volume)),
    on(Char('3'), "surface behind a volume layer", Command::Mode(Mode::Mixed)),
    on(Char('4'), "largest echoes (MIP)", Command::Mode(Mode::Mip)),
    on(Char('5'), "smallest echoes (MinIP)", Command::Mode(Mode::MinIp)),
    on(Char('6'), "X-ray", Command::Mode(Mode::Mean)),
    on(Char('7'), "one plane", Command::Mode(Mode::Plane)),
    on(Char('8'), "three planes", Command::Mode(Mode::Orthogonal)),
    on(Char('9'), "slices", Command::Mode(Mode::Tomography)),
    on(Char('0'), "cube", Command::Mode(Mode::Cube)),
    on(Key::Tab, LAYOUT_FOUR, Command::Layout(Layout::Four)),
    on(Function(4), LAYOUT_FOUR, Command::Layout(Layout::Four)),
    shift(Char('v'), "the rendering, and three planes beside it", Command::Layout(Layout::Beside)),
    on(Char('v'), "volume and surface side by side", Command::Layout(Layout::Pair)),
    shift(Key::Tab, LAYOUT_SINGLE, Command::Layout(Layout::Single)),
    shift(Function(4), LAYOUT_SINGLE, Command::Layout(Layout::Single)),
    // What a drag does.
    on(Char('t'), "drag rotates", Command::Tool(Tool::Rotate)),
    on(Char('l'), "drag moves the light", Command::Tool(Tool::Light)),
    on(Char('g'), "drag moves the region's faces", Command::Tool(Tool::Region)),
    shift(Char('g'), "bend the start line, or straighten it", Command::ToggleStartCurve),
    on(Char('x'), "drag cuts from the front", Command::Tool(Tool::Clip)),
    on(Char('s'), "crosshair: drag moves the planes", Command::Tool(Tool::Plane)),
    on(Char('f'), "drag round it cuts it away (freehand)", Command::Tool(Tool::Cut)),
    on(Char('z'), "drag over it brushes it away", Command::Tool(Tool::Brush)),
    shift(Char('f'), "remove all cuts", Command::ClearCuts),
    shift(Char('x'), "nothing cut from the front", Command::MoveClip(-BEYOND_ANY_VOLUME_MM)),
    // The view.
    shift(Key::Left, ROTATE, Command::Rotate([-5.0, 0.0])).repeating(),
    shift(Key::Right, ROTATE, Command::Rotate([5.0, 0.0])).repeating(),
    shift(Key::Up, ROTATE, Command::Rotate([0.0, 5.0])).repeating(),
    shift(Key::Down, ROTATE, Command::Rotate([0.0, -5.0])).repeating(),
    control(Char('1'), "from the front", Command::LookFrom(Viewpoint::Front)),
    control(Char('2'), "from the left", Command::LookFrom(Viewpoint::Left)),
    control(Char('3'), "from the right", Command::LookFrom(Viewpoint::Right)),
    control(Char('4'), "from the top", Command::LookFrom(Viewpoint::Top)),
    shift(Char('t'), "turntable: the view turns by itself", Command::Turntable),
    on(Char(','), ROLL, Command::Roll(-5.0)).repeating(),
    on(Char('.'), ROLL, Command::Roll(5.0)).repeating(),
    on(Char('+'), CLOSER, Command::Zoom(1.1)).repeating(),
    on(Char('='), CLOSER, Command::Zoom(1.1)).repeating(),
    on(Char('-'), "farther", Command::Zoom(1.0 / 1.1)).repeating(),
    on(Key::Backspace, "reset all settings", Command::Reset),
    control(Char('z'), "undo", Command::Undo),
    with(Modifiers { alt: true, ..CONTROL }, Char('z'), "undo all changes", Command::UndoAll),
    control(Char('y'), REDO, Command::Redo),
    with(Modifiers { shift: true, ..CONTROL }, Char('z'), REDO, Command::Redo),
    // Planes.
    on(Char('a'), "plane A: the scan plane", Command::Plane(PlaneName::A)),
    on(Char('b'), "plane B: across the frames", Command::Plane(PlaneName::B)),
    on(Char('c'), "plane C: at one depth", Command::Plane(PlaneName::C)),
    on(Key::PageUp, STEP_PLANE, Command::StepPlane(-1.0)).repeating(),
    on(Key::PageDown, STEP_PLANE, Command::StepPlane(1.0)).repeating(),
    shift(Key::PageUp, STEP_PLANE_FAR, Command::StepPlane(-5.0)).repeating(),
    shift(Key::PageDown, STEP_PLANE_FAR, Command::StepPlane(5.0)).repeating(),
    on(Char('j'), "planes to the middle", Command::Recentre),
    shift(Char('c'), "curved plane: draw its line", Command::Tool(Tool::Curve)),
    shift(Key::Delete, "remove the curved plane", Command::ClearCurve),
    // Measuring.
    on(Char('m'), "measure: caliper, distance", Command::Tool(Tool::Measure(MeasureKind::Distance))),
    on(Char('n'), "measure: angle", Command::Tool(Tool::Measure(MeasureKind::Angle))),
    on(Char('e'), "measure: ellipse", Command::Tool(Tool::Measure(MeasureKind::Ellipse))),
    on(Char('o'), "measure: trace, area", Command::Tool(Tool::Measure(MeasureKind::Trace))),
    on(Char('u'), "measure: distance on the surface", Command::Tool(Tool::Measure(MeasureKind::Surface))),
    on(Char('w'), "measure: volume by contours", Command::Tool(Tool::Measure(MeasureKind::Volume))),
    on(Char('k'), "measure: automatic volume, of the largest bright body in the region", Command::MeasureBody),
    on(Char('i'), "text", Command::Tool(Tool::Measure(MeasureKind::Text))),
    on(Char('y'), "arrow", Command::Tool(Tool::Measure(MeasureKind::Arrow))),
    shift(Char('l'), "labels: paint, erase, grow from a click", Command::Tool(Tool::Labels)),
    shift(Char('b'), "body mark", Command::Tool(Tool::BodyMark)),
    on(Key::Delete, "delete the last measurement", Command::DeleteMeasure(usize::MAX)),
    control(Char('c'), "copy the results (CSV)", Command::CopyMeasures),
    // The look.
    on(Key::Up, THRESHOLD, Command::StepSlider(sliders::THRESHOLD, 1)).repeating(),
    on(Key::Down, THRESHOLD, Command::StepSlider(sliders::THRESHOLD, -1)).repeating(),
    on(Char('['), GAIN, Command::StepSlider(sliders::GAIN, -1)).repeating(),
    on(Char(']'), GAIN, Command::StepSlider(sliders::GAIN, 1)).repeating(),
    on(Char('d'), "shadow (darker)", Command::Shadow(true)),
    shift(Char('d'), "no shadow", Command::Shadow(false)),
    on(Function(5), "volume: grey", Command::Transfer(TransferName::Grey)),
    on(Function(6), "volume: sepia", Command::Transfer(TransferName::Sepia)),
    on(Function(7), "volume: skin", Command::Transfer(TransferName::Skin)),
    on(Function(8), "volume: bone", Command::Transfer(TransferName::Bone)),
    on(Function(9), "volume: cool", Command::Transfer(TransferName::Cool)),
    on(Function(10), "volume: warm", Command::Transfer(TransferName::Warm)),
    shift(Function(5), "picture: grey", Command::ColourMap(ColourMap::Grey)),
    shift(Function(6), "picture: sepia", Command::ColourMap(ColourMap::Sepia)),
    shift(Function(7), "picture: skin", Command::ColourMap(ColourMap::Skin)),
    shift(Function(8), "picture: ice", Command::ColourMap(ColourMap::Ice)),
    shift(Function(9), "picture: as is", Command::ColourMap(ColourMap::None)),
    // Time. The caller limits the index to the volumes that it has.
    on(Key::Space, "freeze, unfreeze", Command::Freeze),
    on(Key::Left, STEP_LOOP, Command::StepCine(-1)).repeating(),
    on(Key::Right, STEP_LOOP, Command::StepCine(1)).repeating(),
    on(Key::Home, "oldest volume", Command::SeekCine(0)),
    on(Key::End, "newest volume", Command::SeekCine(usize::MAX)),
    on(Key::Enter, "play the cine loop", Command::PlayCine),
    shift(Key::Home, MARK_LOOP, Command::MarkCine(false)),
    shift(Key::End, MARK_LOOP, Command::MarkCine(true)),
    control(Key::Home, "the complete loop", Command::WholeCine),
    control(Key::Left, LOOP_SPEED, Command::CineSpeed(-1)),
    control(Key::Right, LOOP_SPEED, Command::CineSpeed(1)),
    shift(Key::Enter, "loop back and forth", Command::BackAndForth(true)),
    control(Key::Enter, "loop forwards", Command::BackAndForth(false)),
    // What writes a file needs Ctrl: a letter that was meant for a text writes nothing.
    control(Char('i'), "save the picture", Command::SavePicture),
    control(Char('r'), "save the loop", Command::SaveLoop),
    control(Char('s'), "save the workspace", Command::SaveWorkspace),
    control(Char('o'), "open a recording or a workspace", Command::OpenFiles),
    control(Key::PageUp, STEP_RECORDING, Command::StepRecording(-1)),
    control(Key::PageDown, STEP_RECORDING, Command::StepRecording(1)),
    on(Char('p'), "compare with the next open recording or with this picture; end it", Command::Compare),
    control(Char('w'), "close the recording", Command::CloseRecording(usize::MAX)),
    control(Char('e'), "export the volume", Command::Exports),
    control(Char('p'), "presets", Command::Presets),
    // The screen.
    on(Char('h'), THIS_HELP, Command::ToggleHelp),
    on(Function(1), THIS_HELP, Command::ToggleHelp),
    on(Char('/'), FIND, Command::Find),
    control(Char('k'), FIND, Command::Find),
    on(Function(2), "times of the passes", Command::ToggleTimes),
    on(Function(3), "bars and inspector, on and off", Command::TogglePanels),
    shift(Function(3), "next part of the inspector", Command::NextTab),
    control(Key::Tab, "keyboard to the buttons and sliders, and back", Command::FocusPanels),
    shift(Char('m'), "pointer by keyboard, on and off", Command::KeyboardPointer),
    on(Function(11), "full screen", Command::ToggleFullScreen),
    on(Key::Escape, "close what is open, leave full screen, quit", Command::Back),
    on(Char('q'), "quit", Command::Exit),
];

/// The lines of the help: key names, such as "Shift+Left, Shift+Right", and the description, in the order of [`KEY_BINDINGS`].
pub(crate) fn help() -> impl Iterator<Item = (String, &'static str)> {
    KEY_BINDINGS.chunk_by(|a, b| a.description == b.description).filter_map(|same| {
        let keys: Vec<String> = same.iter().map(key_label).collect();
        Some((keys.join(", "), same.first()?.description))
    })
}

/// The name of a key with those that are held meanwhile, such as "Shift+F4". Keys that have no name here are called by those in English.
pub(crate) fn key_label(binding: &Binding) -> String {
    let Modifiers { shift, control, alt } = binding.modifiers;
    let held = [(control, "Ctrl+"), (alt, "Alt+"), (shift, "Shift+")];
    let held: String = held.iter().filter(|(is_held, _)| *is_held).map(|(_, name)| *name).collect();
    let key = match binding.key {
        Char(c) => c.to_uppercase().to_string(),
        Function(n) => format!("F{n}"),
        Key::PageUp => "Page up".into(),
        Key::PageDown => "Page down".into(),
        other => format!("{other:?}"),
    };
    held + &key
}

/// What no key does: name and hint, command.
pub(crate) const WITHOUT_KEY: [([&str; 2], Command); 20] = [
    (texts::VIEW_3D, Command::Rendering),
    (texts::EXCHANGE_LEFT_AND_RIGHT, Command::ExchangeLeftAndRight),
    (["Save the results (CSV)", texts::SAVE_RESULTS_HINT], Command::SaveMeasures),
    (["Clear all measurements", texts::CLEAR[1]], Command::ClearMeasures),
    (texts::CANCEL_EXPORT, Command::CancelExport),
    (["Bar on saved pictures: on", texts::BAR_ON_SAVED_PICTURES[1]], Command::SavesBar(true)),
    (["Bar on saved pictures: off", texts::BAR_ON_SAVED_PICTURES[1]], Command::SavesBar(false)),
    (["Reference picture of slices: on", texts::REFERENCE_PICTURE[1]], Command::Reference(true)),
    (["Reference picture of slices: off", texts::REFERENCE_PICTURE[1]], Command::Reference(false)),
    ([texts::SIDES, texts::SIDES_HINT], Command::InspectorTab(InspectorTab::Marks)),
    ([texts::PROBE_MARKER, texts::SIDES_HINT], Command::InspectorTab(InspectorTab::Marks)),
    ([texts::MEASUREMENTS, texts::TAB_MEASURE_HINT], Command::InspectorTab(InspectorTab::Measure)),
    ([texts::COLOUR, texts::COLOUR_HINT], Command::InspectorTab(InspectorTab::Look)),
    ([texts::OPACITY_OF, texts::OPACITY_OF_HINT], Command::InspectorTab(InspectorTab::Look)),
    (["Compare: all pictures beside each other", texts::COMPARED_TILES[1]], Command::CompareView(CompareView::Tiles)),
    (["Compare: show the difference", texts::COMPARED_DIFFERENCE[1]], Command::CompareView(CompareView::Difference)),
    (["Compare: wipe from one picture to the other", texts::COMPARED_WIPE[1]], Command::CompareView(CompareView::Wipe)),
    (["Compare: add the next open recording", texts::ADD_COMPARED[1]], Command::CompareFurther),
    (["Compare: align both volumes", texts::ALIGN_HINT], Command::Align),
    (["Compare: link windows, filters and light", texts::LINK_LOOK[1]], Command::ToggleLink(Link::Look)),
];

// The pointer by keyboard: its keys, and what they do while it is on.
pub(crate) const BY_KEYBOARD: &str = "Pointer by keyboard";
pub(crate) const POINTER_IS_ON: &str =
    "Pointer by keyboard: the arrows move it (Shift: one pixel), Enter clicks, Space holds and releases, Esc leaves";
pub(crate) const POINTER_IS_OFF: &str = "Pointer by keyboard: off";
pub(crate) const POINTER_KEYS: [(&str, &str); 8] = [
    ("Left, Right, Up, Down", "move the pointer; two at once: aslant"),
    ("Shift + arrows", "one pixel"),
    ("Enter", "click"),
    ("Shift+Enter", "double click"),
    ("Ctrl+Enter", "end the contour, the volume or the line"),
    ("Space", "hold the button, and release it: arrows drag meanwhile"),
    ("Shift+Space, Ctrl+Space", "the same as Shift + drag, Ctrl + drag"),
    ("Esc", "give the drag up; else leave the pointer"),
];
