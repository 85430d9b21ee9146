//! The rendered part of a volume: the insonified box, the region of interest, and the pixel grid of the slices.

use super::{Mode, SceneError, Settings, SliceGrid, refuse};
use crate::probe::{Geometry, Motion, Probe};
use glam::DVec3;

/// Y coordinate in space of the probe's face, mm: what is added to a depth below the face to get Y. 0 for a Cartesian volume.
pub fn depth_offset(geometry: &Geometry) -> f64 {
    match geometry {
        Geometry::Sweep(probe) => probe.array_radius(),
        Geometry::Cartesian(_) => 0.0,
    }
}

pub(super) fn is_still(geometry: &Geometry) -> bool {
    matches!(geometry, Geometry::Sweep(Probe { motion: Motion::Still { .. }, .. }))
}

/// Lower and upper corner of the box around the insonified region, mm in space.
pub fn insonified_box(geometry: &Geometry) -> (DVec3, DVec3) {
    match geometry {
        Geometry::Sweep(probe) => probe.bounds(),
        Geometry::Cartesian(grid) => {
            // Half a voxel beyond the outer voxel centres, so that a volume of one slice has a thickness.
            let (origin, spacing) = (DVec3::from(grid.origin), DVec3::from(grid.spacing));
            let count = DVec3::new(grid.size[0] as f64, grid.size[1] as f64, grid.size[2] as f64);
            (origin - spacing / 2.0, origin + (count - 0.5) * spacing)
        }
    }
}

pub(super) fn slice_grid(geometry: &Geometry, pixels: u32) -> SliceGrid {
    match geometry {
        Geometry::Cartesian(grid) => SliceGrid {
            size: [grid.size[0] as u32, grid.size[1] as u32],
            origin: [grid.origin[0], grid.origin[1]],
            pitch: [grid.spacing[0], grid.spacing[1]],
        },
        Geometry::Sweep(probe) => {
            let (low, high) = probe.plane_bounds();
            let extent = [high[0] - low[0], high[1] - low[1]];
            let pitch = extent[0].max(extent[1]) / f64::from(pixels - 1);
            let count = |e: f64| ((e / pitch - 1e-9).ceil().max(0.0) as u32 + 1).max(2);
            SliceGrid { size: [count(extent[0]), count(extent[1])], origin: low, pitch: [pitch, pitch] }
        }
    }
}

pub(super) fn visible_box(geometry: &Geometry, settings: &Settings) -> Result<(DVec3, DVec3), SceneError> {
    let (mut low, mut high) = insonified_box(geometry);
    let offset = depth_offset(geometry);
    let region = &settings.region;
    let sides =
        [("region.lateral", region.lateral), ("region.depth", region.depth), ("region.elevation", region.elevation)];
    for (axis, (field, side)) in sides.into_iter().enumerate() {
        let Some([from, to]) = side else { continue };
        if !(from.is_finite() && to.is_finite() && from < to) {
            return refuse(field, format!("[{from}, {to}] must be finite and rise"));
        }
        let offset = if axis == 1 { offset } else { 0.0 };
        let there = [low[axis] - offset, high[axis] - offset];
        low[axis] = low[axis].max(from + offset);
        high[axis] = high[axis].min(to + offset);
        if low[axis] >= high[axis] {
            return refuse(
                field,
                format!("[{from}, {to}] mm misses the volume, which lies in [{:.2}, {:.2}]", there[0], there[1]),
            );
        }
    }
    Ok((low, high))
}

/// Lower corner of the box that the camera frames: `low`, moved to the shallowest start depth that the mode uses.
///
/// # Errors
/// A start depth is not a number, or leaves nothing of the region.
pub(super) fn framed_low(
    geometry: &Geometry,
    settings: &Settings,
    low: DVec3,
    high: DVec3,
) -> Result<DVec3, SceneError> {
    let offset = depth_offset(geometry);
    let volume = ("volume.start_depth", settings.volume.start_depth);
    let surface = ("surface.start_depth", settings.surface.start_depth);
    let starts = match settings.mode {
        Mode::Volume => vec![volume],
        Mode::Surface => vec![surface],
        Mode::Mixed => vec![surface, volume],
        Mode::Mip | Mode::MinIp | Mode::Mean => vec![("projection.start_depth", settings.projection.start_depth)],
        Mode::Plane | Mode::Orthogonal | Mode::Tomography | Mode::Cube => vec![],
    };
    for (field, start) in &starts {
        if let Some(start) = start.filter(|s| !s.is_finite() || s + offset >= high.y) {
            return refuse(field, format!("{start} mm leaves nothing: the region ends at {:.2} mm", high.y - offset));
        }
    }
    let shallowest = starts.iter().map(|(_, start)| start.map_or(low.y, |s| low.y.max(s + offset))).reduce(f64::min);
    Ok(low.with_y(shallowest.unwrap_or(low.y)))
}
