//! Fault injection. Failures of driver calls test the error paths for out of memory, a lost device and a time-out. Slow passes test
//! the detection of slowness. Wrong results test the checks of `verify`.

use super::budget::{HeapBudget, MemoryBudget};
use super::lost_device::LossReport;
use crate::passes::fault_injection::{Change, Command};
use crate::passes::slots::{Format, Initializer};
use crate::passes::{DispatchArgs, Params, Pass, Slot};
use crate::scene::Scene;
use crate::sync::locked;
use ash::vk;
use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock};

/// A kind of Vulkan call that can be made to fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InjectionPoint {
    Allocate,
    Submit,
    Wait,
    /// Acquiring an image of a swapchain.
    Acquire,
}

/// The result of a call that is made to fail: an error of Vulkan, for crates that do not use `ash`.
pub use ash::vk::Result as InjectedFailure;

/// Content for newly allocated memory, to find uses of uninitialized memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Poison {
    /// Value of texels of float formats.
    pub float: f32,
    /// Value of texels of normalized formats, 0..1.
    pub normalized: f32,
    /// Value of texels of integer formats.
    pub integer: u32,
    /// Value of each byte of a buffer.
    pub byte: u8,
}

impl Poison {
    /// Two poisons that differ in every field. A result that differs between them depends on uninitialized memory.
    pub const BOTH: [Poison; 2] = [
        Poison { float: f32::NAN, normalized: 2.0 / 3.0, integer: 0xabab_abab, byte: 0xff },
        Poison { float: -999.5, normalized: 1.0 / 3.0, integer: 0x5555_5555, byte: 0x55 },
    ];

    /// The value of a texel of a format after memory was filled with this poison.
    pub fn texel_value(self, format: Format) -> f64 {
        match format {
            Format::R32u | Format::Rg32u => f64::from(self.integer),
            Format::R8 | Format::Rgba8 | Format::Bgra8 => (255.0 * f64::from(self.normalized)).round() / 255.0,
            Format::R16 | Format::Rg16 => (65535.0 * f64::from(self.normalized)).round() / 65535.0,
            _ => f64::from(self.float),
        }
    }
}

/// The injected faults of a context: at most one each of a failing call, a hang, a slow pass, a poison, a loss report, a memory budget and a wrong
/// result.
#[derive(Default)]
pub struct Faults {
    planned: Mutex<Option<(InjectionPoint, u32, vk::Result)>>,
    /// Submissions left until the device hangs.
    hang: Mutex<Option<u32>>,
    slow: Mutex<Option<(&'static str, u32)>>,
    poison: Mutex<Option<Poison>>,
    /// The report that the device gives after its loss.
    pub(super) loss: Mutex<Option<LossReport>>,
    /// The memory budget that the device reports.
    pub(super) budget: Mutex<Option<MemoryBudget>>,
    change: OnceLock<Change>,
    changes: AtomicU64,
    /// A loss was injected that the driver knows nothing of, so that it must not be asked for its cause.
    pub(super) has_lost: AtomicBool,
    /// The host waits for each submission before the next.
    pub(super) waits: AtomicBool,
    /// Pictures in flight count as not done.
    pub(super) holds_pictures: AtomicBool,
}

impl Faults {
    /// The `after`-th call from now (0: the next) at this point returns `result` and does not reach the driver.
    pub fn inject(&self, point: InjectionPoint, after: u32, result: vk::Result) {
        *locked(&self.planned) = Some((point, after, result));
    }

    pub(super) fn check(&self, point: InjectionPoint) -> Result<(), vk::Result> {
        let mut planned = locked(&self.planned);
        if let Some((_, left @ 1.., _)) = planned.as_mut().filter(|(at, ..)| *at == point) {
            *left -= 1;
            return Ok(());
        }
        let Some((_, _, result)) = planned.take_if(|(at, ..)| *at == point) else { return Ok(()) };
        self.has_lost.fetch_or(result == vk::Result::ERROR_DEVICE_LOST, Ordering::Relaxed);
        Err(result)
    }

    /// The `after`-th submission from now (0: the next) and all later ones never reach the device, which then appears to hang.
    pub fn hang(&self, after: u32) {
        *locked(&self.hang) = Some(after);
    }

    /// True if the submission that follows must not reach the device, because the device is to appear to hang.
    pub(super) fn keeps_submission(&self) -> bool {
        let mut hang = locked(&self.hang);
        let is_due = *hang == Some(0);
        *hang = hang.map(|left| left.saturating_sub(1));
        is_due
    }

    /// From now on the host waits for each submission before it makes the next one. This is no fault: it hides faults of synchronization, and so
    /// distinguishes them from others.
    pub fn wait_for_each_submission(&self) {
        self.waits.store(true, Ordering::Relaxed);
    }

    /// After a call with `holds` true, until one with false, a picture in flight counts as not done, as on a slow device.
    pub fn hold_pictures(&self, holds: bool) {
        self.holds_pictures.store(holds, Ordering::Relaxed);
    }

    /// Cancels a failure of [`Faults::inject`] that has not happened yet.
    pub fn forget(&self) {
        *locked(&self.planned) = None;
    }

    /// From now on the driver appears to give this report after a loss of the device.
    pub fn report_loss(&self, report: LossReport) {
        *locked(&self.loss) = Some(report);
    }

    /// From now on the device reports a memory budget of `bytes` bytes, of which none are used: only a single allocation larger than that is refused,
    /// however many were made before.
    pub fn limit_memory(&self, bytes: u64) {
        let heap = HeapBudget { size: bytes, budget: bytes, used: 0, is_device_local: true };
        let types = vec![(0, vk::MemoryPropertyFlags::from_raw(u32::MAX)); 32];
        *locked(&self.budget) = Some(MemoryBudget { heaps: vec![heap], types });
    }

    /// From now on newly allocated memory holds this content; `None`: it is not filled. Slots that must start with zeros still do
    /// ([`Slot::starts_clear`](crate::passes::Slot::starts_clear)).
    pub fn poison(&self, poison: Option<Poison>) {
        *locked(&self.poison) = poison;
    }

    pub(super) fn poisoned(&self) -> Option<Poison> {
        *locked(&self.poison)
    }

    /// From now on each dispatch of the pass is recorded `times` times: results stay the same, and the time grows. 0 leaves the dispatch out. A later
    /// call replaces an earlier one, also for another pass.
    pub fn slow_down(&self, pass: &'static str, times: u32) {
        *locked(&self.slow) = Some((pass, times));
    }

    pub(super) fn times(&self, pass: &str) -> u32 {
        match *locked(&self.slow) {
            Some((slow, times)) if slow == pass => times,
            _ => 1,
        }
    }

    /// Injects a wrong result: changes what the device receives, as long as the context lives. Call it before anything is made from the context. Only
    /// the first call has an effect.
    pub fn inject_change(&self, change: Change) {
        self.change.get_or_init(|| change);
    }

    /// How many times the injected change has changed something so far.
    pub fn change_count(&self) -> u64 {
        self.changes.load(Ordering::Relaxed)
    }

    fn apply(&self, by: impl FnOnce(&Change) -> bool) -> bool {
        let changed = self.change.get().is_some_and(by);
        if changed {
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
        changed
    }

    /// True if the injected change is that this Vulkan command is executed wrongly.
    pub(super) fn breaks(&self, command: Command) -> bool {
        self.apply(|change| matches!(change, Change::Command(broken) if *broken == command))
    }

    /// The arguments of a dispatch after the injected change; `None` if the change leaves the dispatch out.
    pub(super) fn args(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Option<DispatchArgs> {
        let mut args = *args;
        self.apply(|change| change.args(pass.name, scene, &mut args));
        (!self.apply(|change| change.leaves_out(pass.name, scene, &args))).then_some(args)
    }

    pub(super) fn numbers(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> Params {
        let mut params = pass.numbers(scene, args);
        self.apply(|change| change.numbers(pass, scene, &mut params));
        params
    }

    pub(super) fn invocations(&self, pass: &Pass, scene: &Scene, args: &DispatchArgs) -> [u32; 3] {
        let mut extent = pass.invocations(scene, args);
        self.apply(|change| change.extent(pass.name, &mut extent));
        extent
    }

    pub(super) fn constants(&self, pass: &str, constants: &[(&'static str, i32)]) -> Vec<(&'static str, i32)> {
        let mut constants = constants.to_vec();
        self.apply(|change| change.constants(pass, &mut constants));
        constants
    }

    pub(super) fn words(&self, pass: &str, words: &mut Vec<u32>) -> Result<(), String> {
        let Some(change) = self.change.get() else { return Ok(()) };
        let changed = change.words(pass, words).map_err(|e| e.to_string())?;
        self.apply(|_| changed);
        Ok(())
    }

    pub(super) fn table(&self, slot: Slot, scene: &Scene, mut values: Vec<f32>) -> Vec<f32> {
        self.apply(|change| change.table(slot, scene, &mut values));
        values
    }

    fn frame(&self, scene: &Scene, bytes: &mut [u8]) {
        self.apply(|change| change.frame(scene, bytes));
    }

    /// The bytes of an uploaded frame after the injected change.
    pub(super) fn changed_frame<'a>(&self, scene: &Scene, bytes: &'a [u8]) -> Cow<'a, [u8]> {
        let mut changed = Cow::Borrowed(bytes);
        if matches!(self.change.get(), Some(Change::Frame(_))) {
            self.frame(scene, changed.to_mut());
        }
        changed
    }

    /// The bytes of a slot that is an input of a single pass, after the injected change.
    pub(super) fn given(&self, slot: Slot, scene: &Scene, mut bytes: Vec<u8>) -> Vec<u8> {
        if slot == Slot::Frames {
            let [width, height] = scene.frame_size().map(|n| n as usize);
            let frames = bytes.chunks_mut(width * height * slot.format(scene).texel_bytes());
            frames.for_each(|frame| self.frame(scene, frame));
        } else if self.change.get().is_some()
            && slot.format(scene).channel_bytes() == 4
            && matches!(slot.initializer(), Initializer::ByScene(_))
        {
            let values = bytemuck::pod_collect_to_vec(&bytes);
            bytes = bytemuck::cast_slice(&self.table(slot, scene, values)).to_vec();
        }
        bytes
    }

    pub(super) fn filter(&self) -> vk::Filter {
        match self.apply(|change| matches!(change, Change::Nearest)) {
            true => vk::Filter::NEAREST,
            false => vk::Filter::LINEAR,
        }
    }
}
