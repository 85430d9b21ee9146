//! The inspector's part for the look: mode and view of a rendering, the six most used controls, colours, and all other controls by stage.

use super::colours::{self, EDGE, ON_SELECTED, OUTLINE, TEXT};
use super::names::{self, Tell};
use super::widgets::{absent, front, row_of, slider, switch};
use super::{Execute, PanelState, ROW_HEIGHT, heading, section, tools};
use crate::command::Command;
use crate::scene::Slider as Control;
use crate::scene::{ColourMap, Group, Mode, Settings, Transfer, TransferName};
use crate::sliders::{GROUPS, SLIDERS};
use crate::texts;
use crate::texts::hints;
use crate::view;
use egui::{Button, CollapsingHeader, Sense, Stroke, Ui, WidgetInfo, WidgetType, vec2};

/// The modes that render; the others are views of planes.
const RENDERED: [Mode; 7] = [Mode::Surface, Mode::Volume, Mode::Mixed, Mode::Cube, Mode::Mip, Mode::MinIp, Mode::Mean];

/// The controls in front: their names, and the keys of the sliders of which the first that the mode has is meant.
const FRONT: [(&str, &[&str]); 6] = [
    (texts::THRESHOLD, &["threshold"]),
    (texts::GAIN, &["post.brightness"]),
    (texts::SMOOTH, &["smoothing"]),
    (texts::BRIGHTNESS, &["light.volume.exposure", "post.gamma"]),
    (texts::LAMP, &["light.diffuse"]),
    (texts::DEPTH, &["start_depth"]),
];

/// The transfer functions of a volume, which give it colours and opacities.
const TRANSFERS: [(TransferName, &str); 6] = [
    (TransferName::Grey, texts::GREY),
    (TransferName::Sepia, texts::SEPIA),
    (TransferName::Skin, texts::SKIN),
    (TransferName::Bone, texts::BONE),
    (TransferName::Cool, texts::COOL),
    (TransferName::Warm, texts::WARM),
];

const OF_PICTURE: [(ColourMap, &str); 5] = [
    (ColourMap::None, texts::AS_IS),
    (ColourMap::Grey, texts::GREY),
    (ColourMap::Sepia, texts::SEPIA),
    (ColourMap::Skin, texts::SKIN),
    (ColourMap::Ice, texts::ICE),
];

/// Shows this tab of the inspector, `width` points wide.
pub(super) fn show(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let settings = state.controls.settings();
    let modes = RENDERED.map(|mode| (Command::Mode(mode), [mode.title(), hints::of_mode(mode)]));
    let is_chosen = |command| command == Command::Mode(settings.mode);
    row_of(ui, texts::RENDERING, &modes, (4, width), is_chosen, execute);
    let in_front = FRONT.map(|(name, sliders)| (name, front(sliders, settings)));
    section(ui, texts::CONTROLS, |ui| {
        for (name, number) in in_front {
            match number {
                Some(number) if name == texts::LAMP => {
                    ui.horizontal_top(|ui| {
                        let width = ui.available_width() - BALL - ui.spacing().item_spacing.x;
                        ui.vertical(|ui| {
                            ui.set_width(width);
                            slider(ui, state, number, name, execute);
                        });
                        light_ball(ui, settings, execute);
                    });
                }
                Some(number) => slider(ui, state, number, name, execute),
                None => absent(ui, name),
            }
        }
        if front(&["light.shadow.strength"], settings).is_some() {
            let is_on = settings.light.shadow.is_some_and(|shadow| shadow.strength > 0.0);
            switch(ui, is_on, texts::CAST_SHADOWS, Command::Shadow, execute);
        }
    });
    let start = ["unveil.enabled", "unveil.offset"].map(|key| front(&[key], settings));
    if start.iter().any(Option::is_some) {
        section(ui, texts::RENDER_START, |ui| {
            for number in start.iter().flatten() {
                slider(ui, state, *number, SLIDERS[*number].name, execute);
            }
        });
    }
    show_colours(ui, settings, width, execute);
    if !settings.mode.is_flat() {
        views(ui, state, width, execute);
    }
    ui.add_space(8.0);
    let reset = Button::new(texts::RESET).min_size(vec2(width, ROW_HEIGHT));
    ui.add(reset).tell(texts::RESET_HINT).gives(Command::Reset, execute);
    ui.add_space(4.0);
    heading(ui, texts::ADVANCED);
    let elsewhere = [&start[..], &tools::of_clip(settings)[..], &[tools::depth_of_cut(state)]].concat();
    for (group, name) in GROUPS.into_iter().filter(|(group, _)| *group != Group::Planes) {
        let is_there = |(number, s): &(usize, &Control)| {
            let is_elsewhere =
                elsewhere.contains(&Some(*number)) || in_front.iter().any(|(_, front)| *front == Some(*number));
            s.group == group && s.applies(settings) && !is_elsewhere
        };
        let there: Vec<usize> = SLIDERS.iter().enumerate().filter(is_there).map(|(number, _)| number).collect();
        if there.is_empty() {
            continue;
        }
        let is_sought = state.visible.inspector.sought.is_some_and(|number| there.contains(&number));
        let header = CollapsingHeader::new(name).id_salt(name).open(is_sought.then_some(true));
        let shown = header.show_unindented(ui, |ui| {
            names::name(ui, egui::accesskit::Role::Group, name);
            for number in there {
                slider(ui, state, number, SLIDERS[number].name, execute);
            }
        });
        // A control in front may have the name of a stage.
        let header = shown.header_response.expanded(shown.openness > 0.5);
        header.tell(&texts::advanced_hint(name)).named(&texts::advanced_group(name));
    }
}

/// Where a rendering is seen from.
fn views(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let is_seen_from = |v| state.scene.is_some_and(|scene| view::is_seen_from(scene, v));
    let is_there = |command| matches!(command, Command::LookFrom(v) if is_seen_from(v));
    let views = names::VIEWPOINTS.map(|(v, name)| (Command::LookFrom(v), [name, hints::of_viewpoint(v)]));
    row_of(ui, texts::VIEW_FROM, &views, (4, width), is_there, execute);
    let turntable = Button::selectable(state.is_turning, texts::TURNTABLE).frame_when_inactive(true);
    let turntable = ui.add(turntable.min_size(vec2(width, ROW_HEIGHT)));
    turntable.tell(texts::TURNTABLE_HINT).gives(Command::Turntable, execute);
}

/// Shows the colours: of a volume those of its transfer function, and whose opacities it has; of other modes those of the picture.
fn show_colours(ui: &mut Ui, settings: &Settings, width: f32, execute: Execute) {
    let is_volume = matches!(settings.mode, Mode::Volume | Mode::Mixed);
    let of_volume = TRANSFERS.map(|(transfer, name)| (Command::Transfer(transfer), [name, texts::COLOUR_HINT]));
    let of_picture = OF_PICTURE.map(|(map, name)| (Command::ColourMap(map), [name, texts::COLOUR_HINT]));
    let is_chosen = |colour| match colour {
        Command::Transfer(name) => match settings.volume.colour {
            Some(colour) => colour == name,
            None => settings.volume.transfer == Transfer::Named(name),
        },
        colour => colour == Command::ColourMap(settings.post.colour_map),
    };
    let colours = if is_volume { &of_volume[..] } else { &of_picture };
    row_of(ui, texts::COLOUR, colours, (3, width), is_chosen, execute);
    if is_volume {
        let about = |(of, name)| (Command::Opacity(of), [name, texts::OPACITY_OF_HINT]);
        let named = TRANSFERS.map(|(transfer, name)| (Some(transfer), name));
        let opacities: Vec<_> = [(None, texts::SAME_AS_COLOUR)].into_iter().chain(named).map(about).collect();
        let is_chosen = |opacity| opacity == Command::Opacity(settings.volume.opacity);
        row_of(ui, texts::OPACITY_OF, &opacities, (4, width), is_chosen, execute);
    }
}

/// Width of the light ball, points.
const BALL: f32 = 68.0;

/// A ball under the lamp, which a drag on it moves.
fn light_ball(ui: &mut Ui, settings: &Settings, execute: Execute) {
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
