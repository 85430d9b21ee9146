//! The look of a scene: its mode, filters, transfer function, light and tone. It excludes what belongs to one examination: region, camera,
//! positions of planes, clip planes, cuts, labels, marks, measurements, body marks and the cine loop. A user preset keeps a look.

use super::{Cap, Cube, Planes, Projection, Region, Settings, Slices, Surface, Volume};

/// The paths of the settings that are no look.
const OF_EXAMINATION: &[&str] = &[
    "picture",
    "samples",
    "region.lateral",
    "region.depth",
    "region.elevation",
    "region.start_curve",
    "clip",
    "cap.enabled",
    "cuts",
    "unveil",
    "camera",
    "volume.start_depth",
    "surface.start_depth",
    "projection.start_depth",
    "planes.position",
    "planes.azimuth",
    "planes.tilt",
    "planes.roll",
    "planes.plane",
    "planes.curve",
    "cube.inset",
    "cube.tilt",
    "slices.everything",
    "slices.still",
    "labels",
    "marks",
    "measure",
    "body_marks",
    "cine",
];

/// True if the setting at `path` belongs to a look (how things are drawn) and not to an examination (region, camera, measurements and the like).
pub fn is_look(path: &str) -> bool {
    !OF_EXAMINATION
        .iter()
        .any(|other| path.strip_prefix(other).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
}

impl Settings {
    /// The look of `self` with everything else from `other`.
    pub fn look_over(&self, other: &Settings) -> Settings {
        let (look, kept) = (self.clone(), other.clone());
        Settings {
            picture: kept.picture,
            samples: kept.samples,
            region: Region { fade: look.region.fade, ..kept.region },
            clip: kept.clip,
            cap: Cap { level: look.cap.level, ..kept.cap },
            cuts: kept.cuts,
            unveil: kept.unveil,
            camera: kept.camera,
            volume: Volume { start_depth: kept.volume.start_depth, ..look.volume },
            surface: Surface { start_depth: kept.surface.start_depth, ..look.surface },
            projection: Projection { start_depth: kept.projection.start_depth, ..look.projection },
            planes: Planes {
                position: kept.planes.position,
                azimuth: kept.planes.azimuth,
                tilt: kept.planes.tilt,
                roll: kept.planes.roll,
                plane: kept.planes.plane,
                curve: kept.planes.curve,
                ..look.planes
            },
            cube: Cube { inset: kept.cube.inset, tilt: kept.cube.tilt, ..look.cube },
            slices: Slices { everything: kept.slices.everything, still: kept.slices.still, ..look.slices },
            labels: kept.labels,
            drawn: kept.drawn,
            ..look
        }
    }

    /// The look of these settings with defaults for everything else, as at the start of another examination.
    pub fn look(&self) -> Settings {
        self.look_over(&Settings::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::Layers;
    use toml::{Table, Value};

    /// The values of a table by their paths.
    fn values(table: &Table, before: &str, found: &mut Vec<(String, Value)>) {
        for (key, value) in table {
            let path = if before.is_empty() { key.clone() } else { format!("{before}.{key}") };
            match value {
                Value::Table(inner) => values(inner, &path, found),
                _ => found.push((path, value.clone())),
            }
        }
    }

    /// Prevents a preset of a user that takes the region or the camera along, and one that loses a part of the look.
    #[test]
    fn a_look_is_all_but_what_belongs_to_the_examination() {
        let settings = |name: &str, more: &[&str]| {
            let mut layers = Layers::default();
            layers.preset(name).unwrap();
            more.iter().for_each(|line| layers.set(line).unwrap());
            layers.finish().unwrap()
        };
        let present = settings(
            "face-classic",
            &[
                "surface.start_depth=33",
                "volume.start_depth=34",
                "projection.start_depth=35",
                "region.start_curve=[[-9,34],[1,42],[12,36]]",
                "planes.position=[1,2,3]",
                "planes.azimuth=4",
                "planes.tilt=5",
                "planes.roll=6",
                "planes.plane=c",
                "planes.curve={plane='b',points=[[1,2],[3,4]]}",
                "cube.inset.left=7",
                "cube.tilt.left=[8,9]",
                "slices.everything=true",
                "slices.still=true",
                "labels={fill=0.4,outline=false,shell=0.6,behind=0.1}",
                "marks.bar=true",
                "samples.range=[0,100]",
                "unveil={enabled=true,offset=3,smoothing=4}",
                "clip=[{at=[0,0,0],normal=[0,1,0]}]",
                "cap={enabled=false,level=0.2}",
                "cuts=[{contour=[[0,0],[1,0],[0,1]],view={at=[0,0,0],direction=[0,1,0],up=[0,0,1]}}]",
                "measure=[{kind='distance',points=[[0,0,0],[1,0,0]]}]",
                "body_marks=[{body='neck'}]",
                "cine={first=1,last=2,speed=0.5,back_and_forth=true}",
            ],
        );
        let look = settings("glass", &["cube.shading=0.3", "planes.window=[0.1,0.9]", "region.fade=3"]);
        let both = look.look_over(&present);
        let table = |settings: &Settings| {
            let mut found = Vec::new();
            values(&settings.to_table().unwrap(), "", &mut found);
            found
        };
        let (of_look, of_present, of_both) = (table(&look), table(&present), table(&both));
        for (path, value) in &of_both {
            let from = if is_look(path) { &of_look } else { &of_present };
            assert!(from.contains(&(path.clone(), value.clone())), "{path} is {value}");
        }
        let of = |all: &[(String, Value)], look: bool| all.iter().filter(|(path, _)| is_look(path) == look).count();
        assert_eq!(of(&of_both, true), of(&of_look, true));
        assert_eq!(of(&of_both, false), of(&of_present, false));
        assert_eq!(both.light.shadow, None, "what the look has not is not kept of the settings before");
        assert!(OF_EXAMINATION.iter().all(|path| of_present.iter().any(|(there, _)| there.starts_with(path))));
        assert_eq!(look.look().look_over(&present), both, "a look is kept without the examination");
    }
}
