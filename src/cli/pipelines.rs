//! `echolume profile --pipelines`: statistics of the compiled pipelines.

use crate::args::{
    InputArgs, Output, ShaderArgs, check_messages, check_outputs, open_device_for_statistics, write_if_asked,
    write_report,
};
use crate::baselines::Stored;
use crate::profile::pipelines::compare::compare;
use crate::profile::pipelines::table::{comparison_table, table};
use crate::profile::pipelines::{PipelineProfile, measure};
use crate::scene::Scene;
use crate::scene::variants;
use crate::terminal::{Failure, failed, input, remark, say};
use crate::tree;
use std::path::{Path, PathBuf};

/// The options of `profile --pipelines`.
pub struct Request<'a> {
    pub input: &'a InputArgs,
    /// Measures the pipelines of each mode, preset and filter instead of those of the scene alone.
    pub all: bool,
    pub json: Option<&'a Path>,
    /// Files of stored measurements: one is compared with the new measurement, two with each other. Empty: nothing is compared.
    pub compare: &'a [PathBuf],
    pub force: bool,
    pub shaders: &'a ShaderArgs,
}

impl Request<'_> {
    pub fn run(&self) -> Result<(), Failure> {
        let old = self.compare.first().map(|file| read(file)).transpose()?;
        check_outputs(&[("--json", self.json)], self.compare.iter().map(PathBuf::as_path))?;
        if let ([_, new], Some(old)) = (self.compare, &old) {
            return self.judge(old, &read(new)?);
        }
        let profile = self.measure()?;
        say!("{}", table(&profile).trim_end());
        write_if_asked(self.json, || profile.to_json())?;
        old.map_or(Ok(()), |old| self.judge(&old, &profile))
    }

    fn measure(&self) -> Result<PipelineProfile, Failure> {
        let (source, scene) = self.input.open()?;
        let output: Output = ("--json", self.json);
        self.input.check_outputs(&[output], &*source)?;
        let (scenes, what) =
            if self.all { (every(&scene), ", every mode, preset and filter") } else { (vec![scene], "") };
        let shaders = self.shaders.open()?;
        let context = open_device_for_statistics(self.input.device())?;
        if !context.candidate.compile_statistics {
            remark(&format!(
                "{}: has no statistics of pipelines (VK_KHR_pipeline_executable_properties); only times are measured",
                context.candidate.name
            ));
        }
        let profile = measure(&context, &scenes, &shaders, format!("{}{what}", self.input.name()))
            .map_err(|fault| self.shaders.failure(fault))?;
        check_messages(&context)?;
        Ok(profile)
    }

    /// Prints the differences. Fails if something became worse.
    fn judge(&self, old: &PipelineProfile, new: &PipelineProfile) -> Result<(), Failure> {
        let compared = compare(old, new, self.force).map_err(input)?;
        say!("{}", comparison_table(&compared).trim_end());
        if let (Some(file), [_, _]) = (self.json, self.compare) {
            write_report(file, &tree::to_json_lines(&compared).map_err(failed)?)?;
        }
        let worse = compared.worse();
        match worse.first() {
            None => Ok(()),
            Some(first) => Err(failed(format!("{} pipelines are worse than before, first: {first}", worse.len()))),
        }
    }
}

/// The scene in every mode, preset and filter that its geometry allows.
fn every(scene: &Scene) -> Vec<Scene> {
    let made = |variant: variants::Variant| {
        let made = Scene::new(scene.geometry.clone(), scene.input, variant.settings);
        made.inspect_err(|fault| tracing::info!("{}: left out: {fault}", variant.name)).ok()
    };
    variants::all(&scene.settings).into_iter().filter_map(made).collect()
}

fn read(file: &Path) -> Result<PipelineProfile, Failure> {
    PipelineProfile::load(file).map_err(input)
}
