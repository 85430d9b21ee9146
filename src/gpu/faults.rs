//! The one seam at which failures are injected, so that the paths for out of memory, a lost device and a time-out are tested;
//! slowness, so that what finds it is; and wrong results, so that the checks of the device are.

use crate::passes::fault_injection::Change;
use crate::passes::slots::{Format, Initializer};
use crate::passes::{DispatchArgs, Params, Pass, Slot};
use crate::scene::Scene;
use ash::vk;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};

/// Where a call into the driver can be made to fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seam {
    Allocate,
    Submit,
    Wait,
    /// An image of a window.
    Acquire,
}

/// How a call fails, for those who know no Vulkan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    OutOfDeviceMemory,
    OutOfHostMemory,
    DeviceLost,
    TimeOut,
}

impl Failure {
    pub fn result(self) -> vk::Result {
        match self {
            Failure::OutOfDeviceMemory => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            Failure::OutOfHostMemory => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            Failure::DeviceLost => vk::Result::ERROR_DEVICE_LOST,
            Failure::TimeOut => vk::Result::TIMEOUT,
        }
    }
}

/// What new memory holds before anything is written to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Poison {
    /// Texels of floats.
    pub float: f32,
    /// Texels that stand for 0..1.
    pub share: f32,
    /// Texels of whole numbers.
    pub whole: u32,
    /// Buffers.
    pub byte: u8,
}

impl Poison {
    /// Two that differ in every bit that counts: what holds neither of them where it should was computed from them.
    pub const BOTH: [Poison; 2] = [
        Poison { float: f32::NAN, share: 2.0 / 3.0, whole: 0xabab_abab, byte: 0xff },
        Poison { float: -999.5, share: 1.0 / 3.0, whole: 0x5555_5555, byte: 0x55 },
    ];

    /// As a texel of a format holds it.
    pub fn seen_in(self, format: Format) -> f64 {
        match format {
            Format::R32u | Format::Rg32u => f64::from(self.whole),
            Format::R8 | Format::Rgba8 => (255.0 * f64::from(self.share)).round() / 255.0,
            Format::R16 | Format::Rg16 => (65535.0 * f64::from(self.share)).round() / 65535.0,
            _ => f64::from(self.float),
        }
    }
}

/// At most one planned failure, one slow pass, one poison, and one wrong result.
#[derive(Default)]
pub struct Faults {
    planned: Mutex<Option<(Seam, u32, vk::Result)>>,
    slow: Mutex<Option<(&'static str, u32)>>,
    poison: Mutex<Option<Poison>>,
    planted: OnceLock<Change>,
    struck: AtomicU64,
}

impl Faults {
    /// The `after`-th call from now (0: the next) at this seam returns `result` instead of reaching the driver.
    pub fn inject(&self, seam: Seam, after: u32, result: vk::Result) {
        *self.planned.lock().unwrap_or_else(|e| e.into_inner()) = Some((seam, after, result));
    }

    pub(super) fn pass(&self, seam: Seam) -> Result<(), vk::Result> {
        let mut planned = self.planned.lock().unwrap_or_else(|e| e.into_inner());
        match planned.as_mut() {
            Some((at, 0, result)) if *at == seam => {
                let result = *result;
                *planned = None;
                Err(result)
            }
            Some((at, left, _)) if *at == seam => {
                *left -= 1;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Forgets a planned failure that was not reached.
    pub fn forget(&self) {
        *self.planned.lock().unwrap_or_else(|e| e.into_inner()) = None;
    }

    /// From now on new memory holds this; zeros where something relies on them ([`Slot::starts_clear`](crate::passes::Slot::starts_clear)).
    pub fn poison(&self, poison: Option<Poison>) {
        *self.poison.lock().unwrap_or_else(|e| e.into_inner()) = poison;
    }

    pub(super) fn poisoned(&self) -> Option<Poison> {
        *self.poison.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// From now on the pass is dispatched so many times instead of once. It writes the same each time: only time passes. 0 leaves it out.
    pub fn slow_down(&self, pass: &'static str, times: u32) {
        *self.slow.lock().unwrap_or_else(|e| e.into_inner()) = Some((pass, times));
    }

    pub(super) fn times(&self, pass: &str) -> u32 {
        match *self.slow.lock().unwrap_or_else(|e| e.into_inner()) {
            Some((slow, times)) if slow == pass => times,
            _ => 1,
        }
    }

    /// From now on, and for as long as the context lives, the device is told or given something else. Before anything is made from the
    /// context; the first one holds.
    pub fn plant(&self, change: Change) {
        self.planted.get_or_init(|| change);
    }

    /// How often what is planted changed something.
    pub fn struck(&self) -> u64 {
        self.struck.load(Ordering::Relaxed)
    }

    fn strike(&self, by: impl FnOnce(&Change) -> bool) -> bool {
        let struck = self.planted.get().is_some_and(by);
        if struck {
            self.struck.fetch_add(1, Ordering::Relaxed);
        }
        struck
    }

    /// What a dispatch works on; none if it is left out.
    pub(super) fn args(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Option<DispatchArgs> {
        let mut args = *args;
        self.strike(|change| change.args(pass.name, scene, &mut args));
        (!self.strike(|change| change.leaves_out(pass.name, scene, &args))).then_some(args)
    }

    pub(super) fn numbers(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Params {
        let mut params = pass.numbers(scene, args);
        self.strike(|change| change.numbers(pass, scene, &mut params));
        params
    }

    pub(super) fn invocations(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> [u32; 3] {
        let mut extent = pass.invocations(scene, args);
        self.strike(|change| change.extent(pass.name, &mut extent));
        extent
    }

    pub(super) fn constants(&self, pass: &str, constants: &[(&'static str, i32)]) -> Vec<(&'static str, i32)> {
        let mut constants = constants.to_vec();
        self.strike(|change| change.constants(pass, &mut constants));
        constants
    }

    pub(super) fn words(&self, pass: &str, words: &mut Vec<u32>) -> Result<(), String> {
        let Some(change) = self.planted.get() else { return Ok(()) };
        let changed = change.words(pass, words).map_err(|e| e.to_string())?;
        self.strike(|_| changed);
        Ok(())
    }

    pub(super) fn table(&self, slot: Slot, scene: &Scene, mut values: Vec<f32>) -> Vec<f32> {
        self.strike(|change| change.table(slot, scene, &mut values));
        values
    }

    pub(super) fn frame(&self, scene: &Scene, bytes: &mut [u8]) {
        self.strike(|change| change.frame(scene, bytes));
    }

    /// Bytes of a slot that a pass alone is given.
    pub(super) fn given(&self, slot: Slot, scene: &Scene, mut bytes: Vec<u8>) -> Vec<u8> {
        if slot == Slot::Frames {
            self.frame(scene, &mut bytes);
        } else if self.planted.get().is_some() && matches!(slot.filled(), Initializer::ByScene(_)) {
            let values = bytemuck::pod_collect_to_vec(&bytes);
            bytes = bytemuck::cast_slice(&self.table(slot, scene, values)).to_vec();
        }
        bytes
    }

    pub(super) fn filter(&self) -> vk::Filter {
        match self.strike(|change| matches!(change, Change::Nearest)) {
            true => vk::Filter::NEAREST,
            false => vk::Filter::LINEAR,
        }
    }
}
