//! The settings of the view, and how commands change them. After any command the settings can be drawn with the current volume.

mod body_marks;
mod cine;
mod curving;
mod cutting;
mod history;
mod labelling;
mod measuring;
mod presets;
mod sides;
mod starting;

use super::command::{Command, Tool};
use super::labelling::Labelling;
use super::sliders::{self, SLIDERS};
use super::view;
use crate::scene::default_look::Defaults;
use crate::scene::load;
use crate::scene::planes::MAX_TILES;
use crate::scene::{
    BodyMark, Camera, Cube, Curve, Cut, Inset, KeptSide, Layout, MAX_PICTURE, Made, Measurement, Mode, Planes, Scene,
    Settings, Shadow, SharedLabels, Tilt, Transfer,
};
use crate::segment::Patch;
use crate::tree;
pub(super) use cutting::BRUSH_RADII;
use glam::DVec3;
use history::History;
pub(super) use presets::EXAMS;
use std::borrow::Cow;

/// What a command changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    /// Nothing changed.
    Nothing,
    /// Only the selected tool changed.
    Tool,
    Settings,
    /// What is drawn over the picture changed, or how the loop is played, but not the rendered picture.
    Marks,
    /// The command was refused for the given reason.
    Refused(&'static str),
    /// Nothing yet: the command is not about settings, and the caller has to execute it.
    Caller(Command),
}

/// The user's work on a recording: measurements with annotations, body marks, cuts, and labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Handiwork {
    measure: Vec<Measurement>,
    body_marks: Vec<BodyMark>,
    cuts: Vec<Cut>,
    labels: Option<SharedLabels>,
}

impl Handiwork {
    fn of(settings: &Settings) -> Handiwork {
        let Settings { drawn, cuts, labels, .. } = settings.clone();
        Handiwork { measure: drawn.measure, body_marks: drawn.body_marks, cuts, labels: labels.volume }
    }
}

/// What the user changes in the view: the settings and their history, the tool that a drag uses, and the measurement or line in progress.
#[derive(Clone, Debug, tree::Defaults)]
pub struct Controls {
    settings: Settings,
    start: Settings,
    /// The handiwork that is in a file.
    saved: Handiwork,
    tool: Tool,
    /// The last mode that rendered the volume, to which a layout with planes returns.
    rendered: Mode,
    /// The recording's properties from which unset settings follow; `None`: all settings are set.
    defaults: Option<Defaults>,
    history: History,
    /// The measurement whose points are being set.
    work: Option<Measurement>,
    /// The volume and plane on which the next point of a measurement is set.
    made: Option<Made>,
    /// The measurement whose text is being typed.
    typing: Option<usize>,
    /// The line of a curved plane in progress.
    line: Option<Curve>,
    /// The contour of a cut in progress, pixels of the picture, and the side of it that is kept.
    outline: Vec<[f64; 2]>,
    kept_side: KeptSide,
    /// Radius of the brush, mm.
    #[value(cutting::BRUSH_RADIUS)]
    brush_radius: f64,
    /// The index of the selected body mark.
    body_mark: usize,
    labelling: Option<Labelling>,
}

impl Controls {
    /// `settings`: those at the start, which [`Command::Reset`] restores.
    pub(super) fn new(settings: Settings) -> Controls {
        let rendered = if settings.mode.is_flat() { Mode::default() } else { settings.mode };
        Controls { start: settings.clone(), saved: Handiwork::of(&settings), settings, rendered, ..Controls::default() }
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    pub fn tool(&self) -> Tool {
        self.tool
    }

    /// The present measurements, annotations, body marks and cuts.
    pub(super) fn handiwork(&self) -> Handiwork {
        Handiwork::of(&self.settings)
    }

    /// True if measurements, annotations, body marks, cuts or labels are in no file.
    pub(super) fn is_unsaved(&self) -> bool {
        let work = self.handiwork();
        work != self.saved && work != Handiwork::default()
    }

    /// Notes that these measurements, annotations, body marks, cuts and labels are in a file.
    pub(super) fn saved(&mut self, work: Handiwork) {
        self.saved = work;
    }

    /// A copy that is kept while another recording is shown: without what is in progress, and with only the last steps of undo.
    pub(super) fn set_aside(&self) -> Controls {
        let mut aside = Controls { work: None, typing: None, line: None, outline: Vec::new(), ..self.clone() };
        aside.history.shorten();
        aside
    }

    /// Restores the settings of the start, except for the size of the picture and what is drawn over it.
    pub(super) fn reset(&mut self) {
        let again = Settings { picture: self.settings.picture.clone(), ..self.start.clone() };
        let mut again = again.with_drawings_of(&self.settings);
        again.labels.volume.clone_from(&self.settings.labels.volume);
        let before = std::mem::replace(&mut self.settings, again);
        if before != self.settings {
            self.history.record(before, &Command::Reset);
        }
        (self.tool, self.rendered) = (Tool::default(), Controls::new(self.start.clone()).rendered);
        (self.work, self.typing, self.line) = (None, None, None);
    }

    /// True if there is a step to undo; true if there is one to redo.
    pub(crate) fn can_undo(&self) -> [bool; 2] {
        let [past, future] = self.history.has();
        [past || self.work.is_some() || self.line.is_some(), future]
    }

    /// Makes the next change a step of undo of its own.
    pub(super) fn seal(&mut self) {
        self.history.seal();
    }

    /// Goes a step back, or forth again. The size of the picture stays. A step that this volume cannot show is left out.
    fn travel(&mut self, back: bool, scene: Option<&Scene>) -> Change {
        self.typing = None;
        if back && (self.undo_point() || self.undo_line_point()) {
            return Change::Marks;
        }
        self.end_edit_of_labels();
        loop {
            let exchange = |patch: &mut Patch| self.labelling.iter_mut().for_each(|labels| labels.exchange(patch));
            let Some(step) = self.history.travel(back, &self.settings, exchange) else { return Change::Nothing };
            let Some(step) = step else {
                self.show_labels();
                return Change::Settings;
            };
            let mut settings = Settings { picture: self.settings.picture.clone(), ..step };
            settings.labels.volume.clone_from(&self.settings.labels.volume);
            if settings == self.settings || scene.is_some_and(|now| !can_draw(now, &settings)) {
                continue;
            }
            let is_marks = settings.clone().with_drawings_of(&self.settings) == self.settings;
            if !settings.mode.is_flat() {
                self.rendered = settings.mode;
            }
            self.settings = settings;
            return if is_marks { Change::Marks } else { Change::Settings };
        }
    }

    /// Applies settings that were derived from a source. Settings that the user changed since the start are kept.
    pub(super) fn adopt(&mut self, found: Defaults) {
        let Ok(start) = found.settings() else { return };
        let picture = self.settings.picture.clone();
        let start = Settings { picture: self.start.picture.clone(), ..start };
        // The mode of the start may change with the source, one that the user chose may not.
        let (earlier, later) = match in_mode_of(&self.start, &self.settings) {
            same if same == self.start => (same, start.clone()),
            other => {
                let later = found.switched(&start, in_mode_of(&start, &other));
                (self.switched_from(&self.start, other), later)
            }
        };
        if let Some(settings) = load::rebase(&self.settings, &earlier, &later) {
            let settings = Settings { picture, ..settings };
            if settings != self.settings {
                self.history.clear();
            }
            self.settings = settings;
        }
        self.start = start;
        self.defaults = Some(found);
        if !self.settings.mode.is_flat() {
            self.rendered = self.settings.mode;
        }
    }

    /// The settings `to`, which differ from the present ones in mode or layout, with the other settings that depend on these.
    pub(super) fn switched(&self, to: Settings) -> Settings {
        self.switched_from(&self.settings, to)
    }

    fn switched_from(&self, from: &Settings, to: Settings) -> Settings {
        match &self.defaults {
            Some(defaults) => defaults.switched(from, to),
            None => to,
        }
    }

    /// Sets width and height of the picture, pixels. The minimum is 64, so that a picture of tiles has a pixel for each tile; a smaller
    /// window shows the picture scaled down.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        let rays = self.settings.ray.rays.max(self.start.ray.rays);
        let max = MAX_PICTURE / rays.clamp(1, 4);
        self.settings.picture.size = size.map(|edge| edge.clamp(MAX_TILES, max));
    }

    /// Applies a command. `scene`: the one that is shown, which may be older than the settings. Without a scene only changes of the tool, the
    /// reset and commands for the caller have an effect.
    pub(super) fn apply(&mut self, command: &Command, scene: Option<&Scene>) -> Change {
        if let Some(change) = self.cut(command, scene).or_else(|| self.curve(command, scene)) {
            return change;
        }
        match command {
            Command::Tool(tool) if *tool == self.tool => return Change::Nothing,
            Command::Tool(tool) => {
                (self.work, self.typing, self.line) = (None, None, None);
                self.tool = *tool;
                let mode = self.mode_for_line().filter(|_| *tool == Tool::Curve);
                return match mode.map(|mode| self.apply(&mode, scene)) {
                    Some(Change::Settings) => Change::Settings,
                    _ => Change::Tool,
                };
            }
            Command::Reset => {
                self.reset();
                return Change::Settings;
            }
            Command::Undo => return self.travel(true, scene),
            Command::UndoAll => {
                let mut change = Change::Nothing;
                while self.can_undo()[0] {
                    change = match (self.travel(true, scene), change) {
                        (Change::Nothing, before) => before,
                        (Change::Marks, Change::Settings) => Change::Settings,
                        (step, _) => step,
                    };
                }
                return change;
            }
            Command::Redo => return self.travel(false, scene),
            Command::Sides(..) | Command::ExchangeLeftAndRight | Command::ProbeMarker(_) | Command::SavesBar(_) => {
                return self.mark_sides(command);
            }
            _ => {}
        }
        if let Some(change) = self
            .measure(command)
            .or_else(|| self.label(command))
            .or_else(|| self.mark_body(command))
            .or_else(|| self.play(command))
            .or_else(|| of_caller(command))
        {
            return change;
        }
        // The scene lags behind if several commands come between two pictures: each one builds on the settings of the one before.
        let Some(now) = scene.and_then(|scene| self.current(scene)) else { return Change::Nothing };
        if let Some(why) = starting::refusal(command, &now) {
            return Change::Refused(why);
        }
        let Some(wanted) = self.changed(command, &now) else { return Change::Nothing };
        let wanted = self.switched(wanted);
        match drawable(&now, wanted.clone()) {
            Some(settings) if settings != self.settings => self.put(settings, command),
            Some(_) => Change::Nothing,
            None => cutting::in_the_way(&now, &wanted).map_or(Change::Nothing, Change::Refused),
        }
    }

    /// Replaces the settings by ones that can be drawn, as a step that can be undone, and remembers their mode if it renders.
    fn put(&mut self, settings: Settings, command: &Command) -> Change {
        if !settings.mode.is_flat() {
            self.rendered = settings.mode;
        }
        let before = std::mem::replace(&mut self.settings, settings);
        self.history.record(before, command);
        Change::Settings
    }

    /// Does the same with settings that may not fit a scene; `why`: the reason then.
    fn put_if_drawable(&mut self, new: Settings, command: &Command, scene: &Scene, why: &'static str) -> Change {
        match self.current(scene).and_then(|now| drawable(&now, new)) {
            Some(settings) => self.put(settings, command),
            None => Change::Refused(why),
        }
    }

    /// Changes what is drawn over the picture or how the loop is played, as a step that can be undone.
    fn mark(&mut self, command: &Command, change: impl FnOnce(&mut Settings)) -> Change {
        let before = self.settings.clone();
        change(&mut self.settings);
        self.history.record(before, command);
        Change::Marks
    }

    /// The scene of the current settings.
    fn current<'a>(&self, scene: &'a Scene) -> Option<Cow<'a, Scene>> {
        if scene.settings == self.settings {
            return Some(Cow::Borrowed(scene));
        }
        // The picture knows nothing of what is drawn over it.
        if self.settings.clone().with_drawings_of(&scene.settings) == scene.settings {
            return Some(Cow::Owned(Scene { settings: self.settings.clone(), ..scene.clone() }));
        }
        Scene::new(scene.geometry.clone(), scene.input, self.settings.clone()).ok().map(Cow::Owned)
    }

    /// The settings after a command; none if it has no effect in this scene.
    fn changed(&self, command: &Command, now: &Scene) -> Option<Settings> {
        let mut new = self.settings.clone();
        match *command {
            Command::Mode(mode) => new.set_mode(mode),
            Command::Layout(layout) => {
                new.layout = layout;
                if layout.has_planes() && new.mode.is_flat() {
                    new.mode = self.rendered;
                }
                if layout == Layout::Pair {
                    new.mode = Mode::Surface;
                }
            }
            Command::Rendering => {
                new.layout = Layout::Single;
                if new.mode.is_flat() {
                    new.set_mode(self.rendered);
                }
            }
            Command::LookFrom(viewpoint) if !now.is_flat() => {
                new.camera = view::look_from(now, viewpoint);
                return view::keep_scale(now, new);
            }
            Command::Rotate(by) if finite(&by) && !now.is_flat() => {
                new.camera = view::rotate(now, by);
                return view::keep_scale(now, new);
            }
            Command::Roll(by) if finite(&[by]) && now.is_flat() => {
                new.planes.roll = view::wrap_degrees(new.planes.roll + by)
            }
            Command::Roll(by) if finite(&[by]) => {
                new.camera.roll = view::wrap_degrees(new.camera.roll + by);
                return view::keep_scale(now, new);
            }
            Command::Zoom(factor) if finite(&[factor]) && factor > 0.0 => {
                let zoom = if now.is_flat() { &mut new.planes.zoom } else { &mut new.camera.zoom };
                *zoom = view::scale_zoom(*zoom, factor);
            }
            Command::Pan(by) if finite(&by) && !now.is_flat() => {
                new.camera = Camera { target: Some(view::pan(now, by)), ..new.camera };
            }
            Command::MoveLight(by) if finite(&by) && !now.is_flat() => view::move_light(&mut new, by),
            Command::MoveFace(face, by) if finite(&[by]) && face.axis < 3 => {
                return view::keep_scale(now, view::move_face(now, face, by));
            }
            Command::MoveRegion(by) if finite(&by) => {
                return view::keep_scale(now, view::move_region(now, DVec3::from(by)));
            }
            Command::ToggleStartCurve
            | Command::MoveStartHandle(..)
            | Command::AddStartHandle(_)
            | Command::RemoveStartHandle(_) => return starting::changed(command, now),
            Command::MoveClip(by) if finite(&[by]) && !now.is_flat() => {
                new.clip = view::move_clip(now, self.start.clip.len(), by)?
            }
            Command::Plane(name) => {
                new.planes.plane = name;
                if !now.cuts_planes() {
                    new.set_mode(Mode::Plane);
                }
            }
            // Without a visible plane the change would surprise the user later.
            Command::StepPlane(_) | Command::MoveCrossing(_) | Command::RotatePlanes(_) if !now.cuts_planes() => {
                return None;
            }
            Command::StepPlane(by) if finite(&[by]) => {
                new.planes.position = Some(view::step_plane(now, new.planes.plane, by));
            }
            Command::MoveCrossing(point) if finite(&point) => {
                new.planes.position = Some(view::clamp_crossing(now, point))
            }
            Command::Reference(on) if now.settings.mode == Mode::Tomography => new.planes.reference = on,
            Command::Recentre if now.cuts_planes() => new.planes.position = None,
            Command::MoveCurvePoint(index, to) if finite(&to) => return curving::moved(new, index, to),
            Command::ClearCurve => new.planes.curve = None,
            Command::RotatePlanes(by) if finite(&by) => {
                new.planes.azimuth = view::wrap_degrees(new.planes.azimuth + by[0]);
                new.planes.tilt = view::wrap_degrees(new.planes.tilt + by[1]);
            }
            Command::SetSlider(index, value) => set_slider(&mut new, now, index, value)?,
            Command::SetShown(index, value) if finite(&[value]) => {
                let slider = SLIDERS.get(index)?;
                set_slider(&mut new, now, index, sliders::from_shown(slider, now, value))?;
            }
            Command::ResetSlider(index) => {
                // In the current mode.
                let start = self.switched_from(&self.start, in_mode_of(&self.start, &self.settings));
                let slider = SLIDERS.get(index).filter(|slider| slider.applies(&start))?;
                set_slider(&mut new, now, index, slider.get(&start))?;
            }
            Command::StepSlider(index, steps) => {
                let slider = SLIDERS.get(index)?;
                let value = slider.get(&new) + f64::from(steps) * slider.step;
                set_slider(&mut new, now, index, value)?;
            }
            Command::Transfer(name) => {
                new.volume.transfer = Transfer::Named(name);
                new.volume.colour = None;
            }
            Command::Opacity(name) => new.volume.opacity = name,
            Command::ColourMap(map) => new.post.colour_map = map,
            Command::Shadow(on) => new.light.shadow = self.switch_shadow(on),
            _ => return None,
        }
        Some(new)
    }

    /// Switches the shadow. Off sets its strength to 0 and keeps its other values; on restores the strength of the start.
    fn switch_shadow(&self, on: bool) -> Option<Shadow> {
        let (now, start) = (self.settings.light.shadow, self.start.light.shadow);
        let strength = match now {
            Some(shadow) if on && shadow.strength > 0.0 => shadow.strength,
            _ if on => start.map(|s| s.strength).filter(|s| *s > 0.0).unwrap_or(Shadow::default().strength),
            None => return None,
            Some(_) => 0.0,
        };
        Some(Shadow { strength, ..now.or(start).unwrap_or_default() })
    }
}

/// Passes a command that is not about settings on to the caller. None for other commands.
fn of_caller(command: &Command) -> Option<Change> {
    use Command::*;
    match command {
        Freeze | StepCine(_) | SeekCine(_) | PlayCine | MarkCine(_) | TrimCine(..) | SavePicture | SaveLoop
        | ToggleHelp | CloseHints | Find | ShowControl(_) | TypeValue(_) | ToggleTimes | TogglePanels | FocusPanels
        | InspectorTab(_) | NextTab | ToggleDrawer | KeyboardPointer | ToggleFullScreen | Back | Exit | SaveAndExit
        | Discard | PickSurface(_) | MeasureBody | CopyMeasures | SaveMeasures | SaveWorkspace | OpenFiles
        | OpenFile(_) | Turntable | ShowRecording(_) | StepRecording(_) | CloseRecording(_) | CancelReading
        | Compare | CompareView(_) | MoveWipe(_) | ToggleLink(_) | Align | CompareFurther | MoveCompared(..)
        | Exports | Export(_) | CancelExport | Presets | Preset(_) | NamePreset | RenamePreset(_) | EndNaming
        | DeletePreset(_) | RestorePresets => Some(Change::Caller(*command)),
        _ => None,
    }
}

fn finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|n| n.is_finite())
}

/// A position as it is kept: a tenth of a micrometre keeps files short.
fn short<const N: usize>(point: [f64; N]) -> [f64; N] {
    point.map(|mm| (mm * 1e4).round() / 1e4)
}

/// Settings with the mode and the layout of others.
fn in_mode_of(settings: &Settings, other: &Settings) -> Settings {
    Settings { mode: other.mode, layout: other.layout, ..settings.clone() }
}

fn set_slider(settings: &mut Settings, now: &Scene, index: usize, value: f64) -> Option<()> {
    let slider = SLIDERS.get(index).filter(|s| s.applies(settings) && !value.is_nan())?;
    let [low, high] = slider.range_in(now);
    slider.set(settings, value.clamp(low, high));
    Some(())
}

/// The settings if they can be drawn. If the mode or the layout changed, values that only the new mode uses and that do not fit the
/// region are reset: they were set for another mode or region, and must not block the key that selects the mode.
fn drawable(now: &Scene, settings: Settings) -> Option<Settings> {
    if can_draw(now, &settings) {
        return Some(settings);
    }
    if settings.mode == now.settings.mode && settings.layout == now.settings.layout {
        return None;
    }
    let (mut relaxed, default_planes) = (settings, Planes::default());
    relaxed.surface.start_depth = None;
    relaxed.volume.start_depth = None;
    relaxed.projection.start_depth = None;
    relaxed.cube = Cube { inset: Inset::default(), tilt: Tilt::default(), ..relaxed.cube };
    relaxed.planes =
        Planes { columns: default_planes.columns, rows: default_planes.rows, thickness: 0.0, ..relaxed.planes };
    if !can_draw(now, &relaxed) {
        relaxed.unveil.enabled = false;
    }
    can_draw(now, &relaxed).then_some(relaxed)
}

/// Whether settings can be drawn with the volume of a scene.
fn can_draw(now: &Scene, settings: &Settings) -> bool {
    Scene::new(now.geometry.clone(), now.input, settings.clone()).is_ok()
}
