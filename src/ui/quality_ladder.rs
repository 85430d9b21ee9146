//! The dials that a moving view turns, from full quality down: those that a report of errors measured, or where there is none those that
//! were found to cost least for what they save.

use crate::error_report::{Measure, Report, choose};
use crate::scene::load::Layers;
use crate::scene::{Settings, Transfer};

/// Most rungs of a ladder that was measured.
const MOST: usize = 6;

/// One setting of the dials.
#[derive(Clone, Debug, PartialEq)]
pub struct Rung {
    /// For the display.
    pub words: String,
    /// Its time as a share of that of full quality.
    pub share: f64,
    dials: Dials,
}

#[derive(Clone, Debug, PartialEq)]
enum Dials {
    Full,
    Built { half: bool, step: f64, narrow: bool, bare: bool },
    Measured(Vec<String>),
}

/// Without a report. Shares are a first guess, from the phantom's face on two cores (there the last rung takes a tenth): a view finds its
/// own from there on.
pub fn built_in() -> Vec<Rung> {
    let rung = |words: &str, share, half, step, narrow, bare| Rung {
        words: words.into(),
        share,
        dials: Dials::Built { half, step, narrow, bare },
    };
    vec![
        Rung { words: "full quality".into(), share: 1.0, dials: Dials::Full },
        rung("half the rays each way", 0.3, true, 1.0, false, false),
        rung("half the rays, steps x 1.5", 0.22, true, 1.5, false, false),
        rung("half the rays, steps x 2, small filters", 0.14, true, 2.0, true, false),
        rung("half the rays, steps x 3, no shadow, no filters", 0.08, true, 3.0, true, true),
    ]
}

/// From a report of errors: the front of its combinations, from full quality to the fastest.
///
/// # Errors
/// One line: nothing in it was timed.
pub fn measured(report: &Report) -> Result<Vec<Rung>, String> {
    let (front, slowest) = choose::front(report, Measure::Rmse)?;
    let full = Rung { words: "full quality".into(), share: 1.0, dials: Dials::Full };
    // Only what saves a quarter over the rung before is worth a rung.
    let mut rungs = vec![full];
    for choice in front.iter().rev() {
        let (share, before) = (choice.time / slowest, rungs.last().map_or(1.0, |r| r.share));
        if share <= 0.75 * before {
            let words = choice.turned.iter().map(|(dial, point)| format!("{dial} {point}")).collect::<Vec<_>>();
            rungs.push(Rung { words: words.join(", "), share, dials: Dials::Measured(choice.set.clone()) });
        }
    }
    // The fastest stays where there are too many.
    while rungs.len() > MOST {
        rungs.remove(rungs.len() - 2);
    }
    Ok(rungs)
}

impl Rung {
    /// The settings with the dials turned so; unchanged where they do not go together. `voxel`: edge of a slice pixel, mm, which a
    /// step has unless it is set.
    pub fn apply(&self, settings: &Settings, voxel: f64) -> Settings {
        let mut turned = settings.clone();
        match &self.dials {
            Dials::Full => return turned,
            Dials::Built { half, step, narrow, bare } => {
                if *half {
                    turned = turned.moving();
                }
                // A jump in the transfer function shows every step that is left out.
                let steep = matches!(&settings.volume.transfer, Transfer::Points(p) if p.len() > 8);
                if *step > 1.0 && !steep {
                    turned.ray.step = Some(settings.ray.step.unwrap_or(voxel) * step);
                }
                if *narrow {
                    turned.distance = turned.distance.halved();
                    turned.light.occlusion = None;
                }
                if *bare {
                    turned.light.shadow = None;
                    turned.distance = Default::default();
                    (turned.post.sigma, turned.post.enhanced_sigma, turned.post.perona_malik) = (None, None, None);
                }
            }
            Dials::Measured(set) => {
                let with = || -> Option<Settings> {
                    let mut layers = Layers::of(settings)?;
                    set.iter().try_for_each(|assignment| layers.set(assignment)).ok()?;
                    layers.finish().ok()
                };
                turned = with().unwrap_or(turned);
            }
        }
        // What stage 1 makes stays: frames would have to come again.
        turned.slices = settings.slices.clone();
        turned.conditioning = settings.conditioning.clone();
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rung_leaves_stage_1_as_it_is_and_is_faster_than_the_one_before() {
        for (preset, _) in crate::scene::load::PRESETS {
            let mut layers = Layers::default();
            layers.preset(preset).expect("preset");
            let settings = layers.finish().expect("settings");
            let rungs = built_in();
            assert_eq!(rungs[0].apply(&settings, 0.3), settings);
            for pair in rungs.windows(2) {
                assert!(pair[1].share < pair[0].share);
                let turned = pair[1].apply(&settings, 0.3);
                assert!(turned.ray.half && turned.slices == settings.slices, "{preset}: {}", pair[1].words);
            }
        }
    }

    #[test]
    fn settings_survive_the_way_through_layers() {
        for (preset, _) in crate::scene::load::PRESETS {
            let mut layers = Layers::default();
            layers.preset(preset).expect("preset");
            let settings = layers.finish().expect("settings");
            assert_eq!(Layers::of(&settings).and_then(|l| l.finish().ok()).as_ref(), Some(&settings), "{preset}");
        }
    }
}
