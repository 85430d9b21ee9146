//! The quality ladder of a moving view: changes of the settings from full quality down. They come from a measured error report, or are
//! the built-in ones, which were found to cost the least error for the time that they save.

use crate::error_report::{Measure, Report, choose};
use crate::scene::load::Layers;
use crate::scene::{Settings, Transfer};

/// Largest number of rungs of a measured ladder.
const MAX_RUNGS: usize = 6;

/// One rung of the ladder.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// Description for the display of times.
    pub(super) label: String,
    /// Time of a picture as a fraction of that at full quality.
    pub(super) time_share: f64,
    change: Change,
}

/// How a rung changes the settings.
#[derive(Clone, Debug, PartialEq)]
enum Change {
    None,
    BuiltIn {
        half_rays: bool,
        step_factor: f64,
        small_filters: bool,
        no_filters: bool,
    },
    /// Assignments as of `--set`, from an error report.
    Measured(Vec<String>),
}

/// The built-in ladder. The time shares are a first estimate, from the phantom's face on two cores (where the last rung takes a tenth);
/// the frame budget corrects them with measurements.
pub fn built_in() -> Vec<Rung> {
    let rung = |label: &str, time_share, half_rays, step_factor, small_filters, no_filters| Rung {
        label: label.into(),
        time_share,
        change: Change::BuiltIn { half_rays, step_factor, small_filters, no_filters },
    };
    vec![
        Rung { label: "full quality".into(), time_share: 1.0, change: Change::None },
        rung("half the rays each way", 0.3, true, 1.0, false, false),
        rung("half the rays, steps x 1.5", 0.22, true, 1.5, false, false),
        rung("half the rays, steps x 2, small filters", 0.14, true, 2.0, true, false),
        rung("half the rays, steps x 3, no shadow, no filters", 0.08, true, 3.0, true, true),
    ]
}

/// The ladder of an error report: the Pareto front of its combinations, from full quality to the fastest.
///
/// # Errors
/// One line: the report has no times.
pub fn measured(report: &Report) -> Result<Vec<Rung>, String> {
    let (front, slowest) = choose::front(report, Measure::Rmse)?;
    let full = Rung { label: "full quality".into(), time_share: 1.0, change: Change::None };
    // A rung must save at least a quarter of the time of the one before.
    let mut rungs = vec![full];
    for choice in front.iter().rev() {
        let (time_share, before) = (choice.time / slowest, rungs.last().map_or(1.0, |r| r.time_share));
        if time_share <= 0.75 * before {
            let label = choice.changed.iter().map(|(dial, point)| format!("{dial} {point}")).collect::<Vec<_>>();
            rungs.push(Rung { label: label.join(", "), time_share, change: Change::Measured(choice.set.clone()) });
        }
    }
    // If there are too many, the fastest one stays.
    while rungs.len() > MAX_RUNGS {
        rungs.remove(rungs.len() - 2);
    }
    Ok(rungs)
}

impl Rung {
    /// The settings on this rung; unchanged if a measured change does not fit them. `voxel`: edge of a slice pixel, mm, which is the step
    /// unless one is set.
    pub(super) fn apply(&self, settings: &Settings, voxel: f64) -> Settings {
        let mut changed = settings.clone();
        match &self.change {
            Change::None => return changed,
            Change::BuiltIn { half_rays, step_factor, small_filters, no_filters } => {
                if *half_rays {
                    changed = changed.moving();
                }
                // With a steep transfer function a longer step is visible as rings.
                let steep = matches!(&settings.volume.transfer, Transfer::Points(p) if p.len() > 8);
                if *step_factor > 1.0 && !steep {
                    changed.ray.step = Some(settings.ray.step.unwrap_or(voxel) * step_factor);
                }
                if *small_filters {
                    changed.distance = changed.distance.halved();
                    changed.light.occlusion = None;
                }
                if *no_filters {
                    changed.light.shadow = None;
                    changed.distance = Default::default();
                    (changed.post.sigma, changed.post.enhanced_sigma, changed.post.perona_malik) = (None, None, None);
                }
            }
            Change::Measured(set) => {
                let apply = || -> Option<Settings> {
                    let mut layers = Layers::of(settings)?;
                    set.iter().try_for_each(|assignment| layers.set(assignment)).ok()?;
                    layers.finish().ok()
                };
                changed = apply().unwrap_or(changed);
            }
        }
        // Stage 1 stays the same: a change would need all frames again.
        changed.slices = settings.slices.clone();
        changed.conditioning = settings.conditioning.clone();
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rung_keeps_stage_1_and_is_faster_than_the_one_before() {
        for (preset, _) in crate::scene::load::PRESETS {
            let mut layers = Layers::default();
            layers.preset(preset).expect("preset");
            let settings = layers.finish().expect("settings");
            let rungs = built_in();
            assert_eq!(rungs[0].apply(&settings, 0.3), settings);
            for pair in rungs.windows(2) {
                assert!(pair[1].time_share < pair[0].time_share);
                let changed = pair[1].apply(&settings, 0.3);
                assert!(changed.ray.half && changed.slices == settings.slices, "{preset}: {}", pair[1].label);
            }
        }
    }

    #[test]
    fn settings_survive_the_conversion_to_layers() {
        for (preset, _) in crate::scene::load::PRESETS {
            let mut layers = Layers::default();
            layers.preset(preset).expect("preset");
            let settings = layers.finish().expect("settings");
            assert_eq!(Layers::of(&settings).and_then(|l| l.finish().ok()).as_ref(), Some(&settings), "{preset}");
        }
    }
}
