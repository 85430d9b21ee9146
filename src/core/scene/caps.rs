//! Caps: which cut faces of clip planes show their echoes, and the echo from which on matter counts as tissue.

use super::{Mode, Scene, Settings, Sign, View, transfer};

/// A value is opaque if a stretch of this share of the box's diagonal lets less than half of the light through.
const STRETCH: f64 = 1.0 / 40.0;
const OPAQUE: f64 = 0.5;
/// Least level where something is removed.
const LEAST_LEVEL: f64 = 1e-6;

impl Settings {
    /// True if clip planes of these settings cut what is rendered, whether or not the cut faces are shown.
    pub(crate) fn can_cap(&self) -> bool {
        let is_cut = match self.mode {
            Mode::Surface | Mode::Mixed => self.surface.sign != Sign::Dark,
            mode => mode == Mode::Volume,
        };
        is_cut && !self.clip.is_empty()
    }
}

impl Scene {
    /// True if clip planes cut the rendering and it shows echoes on their cut faces (`cap.enabled`), even if no echo reaches the level of tissue
    /// ([`Scene::cap_level`]). False for a still ([`Scene::still`]), which lights cut faces like other matter.
    pub fn has_caps(&self) -> bool {
        self.settings.cap.enabled && self.settings.can_cap() && self.still().is_none()
    }

    /// The region in which cut faces are shown, with the grey window of planes. In mode mixed it is the region of the surface.
    pub(crate) fn cap_view(&self) -> View {
        let low = match self.settings.mode {
            Mode::Surface | Mode::Mixed => self.surface_view().low,
            _ => self.volume_view().low,
        };
        View { window: self.settings.planes.window, low, high: self.high }
    }

    /// The sample value, before any window, from which on matter counts as tissue on a cut face. None in mode volume if the brightest matter is
    /// translucent, so that no cut face is shown.
    pub fn cap_level(&self) -> Option<f64> {
        let solid = self.solid_from()?;
        let level = self.settings.cap.level.unwrap_or(solid);
        // What is removed has the value 0, and is open whatever the level is.
        Some(if self.removes() { level.max(LEAST_LEVEL) } else { level })
    }

    /// Radius of the disc on a cut face over which echoes are averaged to tell tissue from fluid, mm: the length of an edge.
    pub(crate) fn cap_radius(&self) -> f64 {
        self.ring.step * f64::from(self.ring.half)
    }

    /// True if cut faces fade towards the faces of the region, as composited matter does.
    pub(crate) fn fades_caps(&self) -> bool {
        self.settings.mode == Mode::Volume && self.region_fade().is_some()
    }

    /// The level where none is set: the echo from which on what is rendered is solid.
    fn solid_from(&self) -> Option<f64> {
        let surface = &self.settings.surface;
        let [low, high] = surface.window;
        match self.settings.mode {
            Mode::Volume => self.opaque_from(),
            // Of mode mixed the surface alone: the volume in front of it is a veil.
            _ => Some(low + surface.threshold * (high - low)),
        }
    }

    /// The least echo from which on all are opaque in volume rendering; none if the brightest lets light through.
    fn opaque_from(&self) -> Option<f64> {
        let volume = &self.settings.volume;
        let table = transfer::table_of(volume, self.reference_length(), self.transfer_entries());
        let stretch = STRETCH * (self.high - self.low).length() / self.reference_length();
        let is_opaque = |entry: &[f64; 4]| transfer::opacity(entry[3] * stretch) >= OPAQUE;
        let first = table.iter().rposition(|entry| !is_opaque(entry)).map_or(0, |last| last + 1);
        let [low, high] = volume.window;
        match first {
            // What is darker than the window has its first value.
            0 => Some(0.0),
            n if n < table.len() => Some(low + n as f64 / (table.len() - 1) as f64 * (high - low)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::probe::StoredType;
    use crate::probe::{Geometry, Grid};
    use crate::scene::load::Layers;
    use crate::scene::{Input, Scene};

    fn level(preset: &str, more: &[&str]) -> Option<f64> {
        let mut layers = Layers::default();
        layers.preset(preset).unwrap();
        let clip = "clip=[{at=[0,60,0],normal=[0,-1,0]}]";
        [clip].iter().chain(more).for_each(|line| layers.set(line).unwrap());
        let grid = Grid { size: [120; 3], spacing: [1.0; 3], origin: [-60.0, 0.0, -60.0] };
        let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
        let scene = Scene::new(Geometry::Cartesian(grid), input, layers.finish().unwrap()).unwrap();
        scene.has_caps().then(|| scene.cap_level())?
    }

    /// Prevents a head that is cut open and empty: the brain is darker than what these presets draw, and the fluid around it darker still.
    #[test]
    fn presets_of_the_face_cap_the_brain_and_leave_the_fluid_open() {
        for preset in ["face", "face-classic"] {
            for mode in ["mode='volume'", "mode='surface'"] {
                assert_eq!(level(preset, &[mode]), Some(0.1), "{preset}, {mode}");
            }
        }
    }

    /// Prevents a face in front of what a look does not draw, or shows through something.
    #[test]
    fn what_is_solid_is_capped_and_nothing_else() {
        let [surface, mixed] = ["surface", "mixed"].map(|mode| level("bone", &[&format!("mode='{mode}'")]).unwrap());
        assert!((surface - (0.235 + 0.08 * 0.765)).abs() < 1e-9 && surface == mixed, "{surface}: the threshold");
        // The ramp of the default look begins at 0.42 and ends at 0.72.
        let solid = level("face", &["cap.level='none'"]).unwrap();
        assert!((0.44..0.6).contains(&solid), "{solid}");
        assert!((0.9..0.96).contains(&level("skeleton", &[]).unwrap()), "bone");
        assert_eq!(level("glass", &[]), None, "glass lets light through everywhere");
        assert_eq!(level("glass", &["cap.level=0.2"]), None, "whatever the level is");
        assert_eq!(level("vessel", &[]), None, "fluid is what is drawn");
        assert_eq!(level("face-classic", &["surface.sign='dark'"]), None);
        assert_eq!(level("bmode", &["mode='volume'"]), Some(0.0), "every sample is opaque");
        assert_eq!(level("bone", &["cap.level=0.07"]), Some(0.07));
    }
}
