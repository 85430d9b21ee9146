//! What no plane, tile or block may be, told by name and limit.

use super::check::within;
use super::planes::{MAX_SLAB, MAX_TILES};
use super::{Mode, Scene, SceneError, Settings, refuse};

/// Everything that can be told without a geometry.
pub(super) fn check(settings: &Settings) -> Result<(), SceneError> {
    let p = &settings.planes;
    for value in p.position.iter().flatten() {
        within("planes.position", *value, -1e6, 1e6)?;
    }
    for (field, value) in [("planes.azimuth", p.azimuth), ("planes.tilt", p.tilt), ("planes.roll", p.roll)] {
        within(field, value, -360.0, 360.0)?;
    }
    within("planes.thickness", p.thickness, 0.0, 1e6)?;
    within("planes.zoom", p.zoom, 1e-3, 1e3)?;
    within("planes.columns", f64::from(p.columns), 1.0, f64::from(MAX_TILES))?;
    within("planes.rows", f64::from(p.rows), 1.0, f64::from(MAX_TILES))?;
    if let Some(spacing) = p.spacing {
        within("planes.spacing", spacing, 1e-4, 1e4)?;
    }
    let (inset, tilt) = (&settings.cube.inset, &settings.cube.tilt);
    for (field, inset, tilt) in [
        ("cube.inset.left, cube.tilt.left", inset.left, tilt.left),
        ("cube.inset.right, cube.tilt.right", inset.right, tilt.right),
        ("cube.inset.near, cube.tilt.near", inset.near, tilt.near),
        ("cube.inset.far, cube.tilt.far", inset.far, tilt.far),
        ("cube.inset.bottom, cube.tilt.bottom", inset.bottom, tilt.bottom),
        ("cube.inset.top, cube.tilt.top", inset.top, tilt.top),
    ] {
        within(field, inset, 0.0, 1e6)?;
        // Edge-on a face would no longer bound its side.
        tilt.iter().try_for_each(|angle| within(field, *angle, -80.0, 80.0))?;
    }
    within("cube.shading", settings.cube.shading, 0.0, 1.0)
}

/// What needs the volume: how many tiles and samples there are, and whether anything is left of the block.
pub(super) fn check_resolved(scene: &Scene) -> Result<(), SceneError> {
    if scene.settings.mode == Mode::Cube {
        scene.check_block()?;
    }
    if !scene.cuts_planes() {
        return Ok(());
    }
    let tiles = scene.tile_count();
    if tiles > MAX_TILES {
        return refuse("planes.columns, planes.rows", format!("make {tiles} tiles, at most {MAX_TILES} can be drawn"));
    }
    let ([columns, rows], [width, height]) = (scene.tile_grid(), scene.picture_size());
    if columns > width || rows > height {
        return refuse(
            "picture.size",
            format!("is {width}x{height}: {columns} x {rows} tiles need at least one pixel each"),
        );
    }
    let samples = scene.slab_samples();
    if samples > MAX_SLAB {
        let thickness = scene.settings.planes.thickness;
        return refuse(
            "planes.thickness",
            format!("{thickness} mm makes {samples:.0} samples through the slab, at most {MAX_SLAB}"),
        );
    }
    Ok(())
}
