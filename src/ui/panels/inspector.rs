//! The inspector on the right: the options of the selected tool, and below them one of its parts, selected by tabs. If the window has no room for it
//! beside the picture, it is a drawer over the picture. If tools and views have no room at the edges either, they are its first part.

use super::colours::{ACCENT, EDGE, PANEL, TEXT, WEAK_TEXT};
use super::names::{self, Tell};
use super::{Edges, Execute, INSPECTOR_WIDTH, PanelState, Pictures, Room, SMALL_TEXT, TEXT_SIZE};
use super::{body_marks, labels, look, measures, planes, presets, rail, recordings, sides, tools, top};
use crate::command::{Command, InspectorTab, Tool};
use crate::scene::{Group, MeasureKind};
use crate::sliders::SLIDERS;
use crate::texts;
use egui::accesskit::Role;
use egui::{
    Align2, Area, FontId, Frame, Id, Margin, Order, Panel, ScrollArea, Sense, Stroke, Ui, WidgetInfo, WidgetType, pos2,
    vec2,
};

const TABS: [(InspectorTab, [&str; 2]); 5] = [
    (InspectorTab::Tools, texts::TAB_TOOLS),
    (InspectorTab::Look, texts::TAB_LOOK),
    (InspectorTab::Planes, [texts::PLANES, texts::TAB_PLANES_HINT]),
    (InspectorTab::Measure, [texts::MEASURE, texts::TAB_MEASURE_HINT]),
    (InspectorTab::Marks, texts::TAB_MARKS),
];
/// Of the tabs, points; the second in a low drawer.
const TABS_HEIGHT: [f32; 2] = [40.0, 28.0];
const LOW_DRAWER: f32 = 150.0;
/// Between the content and the edges of the inspector, points: on the right is the scroll bar.
const MARGINS: [f32; 2] = [12.0, 14.0];

/// The state of the inspector, the panel with the sliders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Inspector {
    tab: InspectorTab,
    /// True if the inspector is open, in a window in which it is a drawer.
    pub is_open: bool,
    /// The index of the slider that a search selected and that has to be scrolled to; None if none was.
    pub sought: Option<usize>,
}

impl Inspector {
    /// The tab that is shown in a window with this division.
    pub(crate) fn tab(&self, room: &Room) -> InspectorTab {
        match self.tab {
            InspectorTab::Tools if !room.has_tools_tab => InspectorTab::Look,
            tab => tab,
        }
    }

    /// True if the inspector is an open drawer, which covers a part of the picture.
    pub(super) fn is_drawn_over(&self, room: &Room) -> bool {
        room.has_drawer && self.is_open
    }

    /// Executes a command about the inspector; returns false for other commands. The selection of a tool selects the tab with its options and
    /// results.
    pub(crate) fn apply(&mut self, command: &Command, room: &Room) -> bool {
        self.sought = None;
        match *command {
            Command::InspectorTab(tab) => (self.tab, self.is_open) = (tab, true),
            Command::ToggleDrawer => self.is_open = !self.is_open,
            Command::NextTab => {
                let there: Vec<_> = tabs(room).map(|(tab, _)| tab).collect();
                let at = there.iter().position(|tab| *tab == self.tab(room)).unwrap_or_default();
                match (room.has_drawer, self.is_open) {
                    (true, false) => (self.is_open, self.tab) = (true, there[0]),
                    (true, true) if at + 1 == there.len() => self.is_open = false,
                    _ => self.tab = there[(at + 1) % there.len()],
                }
            }
            Command::ShowControl(number) => {
                let is_of_planes = SLIDERS.get(number).is_some_and(|slider| slider.group == Group::Planes);
                self.tab = if is_of_planes { InspectorTab::Planes } else { InspectorTab::Look };
                (self.is_open, self.sought) = (true, Some(number));
            }
            _ => return false,
        }
        true
    }

    /// Selects the tab with the options and results of a tool.
    pub(crate) fn follow(&mut self, tool: Tool) {
        self.tab = match tool {
            Tool::Rotate => return,
            Tool::Light | Tool::Region | Tool::Clip | Tool::Cut | Tool::Brush | Tool::Labels => InspectorTab::Look,
            Tool::Plane | Tool::Curve => InspectorTab::Planes,
            Tool::BodyMark => InspectorTab::Marks,
            Tool::Measure(MeasureKind::Text | MeasureKind::Arrow) => InspectorTab::Marks,
            Tool::Measure(_) => InspectorTab::Measure,
        };
    }
}

fn tabs(room: &Room) -> impl Iterator<Item = (InspectorTab, [&'static str; 2])> {
    let has_tools = room.has_tools_tab;
    TABS.into_iter().filter(move |(tab, _)| has_tools || *tab != InspectorTab::Tools)
}

/// Shows the inspector as a column beside the picture. `looks`: thumbnails of the presets.
pub(super) fn show_column(ui: &mut Ui, state: &PanelState, width: f32, looks: Pictures, execute: Execute) {
    let frame = Frame::new().fill(PANEL);
    let column = Panel::right("inspector").exact_size(width).resizable(false).show_separator_line(false).frame(frame);
    column.show(ui, |ui| show(ui, state, width, TABS_HEIGHT[0], looks, execute));
}

/// Shows the inspector as a drawer over a part of the picture, in a small window. `looks`: thumbnails of the presets.
pub(super) fn show_drawer(
    ui: &mut Ui,
    state: &PanelState,
    size: [f32; 2],
    edges: Edges,
    looks: Pictures,
    execute: Execute,
) {
    let [width, height] = [size[0].min(INSPECTOR_WIDTH), (size[1] - edges.below - edges.above).max(1.0)];
    let corner = pos2(size[0] - width, edges.above);
    let area = Area::new(Id::new("drawer")).order(Order::Middle).fixed_pos(corner).constrain(false);
    area.show(ui.ctx(), |ui| {
        let frame = Frame::new().fill(PANEL).stroke(Stroke::new(1.0, EDGE)).inner_margin(Margin::same(0));
        frame.show(ui, |ui| {
            let inner = vec2(width - 2.0, height - 2.0);
            ui.set_min_size(inner);
            ui.set_max_size(inner);
            show(ui, state, inner.x, TABS_HEIGHT[usize::from(height < LOW_DRAWER)], looks, execute);
        });
    });
}

fn show(ui: &mut Ui, state: &PanelState, width: f32, tabs_height: f32, looks: Pictures, execute: Execute) {
    ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
    show_tabs(ui, state, [width, tabs_height], execute);
    let content = width - MARGINS[0] - MARGINS[1];
    let tab = state.visible.inspector.tab(&state.room);
    ui.scope(|ui| {
        names::name(ui, Role::Group, name_of(tab));
        let area = ScrollArea::vertical().id_salt(name_of(tab)).auto_shrink(false).min_scrolled_height(0.0);
        area.show(ui, |ui| {
            ui.horizontal_top(|ui| {
                ui.spacing_mut().item_spacing.x = 0.0;
                ui.add_space(MARGINS[0]);
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.x = 8.0;
                    ui.set_width(content);
                    // What belongs to the tool comes first.
                    tools::clip(ui, state, content, execute);
                    tools::cuts(ui, state, content, execute);
                    tools::start_line(ui, state, content, execute);
                    labels::show(ui, state, content, execute);
                    match tab {
                        InspectorTab::Tools => {
                            if !state.room.has_top {
                                recordings::show_list(ui, state, content, execute);
                            }
                            top::show_buttons(ui, state, content, execute);
                            rail::show_grid(ui, state, content, execute);
                        }
                        InspectorTab::Look => {
                            presets::show_strip(ui, state, looks, content, execute);
                            look::show(ui, state, content, execute);
                        }
                        InspectorTab::Planes => planes::show(ui, state, content, execute),
                        InspectorTab::Measure => {
                            measures::show_tools(ui, state, content, execute);
                            measures::show_results(ui, state, content, execute);
                        }
                        InspectorTab::Marks => {
                            measures::show_marks(ui, state, content, execute);
                            body_marks::show(ui, state, content, execute);
                            sides::show(ui, state, content, execute);
                        }
                    }
                    ui.add_space(8.0);
                });
            });
        });
    });
}

fn name_of(tab: InspectorTab) -> &'static str {
    TABS.iter().find(|(other, _)| *other == tab).map_or("", |(_, [name, _])| name)
}

fn show_tabs(ui: &mut Ui, state: &PanelState, [width, height]: [f32; 2], execute: Execute) {
    let shown = state.visible.inspector.tab(&state.room);
    let count = tabs(&state.room).count() as f32;
    let measured = state.controls.measures().len();
    ui.horizontal(|ui| {
        names::name(ui, Role::TabList, texts::INSPECTOR);
        ui.spacing_mut().item_spacing.x = 0.0;
        for (tab, [name, hint]) in tabs(&state.room) {
            let is_chosen = tab == shown;
            let (area, tab_shown) = ui.allocate_exact_size(vec2(width / count, height), Sense::click());
            tab_shown.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, is_chosen, name));
            let is_marked = is_chosen || tab_shown.hovered() || tab_shown.has_focus();
            let painter = ui.painter();
            let size = if count > 4.0 || width < 260.0 { SMALL_TEXT } else { TEXT_SIZE };
            let colour = if is_marked { TEXT } else { WEAK_TEXT };
            let has_number = tab == InspectorTab::Measure && measured > 0;
            let text = if has_number { format!("{name} {measured}") } else { name.into() };
            painter.text(area.center(), Align2::CENTER_CENTER, text, FontId::proportional(size), colour);
            let line = if is_chosen { Stroke::new(2.0, ACCENT) } else { Stroke::new(1.0, EDGE) };
            painter.hline(area.x_range(), area.bottom() - line.width / 2.0, line);
            // A tab is selected, not toggled as egui says.
            let tab_shown = tab_shown.tell(hint).with_role(Role::Tab).with(|node| {
                node.clear_toggled();
                node.set_selected(is_chosen);
            });
            tab_shown.gives(Command::InspectorTab(tab), execute);
        }
    });
}
