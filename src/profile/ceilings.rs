//! The rates that bound every pass of a device, measured by [`crate::passes::measure`].

use crate::gpu::{Context, GpuError, pass_runner};
use crate::passes::measure::{self, SAMPLES};
use crate::passes::{Pass, Slot};
use crate::profile::statistics::Sample;
use crate::profile::{Ceiling, Ceilings};
use crate::scene::Scene;
use std::sync::Arc;

/// Times of each loop; the median counts.
const REPEATS: u32 = 15;

/// None where the device has no time stamps.
///
/// # Errors
/// A device that cannot hold a volume of 128^3 and pictures of 2048^2, or fails.
pub fn measure(context: &Arc<Context>) -> Result<Option<Ceilings>, GpuError> {
    let broken = |e: crate::scene::SceneError| GpuError::Broken(format!("the scene that measures: {e}"));
    // More than caches hold, on a software device as little as is still steady.
    let pixels = if context.candidate.is_software() { 256 } else { 2048 };
    let sampled = measure::scene(128, pixels).map_err(broken)?;
    let copied = measure::scene(2, 2048).map_err(broken)?;
    let rate = |pass: &'static Pass, scene: &Scene, of_one: f64| -> Result<Option<Ceiling>, GpuError> {
        let rates: Vec<f64> = pass_runner::time(context, scene, pass, REPEATS)?
            .iter()
            .filter(|ns| **ns > 0.0)
            .map(|ns| of_one / ns * 1e9)
            .collect();
        Ok(Sample::new(&rates).ok().map(|s| Ceiling {
            median: s.median(),
            low: s.quantile(0.05),
            high: s.quantile(0.95),
        }))
    };
    let samples = f64::from(pixels) * f64::from(pixels) * f64::from(SAMPLES);
    let bytes = 2.0 * Slot::Picture.bytes(&copied) as f64;
    let copy = rate(&measure::COPY, &copied, bytes)?;
    let sampling = rate(&measure::FILTERED, &sampled, samples)?;
    let exact = rate(&measure::EIGHT_FETCHES, &sampled, samples)?;
    let fetch = rate(&measure::ONE_FETCH, &sampled, samples)?;
    Ok(match (copy, sampling, fetch) {
        (Some(copy), Some(sampling), Some(fetch)) => Some(Ceilings { copy, sampling, exact, fetch }),
        _ => None,
    })
}
