//! Names, roles and values of the panels for a screen reader, and the frame around the focused control. egui makes a tree of its widgets (AccessKit),
//! which is served to the desktop's screen readers; this adds what egui cannot know.

use super::colours::{FOCUS, FOCUS_EDGE};
use super::{Execute, PanelState, picture_rect};
use crate::command::{Command, Viewpoint};
use crate::scene::{Layout, Scene};
use crate::texts;
use crate::view;
use egui::accesskit::{Action, Live, Node, Rect as Bounds, Role};
use egui::{Context, Id, Key, Response, Stroke, StrokeKind, Ui};

/// The viewpoints of a rendering with their names in the panels.
pub(super) const VIEWPOINTS: [(Viewpoint, &str); 4] = [
    (Viewpoint::Front, texts::VIEW_FRONT),
    (Viewpoint::Left, texts::VIEW_LEFT),
    (Viewpoint::Right, texts::VIEW_RIGHT),
    (Viewpoint::Top, texts::VIEW_TOP),
];

/// Changes the node of the tree that stands for a widget, while a screen reader listens.
fn node(context: &Context, id: Id, change: impl FnOnce(&mut Node)) {
    _ = context.accesskit_node_builder(id, change);
}

/// Adds to a control what a screen reader says about it, and what it does.
pub(super) trait Tell: Sized {
    /// Changes the node of the tree that stands for the control.
    fn with(self, change: impl FnOnce(&mut Node)) -> Response;
    /// Adds a tooltip, which is also the description of the control.
    fn tell(self, hint: &str) -> Response;
    /// Gives this command when the control is clicked.
    fn gives(self, command: Command, execute: Execute);

    /// Sets a name that takes the place of the text on the control.
    fn named(self, name: &str) -> Response {
        self.with(|node| node.set_label(name))
    }

    fn with_role(self, role: Role) -> Response {
        self.with(|node| node.set_role(role))
    }

    /// Sets the value of the control in words, with its unit.
    fn with_value(self, value: &str) -> Response {
        self.with(|node| node.set_value(value))
    }

    /// Says whether the list or panel that the control opens is open.
    fn expanded(self, is_open: bool) -> Response {
        self.with(|node| node.set_expanded(is_open))
    }
}

impl Tell for Response {
    fn with(self, change: impl FnOnce(&mut Node)) -> Response {
        node(&self.ctx, self.id, change);
        self
    }

    fn tell(self, hint: &str) -> Response {
        // A control that just got the keyboard comes into sight.
        if self.gained_focus() {
            self.scroll_to_me(None);
        }
        self.with(|node| node.set_description(hint)).on_hover_text(hint)
    }

    fn gives(self, command: Command, execute: Execute) {
        if self.clicked() {
            execute(command);
        }
    }
}

/// Describes a progress bar to a screen reader. `share`: progress from 0 to 1; None if not known.
pub(super) fn progress(bar: &Response, share: Option<f32>) {
    node(&bar.ctx, bar.id, |node| {
        node.set_min_numeric_value(0.0);
        node.set_max_numeric_value(100.0);
        match share {
            Some(share) => node.set_numeric_value(f64::from(share * 100.0).round()),
            None => node.clear_numeric_value(),
        }
    });
}

/// Describes the range and step of a control that is adjusted like a slider to a screen reader.
pub(super) fn range(control: &Response, [low, high]: [f64; 2], step: f64) {
    node(&control.ctx, control.id, |node| {
        node.set_min_numeric_value(low);
        node.set_max_numeric_value(high);
        node.set_numeric_value_step(step);
        [Action::SetValue, Action::Increment, Action::Decrement].into_iter().for_each(|action| node.add_action(action));
    });
}

/// Gives the content of a [`Ui`] a role and a name for screen readers.
pub(super) fn name(ui: &Ui, role: Role, name: &str) {
    node(ui.ctx(), ui.unique_id(), |node| {
        node.set_role(role);
        node.set_label(name);
    });
}

/// Adds a list with this name for screen readers. `add` adds its entries.
pub(super) fn list(ui: &mut Ui, title: &str, add: impl FnOnce(&mut Ui)) {
    part(ui, Role::List, title, add);
}

/// Adds a group with this name for screen readers. `add` adds its controls.
pub(super) fn group(ui: &mut Ui, title: &str, add: impl FnOnce(&mut Ui)) {
    part(ui, Role::Group, title, add);
}

fn part(ui: &mut Ui, role: Role, title: &str, add: impl FnOnce(&mut Ui)) {
    ui.scope(|ui| {
        name(ui, role, title);
        add(ui);
    });
}

/// Announces a message to a screen reader, which reads a fault at once and others when it has finished.
pub(super) fn announce(ui: &Ui, text: &str, is_fault: bool) {
    name(ui, if is_fault { Role::Alert } else { Role::Status }, text);
    let live = if is_fault { Live::Assertive } else { Live::Polite };
    node(ui.ctx(), ui.unique_id(), |node| node.set_live(live));
}

/// Describes to a screen reader in words what the picture shows.
pub(super) fn picture(ui: &Ui, state: &PanelState, scale: f32) {
    let at = picture_rect(state, scale);
    let (title, about) = in_words(state);
    node(ui.ctx(), Id::new("picture"), |node| {
        node.set_role(Role::Image);
        node.set_label(title);
        node.set_description(about);
        let [x0, y0, x1, y1] = [at.min.x, at.min.y, at.max.x, at.max.y].map(f64::from);
        node.set_bounds(Bounds { x0, y0, x1, y1 });
    });
}

/// The name of the picture, such as "Surface from the front, live, Demo data (phantom)", and what else is to be said of it.
fn in_words(state: &PanelState) -> (String, String) {
    let Some(scene) = state.picture.map(|picture| &picture.scene) else {
        return (texts::NO_PICTURE_YET.into(), String::new());
    };
    let settings = &scene.settings;
    let layout = match settings.layout {
        Layout::Single => "",
        Layout::Four | Layout::Beside => texts::WITH_THREE_PLANES,
        Layout::Pair => texts::BESIDE_THE_VOLUME,
    };
    let time = match (state.timeliness.is_frozen, state.timeliness.ended) {
        (true, _) => texts::IS_FROZEN,
        (false, None) => texts::IS_LIVE,
        (false, Some(_)) => texts::HAS_ENDED,
    };
    let delay = state.delay().map_or(String::new(), |delay| format!(", {delay}"));
    let origin = state.origin.map_or(String::new(), |origin| format!(", {origin}"));
    let name = format!("{}{layout}{}, {time}{delay}{origin}", settings.mode.title(), view_in_words(scene));
    let volume = match (state.cine.count, state.cine.shown) {
        (count, Some(at)) => texts::volume_of_loop(at + 1, count),
        _ => String::new(),
    };
    let count = state.controls.measures().len();
    let drawn = if state.timeliness.is_late { texts::IS_DRAWN } else { "" };
    (name, format!("{drawn}{volume}{}", texts::count_of_measurements(count)))
}

fn view_in_words(scene: &Scene) -> String {
    let settings = &scene.settings;
    if scene.is_flat() {
        let plane = settings.planes.plane.letter();
        let curved = scene.curve().map_or(String::new(), |curve| texts::with_curved_plane(curve.plane.letter()));
        return if scene.shows_three() { curved } else { texts::of_plane(plane) + &curved };
    }
    match VIEWPOINTS.iter().find(|(viewpoint, _)| view::is_seen_from(scene, *viewpoint)) {
        Some((_, side)) => texts::seen_from(side.to_lowercase()),
        None => texts::turned_to(settings.camera.azimuth, settings.camera.elevation),
    }
}

/// True if the pointer, the keyboard or a screen reader moves a slider. egui also reports a change when it rounds a value to the step, without any input.
pub(super) fn asks_for_value(ui: &Ui, slider: &Response) -> bool {
    if slider.dragged() || slider.clicked() || slider.is_pointer_button_down_on() {
        return true;
    }
    let has_focus = slider.has_focus();
    ui.input(|input| {
        let is_stepped = has_focus && (input.key_pressed(Key::ArrowLeft) || input.key_pressed(Key::ArrowRight));
        let actions = [Action::SetValue, Action::Increment, Action::Decrement];
        is_stepped || actions.into_iter().any(|action| input.has_accesskit_action_request(slider.id, action))
    })
}

/// The frame of the focused control, and the ring around the pointer by keyboard: bright with a dark outline, so that they are visible on every colour.
pub(super) const FOCUS_STROKES: [Stroke; 2] =
    [Stroke { width: 5.0, color: FOCUS_EDGE }, Stroke { width: 2.5, color: FOCUS }];

/// Draws the frame around the focused control.
pub(super) fn mark_focus(context: &Context) {
    let focused = context.memory(|memory| memory.focused()).and_then(|id| context.read_response(id));
    let Some(control) = focused else { return };
    let painter = context.layer_painter(control.layer_id);
    for stroke in FOCUS_STROKES {
        painter.rect_stroke(control.rect.expand(1.0), 6.0, stroke, StrokeKind::Middle);
    }
}
