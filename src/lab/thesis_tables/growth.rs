//! Tables 7-9 of the thesis (5.5): the growth of the windows of the enhanced sigma filter on a picture, as the share of pixels whose window
//! grew by +0, +2, +4 ... pixels.

use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::Slot;
use crate::picture::Grey;
use crate::probe::{Geometry, Grid};
use crate::profile::export::aligned;
use crate::scene::{EnhancedSigma, Estimator, Input, Mode, Scene, SceneError, Settings, VolumeFormat};
use crate::source::StoredType;
use std::sync::Arc;

/// Starting and largest windows of Tables 7-9, pixels, up to the last columns of the tables: a window of 7x7 grows to 19 in Tables 7 and 9, and to 21
/// in Table 8.
pub const WINDOWS: [[u32; 2]; 7] = [[3, 17], [5, 19], [7, 19], [7, 21], [9, 21], [11, 21], [13, 23]];
/// Estimators of the enhanced sigma filter's centre value for which growth is measured. The thesis ties Fig. 48, and so Table 7, to the median (5.7),
/// and planes to Perona-Malik (5.7). Tables 8 and 9 do not say.
pub const CENTRES: [Estimator; 2] = [Estimator::Median, Estimator::PeronaMalik];

/// Values of the thesis: name of the table, starting window in pixels, and per cent of the pixels whose window's edge grew by 0, 2 and 4 pixels.
pub(crate) const THESIS: [(&str, u32, [f64; 3]); 4] = [
    ("Table 7 (Fig. 48)", 3, [79.30, 20.51, 0.04]),
    ("Table 7 (Fig. 48)", 7, [37.02, 57.88, 2.20]),
    ("Table 9 (liver, Fig. 50)", 3, [77.95, 21.83, 0.20]),
    ("Table 9 (liver, Fig. 50)", 7, [41.51, 50.11, 4.91]),
];
/// Standard deviations of the noise for which the thesis measures growth, 0..1.
pub const SIGMAS: [f64; 3] = [0.03, 0.1, 0.17];

/// How far the windows of the enhanced sigma filter grew on one picture, with one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Growth {
    pub centre: Estimator,
    pub sigma: f64,
    /// Starting and largest window, pixels.
    pub windows: [u32; 2],
    /// Number of pixels whose window grew by n rings, at index n. A ring is one pixel wide, so that it makes the window's edge 2 pixels longer.
    pub counts: Vec<u64>,
}

impl Growth {
    /// Counts the pixels. `windows`: starting and largest window, pixels. `rings`: for each pixel the number of rings, each one pixel wide, by which
    /// its window grew.
    pub fn new(centre: Estimator, sigma: f64, windows: [u32; 2], rings: &[f64]) -> Growth {
        let max_rings = (windows[1] - windows[0]) / 2;
        let mut counts = vec![0; max_rings as usize + 1];
        for ring in rings {
            counts[(ring.round().max(0.0) as usize).min(max_rings as usize)] += 1;
        }
        Growth { centre, sigma, windows, counts }
    }

    /// Share (0..1) of the pixels whose window grew by exactly `rings` rings. None if windows cannot grow that far.
    pub fn share(&self, rings: usize) -> Option<f64> {
        let all: u64 = self.counts.iter().sum();
        self.counts.get(rings).map(|n| *n as f64 / all.max(1) as f64)
    }
}

/// A header and the cells of each row: its settings, then the shares by how far the edge of a window grew, each in words. The header of a share is
/// `grew` and the pixels.
fn cells(rows: &[Growth], grew: &str, in_words: fn(f64) -> String) -> Vec<Vec<String>> {
    let columns = rows.iter().map(|r| r.counts.len()).max().unwrap_or(0);
    let mut head = ["centre", "sigma", "window", "largest"].map(String::from).to_vec();
    head.extend((0..columns).map(|n| format!("{grew}{}", 2 * n)));
    let row = |row: &Growth| {
        let [window, largest] = row.windows.map(|n| n.to_string());
        let mut cells = vec![row.centre.name().into(), row.sigma.to_string(), window, largest];
        cells.extend((0..columns).map(|n| row.share(n).map_or(String::new(), in_words)));
        cells
    };
    [head].into_iter().chain(rows.iter().map(row)).collect()
}

/// A table of text, one line per row, with the share of the pixels whose window's edge grew by 0, 2, 4 ... pixels, in per cent.
pub fn table(rows: &[Growth]) -> String {
    aligned(&cells(rows, "+", |share| format!("{:.2} %", 100.0 * share)), 1)
}

/// Shares (0..1) of the pixels whose window's edge grew by 0, 2, 4 ... pixels as CSV: a header, and one line per row. A window that cannot grow that
/// far has an empty field.
pub fn csv(rows: &[Growth]) -> String {
    cells(rows, "grew ", |share| format!("{share:.6}")).iter().map(|row| row.join(",") + "\n").collect()
}

/// How far the windows of the enhanced sigma filter grew on one picture, with all settings of Tables 7-9.
#[derive(Clone, Debug, PartialEq)]
pub struct Grown {
    /// Name of the picture.
    pub picture: String,
    pub rows: Vec<Growth>,
}

/// What one row is measured with: estimator of the centre, sigma, starting and largest window in pixels, and all settings.
pub type GrowthSettings = (Estimator, f64, [u32; 2], Settings);

/// Why growth cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum GrowthError {
    #[error("{0}")]
    Scene(#[from] SceneError),
    #[error("{0}")]
    Gpu(#[from] GpuError),
}

/// The scene of a grey picture, as a Cartesian volume of one slice.
///
/// # Errors
/// A setting is out of range, or does not suit such a volume.
pub fn scene_of(grey: &Grey, settings: Settings) -> Result<Scene, SceneError> {
    let grid = Grid { size: [grey.width as usize, grey.height as usize, 1], spacing: [1.0; 3], origin: [0.0; 3] };
    let stored = if grey.sixteen { StoredType::U16 } else { StoredType::U8 };
    Scene::new(Geometry::Cartesian(grid), Input { stored, range: [0.0, grey.white()] }, settings)
}

/// Filters one picture with the settings of every row, and returns how far its windows grew in each.
///
/// # Errors
/// The settings of a row are refused or do not record growth, or the device cannot hold the picture or fails.
pub fn measure(context: &Arc<Context>, grey: &Grey, rows: Vec<GrowthSettings>) -> Result<Vec<Growth>, GrowthError> {
    let (mut grown, mut renderer) = (Vec::new(), None);
    for (centre, sigma, windows, settings) in rows {
        let scene = scene_of(grey, settings)?;
        let renderer: &mut Renderer = match &mut renderer {
            None => renderer.insert(Renderer::new(context, scene, &RendererOptions::default())?),
            Some(renderer) => {
                renderer.change(scene)?;
                renderer
            }
        };
        renderer.frame(0, &grey.bytes(), 0)?;
        let rings = renderer.read(Slot::Growth)?;
        let rings = rings.ok_or_else(|| GpuError::Broken("slot 'growth' is not in the plan".into()))?;
        grown.push(Growth::new(centre, sigma, windows, &rings.values));
    }
    Ok(grown)
}

/// Measures Tables 7-9 on a picture, with both estimators, as `echolume filter --growth-table` does. `picture`: its name.
///
/// # Errors
/// The scene of the picture is refused, or the device cannot hold the picture or fails.
pub fn growth(context: &Arc<Context>, picture: &str, grey: &Grey) -> Result<Grown, GrowthError> {
    let mut rows = Vec::new();
    for (centre, sigma) in CENTRES.into_iter().flat_map(|centre| SIGMAS.map(|sigma| (centre, sigma))) {
        rows.extend(WINDOWS.map(|windows| (centre, sigma, windows, growth_settings(centre, sigma, windows))));
    }
    Ok(Grown { picture: picture.into(), rows: measure(context, grey, rows)? })
}

/// The settings of a row of Tables 7-9, with a starting and a largest window in pixels.
pub fn growth_settings(centre: Estimator, sigma: f64, [window, largest]: [u32; 2]) -> Settings {
    let mut settings = Settings { mode: Mode::Plane, ..Settings::default() };
    settings.picture.size = [1, 1];
    settings.slices.format = VolumeFormat::R32f;
    let centre = Some(centre);
    settings.slices.enhanced_sigma =
        Some(EnhancedSigma { window, largest, sigma, centre, growth: true, ..EnhancedSigma::default() });
    settings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_pixels_and_a_window_that_cannot_grow_has_none() {
        let wide = Growth::new(Estimator::Median, 0.1, [3, 7], &[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 0.0, 0.0]);
        assert_eq!(wide.counts, [5, 1, 2]);
        let narrow = Growth::new(Estimator::PeronaMalik, 0.1, [5, 7], &[1.0, 0.0]);
        let csv = csv(&[wide.clone(), narrow.clone()]);
        assert_eq!(
            csv,
            "centre,sigma,window,largest,grew 0,grew 2,grew 4\nmedian,0.1,3,7,0.625000,0.125000,0.250000\n\
             perona-malik,0.1,5,7,0.500000,0.500000,\n"
        );
        let table = table(&[wide, narrow]);
        assert!(table.contains("62.50 %") && table.lines().count() == 3, "{table}");
    }
}
