//! The result of compiling the pipelines: registers, occupancy, spills, instructions, and the time to compile them. [`measure`] asks a
//! device, [`compare`] finds what became worse, and [`table`] writes tables. [`PipelineProfile`] is the file, which is small enough to be
//! stored for drivers that the current machine lacks.

mod columns;
pub mod compare;
pub mod table;

pub use columns::Columns;
pub use table::table;

use crate::baselines::Stored;
use crate::gpu::pipeline_measure::{self, MeasuredPipeline};
use crate::gpu::{Context, GpuError, Shaders};
use crate::machine;
use crate::scene::Scene;
use crate::tree::{self, FromNode, ToNode};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The statistics of compiled pipelines on one device.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct PipelineProfile {
    /// The name of the file format: [`Stored::FORMAT`].
    pub format: String,
    /// Name, version and build of the program.
    pub program: String,
    /// When it was measured, RFC 3339.
    pub date: String,
    pub device: String,
    pub driver: String,
    /// Which pipelines were compiled: the input, and `every mode, preset and filter` or only those of the settings.
    pub input: String,
    /// False if the device reports no statistics, so that there are only compile times.
    pub has_statistics: bool,
    /// The driver's names of its statistics, in the order of [`Executable::values`].
    pub statistics: Vec<String>,
    /// The pipelines in the order of their first use.
    pub pipelines: Vec<Pipeline>,
}

/// A measured pipeline, identified by its shader, constants and formats.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Pipeline {
    /// The first pass that uses it; None if not stored.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub pass: Option<String>,
    pub shader: String,
    /// Values of specialization constants by name.
    #[tree(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub constants: BTreeMap<String, i32>,
    /// Formats of the inputs, such as `R8`, in the order in which the pass declares them.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub formats: Vec<String>,
    /// Compile time without any cache, ms.
    pub(crate) cold_ms: f64,
    /// Compile time with a pipeline cache that holds it, ms.
    pub(crate) warm_ms: f64,
    /// True if the driver took the pipeline from the cache when `warm_ms` was measured. `None` if the driver does not report it.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub(crate) from_cache: Option<bool>,
    /// The executables that the driver compiled for it. The driver chooses one for a dispatch.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub executables: Vec<Executable>,
}

/// An executable of a pipeline (VK_KHR_pipeline_executable_properties).
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Executable {
    pub name: String,
    /// Number of invocations in a subgroup.
    pub subgroup: u32,
    /// The driver's statistics, in the order of [`PipelineProfile::statistics`]. `None` if this executable lacks one.
    pub values: Vec<Option<f64>>,
}

impl Pipeline {
    /// Shader, constants and formats in one line.
    pub fn title(&self) -> String {
        let constants: Vec<String> = self.constants.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let parts = [vec![self.shader.clone()], constants, vec![self.formats.join("+")]].concat();
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
    }
}

/// Compiles every pipeline that these scenes need with these shaders, twice: without any cache, and with a pipeline cache that holds it. Submits
/// nothing to the device.
///
/// # Errors
/// The device cannot hold a scene, or a shader does not compile.
pub fn measure(
    context: &Arc<Context>,
    scenes: &[Scene],
    shaders: &Arc<Shaders>,
    input: String,
) -> Result<PipelineProfile, GpuError> {
    let measured = pipeline_measure::measure(context, scenes, shaders)?;
    let mut statistics: Vec<String> = Vec::new();
    for (name, _) in measured.iter().flat_map(|p| &p.executables).flat_map(|e| &e.statistics) {
        if is_measure(name) && !statistics.contains(name) {
            statistics.push(name.clone());
        }
    }
    let device = machine::device(context);
    Ok(PipelineProfile {
        format: PipelineProfile::FORMAT.into(),
        program: machine::program(),
        date: machine::date(),
        device: device.name,
        driver: device.driver,
        input,
        has_statistics: context.candidate.compile_statistics,
        pipelines: measured.into_iter().map(|p| pipeline(p, &statistics)).collect(),
        statistics,
    })
}

/// False for numbers that name a build instead of measuring it.
fn is_measure(name: &str) -> bool {
    !name.to_lowercase().contains("hash")
}

fn pipeline(measured: MeasuredPipeline, statistics: &[String]) -> Pipeline {
    // A hundredth of a millisecond is what a reader and a file need.
    let ms = |time: std::time::Duration| (time.as_secs_f64() * 1e5).round() / 100.0;
    let executable = |e: pipeline_measure::Executable| Executable {
        values: statistics.iter().map(|name| e.statistics.iter().find(|s| s.0 == *name).map(|s| s.1)).collect(),
        name: e.name,
        subgroup: e.subgroup,
    };
    Pipeline {
        pass: Some(measured.pass.into()),
        shader: measured.shader.into(),
        constants: measured.constants.into_iter().map(|(name, value)| (name.to_string(), value)).collect(),
        formats: measured.formats.iter().map(|format| format!("{format:?}")).collect(),
        cold_ms: ms(measured.cold),
        warm_ms: ms(measured.warm),
        from_cache: measured.warm_hit,
        executables: measured.executables.into_iter().map(executable).collect(),
    }
}

impl PipelineProfile {
    /// The statistics of a pipeline that several drivers report.
    pub fn columns(&self, pipeline: &Pipeline) -> Columns {
        Columns::of(&self.statistics, pipeline)
    }
}

impl Stored for PipelineProfile {
    const FORMAT: &'static str = "echolume-pipelines-1";
    const WHAT: &'static str = "statistics of pipelines";
    const AGAIN: &'static str = "profile the pipelines again with it";
    const KIND: &'static str = "statistics of pipelines";
    const MAX_BYTES: u64 = 64 << 20;

    /// The lists are consistent and all numbers are finite.
    fn fault(&self) -> Option<(String, String)> {
        let mut known = std::collections::BTreeSet::new();
        for pipeline in &self.pipelines {
            let title = pipeline.title();
            if !known.insert((&pipeline.shader, &pipeline.constants, &pipeline.formats)) {
                return Some((title, "is listed twice".into()));
            }
            let times = [pipeline.cold_ms, pipeline.warm_ms];
            if let Some(ms) = times.iter().find(|ms| !(ms.is_finite() && **ms >= 0.0)) {
                return Some((title, format!("a time is {ms} ms; a time is finite and not below 0")));
            }
            for executable in &pipeline.executables {
                let (count, expected) = (executable.values.len(), self.statistics.len());
                if count != expected {
                    return Some((title, format!("has {count} values for {expected} statistics")));
                }
                if executable.values.iter().flatten().any(|value| !value.is_finite()) {
                    return Some((title, "has a value that is not finite".into()));
                }
            }
        }
        None
    }

    /// A line for each pipeline.
    fn to_json(&self) -> Result<String, String> {
        self.check()?;
        let json = |fault: serde_json::Error| fault.to_string();
        let without = PipelineProfile { pipelines: Vec::new(), ..self.clone() };
        let head = tree::to_json(&without).map_err(json)?;
        let lines: Result<Vec<String>, _> = self.pipelines.iter().map(|pipeline| tree::to_json(pipeline)).collect();
        let lines = lines.map_err(json)?.join(",\n");
        // The list of pipelines is the last field and empty.
        let head = head.strip_suffix("]}").unwrap_or(&head);
        Ok(format!("{head}\n{lines}\n]}}\n"))
    }
}
