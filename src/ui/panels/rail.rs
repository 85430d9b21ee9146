//! The rail on the left: modes and tools, and in a window without a column the controls too, each under a tab. A window that has no room for a rail has it as a
//! drawer over the picture, which a button of the bar opens.

use super::colours::{EDGE, PANEL};
use super::names::{self, Tell};
use super::{MODES_WIDTH, PanelState, TOUCH_SIZE};
use crate::command::{Command, RailTab};
use crate::texts;
use egui::accesskit::Role;
use egui::{Area, Button, Frame, Id, Margin, Order, Panel, Stroke, Ui, pos2, vec2};

const TABS: [(RailTab, &str, &str); 2] = [
    (RailTab::Tools, texts::TAB_TOOLS, texts::TAB_TOOLS_HINT),
    (RailTab::Controls, texts::CONTROLS, texts::TAB_CONTROLS_HINT),
];
/// In a lower drawer the tabs are low, points.
const LOW_DRAWER: f32 = 150.0;

/// What of the rail the user chose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rail {
    pub tab: RailTab,
    /// The drawer is open, in a window that has one.
    pub is_open: bool,
}

impl Rail {
    /// Executes a command for the rail; false if it is another one's.
    pub fn apply(&mut self, command: &Command, has_drawer: bool) -> bool {
        match *command {
            Command::RailTab(tab) => self.tab = tab,
            Command::ToggleDrawer => self.is_open = !self.is_open,
            Command::SwitchRail if has_drawer => {
                (self.is_open, self.tab) = match (self.is_open, self.tab) {
                    (false, _) => (true, RailTab::Controls),
                    (true, RailTab::Controls) => (true, RailTab::Tools),
                    (true, RailTab::Tools) => (false, RailTab::Tools),
                }
            }
            Command::SwitchRail => {
                self.tab = if self.tab == RailTab::Tools { RailTab::Controls } else { RailTab::Tools };
            }
            _ => return false,
        }
        true
    }
}

/// Shows the rail at the edge of the window. `show`: shows what a tab has.
pub(super) fn show_rail(
    ui: &mut Ui,
    state: &PanelState,
    width: f32,
    execute: &mut dyn FnMut(Command),
    show: impl FnOnce(&mut Ui, RailTab, &mut dyn FnMut(Command)),
) {
    Panel::left("rail").exact_size(width).resizable(false).show_separator_line(false).show(ui, |ui| {
        if state.room.has_column {
            return show(ui, RailTab::Tools, execute);
        }
        ui.add_space(6.0);
        tabs(ui, state, [width, TOUCH_SIZE * 0.75], execute);
        show(ui, state.visible.rail.tab, execute);
    });
}

/// Width and height of the drawer in a window of this size above its bar, points.
pub(super) fn drawer_size([width, height]: [f32; 2], below: f32) -> [f32; 2] {
    [width.min(MODES_WIDTH), (height - below).max(1.0)]
}

/// Shows the rail as a drawer over the picture.
pub(super) fn show_drawer(
    ui: &mut Ui,
    state: &PanelState,
    [width, height]: [f32; 2],
    execute: &mut dyn FnMut(Command),
    show: impl FnOnce(&mut Ui, RailTab, &mut dyn FnMut(Command)),
) {
    let area = Area::new(Id::new("drawer")).order(Order::Middle).fixed_pos(pos2(0.0, 0.0)).constrain(false);
    area.show(ui.ctx(), |ui| {
        let frame = Frame::new().fill(PANEL).stroke(Stroke::new(1.0, EDGE)).inner_margin(Margin::symmetric(7, 5));
        frame.show(ui, |ui| {
            let inner = vec2(width - 16.0, height - 12.0);
            ui.set_min_size(inner);
            ui.set_max_size(inner);
            let tab = if height < LOW_DRAWER { 28.0 } else { TOUCH_SIZE * 0.75 };
            tabs(ui, state, [width, tab], execute);
            show(ui, state.visible.rail.tab, execute);
        });
    });
}

fn tabs(ui: &mut Ui, state: &PanelState, [width, height]: [f32; 2], execute: &mut dyn FnMut(Command)) {
    let each = vec2((width - 16.0 - ui.spacing().item_spacing.x) / 2.0, height);
    ui.horizontal(|ui| {
        names::name(ui, Role::TabList, texts::TABS);
        for (tab, name, hint) in TABS {
            let is_chosen = state.visible.rail.tab == tab;
            let button = Button::selectable(is_chosen, name).frame_when_inactive(true).min_size(each);
            if ui.add(button).tell(hint).with_role(Role::Tab).chosen(is_chosen).clicked() {
                execute(Command::RailTab(tab));
            }
        }
    });
}
