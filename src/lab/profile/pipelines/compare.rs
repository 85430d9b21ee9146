//! Compares the statistics of pipelines with earlier ones of the same device. They are counts without noise: any loss of occupancy and any
//! spill is a fact, and small changes of registers or instructions are not reported.

use super::{Pipeline, PipelineProfile};
use crate::baselines::{differing, matched};
use crate::tree::ToNode;

/// Ratio above which more registers or instructions are reported as worse.
const GROWTH: f64 = 1.05;

/// A pipeline whose value in a column differs between two profiles.
#[derive(Clone, Debug, PartialEq, ToNode)]
pub struct Change {
    /// Shader, constants and formats in one line.
    pub pipeline: String,
    /// Name of the column: "waves", "subgroup", "spills", "registers" or "instructions".
    pub column: &'static str,
    pub old: f64,
    pub new: f64,
    /// True if the change makes the comparison fail.
    pub is_worse: bool,
}

/// The comparison of two sets of pipeline statistics.
#[derive(Clone, Debug, PartialEq, ToNode)]
pub struct PipelineComparison {
    pub format: &'static str,
    /// Number of pipelines, by shader, constants and formats, that both sets have.
    pub compared: usize,
    /// Number of pipelines that only the new set has.
    pub added: usize,
    /// Number of pipelines that only the old set has.
    pub gone: usize,
    /// The changes; those that fail the comparison first.
    pub changes: Vec<Change>,
    /// Pipelines that only the new set has and whose registers spill.
    pub(crate) new_spills: Vec<String>,
    /// Compile time without any cache of the pipelines that both have, ms: old, new. It is reported and never fails the comparison, because another
    /// machine is faster or slower.
    pub(crate) cold_ms: [f64; 2],
    /// Differences in device, driver and input, one line each.
    pub notes: Vec<String>,
}

/// Why two sets cannot be compared.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum CompareError {
    #[error("{which} statistics: the device '{device}' reported none; there is nothing to compare")]
    NoStatistics { which: &'static str, device: String },
    #[error(
        "the devices differ ('{old}', '{new}'), and their statistics have nothing in common; compare runs of one device, or pass --force"
    )]
    Devices { old: String, new: String },
    #[error("no pipeline is in both; measure the same input with the same flags")]
    NothingInCommon,
}

impl PipelineComparison {
    /// Titles of the pipelines that fail the comparison, each once: those with a change for the worse, and new ones whose registers spill.
    pub fn worse(&self) -> Vec<&str> {
        let changed = self.changes.iter().filter(|change| change.is_worse).map(|change| &change.pipeline);
        let mut titles: Vec<&str> = changed.chain(&self.new_spills).map(String::as_str).collect();
        titles.dedup();
        titles
    }
}

/// Compares `new` with `old`. Pipelines match if shader, constants and formats are equal. `force`: also compares pipelines of different
/// devices.
///
/// # Errors
/// The devices differ and `force` is not set, there are no statistics, or there is no pipeline in common.
pub fn compare(old: &PipelineProfile, new: &PipelineProfile, force: bool) -> Result<PipelineComparison, CompareError> {
    for (which, profile) in [("old", old), ("new", new)] {
        if !profile.has_statistics {
            return Err(CompareError::NoStatistics { which, device: profile.device.clone() });
        }
    }
    if old.device != new.device && !force {
        return Err(CompareError::Devices { old: old.device.clone(), new: new.device.clone() });
    }
    let (mut changes, mut new_spills, mut compared, mut cold_ms) = (Vec::new(), Vec::new(), 0, [0.0; 2]);
    for both in matched(&old.pipelines, &new.pipelines, |p| (&p.shader, &p.constants, &p.formats)) {
        match both {
            (Some(earlier), Some(pipeline)) => {
                compared += 1;
                cold_ms = [cold_ms[0] + earlier.cold_ms, cold_ms[1] + pipeline.cold_ms];
                changes.extend(changes_of(old, earlier, new, pipeline));
            }
            (None, Some(pipeline)) if new.columns(pipeline).spills.is_some_and(|spills| spills > 0.0) => {
                new_spills.push(pipeline.title())
            }
            _ => {}
        }
    }
    if compared == 0 {
        return Err(CompareError::NothingInCommon);
    }
    // The sort is stable: the order of use stays.
    changes.sort_by_key(|change| !change.is_worse);
    let conditions =
        |p: &PipelineProfile| [("device", p.device.clone()), ("driver", p.driver.clone()), ("input", p.input.clone())];
    Ok(PipelineComparison {
        format: "echolume-pipeline-comparison-1",
        compared,
        added: new.pipelines.len() - compared,
        gone: old.pipelines.len() - compared,
        changes,
        new_spills,
        cold_ms,
        notes: differing(conditions(old), conditions(new)),
    })
}

/// Tells from the old value and the new one whether a column became worse.
type IsWorse = fn(f64, f64) -> bool;

/// What differs between two runs of a pipeline.
fn changes_of(old: &PipelineProfile, earlier: &Pipeline, new: &PipelineProfile, pipeline: &Pipeline) -> Vec<Change> {
    let (was, is) = (old.columns(earlier), new.columns(pipeline));
    let subgroup = |columns: &super::Columns| columns.subgroup.map(f64::from);
    let columns: [(&'static str, Option<f64>, Option<f64>, IsWorse); 5] = [
        ("waves", was.waves, is.waves, |old, new| new < old),
        ("subgroup", subgroup(&was), subgroup(&is), |old, new| new < old),
        ("spills", was.spills, is.spills, |old, new| new > old),
        ("registers", was.registers, is.registers, |old, new| new > old * GROWTH),
        ("instructions", was.instructions, is.instructions, |old, new| new > old * GROWTH),
    ];
    let differing = columns.into_iter().filter_map(|(column, old, new, is_worse)| {
        let (old, new) = (old?, new?);
        let change = || Change { pipeline: pipeline.title(), column, old, new, is_worse: is_worse(old, new) };
        (old != new).then(change)
    });
    differing.collect()
}

#[cfg(test)]
mod tests {
    use super::super::Executable;
    use super::*;
    use crate::baselines::Stored;

    /// Waves, spills, registers, instructions of pipelines that differ by a constant.
    fn profile(pipelines: &[(i32, [f64; 4])]) -> PipelineProfile {
        let one = |(constant, values): &(i32, [f64; 4])| Pipeline {
            pass: None,
            shader: "a.b".into(),
            constants: [("N".to_string(), *constant)].into(),
            formats: vec!["R8".into()],
            cold_ms: 2.0,
            warm_ms: 0.5,
            from_cache: Some(true),
            executables: vec![Executable {
                name: "main".into(),
                subgroup: 32,
                values: values.iter().copied().map(Some).collect(),
            }],
        };
        PipelineProfile {
            format: PipelineProfile::FORMAT.into(),
            program: "p".into(),
            date: "d".into(),
            device: "GPU".into(),
            driver: "1".into(),
            input: "phantom".into(),
            has_statistics: true,
            statistics: ["Max warps/SM", "Spills to memory", "Number of GPRs", "Instruction count"]
                .map(Into::into)
                .into(),
            pipelines: pipelines.iter().map(one).collect(),
        }
    }

    const PLAIN: [f64; 4] = [48.0, 0.0, 40.0, 1000.0];

    #[test]
    fn a_loss_of_occupancy_a_spill_and_growth_beyond_a_twentieth_are_worse_and_less_is_not() {
        for (values, worse) in [
            ([47.0, 0.0, 40.0, 1000.0], Some("waves")),
            ([48.0, 1.0, 40.0, 1000.0], Some("spills")),
            ([48.0, 0.0, 43.0, 1000.0], Some("registers")),
            ([48.0, 0.0, 40.0, 1051.0], Some("instructions")),
            ([48.0, 0.0, 42.0, 1050.0], None),
            ([56.0, 0.0, 24.0, 500.0], None),
            (PLAIN, None),
        ] {
            let compared = compare(&profile(&[(1, PLAIN)]), &profile(&[(1, values)]), false).expect("compared");
            let found: Vec<_> = compared.changes.iter().filter(|c| c.is_worse).map(|c| c.column).collect();
            assert_eq!(found, worse.into_iter().collect::<Vec<_>>(), "{values:?}");
            assert_eq!(compared.worse().len(), found.len());
            assert_eq!(compared.changes.is_empty(), values == PLAIN, "{values:?}");
        }
        let mut narrower = profile(&[(1, PLAIN)]);
        narrower.pipelines[0].executables[0].subgroup = 16;
        let compared = compare(&profile(&[(1, PLAIN)]), &narrower, false).expect("compared");
        assert_eq!(compared.worse(), ["a.b N=1 R8"]);
    }

    #[test]
    fn pipelines_of_one_side_are_counted_and_a_new_one_must_not_spill() {
        let old = profile(&[(1, PLAIN), (2, PLAIN)]);
        let new = profile(&[(2, PLAIN), (3, PLAIN), (4, [48.0, 7.0, 40.0, 9.0])]);
        let compared = compare(&old, &new, false).expect("compared");
        assert_eq!((compared.compared, compared.added, compared.gone), (1, 2, 1));
        assert_eq!(compared.worse(), ["a.b N=4 R8"]);
        assert_eq!(compared.cold_ms, [2.0, 2.0]);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let plain = profile(&[(1, PLAIN)]);
        let other = PipelineProfile { device: "other".into(), ..plain.clone() };
        assert!(matches!(compare(&plain, &other, false), Err(CompareError::Devices { .. })));
        assert_eq!(compare(&plain, &other, true).expect("forced").notes, ["device: GPU -> other"]);
        let none = PipelineProfile { has_statistics: false, ..plain.clone() };
        assert!(matches!(compare(&none, &plain, false), Err(CompareError::NoStatistics { which: "old", .. })));
        assert!(matches!(compare(&plain, &none, false), Err(CompareError::NoStatistics { which: "new", .. })));
        assert_eq!(compare(&plain, &profile(&[(2, PLAIN)]), false), Err(CompareError::NothingInCommon));
    }

    #[test]
    fn what_is_written_is_read_back_and_nothing_else_is_accepted() {
        let plain = profile(&[(1, PLAIN), (2, PLAIN)]);
        let text = plain.to_json().expect("json");
        assert_eq!(PipelineProfile::from_json(&text).expect("read back"), plain);
        assert_eq!(text.lines().count(), 4, "a line for each pipeline: {text}");
        assert!(PipelineProfile::from_json(&text.replace(PipelineProfile::FORMAT, "echolume-profile-2")).is_err());
        assert!(PipelineProfile::from_json(&text.replace("\"N\":2", "\"N\":1")).is_err(), "twice the same");
        assert!(PipelineProfile::from_json(&text.replace("48.0,0.0,", "48.0,")).is_err(), "a value is missing");
        assert!(PipelineProfile::from_json(&text.replace("\"cold_ms\":2.0", "\"cold_ms\":-2.0")).is_err());
        assert!(PipelineProfile::from_json("{}").is_err());
    }
}
