//! Group "specialization": the driver itself applies specialization constants. Otherwise software devices get modules with the constants
//! written in, so that the group "passes" alone would not detect a driver that ignores them.

use super::each_pass::{PASSES, PassSummary, dispatch_args_of, run_with_reference, seed_of};
use super::{Check, DeviceUnderTest, Findings};
use crate::gpu::pass_runner::PassRunner;
use crate::gpu::{ContextOptions, GpuError};
use crate::passes::Stage;
use crate::report::Level;
use std::collections::{BTreeMap, BTreeSet};

/// The checks of the group "specialization": one for each stage.
pub fn checks(_: Level) -> Vec<Check> {
    let check = |stage: Stage| {
        Check::new("specialization", format!("constants of stage {}", stage.name()), move |dut| check(dut, stage))
    };
    [Stage::Preprocess, Stage::Raycast, Stage::Shade, Stage::Postprocess].into_iter().map(check).collect()
}

/// Every pass of a stage in the scenes that give one of its constants its first or second value: one of them is not the default.
fn check(dut: &mut DeviceUnderTest, stage: Stage) -> Result<Findings, GpuError> {
    let context = dut.another_with(ContextOptions { specialize: Some(false), ..dut.options().clone() })?;
    let (mut runner, scenes) = (PassRunner::new(&context)?, dut.scenes());
    let mut findings = Findings::default();
    let mut pipelines = 0;
    for pass in PASSES.iter().filter(|pass| pass.stage == stage) {
        let (mut seen, mut sum) = (BTreeMap::new(), PassSummary::default());
        for (name, scene) in scenes.iter().filter(|(_, scene)| pass.is_needed(scene)) {
            let shader = pass.shader(scene, &dispatch_args_of(scene, pass, 0));
            let constants = pass.constants(scene, &dispatch_args_of(scene, pass, 0));
            let mut is_new = false;
            for (constant, value) in constants {
                let values: &mut BTreeSet<i32> = seen.entry((shader, constant)).or_default();
                is_new |= values.len() < 2 && values.insert(value);
            }
            if is_new {
                let result = run_with_reference(&mut runner, scene, pass, 0, "noise", seed_of(pass, 0))?;
                sum.record(pass, name, 0, "noise", &result);
                pipelines += 1;
            }
        }
        if !seen.is_empty() {
            let mut of_pass = sum.into_findings(pass);
            of_pass.faults.iter_mut().for_each(|fault| fault.what.insert_str(0, "specialized by the driver: "));
            findings.faults.extend(of_pass.faults);
            findings.pictures.extend(of_pass.pictures);
        }
    }
    findings.notes.push(format!("{pipelines} pipelines whose constants the driver applied"));
    findings.add_messages(&super::credible_messages(&context, context.messages(), true));
    Ok(findings)
}
