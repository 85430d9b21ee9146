//! Caps: which cut faces of clip planes show their echoes, and from which echo on there is tissue.

use super::{Mode, Scene, Sign, View, transfer};

/// Share of the echo that a rendering shows from which on there is tissue: what is darker than this is fluid. The grey scale is
/// logarithmic. The brain of a fetus has about half of the grey of its skin, a fifth in the shadow of bone; fluid has a
/// tenth.
const TISSUE: f64 = 1.0 / 4.0;
/// A transfer function that draws echoes below this share of its opaque ones has a veil, which is to be seen through.
const VEIL: f64 = 0.5;
/// A value is opaque if a stretch of this share of the box's diagonal lets less than half of the light through.
const STRETCH: f64 = 1.0 / 40.0;
const OPAQUE: f64 = 0.5;

impl Scene {
    /// True if clip planes have cut faces: there is a plane, and something is rendered that it cuts.
    pub fn has_caps(&self) -> bool {
        let is_cut = matches!(self.settings.mode, Mode::Surface | Mode::Volume | Mode::Mixed);
        is_cut && self.settings.cap.enabled && !self.settings.clip.is_empty()
    }

    /// The region that is cut, with the grey window of planes. In mode mixed that of what begins first.
    pub fn cap_view(&self) -> View {
        let low = match self.settings.mode {
            Mode::Surface => self.surface_view().low,
            Mode::Mixed => self.surface_view().low.min(self.volume_view().low),
            _ => self.volume_view().low,
        };
        View { window: self.settings.planes.window, low, high: self.high }
    }

    /// The echo from which on there is tissue, before any window. None if nothing is capped: what is dark is drawn, or everything lets
    /// light through.
    pub fn cap_level(&self) -> Option<f64> {
        let from = self.drawn_from()?;
        Some(self.settings.cap.level.unwrap_or(from))
    }

    /// Radius of the disc around a place of a cut face that tells tissue from fluid, mm: the length of an edge.
    pub fn cap_radius(&self) -> f64 {
        self.ring.step * f64::from(self.ring.half)
    }

    /// True if cut faces fade towards the faces of the region, as what is composited does.
    pub fn fades_caps(&self) -> bool {
        self.settings.mode == Mode::Volume && self.region_fade().is_some()
    }

    /// The level where none is set.
    fn drawn_from(&self) -> Option<f64> {
        let surface = &self.settings.surface;
        let [low, high] = surface.window;
        let detected = low + surface.threshold * (high - low);
        let is_dark = surface.sign == Sign::Dark;
        match self.settings.mode {
            Mode::Surface if !is_dark => Some(TISSUE * detected),
            // The volume in front of the surface is a veil.
            Mode::Mixed if !is_dark => Some(detected),
            Mode::Volume => self.composited_from(),
            _ => None,
        }
    }

    /// The same of volume rendering: a share of the least echo from which on all are opaque, or that echo itself where there is a veil of
    /// darker ones.
    fn composited_from(&self) -> Option<f64> {
        let volume = &self.settings.volume;
        let table = transfer::table_of(volume, self.reference_length(), self.transfer_entries());
        let stretch = STRETCH * (self.high - self.low).length() / self.reference_length();
        let is_opaque = |entry: &[f64; 4]| transfer::opacity(entry[3] * stretch) >= OPAQUE;
        let clear = table.iter().rposition(|entry| !is_opaque(entry)).map_or(0, |last| last + 1);
        let first = table.iter().position(|entry| entry[3] > 0.0)?;
        if clear == table.len() {
            return None;
        }
        let [low, high] = volume.window;
        // What is darker than the window has its first value.
        let echo = |n: usize| match n {
            0 => 0.0,
            n => low + n as f64 / (table.len() - 1) as f64 * (high - low),
        };
        let (drawn, opaque) = (echo(first), echo(clear));
        Some(if drawn < VEIL * opaque { opaque } else { TISSUE * opaque })
    }
}

#[cfg(test)]
mod tests {
    use crate::probe::{Geometry, Grid};
    use crate::scene::load::Layers;
    use crate::scene::{Input, Scene};
    use crate::source::StoredType;

    fn level(preset: &str, more: &[&str]) -> Option<f64> {
        let mut layers = Layers::default();
        layers.preset(preset).unwrap();
        let clip = "clip=[{at=[0,60,0],normal=[0,-1,0]}]";
        [clip].iter().chain(more).for_each(|line| layers.set(line).unwrap());
        let grid = Grid { size: [120; 3], spacing: [1.0; 3], origin: [-60.0, 0.0, -60.0] };
        let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
        let scene = Scene::new(Geometry::Cartesian(grid), input, layers.finish().unwrap()).unwrap();
        assert!(scene.has_caps());
        scene.cap_level()
    }

    /// Prevents a head that is cut open and empty: the brain is darker than what a preset draws, and the fluid around it darker still.
    #[test]
    fn presets_that_show_skin_cap_the_brain_and_leave_the_fluid_open() {
        for preset in ["face", "face-classic", "fetal"] {
            for mode in ["mode='volume'", "mode='surface'"] {
                let level = level(preset, &[mode]).unwrap();
                assert!((0.1..0.25).contains(&level), "{preset}, {mode}: {level}");
            }
        }
    }

    /// Prevents an opaque face in front of what a look shows through something.
    #[test]
    fn looks_that_are_seen_through_cap_what_is_opaque_alone() {
        assert!((0.9..0.96).contains(&level("skeleton", &[]).unwrap()), "bone");
        assert_eq!(level("glass", &[]), None, "glass lets light through everywhere");
        assert_eq!(level("vessel", &[]), None, "fluid is what is drawn");
        assert_eq!(level("face-classic", &["surface.sign='dark'"]), None);
        assert_eq!(level("face-classic", &["surface.sign='dark'", "cap.level=0.2"]), None, "whatever the level is");
        let [surface, mixed] = ["surface", "mixed"].map(|mode| level("bone", &[&format!("mode='{mode}'")]).unwrap());
        assert!((mixed - 4.0 * surface).abs() < 1e-9, "muscle before the bone is a veil");
        assert_eq!(level("bmode", &["mode='volume'"]), Some(0.0), "every sample is opaque");
        assert_eq!(level("face", &["cap.level=0.07"]), Some(0.07));
    }
}
