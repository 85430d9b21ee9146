//! Division of a manifest into shards of about equal expected cost. Every process computes the same division by itself.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt;
use std::str::FromStr;

/// Largest number of shards.
const MAX_SHARDS: u32 = 1 << 20;

/// One of several parts into which the units of a manifest are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of this part, from 0; `count` is the number of parts.
    pub index: u32,
    pub count: u32,
}

impl Shard {
    /// Part `index` of `count`.
    ///
    /// # Errors
    /// One line: `index` is not below `count`, or `count` is not in 1..=1048576.
    pub fn new(index: u32, count: u32) -> Result<Shard, String> {
        match () {
            _ if count == 0 || count > MAX_SHARDS => Err(format!("{count} shards: must be 1..={MAX_SHARDS}")),
            _ if index >= count => Err(format!("shard {index} of {count}: they are numbered from 0 to {}", count - 1)),
            _ => Ok(Shard { index, count }),
        }
    }

    /// The shard of this process according to the environment variables of Slurm (task of an array) or Kubernetes (completion of an Indexed
    /// Job); the whole manifest if there are none. `count`: the number of shards, which Kubernetes does not state; if it is given, an array that
    /// is submitted again in part keeps its division. `variable`: returns the value of an environment variable, None if it is not set.
    ///
    /// # Errors
    /// One line: an invalid number, an array with gaps and no `count`, a Job without a `count`, or a `count` above 1 without any of these variables.
    pub fn from_environment(count: Option<u32>, variable: impl Fn(&str) -> Option<String>) -> Result<Shard, String> {
        let number = |name: &str| match variable(name) {
            None => Ok(None),
            Some(text) => {
                let parsed = text.trim().parse::<u32>();
                parsed.map(Some).map_err(|_| format!("{name} is '{}', which is no number", text.escape_debug()))
            }
        };
        if let Some(id) = number("SLURM_ARRAY_TASK_ID")? {
            if let Some(count) = count {
                return Shard::new(id, count).map_err(|e| format!("SLURM_ARRAY_TASK_ID: {e}"));
            }
            let tasks = number("SLURM_ARRAY_TASK_COUNT")?.ok_or("SLURM_ARRAY_TASK_COUNT is not set; give --shards")?;
            let (min, step) =
                (number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0), number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1));
            let max = number("SLURM_ARRAY_TASK_MAX")?;
            let place = |id: u32| id.checked_sub(min).filter(|n| step > 0 && n % step == 0).map(|n| n / step);
            let is_whole = max.is_none_or(|max| place(max).is_some_and(|last| last + 1 == tasks));
            return match place(id).filter(|place| is_whole && *place < tasks) {
                Some(index) => Shard::new(index, tasks),
                None => Err("the array has gaps, so its tasks do not say which shard they are; give --shards N and number them 0..N-1".into()),
            };
        }
        match (number("JOB_COMPLETION_INDEX")?, count) {
            (Some(index), Some(count)) => Shard::new(index, count).map_err(|e| format!("JOB_COMPLETION_INDEX: {e}")),
            (Some(index), None) => Err(format!(
                "JOB_COMPLETION_INDEX says {index}, and nothing says of how many; give --shards with the Job's completions"
            )),
            (None, Some(1) | None) => Shard::new(0, 1),
            (None, Some(count)) => Err(format!(
                "--shards {count}: neither SLURM_ARRAY_TASK_ID nor JOB_COMPLETION_INDEX says which one this is; give --shard I/{count}"
            )),
        }
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Reads `I/N`: part I, from 0, of N.
    fn from_str(text: &str) -> Result<Shard, String> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let (index, count) = parts.ok_or("must read I/N, as 0/8 for the first of eight")?;
        Shard::new(index, count)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// The index of the shard of every unit by Graham's LPT rule: the most expensive unit first, each to the shard with the least cost so far. No
/// shard costs more than the mean of the shards plus the cost of one unit. O(n log n), deterministic. `costs`: finite and at least 0, as a manifest
/// has them.
pub fn assign(costs: &[f64], count: u32) -> Vec<u32> {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    order.sort_by(|a, b| costs[*b].total_cmp(&costs[*a]).then(a.cmp(b)));
    // Cost, number of units and index, the least first. The bits of numbers that are not negative are in the order of the numbers.
    let mut loads: BinaryHeap<_> =
        (0..count.max(1)).map(|shard| Reverse((0.0_f64.to_bits(), 0_usize, shard))).collect();
    let mut shards = vec![0; costs.len()];
    for place in order {
        let Some(Reverse((cost, units, shard))) = loads.pop() else { break };
        shards[place] = shard;
        loads.push(Reverse(((f64::from_bits(cost) + costs[place]).to_bits(), units + 1, shard)));
    }
    shards
}
