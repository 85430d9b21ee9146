//! Pictures through the enhanced sigma filter, window by window: how far they grow (thesis Tables 7-9).

use crate::gpu::{Context, GpuError, Options, Renderer};
use crate::passes::Slot;
use crate::picture::grey::Grey;
use crate::probe::{Geometry, Grid};
use crate::scene::{Input, Scene, SceneError, Settings};
use crate::source::StoredType;
use crate::thesis_tables::window_growth::Growth;
use std::sync::Arc;

/// One row of the growth table: sigma, starting and largest window, and the settings that make it.
pub type Row = (f64, [u32; 2], Settings);

#[derive(Debug, thiserror::Error)]
pub enum Fault {
    #[error("{0}")]
    Scene(#[from] SceneError),
    #[error("{0}")]
    Gpu(#[from] GpuError),
}

/// A picture as a Cartesian volume of one slice.
///
/// # Errors
/// Settings that cannot be.
pub fn scene(grey: &Grey, settings: Settings) -> Result<Scene, SceneError> {
    let grid = Grid { size: [grey.width as usize, grey.height as usize, 1], spacing: [1.0; 3], origin: [0.0; 3] };
    let stored = if grey.sixteen { StoredType::U16 } else { StoredType::U8 };
    Scene::new(Geometry::Cartesian(grid), Input { stored, range: [0.0, grey.white()] }, settings)
}

/// One picture through the filter for every row; only the filter changes in between.
///
/// # Errors
/// Windows beyond what is filtered; a picture that the device cannot hold.
pub fn measure(context: &Arc<Context>, grey: &Grey, rows: Vec<Row>) -> Result<Vec<Growth>, Fault> {
    let (mut grown, mut renderer) = (Vec::new(), None);
    for (sigma, windows, settings) in rows {
        let scene = scene(grey, settings)?;
        let renderer: &mut Renderer = match &mut renderer {
            None => renderer.insert(Renderer::new(context, scene, &Options::default())?),
            Some(there) => {
                there.change(scene)?;
                there
            }
        };
        renderer.frame(0, &grey.bytes(), 0)?;
        let rings = renderer.read(Slot::Growth)?;
        let rings = rings.ok_or_else(|| GpuError::Broken("slot 'growth' is not in the plan".into()))?;
        grown.push(Growth::new(sigma, windows, &rings.values));
    }
    Ok(grown)
}
