//! The panels with buttons and sliders: modes and tools on the left, controls on the right, the cine loop below. The six controls that
//! every examination needs are in front; the others are below them, by stage.

use super::colours::{
    self, ABSENT, ACCENT, BUTTON, EDGE, ON_SELECTED, ON_WARNING, OUTLINE, SELECTED, TEXT, WARNING, WEAK_TEXT,
};
use super::names::{self, Tell};
use super::widgets::{front, name_and_value, slider, switch};
use super::{PanelState, TEXT_SIZE, TOUCH_SIZE, heading};
use super::{body_marks, measures, rail, recordings, sides, tools};
use crate::cine_player::{CineState, SPEEDS};
use crate::command::{Command, RailTab, Tool};
use crate::scene::Slider as Control;
use crate::scene::{ColourMap, Layout, Mode, PlaneName, Settings, Transfer, TransferName};
use crate::sliders::{GROUPS, SLIDERS};
use crate::texts;
use crate::texts::hints;
use crate::view;
use egui::accesskit::Role;
use egui::{
    Align, Button, CollapsingHeader, FontId, Label, Panel, RichText, ScrollArea, Sense, Slider, Stroke, Ui, WidgetInfo,
    WidgetType, vec2,
};
use std::time::Duration;

const TOOLS: [(Tool, &str); 8] = [
    (Tool::Rotate, texts::TURN),
    (Tool::Light, texts::LIGHT),
    (Tool::Region, texts::REGION),
    (Tool::Clip, texts::CLIP),
    (Tool::Cut, texts::CUT),
    (Tool::Brush, texts::BRUSH),
    (Tool::Plane, texts::CROSSHAIR),
    (Tool::Curve, texts::CURVE),
];

/// In less width two buttons stand beside each other, not three, points.
const NARROW: f32 = 220.0;

const PLANES: [(PlaneName, &str); 3] = [(PlaneName::A, "A"), (PlaneName::B, "B"), (PlaneName::C, "C")];

/// The controls in front: their names, and the keys of the sliders of which the first that the mode has is meant.
const FRONT: [(&str, &[&str]); 6] = [
    (texts::THRESHOLD, &["threshold"]),
    (texts::GAIN, &["post.brightness"]),
    (texts::SMOOTH, &["smoothing"]),
    (texts::BRIGHTNESS, &["light.volume.exposure", "post.gamma"]),
    (texts::LAMP, &["light.diffuse"]),
    (texts::DEPTH, &["start_depth"]),
];

pub(super) fn show_modes(ui: &mut Ui, state: &PanelState, width: f32, execute: &mut dyn FnMut(Command)) {
    let tab = |ui: &mut Ui, tab, execute: &mut dyn FnMut(Command)| show_tab(ui, state, tab, width, execute);
    rail::show_rail(ui, state, width, execute, tab);
}

/// Modes, tools and controls over the picture of a small window.
pub(super) fn show_drawer(ui: &mut Ui, state: &PanelState, size: [f32; 2], execute: &mut dyn FnMut(Command)) {
    let tab = |ui: &mut Ui, tab, execute: &mut dyn FnMut(Command)| show_tab(ui, state, tab, size[0], execute);
    rail::show_drawer(ui, state, size, execute, tab);
}

/// What a tab of the rail has.
fn show_tab(ui: &mut Ui, state: &PanelState, tab: RailTab, width: f32, execute: &mut dyn FnMut(Command)) {
    match tab {
        RailTab::Tools => show_tools(ui, state, width, execute),
        RailTab::Controls => show_controls(ui, state, width, execute),
    }
}

fn show_tools(ui: &mut Ui, state: &PanelState, width: f32, execute: &mut dyn FnMut(Command)) {
    ui.scope(|ui| {
        names::name(ui, Role::Toolbar, texts::MODES_AND_TOOLS);
        // A low window scrolls.
        ScrollArea::vertical().auto_shrink(false).min_scrolled_height(0.0).show(ui, |ui| {
            let settings = state.controls.settings();
            let row = Row { width, height: TOUCH_SIZE * 0.92, title: "", is_large_title: false };
            ui.add_space(6.0);
            recordings::show_list(ui, state, width - 16.0, execute);
            undo_and_redo(ui, state, &row, execute);
            let hint = texts::PRESETS_HINT;
            let size = vec2(width - 16.0, TOUCH_SIZE * 0.75);
            if ui.add_sized(size, Button::new(texts::PRESETS)).tell(hint).clicked() {
                execute(Command::Presets);
            }
            let modes = Mode::ALL.map(|mode| (mode, mode.title()));
            row.titled(texts::MODE).show(
                ui,
                &modes,
                2,
                |m| settings.mode == m,
                hints::of_mode,
                |m| execute(Command::Mode(m)),
            );
            let layouts = [
                (Layout::Single, texts::LAYOUT_SINGLE),
                (Layout::Four, texts::LAYOUT_FOUR),
                (Layout::Pair, texts::LAYOUT_PAIR),
            ];
            row.titled(texts::LAYOUT).show(
                ui,
                &layouts,
                2,
                |l| settings.layout == l,
                hints::of_layout,
                |l| execute(Command::Layout(l)),
            );
            if !settings.mode.is_flat() {
                let is_there = |v| state.scene.is_some_and(|scene| view::is_seen_from(scene, v));
                row.titled(texts::VIEW_FROM)
                    .show(ui, &names::VIEWPOINTS, 2, is_there, hints::of_viewpoint, |v| execute(Command::LookFrom(v)));
                let size = vec2(width - 16.0, TOUCH_SIZE * 0.75);
                let turntable = Button::selectable(state.is_turning, texts::TURNTABLE).frame_when_inactive(true);
                if ui.add_sized(size, turntable).tell(texts::TURNTABLE_HINT).clicked() {
                    execute(Command::Turntable);
                }
            }
            row.titled(texts::DRAG).show(
                ui,
                &TOOLS,
                2,
                |t| state.controls.tool() == t,
                hints::of_tool,
                |t| execute(Command::Tool(t)),
            );
            if !state.room.has_column {
                tools::clip(ui, state, width - 16.0, execute);
                tools::cuts(ui, state, width - 16.0, execute);
                tools::start_line(ui, state, width - 16.0, execute);
            }
            if settings.mode.is_flat() && settings.mode != Mode::Orthogonal {
                let hint = |_| texts::PLANE_HINT;
                row.titled(texts::PLANE).show(
                    ui,
                    &PLANES,
                    3,
                    |p| settings.planes.plane == p,
                    hint,
                    |p| execute(Command::Plane(p)),
                );
            }
            if settings.mode.is_flat() || settings.layout == Layout::Four {
                let hint = texts::RECENTRE_PLANES_HINT;
                let size = vec2(width - 16.0, TOUCH_SIZE * 0.75);
                if ui.add_sized(size, Button::new(texts::RECENTRE_PLANES)).tell(hint).clicked() {
                    execute(Command::Recentre);
                }
            }
            if !state.room.has_column {
                tools::curve(ui, state, width - 16.0, execute);
            }
            names::group(ui, texts::MEASURE, |ui| {
                heading(ui, texts::MEASURE);
                measures::show_tools(ui, state, width - 16.0, execute);
            });
            if !state.room.has_column {
                body_marks::show(ui, state, width - 16.0, execute);
                measures::show_results(ui, state, width - 24.0, execute);
            }
            let files = [
                (Command::OpenFiles, texts::OPEN, texts::OPEN_HINT),
                (Command::SaveWorkspace, texts::SAVE, texts::SAVE_WORKSPACE_HINT),
            ];
            let half = vec2((width - 16.0 - ui.spacing().item_spacing.x) / 2.0, TOUCH_SIZE * 0.75);
            let hint = texts::EXPORT_HINT;
            let whole = vec2(width - 16.0, TOUCH_SIZE * 0.75);
            names::group(ui, texts::WORKSPACE, |ui| {
                heading(ui, texts::WORKSPACE);
                ui.horizontal(|ui| {
                    for (command, name, hint) in files {
                        if ui.add(Button::new(name).min_size(half)).tell(hint).clicked() {
                            execute(command);
                        }
                    }
                });
                if ui.add_sized(whole, Button::new(texts::EXPORT)).tell(hint).clicked() {
                    execute(Command::Exports);
                }
            });
        });
    });
}

fn undo_and_redo(ui: &mut Ui, state: &PanelState, row: &Row, execute: &mut dyn FnMut(Command)) {
    let [can_undo, can_redo] = state.controls.can_undo();
    let size = vec2((row.width - 16.0 - ui.spacing().item_spacing.x) / 2.0, TOUCH_SIZE * 0.75);
    ui.horizontal(|ui| {
        for (command, name, is_there, hint) in [
            (Command::Undo, texts::UNDO, can_undo, texts::UNDO_HINT),
            (Command::Redo, texts::REDO, can_redo, texts::REDO_HINT),
        ] {
            let button = ui.add_enabled(is_there, Button::new(name).min_size(size));
            if button.tell(hint).on_disabled_hover_text(hint).clicked() {
                execute(command);
            }
        }
    });
}

/// Rows of buttons of which one is chosen, under a title.
#[derive(Clone, Copy)]
struct Row {
    /// Width of the panel, points.
    width: f32,
    height: f32,
    title: &'static str,
    /// The title is as large as the names of the controls.
    is_large_title: bool,
}

impl Row {
    fn titled(self, title: &'static str) -> Row {
        Row { title, ..self }
    }

    fn show<T: Copy>(
        &self,
        ui: &mut Ui,
        all: &[(T, &str)],
        columns: usize,
        is: impl Fn(T) -> bool,
        hint: impl Fn(T) -> &'static str,
        mut select: impl FnMut(T),
    ) {
        let gap = ui.spacing().item_spacing.x;
        let width = (self.width - 16.0 - gap * (columns - 1) as f32) / columns as f32;
        names::group(ui, self.title, |ui| {
            match self.is_large_title {
                true => _ = ui.label(self.title),
                false => heading(ui, self.title),
            }
            for some in all.chunks(columns) {
                ui.horizontal(|ui| {
                    for (value, name) in some {
                        let button = Button::selectable(is(*value), *name).frame_when_inactive(true);
                        if ui.add(button.min_size(vec2(width, self.height))).tell(hint(*value)).clicked() {
                            select(*value);
                        }
                    }
                });
            }
        });
    }
}

/// Colours of what is shown: of a volume those of its transfer function, of other modes those of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Colour {
    Transfer(TransferName),
    Map(ColourMap),
}

const OF_VOLUME: [(Colour, &str); 6] = [
    (Colour::Transfer(TransferName::Grey), texts::GREY),
    (Colour::Transfer(TransferName::Sepia), texts::SEPIA),
    (Colour::Transfer(TransferName::Skin), texts::SKIN),
    (Colour::Transfer(TransferName::Bone), texts::BONE),
    (Colour::Transfer(TransferName::Cool), texts::COOL),
    (Colour::Transfer(TransferName::Warm), texts::WARM),
];

const OF_PICTURE: [(Colour, &str); 5] = [
    (Colour::Map(ColourMap::None), texts::AS_IS),
    (Colour::Map(ColourMap::Grey), texts::GREY),
    (Colour::Map(ColourMap::Sepia), texts::SEPIA),
    (Colour::Map(ColourMap::Skin), texts::SKIN),
    (Colour::Map(ColourMap::Ice), texts::ICE),
];

/// Whose opacities a volume has: those of its own function, or of another.
const OPACITIES: [(Option<TransferName>, &str); 7] = [
    (None, texts::SAME_AS_COLOUR),
    (Some(TransferName::Grey), texts::GREY),
    (Some(TransferName::Sepia), texts::SEPIA),
    (Some(TransferName::Skin), texts::SKIN),
    (Some(TransferName::Bone), texts::BONE),
    (Some(TransferName::Cool), texts::COOL),
    (Some(TransferName::Warm), texts::WARM),
];

fn colours(settings: &Settings) -> &'static [(Colour, &'static str)] {
    match settings.mode {
        Mode::Volume | Mode::Mixed => &OF_VOLUME,
        _ => &OF_PICTURE,
    }
}

pub(super) fn show_column(ui: &mut Ui, state: &PanelState, width: f32, execute: &mut dyn FnMut(Command)) {
    let column = Panel::right("column").exact_size(width).resizable(false).show_separator_line(false);
    column.show(ui, |ui| show_controls(ui, state, width, execute));
}

/// The controls in a panel of this width, points. In the column, what belongs to the tool follows the controls in front, which keep their places.
fn show_controls(ui: &mut Ui, state: &PanelState, width: f32, execute: &mut dyn FnMut(Command)) {
    let settings = state.controls.settings();
    ui.scope(|ui| {
        names::name(ui, Role::Group, texts::CONTROLS);
        ScrollArea::vertical().id_salt("controls").auto_shrink(false).min_scrolled_height(0.0).show(ui, |ui| {
            // Leaves room for the scroll bar, which covers the edge.
            ui.set_max_width(width - 32.0);
            ui.add_space(6.0);
            heading(ui, texts::CONTROLS);
            let in_front = FRONT.map(|(name, sliders)| (name, front(sliders, settings)));
            let with_cuts = tools::depth_of_cut(state);
            let start = ["unveil.enabled", "unveil.offset"].map(|key| front(&[key], settings));
            let elsewhere = [&start[..], &tools::of_clip(settings)[..], &[with_cuts]].concat();
            for (name, number) in in_front {
                match number {
                    Some(number) if name == texts::LAMP => {
                        ui.horizontal_top(|ui| {
                            let width = ui.available_width() - BALL - ui.spacing().item_spacing.x;
                            ui.vertical(|ui| {
                                ui.set_width(width);
                                slider(ui, state, number, name, true, execute);
                            });
                            light_ball(ui, settings, execute);
                        });
                    }
                    Some(number) => slider(ui, state, number, name, true, execute),
                    None => absent(ui, name),
                }
            }
            if state.room.has_column {
                measures::show_results(ui, state, width - 40.0, execute);
                tools::clip(ui, state, width - 32.0, execute);
                tools::cuts(ui, state, width - 32.0, execute);
                tools::start_line(ui, state, width - 32.0, execute);
                tools::curve(ui, state, width - 32.0, execute);
                body_marks::show(ui, state, width - 32.0, execute);
            }
            let colours = colours(settings);
            ui.add_space(4.0);
            let is = |colour| match colour {
                Colour::Transfer(name) => match settings.volume.colour {
                    Some(colour) => colour == name,
                    None => settings.volume.transfer == Transfer::Named(name),
                },
                Colour::Map(map) => settings.post.colour_map == map,
            };
            let hint = |_| texts::COLOUR_HINT;
            Row { width: width - 24.0, height: TOUCH_SIZE * 0.8, title: texts::COLOUR, is_large_title: true }.show(
                ui,
                colours,
                if width < NARROW { 2 } else { 3 },
                is,
                hint,
                |colour| match colour {
                    Colour::Transfer(name) => execute(Command::Transfer(name)),
                    Colour::Map(map) => execute(Command::ColourMap(map)),
                },
            );
            if matches!(settings.mode, Mode::Volume | Mode::Mixed) {
                Row { width: width - 24.0, height: TOUCH_SIZE * 0.8, title: texts::OPACITY_OF, is_large_title: true }
                    .show(
                        ui,
                        &OPACITIES,
                        if width < NARROW { 2 } else { 3 },
                        |name| settings.volume.opacity == name,
                        |_| texts::OPACITY_OF_HINT,
                        |name| execute(Command::Opacity(name)),
                    );
            }
            if front(&["light.shadow.strength"], settings).is_some() {
                let mut on = settings.light.shadow.is_some_and(|shadow| shadow.strength > 0.0);
                if switch(ui, &mut on, texts::CAST_SHADOWS, texts::CAST_SHADOWS_HINT) {
                    execute(Command::Shadow(on));
                }
            }
            for number in start.iter().flatten() {
                slider(ui, state, *number, SLIDERS[*number].name, false, execute);
            }
            if settings.mode == Mode::Tomography {
                let mut on = settings.planes.reference;
                let hint = texts::REFERENCE_PICTURE_HINT;
                if switch(ui, &mut on, texts::REFERENCE_PICTURE, hint) {
                    execute(Command::Reference(on));
                }
            }
            let mut saves_bar = settings.marks.bar;
            let hint = texts::BAR_ON_SAVED_PICTURES_HINT;
            if switch(ui, &mut saves_bar, texts::BAR_ON_SAVED_PICTURES, hint) {
                execute(Command::SavesBar(saves_bar));
            }
            sides::show(ui, state, width - 32.0, execute);
            ui.add_space(8.0);
            heading(ui, texts::ADVANCED);
            for (group, name) in GROUPS {
                let is_there = |(number, s): &(usize, &Control)| {
                    let is_elsewhere =
                        elsewhere.contains(&Some(*number)) || in_front.iter().any(|(_, front)| *front == Some(*number));
                    s.group == group && s.applies(settings) && !is_elsewhere
                };
                let there: Vec<usize> = SLIDERS.iter().enumerate().filter(is_there).map(|(number, _)| number).collect();
                if there.is_empty() {
                    continue;
                }
                let shown = CollapsingHeader::new(name).id_salt(name).show_unindented(ui, |ui| {
                    names::name(ui, Role::Group, name);
                    for number in there {
                        slider(ui, state, number, SLIDERS[number].name, false, execute);
                    }
                });
                // A control in front may have the name of a stage.
                let header = shown.header_response.expanded(shown.openness > 0.5);
                header.tell(&texts::advanced_hint(name)).named(&texts::advanced_group(name));
            }
        });
    });
}

/// A control in front that the mode has not: it keeps its place.
fn absent(ui: &mut Ui, name: &str) {
    name_and_value(ui, RichText::new(name).color(ABSENT), RichText::new("-").color(ABSENT));
    let size = vec2(ui.available_width(), TOUCH_SIZE * 0.62);
    ui.allocate_exact_size(size, Sense::hover()).1.on_hover_text(texts::NO_SUCH_CONTROL);
}

/// Width of the light ball, points.
const BALL: f32 = 68.0;

/// A ball under the lamp, which a drag on it moves.
fn light_ball(ui: &mut Ui, settings: &Settings, execute: &mut dyn FnMut(Command)) {
    let (area, response) = ui.allocate_exact_size(vec2(BALL, BALL), Sense::DRAG);
    let light = settings.light.position.unwrap_or(settings.light.direction).normalize_or(glam::DVec3::Z);
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Image, true, texts::LIGHT_BALL));
    let [right, up] = [light.x.atan2(light.z), light.y.clamp(-1.0, 1.0).asin()].map(|angle| angle.to_degrees().round());
    let response = response.tell(texts::LIGHT_BALL_HINT).with_value(&texts::lamp_place(right, up));
    let (centre, radius) = (area.center(), BALL / 2.0 - 2.0);
    // The ball in rings, lit as a matt one is.
    const RINGS: u32 = 8;
    const SPOKES: u32 = 24;
    let mut mesh = egui::Mesh::default();
    for ring in 0..=RINGS {
        for spoke in 0..SPOKES {
            let out = f64::from(ring) / f64::from(RINGS);
            let (sin, cos) = (f64::from(spoke) / f64::from(SPOKES) * std::f64::consts::TAU).sin_cos();
            let normal = glam::DVec3::new(out * cos, out * sin, (1.0 - out * out).max(0.0).sqrt());
            let bright = 0.12 + 0.6 * normal.dot(light).max(0.0);
            let at = centre + vec2(normal.x as f32, -normal.y as f32) * radius;
            mesh.colored_vertex(at, colours::of_scene([bright; 3]));
        }
    }
    for (ring, spoke) in (0..RINGS).flat_map(|ring| (0..SPOKES).map(move |spoke| (ring, spoke))) {
        let corner = |ring: u32, spoke: u32| ring * SPOKES + spoke % SPOKES;
        let [a, b] = [corner(ring, spoke), corner(ring, spoke + 1)];
        let [c, d] = [corner(ring + 1, spoke), corner(ring + 1, spoke + 1)];
        mesh.add_triangle(a, c, d);
        mesh.add_triangle(a, d, b);
    }
    let painter = ui.painter();
    painter.add(mesh);
    let edge = if response.hovered() || response.dragged() { TEXT } else { EDGE };
    painter.circle_stroke(centre, radius, Stroke::new(1.5, edge));
    let lamp = centre + vec2(light.x as f32, -light.y as f32) * radius;
    painter.circle(lamp, 5.0, ON_SELECTED, Stroke::new(1.5, OUTLINE));
    let by = response.drag_delta();
    if response.dragged() && by != egui::Vec2::ZERO {
        // The width of the ball is that of the dome over which the lamp moves.
        execute(Command::MoveLight([by.x, by.y].map(|points| f64::from(points / (2.0 * radius)))));
    }
}

pub(super) fn show_cine_bar(ui: &mut Ui, state: &PanelState, height: f32, execute: &mut dyn FnMut(Command)) {
    Panel::bottom("bar").exact_size(height).resizable(false).show_separator_line(false).show(ui, |ui| {
        names::name(ui, Role::Toolbar, texts::CINE_LOOP);
        let touch = (height - 12.0).min(TOUCH_SIZE);
        ui.horizontal_centered(|ui| {
            let room = ui.available_width();
            let is_narrow = room < 420.0;
            let (label, fill, colour) = match (state.is_frozen, state.ended) {
                (true, _) => (texts::FROZEN.to_string(), WARNING, ON_WARNING),
                (false, None) => (texts::FREEZE.into(), SELECTED, ON_SELECTED),
                (false, Some(_)) if is_narrow => (texts::ENDED.into(), BUTTON, TEXT),
                (false, Some(ago)) => {
                    // It says another time then.
                    ui.ctx().request_repaint_after(Duration::from_secs(1));
                    (texts::ended_for(ago), BUTTON, TEXT)
                }
            };
            let text = RichText::new(&label).color(colour).strong();
            let width = if is_narrow { 84.0 } else { 120.0 };
            let (name, hint) = match (state.is_frozen, state.ended) {
                (true, _) => (texts::UNFREEZE, texts::FREEZE_HINT),
                (false, None) => (texts::FREEZE, texts::FREEZE_HINT),
                (false, Some(_)) => (label.as_str(), texts::ENDED_HINT),
            };
            let freeze = Button::new(text).fill(fill).min_size(vec2(width, touch));
            if ui.add(freeze).tell(hint).named(name).clicked() {
                execute(Command::Freeze);
            }
            let mut left = room - width - ui.spacing().item_spacing.x;
            let loop_room = LoopRoom::of(ui, state);
            // In the order in which they give way to a narrow window; the first is always there.
            let drawer = match (is_narrow, room < NARROW) {
                (true, true) => (texts::DRAWER_SIGN, 32.0),
                (true, false) => (texts::DRAWER_SIGN, 44.0),
                (false, _) => (texts::CONTROLS, 96.0),
            };
            let save = (
                if is_narrow { texts::SAVE } else { texts::SAVE_PICTURE },
                if is_narrow { 64.0 } else { 124.0 },
                Command::SavePicture,
                texts::SAVE_PICTURE_HINT,
            );
            let drawer = (drawer.0, drawer.1, Command::ToggleDrawer, texts::DRAWER_HINT);
            let buttons = [
                ("?", 44.0, Command::ToggleHelp, texts::HELP_HINT),
                (texts::SAVE_LOOP, 100.0, Command::SaveLoop, texts::SAVE_LOOP_HINT),
                (texts::RESET, 70.0, Command::Reset, texts::RESET_HINT),
                (texts::FULL_SCREEN, 110.0, Command::ToggleFullScreen, texts::FULL_SCREEN_HINT),
                (texts::TIMES, 70.0, Command::ToggleTimes, texts::TIMES_HINT),
            ];
            let mut shown = Vec::new();
            let between = ui.spacing().item_spacing.x;
            for (label, width, command, hint) in
                [save].into_iter().chain(state.room.has_drawer.then_some(drawer)).chain(buttons)
            {
                let wanted = width + between;
                // The loop needs its buttons and some of its slider.
                let kept = match command {
                    Command::SavePicture => f32::NEG_INFINITY,
                    Command::ToggleDrawer => -between,
                    Command::ToggleHelp if left < LoopRoom::LEAST => 0.0,
                    Command::ToggleHelp => 60.0,
                    Command::SaveLoop => loop_room.steps,
                    _ => loop_room.steps + LoopRoom::TOOLS,
                };
                if left >= wanted + kept {
                    left -= wanted;
                    shown.push((label, width, command, hint));
                }
            }
            if left >= LoopRoom::LEAST {
                cine(ui, state, left, touch, &loop_room, execute);
            }
            ui.with_layout(egui::Layout::right_to_left(Align::Center), |ui| {
                // From the right: help first, the picture next to the loop.
                shown.sort_by_key(|(.., command, _)| match command {
                    Command::ToggleHelp => 0,
                    Command::ToggleFullScreen => 1,
                    Command::ToggleTimes => 2,
                    Command::Reset => 3,
                    Command::SaveLoop => 4,
                    Command::ToggleDrawer => 5,
                    _ => 6,
                });
                for (label, width, command, hint) in shown {
                    let name = match command {
                        Command::ToggleHelp => texts::HELP,
                        Command::ToggleDrawer => texts::DRAWER,
                        _ => label,
                    };
                    let button = ui.add(Button::new(label).min_size(vec2(width, touch))).tell(hint).named(name);
                    let button = match command {
                        Command::ToggleDrawer => button.expanded(state.visible.rail.is_open),
                        _ => button,
                    };
                    if button.clicked() {
                        execute(command);
                    }
                }
            });
        });
    });
}

/// Room that the cine loop needs, points.
struct LoopRoom {
    text: String,
    /// For the text alone.
    words: f32,
    /// With buttons, steps, the text and a short slider.
    steps: f32,
}

impl LoopRoom {
    /// In addition for the speed and the marks.
    const TOOLS: f32 = 268.0;
    const SHORTEST_SLIDER: f32 = 50.0;
    /// With less, the bar says nothing of the loop.
    const LEAST: f32 = 150.0;

    fn of(ui: &Ui, state: &PanelState) -> LoopRoom {
        let text = cine_text(&state.cine);
        let words = ui.painter().layout_no_wrap(text.clone(), FontId::proportional(TEXT_SIZE), TEXT).size().x;
        let between = ui.spacing().item_spacing.x;
        LoopRoom { text, words, steps: 64.0 + 2.0 * 44.0 + LoopRoom::SHORTEST_SLIDER + words + 6.0 * between }
    }
}

/// The cine loop in so much room, points.
fn cine(ui: &mut Ui, state: &PanelState, room: f32, touch: f32, needed: &LoopRoom, execute: &mut dyn FnMut(Command)) {
    let cine = &state.cine;
    if cine.count == 0 {
        ui.label(RichText::new(texts::NO_VOLUMES_YET).color(WEAK_TEXT));
        return;
    }
    let mut button = |ui: &mut Ui, label: &str, width: f32, name: &str, hint: &str, command: Command| {
        if ui.add(Button::new(label).min_size(vec2(width, touch))).tell(hint).named(name).clicked() {
            execute(command);
        }
    };
    let label = if cine.is_playing { texts::STOP } else { texts::PLAY };
    button(ui, label, 64.0, label, texts::PLAY_HINT, Command::PlayCine);
    if room >= needed.steps {
        button(ui, "<", 44.0, texts::PREVIOUS_VOLUME, texts::PREVIOUS_VOLUME_HINT, Command::StepCine(-1));
        button(ui, ">", 44.0, texts::NEXT_VOLUME, texts::NEXT_VOLUME_HINT, Command::StepCine(1));
        let has_tools = room >= needed.steps + LoopRoom::TOOLS;
        if has_tools {
            let speed = format!("{}x", cine.speed);
            // After the fastest comes the slowest.
            let faster = if cine.speed >= SPEEDS[SPEEDS.len() - 1] { -(SPEEDS.len() as i32) } else { 1 };
            let hint = texts::SPEED_HINT;
            button(ui, &speed, 56.0, &texts::speed(&speed), hint, Command::CineSpeed(faster));
            let (label, name, hint) = match cine.goes_back_and_forth {
                true => ("<->", texts::BACK_AND_FORTH, texts::BACK_AND_FORTH_HINT),
                false => ("->", texts::FORWARDS, texts::FORWARDS_HINT),
            };
            button(ui, label, 44.0, name, hint, Command::BackAndForth(!cine.goes_back_and_forth));
            let hint = texts::LOOP_BEGINS_HERE_HINT;
            button(ui, "[", 36.0, texts::LOOP_BEGINS_HERE, hint, Command::MarkCine(false));
            let hint = texts::LOOP_ENDS_HERE_HINT;
            button(ui, "]", 36.0, texts::LOOP_ENDS_HERE, hint, Command::MarkCine(true));
            let whole = Button::new(texts::ALL_SHORT).min_size(vec2(44.0, touch));
            let whole = ui.add_enabled(cine.is_trimmed, whole).tell(texts::ALL_VOLUMES_HINT);
            if whole.named(texts::ALL_VOLUMES).clicked() {
                execute(Command::WholeCine);
            }
        }
        let tools = if has_tools { LoopRoom::TOOLS } else { 0.0 };
        ui.spacing_mut().slider_width = (room - needed.steps - tools + LoopRoom::SHORTEST_SLIDER).min(400.0);
        let mut at = cine.shown.map_or(cine.count, |p| p + 1);
        let slider = ui.add_enabled(cine.count > 1, Slider::new(&mut at, 1..=cine.count).show_value(false));
        if cine.is_trimmed {
            // What is played, under the slider.
            let last = (cine.count - 1).max(1) as f32;
            let x = |index: usize| egui::lerp(slider.rect.x_range().shrink(8.0), index as f32 / last);
            let [low, high] = [*cine.range.start(), *cine.range.end()].map(x);
            let y = slider.rect.bottom() - 3.0;
            ui.painter().hline(low - 3.0..=high + 3.0, y, Stroke::new(3.0, ACCENT));
        }
        let slider = slider.tell(texts::VOLUME_OF_THE_LOOP_HINT).named(texts::VOLUME_OF_THE_LOOP);
        let is_held = slider.dragged() || slider.clicked() || slider.is_pointer_button_down_on();
        let is_asked = names::asks_for_value(ui, &slider);
        if (is_held || is_asked) && cine.shown != Some(at - 1) {
            execute(Command::SeekCine(at - 1));
        }
        ui.add(Label::new(&needed.text).extend());
    } else if room >= 64.0 + needed.words + ui.spacing().item_spacing.x {
        ui.add(Label::new(&needed.text).extend());
    } else {
        ui.add(Label::new(place_text(cine)).extend());
    }
}

fn place_text(cine: &CineState) -> String {
    texts::place_in_loop(cine.shown.map_or("-".into(), |p| (p + 1).to_string()), cine.count)
}

/// Place, time and rate of the loop, as far as they are known.
fn cine_text(cine: &CineState) -> String {
    let mut text = place_text(cine);
    if let Some(seconds) = cine.seconds {
        text += &texts::loop_seconds(seconds);
    }
    if let Some(rate) = cine.rate {
        text += &texts::loop_rate(rate);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::Layers;

    #[test]
    fn every_mode_has_the_controls_in_front_that_it_can_have() {
        for mode in Mode::ALL {
            let mut settings = Layers::default().finish().expect("settings");
            settings.set_mode(mode);
            let names: Vec<&str> = FRONT
                .iter()
                .filter(|(_, sliders)| front(sliders, &settings).is_some())
                .map(|(name, _)| *name)
                .collect();
            assert!(["Gain", "Smooth", "Brightness"].iter().all(|name| names.contains(name)), "{mode:?}: {names:?}");
            assert!(mode != Mode::Surface || names.len() == FRONT.len(), "{mode:?}: {names:?}");
        }
        for (name, sliders) in FRONT {
            for slider in sliders {
                assert!(SLIDERS.iter().any(|s| s.key == *slider), "{name}: no slider {slider}");
            }
        }
    }
}
