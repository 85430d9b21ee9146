//! `--budget` of `echolume render`: settings from an error report.

use crate::args::parse_nanoseconds;
use crate::baselines::Stored;
use crate::error_report::choose::{Bound, choose};
use crate::error_report::{Measure, Report};
use crate::passes::PassTime;
use crate::scene::Scene;
use crate::terminal::{Failure, failed, input, say};
use std::path::Path;

/// The settings with the smallest error whose time is within the budget, according to the error report in `file`, as assignments. `scene`: opens the
/// scene to which they are added.
///
/// # Errors
/// The budget is no time, the report cannot be read or is for a volume of another size, or no settings are within the budget.
pub(super) fn chosen(
    budget: &str,
    file: &Path,
    scene: impl FnOnce() -> Result<Scene, Failure>,
) -> Result<Vec<String>, Failure> {
    let time = parse_nanoseconds("--budget", budget)?;
    let report = Report::load(file).map_err(input)?;
    let scene = scene()?;
    let (there, here) = (report.sizes.volume, scene.volume_size());
    if there != here {
        let shown = |[x, y, z]: [u32; 3]| format!("{x}x{y}x{z}");
        let (file, there, here) = (file.display(), shown(there), shown(here));
        return Err(input(format!("--report {file}: is for a volume of {there}, this one has {here}")));
    }
    let measure = Measure::Rmse;
    let chosen =
        choose(&report, measure, Bound::Time(time), &[]).map_err(|e| failed(format!("--budget {budget}: {e}")))?;
    let choice = &report.choices[chosen];
    let of = if report.is_of(&scene) { "this scene" } else { "another scene, whose error it is" };
    say!("budget {budget}: {}, measured on {} with {of}", choice.describe(measure), report.device);
    Ok(choice.set.clone())
}

/// Prints whether the times of a picture's passes are within the budget. An error only if the budget is no time.
pub(super) fn judge(budget: &str, times: &[PassTime]) -> Result<(), Failure> {
    let (time, taken) = (parse_nanoseconds("--budget", budget)?, times.iter().map(|t| t.total).sum::<f64>());
    let kept = if taken <= time { "within" } else { "over" };
    match times.is_empty() {
        true => say!("budget {budget}: this device has no time stamps"),
        false => say!("budget {budget}: volume and picture took {:.3} ms, {kept} the budget", taken * 1e-6),
    }
    Ok(())
}
