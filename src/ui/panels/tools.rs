//! The options of tools, at the top of the inspector: clip faces, cuts and brush, the curved plane, the start line.

use super::colours::ACCENT;
use super::names::Tell;
use super::widgets::{add_and_remove, command_button, front, say_step, scale_slider, slider, switch};
use super::{Execute, PanelState, ROW_HEIGHT, section};
use crate::command::{Command, Tool};
use crate::controls::BRUSH_RADII;
use crate::scene::{KeptSide, MAX_START_POINTS, MIN_START_POINTS, Settings};
use crate::sliders::SLIDERS;
use crate::texts;
use crate::view;
use egui::{RichText, Ui, vec2};

/// The indices of the two sliders for faces of clip planes; None for one that does not exist with these settings.
pub(super) fn of_clip(settings: &Settings) -> [Option<usize>; 2] {
    ["cap.enabled", "cap.level"].map(|key| front(&[key], settings))
}

/// Shows, while there are clip planes, the switch for showing echoes on cut faces, and their level.
pub(super) fn clip(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let there = of_clip(state.controls.settings());
    if there == [None; 2] {
        return;
    }
    section(ui, texts::CLIP, |ui| {
        ui.set_max_width(width);
        for number in there.into_iter().flatten() {
            slider(ui, state, number, SLIDERS[number].name, execute);
        }
    });
}

/// The index of the slider for the depth of the last cut; None if the slider is not shown.
pub(super) fn depth_of_cut(state: &PanelState) -> Option<usize> {
    front(&["cuts.depth"], state.controls.settings()).filter(|_| state.controls.tool() == Tool::Cut)
}

/// Shows, while the tool for cuts is selected, which side of a contour is kept and the depth of the last cut; and, if there are cuts, a button
/// that removes them.
pub(super) fn cuts(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let is_chosen = state.controls.tool() == Tool::Cut;
    let is_brush = state.controls.tool() == Tool::Brush;
    if !is_chosen && !is_brush && state.controls.settings().cuts.is_empty() {
        return;
    }
    section(ui, texts::CUTS, |ui| {
        ui.set_max_width(width);
        if is_chosen {
            let is_inside = state.controls.kept_side() == KeptSide::Inside;
            let keep = |on| Command::KeepSide(if on { KeptSide::Inside } else { KeptSide::Outside });
            switch(ui, is_inside, texts::KEEP_INSIDE, keep, execute);
        }
        if is_brush {
            brush_radius(ui, state, execute);
        }
        if let Some(number) = depth_of_cut(state) {
            slider(ui, state, number, SLIDERS[number].name, execute);
        }
        if !state.controls.settings().cuts.is_empty() {
            command_button(ui, vec2(width, ROW_HEIGHT), texts::REMOVE_ALL_CUTS, Command::ClearCuts, execute);
        }
    });
}

/// Shows, while the tool for curved planes is selected, what to do next; and, if there is a curved plane, a button that removes it.
pub(super) fn curve(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let (is_chosen, line) = (state.controls.tool() == Tool::Curve, state.controls.line());
    let has_curve = state.controls.settings().planes.curve.is_some();
    if !is_chosen && !has_curve {
        return;
    }
    section(ui, texts::CURVED_PLANE, |ui| {
        ui.set_max_width(width);
        if is_chosen {
            let step = match (line.map(|line| line.points.len()), has_curve) {
                (Some(1), _) => texts::CURVE_STEP_SECOND,
                (Some(_), _) => texts::CURVE_STEP_NEXT,
                (None, true) => texts::CURVE_STEP_CHANGE,
                (None, false) => texts::CURVE_STEP_FIRST,
            };
            say_step(ui, step, ACCENT);
        }
        let size = vec2(width, ROW_HEIGHT);
        if line.is_some_and(|line| line.points.len() > 1) {
            let [name, hint] = texts::END_CURVE;
            let button = super::overlays::first(RichText::new(name));
            ui.add_sized(size, button).tell(hint).gives(Command::EndCurve, execute);
        }
        if has_curve {
            command_button(ui, size, texts::REMOVE_CURVE, Command::ClearCurve, execute);
        }
    });
}

/// Shows, while the tool for the region is selected, the switch of the start curve, the depths of its handles and their number; with other tools
/// only the switch, if the start curve is bent.
pub(super) fn start_line(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let Some(scene) = state.scene.filter(|scene| scene.renders()) else { return };
    let points = state.controls.settings().region.start_curve.as_deref();
    let is_chosen = state.controls.tool() == Tool::Region;
    if !is_chosen && points.is_none() {
        return;
    }
    section(ui, texts::START_LINE, |ui| {
        ui.set_max_width(width);
        let about = [texts::CURVED_LINE, texts::CURVED_LINE_HINT];
        switch(ui, points.is_some(), about, |_| Command::ToggleStartCurve, execute);
        let Some(points) = points.filter(|_| is_chosen) else { return };
        let [low, high] = [scene.low, scene.high].map(|corner| view::below_face(scene, corner).y);
        for (n, [lateral, depth]) in points.iter().copied().enumerate() {
            let name = texts::start_handle(n + 1);
            let shown = (depth, texts::millimetres(depth));
            let to = |depth| Command::MoveStartHandle(n, [lateral, depth]);
            scale_slider(ui, [&name, texts::START_HANDLE_HINT], shown, ([low, high], 0.5), to, execute);
        }
        let both = [
            (Command::AddStartHandle(None), texts::ADD_HANDLE, points.len() < MAX_START_POINTS),
            (Command::RemoveStartHandle(None), texts::REMOVE_HANDLE, points.len() > MIN_START_POINTS),
        ];
        add_and_remove(ui, width, both, execute);
    });
}

pub(super) fn brush_radius(ui: &mut Ui, state: &PanelState, execute: Execute) {
    let radius = state.controls.brush_radius();
    let shown = (radius, texts::millimetres(radius));
    scale_slider(ui, texts::RADIUS_OF_BRUSH, shown, (BRUSH_RADII, 0.5), Command::BrushRadius, execute);
}
