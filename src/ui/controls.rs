//! Settings that commands change. Whatever is asked, what is left can be drawn of the volume that is shown.

use super::command::{Command, Tool};
use super::sliders::SLIDERS;
use super::view;
use crate::scene::planes::MAX_TILES;
use crate::scene::{Camera, Cube, Inset, Layout, MAX_PICTURE, Mode, Planes, Scene, Settings, Shadow, Tilt, Transfer};
use std::borrow::Cow;

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// All is as it was.
    Nothing,
    /// What a drag does.
    Tool,
    Settings,
    /// Not a matter of settings: for who asked.
    Screen(Command),
}

#[derive(Clone, Debug)]
pub struct Controls {
    settings: Settings,
    start: Settings,
    tool: Tool,
    /// The last mode that was no mode of planes: a 4-up picture goes back to it.
    rendered: Mode,
}

impl Controls {
    /// Settings that can be drawn, as at the start.
    pub fn new(settings: Settings) -> Controls {
        let rendered = if settings.mode.is_flat() { Mode::default() } else { settings.mode };
        Controls { start: settings.clone(), settings, tool: Tool::default(), rendered }
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    pub fn tool(&self) -> Tool {
        self.tool
    }

    /// Everything as at the start, but the picture's size.
    pub fn reset(&mut self) {
        let picture = self.settings.picture.clone();
        let mut again = Controls::new(self.start.clone());
        again.settings.picture = picture;
        // A reset of a reset knows the same start.
        again.start = std::mem::take(&mut self.start);
        *self = again;
    }

    /// Width and height of the picture, pixels. Below 64 no sheet of tiles would have a pixel for each: a smaller window shows a
    /// picture made smaller.
    pub fn resize(&mut self, size: [u32; 2]) {
        let rays = self.settings.ray.rays.max(self.start.ray.rays);
        let most = MAX_PICTURE / rays.clamp(1, 4);
        self.settings.picture.size = size.map(|edge| edge.clamp(MAX_TILES, most));
    }

    /// Does what is asked. `scene` is what is shown, of these settings or earlier ones. Without it nothing is shown, and nothing but
    /// the tool and the start can be asked for.
    pub fn apply(&mut self, command: &Command, scene: Option<&Scene>) -> Change {
        match command {
            Command::Tool(tool) => {
                let changed = *tool != self.tool;
                self.tool = *tool;
                return if changed { Change::Tool } else { Change::Nothing };
            }
            Command::Reset => {
                self.reset();
                return Change::Settings;
            }
            Command::Freeze
            | Command::Cine(_)
            | Command::CineAt(_)
            | Command::CinePlay
            | Command::SavePicture
            | Command::SaveLoop
            | Command::Help
            | Command::Hud
            | Command::Panels
            | Command::FullScreen
            | Command::Exit => return Change::Screen(*command),
            _ => {}
        }
        // What is shown lags behind where several commands come between two pictures: each goes on from the one before.
        let Some(now) = scene.and_then(|scene| self.current(scene)) else { return Change::Nothing };
        match self.asked(command, &now).and_then(|settings| drawable(&now, settings)) {
            Some(settings) if settings != self.settings => {
                if !settings.mode.is_flat() {
                    self.rendered = settings.mode;
                }
                self.settings = settings;
                Change::Settings
            }
            _ => Change::Nothing,
        }
    }

    /// What is shown once these settings are.
    fn current<'a>(&self, scene: &'a Scene) -> Option<Cow<'a, Scene>> {
        if scene.settings == self.settings {
            return Some(Cow::Borrowed(scene));
        }
        Scene::new(scene.geometry.clone(), scene.input, self.settings.clone()).ok().map(Cow::Owned)
    }

    /// The settings that a command asks for; nothing where it makes no sense.
    fn asked(&self, command: &Command, now: &Scene) -> Option<Settings> {
        let finite = |numbers: &[f64]| numbers.iter().all(|n| n.is_finite());
        let mut new = self.settings.clone();
        match *command {
            Command::Mode(mode) => self.show(&mut new, mode),
            Command::Layout(layout) => {
                new.layout = layout;
                if layout == Layout::Four && new.mode.is_flat() {
                    new.mode = self.rendered;
                }
            }
            Command::Turn(by) if finite(&by) && !now.is_flat() => {
                new.camera = view::turn(now, by);
                return view::held(now, new);
            }
            Command::Roll(by) if finite(&[by]) && now.is_flat() => {
                new.planes.roll = view::wrapped(new.planes.roll + by)
            }
            Command::Roll(by) if finite(&[by]) => {
                new.camera.roll = view::wrapped(new.camera.roll + by);
                return view::held(now, new);
            }
            Command::Zoom(times) if finite(&[times]) && times > 0.0 => {
                let zoom = if now.is_flat() { &mut new.planes.zoom } else { &mut new.camera.zoom };
                *zoom = view::zoomed(*zoom, times);
            }
            Command::Pan(by) if finite(&by) && !now.is_flat() => {
                new.camera = Camera { target: Some(view::pan(now, by)), ..new.camera };
            }
            Command::Light(by) if finite(&by) && !now.is_flat() => view::light(&mut new, by),
            Command::Face(face, by) if finite(&[by]) && face.axis < 3 => {
                return view::held(now, view::move_face(now, face, by));
            }
            Command::Clip(by) if finite(&[by]) && !now.is_flat() => {
                new.clip = view::clip(now, self.start.clip.len(), by)?
            }
            Command::Plane(name) => {
                new.planes.plane = name;
                if !now.cuts_planes() {
                    self.show(&mut new, Mode::Plane);
                }
            }
            // What no picture shows would be a surprise later.
            Command::PlaneBy(_) | Command::Meet(_) | Command::PlaneTurn(_) if !now.cuts_planes() => return None,
            Command::PlaneBy(by) if finite(&[by]) => {
                new.planes.position = Some(view::stepped(now, new.planes.plane, by));
            }
            Command::Meet(place) if finite(&place) => new.planes.position = Some(view::meeting(now, place)),
            Command::PlaneTurn(by) if finite(&by) => {
                new.planes.azimuth = view::wrapped(new.planes.azimuth + by[0]);
                new.planes.tilt = view::wrapped(new.planes.tilt + by[1]);
            }
            Command::Slide(place, value) => slide(&mut new, now, place, value)?,
            Command::Nudge(place, steps) => {
                let slider = SLIDERS.get(place)?;
                let value = slider.get(&new) + f64::from(steps) * slider.step;
                slide(&mut new, now, place, value)?;
            }
            Command::Transfer(name) => new.volume.transfer = Transfer::Named(name),
            Command::ColourMap(map) => new.post.colour_map = map,
            Command::Shadow(on) => new.light.shadow = self.shadow(on),
            _ => return None,
        }
        Some(new)
    }

    fn show(&self, settings: &mut Settings, mode: Mode) {
        settings.mode = mode;
        if mode.is_flat() {
            settings.layout = Layout::Single;
        }
    }

    /// A shadow that is taken away keeps its edge and reach; only its strength goes, and comes back as it was at the start.
    fn shadow(&self, on: bool) -> Option<Shadow> {
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

fn slide(settings: &mut Settings, now: &Scene, place: usize, value: f64) -> Option<()> {
    let slider = SLIDERS.get(place).filter(|s| s.applies(settings) && !value.is_nan())?;
    let [low, high] = slider.range_in(now);
    slider.set(settings, value.clamp(low, high));
    Some(())
}

/// Settings if they can be drawn. What the shown mode alone asks for and this region has no room for is given up: it was set while
/// another mode or region was shown, and a key that shows the mode must not be dead for it.
fn drawable(now: &Scene, settings: Settings) -> Option<Settings> {
    let is_drawn = |s: &Settings| Scene::new(now.geometry.clone(), now.input, s.clone()).is_ok();
    if is_drawn(&settings) {
        return Some(settings);
    }
    if settings.mode == now.settings.mode && settings.layout == now.settings.layout {
        return None;
    }
    let (mut given_up, usual) = (settings, Planes::default());
    given_up.surface.start_depth = None;
    given_up.volume.start_depth = None;
    given_up.projection.start_depth = None;
    given_up.cube = Cube { inset: Inset::default(), tilt: Tilt::default(), ..given_up.cube };
    given_up.planes = Planes { columns: usual.columns, rows: usual.rows, thickness: 0.0, ..given_up.planes };
    is_drawn(&given_up).then_some(given_up)
}
