//! Converts the driver-specific statistics of a pipeline to common columns.

use super::{Executable, Pipeline};

/// The driver's names of a column: the value is the sum of those that it has. Names are of NVK, RADV, ANV, Turnip, and the drivers of
/// NVIDIA and AMD.
const REGISTERS: &[&str] = &[
    "Number of GPRs",
    "VGPRs",
    "Max live registers",
    "Registers used",
    "Half-registers used",
    "Register Count",
    "numUsedVgprs",
];
/// Subgroups that a processor can hold at the same time.
const WAVES: &[&str] = &["Max warps/SM", "Subgroups per SIMD", "Max Waves Per Core"];
/// What did not fit into registers. NVK moves some values into other registers ("Spills to reg"): a spill does not leave the registers
/// there, and costs no more than a copy.
const SPILLS: &[&str] = &[
    "Spills to memory",
    "Spilled VGPRs",
    "Spilled SGPRs",
    "Spill Count",
    "Spill count",
    "STP Count",
    "Local Memory Size",
    "scratchMemUsageInBytes",
];
/// No invocation has so much memory, bytes: NVIDIA's driver 580 states 64 GiB of local memory for every pipeline of an H100.
const UNLIKELY_MEMORY: f64 = (1u64 << 24) as f64;
const INSTRUCTIONS: &[&str] = &["Instruction count", "Instructions", "Instruction Count"];
/// Shared memory of a workgroup, bytes.
const SHARED: &[&str] = &["SLM size", "LDS size", "Workgroup Memory Size", "ldsUsageSizeInBytes", "Shared Memory Size"];

/// Those statistics of a pipeline that several drivers report. `None` if this driver does not report a value. If the driver compiles several
/// executables of a pipeline, the worst value counts, because the driver decides which one runs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Columns {
    /// Number of registers of an invocation; half registers count as registers.
    pub registers: Option<f64>,
    /// Occupancy: how many subgroups a multiprocessor, SIMD unit or core, depending on the driver, can hold at the same time.
    pub waves: Option<f64>,
    /// Values that did not fit into registers, in the driver's unit.
    pub spills: Option<f64>,
    pub instructions: Option<f64>,
    /// Shared memory of a workgroup, bytes; of several executables the largest.
    pub shared: Option<f64>,
    /// Number of invocations in a subgroup. If the driver chooses it by the number of registers, a smaller number is a loss of occupancy.
    pub subgroup: Option<u32>,
}

impl Columns {
    /// Converts the driver's statistics of a pipeline. `statistics`: the driver's names of the values of each executable
    /// ([`PipelineProfile::statistics`](super::PipelineProfile::statistics)).
    pub fn of(statistics: &[String], pipeline: &Pipeline) -> Columns {
        let executables = &pipeline.executables;
        let sum = |executable: &Executable, names: &[&str]| {
            let values = statistics.iter().zip(&executable.values).filter(|(name, _)| names.contains(&name.as_str()));
            values.filter_map(|(_, value)| *value).reduce(|a, b| a + b)
        };
        let spills = |executable: &Executable| sum(executable, SPILLS).filter(|spills| *spills < UNLIKELY_MEMORY);
        let most = |names: &[&str]| executables.iter().filter_map(|e| sum(e, names)).reduce(f64::max);
        Columns {
            registers: most(REGISTERS),
            waves: executables.iter().filter_map(|e| sum(e, WAVES)).reduce(f64::min),
            spills: executables.iter().filter_map(spills).reduce(f64::max),
            instructions: most(INSTRUCTIONS),
            shared: most(SHARED),
            subgroup: executables.iter().map(|e| e.subgroup).min(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(executables: &[&[(&str, f64)]]) -> Columns {
        let mut statistics: Vec<String> = Vec::new();
        executables.iter().flat_map(|e| e.iter()).for_each(|(name, _)| {
            if !statistics.iter().any(|s| s == name) {
                statistics.push((*name).into());
            }
        });
        let one = |(n, e): (usize, &&[(&str, f64)])| Executable {
            name: "main".into(),
            subgroup: 16 << n,
            values: statistics.iter().map(|name| e.iter().find(|s| s.0 == name).map(|s| s.1)).collect(),
        };
        let pipeline = Pipeline {
            pass: None,
            shader: "a".into(),
            constants: Default::default(),
            formats: vec![],
            cold_ms: 0.0,
            warm_ms: 0.0,
            from_cache: None,
            executables: executables.iter().enumerate().map(one).collect(),
        };
        Columns::of(&statistics, &pipeline)
    }

    /// As the drivers of Mesa 26.2 tell it: NVK, RADV, Turnip, each with the names of its own.
    #[test]
    fn each_drivers_names_become_the_common_columns() {
        let nvk = columns(&[&[
            ("Instruction count", 879.0),
            ("Static cycle count", 10914.0),
            ("Max warps/SM", 40.0),
            ("Spills to memory", 2.0),
            ("Fills from memory", 3.0),
            ("Spills to reg", 5.0),
            ("Code size", 14064.0),
            ("Number of GPRs", 48.0),
            ("SLM size", 64.0),
        ]]);
        let some = |registers, waves, spills, instructions, shared| Columns {
            registers: Some(registers),
            waves: Some(waves),
            spills: Some(spills),
            instructions: Some(instructions),
            shared,
            subgroup: Some(16),
        };
        assert_eq!(nvk, some(48.0, 40.0, 2.0, 879.0, Some(64.0)));
        let radv = columns(&[&[
            ("SGPRs", 108.0),
            ("VGPRs", 24.0),
            ("Spilled SGPRs", 1.0),
            ("Spilled VGPRs", 2.0),
            ("LDS size", 0.0),
            ("Subgroups per SIMD", 32.0),
            ("Instructions", 104.0),
            ("Pre-Sched VGPRs", 9.0),
        ]]);
        assert_eq!(radv, some(24.0, 32.0, 3.0, 104.0, Some(0.0)));
        let turnip = columns(&[&[
            ("Max Waves Per Core", 16.0),
            ("Instruction Count", 75.0),
            ("Registers used", 6.0),
            ("Half-registers used", 2.0),
            ("Preamble Instruction Count", 28.0),
            ("STP Count", 0.0),
        ]]);
        assert_eq!(turnip, some(8.0, 16.0, 0.0, 75.0, None));
    }

    /// ANV compiles for several widths of a subgroup, and has no statistic of occupancy.
    #[test]
    fn of_several_executables_the_worst_counts_and_what_is_not_told_is_none() {
        let anv = columns(&[
            &[("Instruction Count", 200.0), ("Spill Count", 0.0), ("Max live registers", 60.0)],
            &[("Instruction Count", 180.0), ("Spill Count", 4.0), ("Max live registers", 110.0)],
        ]);
        let expected = Columns {
            registers: Some(110.0),
            spills: Some(4.0),
            instructions: Some(200.0),
            subgroup: Some(16),
            ..Columns::default()
        };
        assert_eq!(anv, expected);
        assert_eq!(columns(&[]), Columns::default());
    }
}
