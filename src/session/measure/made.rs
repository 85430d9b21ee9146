//! Describes the conditions of a measurement: the plane or the view, and the settings of the picture. Exported results contain these texts.

use crate::scene::{Scene, Settings};
use glam::DVec3;

/// Largest distance of a point that counts as on a plane, mm. Coordinates are stored to a tenth of a micrometre.
const ON_PLANE: f64 = 1e-3;

/// Describes the plane of the picture in which all points of a measurement lie, by its centre and its normal. Points and centre are lateral, depth
/// from the probe's face and elevation, mm.
/// For points on the rendered surface (`on_surface`) it states the angles of the view instead. Empty if no plane contains them.
pub fn plane(scene: &Scene, points: &[[f64; 3]], on_surface: bool) -> String {
    if on_surface {
        let camera = &scene.settings.camera;
        let [azimuth, elevation, roll] = [camera.azimuth, camera.elevation, camera.roll];
        return format!("rendering, azimuth {azimuth:.1}, elevation {elevation:.1}, roll {roll:.1} deg");
    }
    if !scene.cuts_planes() {
        return String::new();
    }
    let tiling = scene.tiling();
    let holds = |n: &usize| {
        let off = |point: &[f64; 3]| tiling.project(&tiling.tiles[*n], scene.place_of(*point)).1.abs();
        points.iter().all(|point| off(point) <= ON_PLANE)
    };
    let Some(n) = (0..tiling.tiles.len()).find(holds) else { return String::new() };
    let plane = tiling.tiles[n].plane;
    let [at, normal] = [scene.point_of(plane.at), plane.normal.to_array()];
    let [x, y, z] = at.map(|mm| format!("{mm:.1}"));
    let [along_x, along_y, along_z] = normal.map(|share| format!("{share:.3}"));
    let name = match (&tiling.tiles[n].section, scene.curve(), scene.plane_of_tile(n)) {
        (Some(_), Some(curve), _) => format!("curved plane on {}", curve.plane.letter()),
        (_, _, Some(name)) => name.letter().to_string(),
        _ => scene.settings.planes.plane.letter().to_string(),
    };
    format!("{name} at {x}, {y}, {z} mm, normal {along_x}, {along_y}, {along_z}")
}

/// The direction of the view that [`plane`] describes: azimuth, elevation and roll to a tenth of a degree. None if it is not one.
pub(crate) fn direction(words: &str) -> Option<[f64; 3]> {
    let rest = words.strip_prefix("rendering, azimuth ")?.strip_suffix(" deg")?;
    let (azimuth, rest) = rest.split_once(", elevation ")?;
    let (elevation, roll) = rest.split_once(", roll ")?;
    let [Ok(azimuth), Ok(elevation), Ok(roll)] = [azimuth, elevation, roll].map(str::parse) else { return None };
    Some([azimuth, elevation, roll])
}

/// The normal of the plane that [`plane`] describes, to three decimals. None if it describes none.
pub(crate) fn normal(words: &str) -> Option<DVec3> {
    let numbers = words.split_once(" mm, normal ")?.1.split(", ").map(str::parse);
    let numbers = numbers.collect::<Result<Vec<f64>, _>>().ok()?;
    DVec3::from(<[f64; 3]>::try_from(numbers).ok()?).try_normalize()
}

/// The mode, and a digest of all settings except the size of the picture and what is drawn over it (FNV-1a of their text, 64 bits).
pub fn settings(of: &Settings) -> String {
    let settings = Settings { picture: Settings::default().picture, ..of.clone().without_drawings() };
    let text = settings.to_toml().unwrap_or_default();
    let digest = text
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |digest, byte| (digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{} {digest:016x}", of.mode.title())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_block::block;

    fn scene(lines: &[&str]) -> Scene {
        block(&[&["picture.size=[200,100]"], lines].concat(), [41, 31, 21])
    }

    /// Prevents a table that names another plane than the one that was measured on.
    #[test]
    fn the_plane_of_a_measurement_is_the_one_that_holds_all_of_its_points() {
        let three = scene(&["mode='orthogonal'", "planes.position=[1,15,2]"]);
        let cross = [1.0, 15.0, 2.0];
        for (end, letter) in [([5.0, 18.0, 2.0], "A"), ([1.0, 18.0, 6.0], "B"), ([5.0, 15.0, 6.0], "C")] {
            let words = plane(&three, &[cross, end], false);
            assert!(words.starts_with(&format!("{letter} at ")), "{words}");
            let axis = [DVec3::Z, DVec3::X, DVec3::Y][(letter.as_bytes()[0] - b'A') as usize];
            assert_eq!((normal(&words), direction(&words)), (Some(axis), None), "{words}");
        }
        assert_eq!(plane(&three, &[cross, [5.0, 18.0, 6.0]], false), "", "on none of them");
        let sliced = scene(&["mode='tomography'", "planes.plane='c'"]);
        let slice = sliced.tiling().tiles[3].plane;
        let words = plane(&sliced, &[sliced.point_of(slice.at)], false);
        assert!(
            words.starts_with("C at ") && words.contains(&format!(", {:.1}, ", sliced.point_of(slice.at)[1])),
            "{words}"
        );
        let rendered = scene(&["camera.azimuth=30"]);
        let words = plane(&rendered, &[cross], true);
        assert!(words.contains("azimuth 30.0") && plane(&rendered, &[cross], false).is_empty(), "{words}");
        assert_eq!((direction(&words), normal(&words)), (Some([30.0, 0.0, 0.0]), None));
    }

    #[test]
    fn settings_of_one_look_have_one_digest_and_others_another() {
        let words = |lines: &[&str]| settings(&scene(lines).settings);
        let plain = words(&["mode='plane'"]);
        assert!(plain.starts_with("Plane ") && plain.len() == "Plane ".len() + 16, "{plain}");
        assert_eq!(plain, words(&["mode='plane'", "picture.size=[90,80]", "marks.bar=true"]));
        assert_ne!(plain, words(&["mode='plane'", "planes.zoom=2"]));
    }
}
