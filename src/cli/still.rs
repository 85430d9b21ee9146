//! `echolume render --still`: the number of paths of a still, and the error of its mean.

use crate::args::parse_nanoseconds;
use crate::gpu::{GpuError, Renderer};
use crate::passes::raycast::still::{final_sums, luminance};
use crate::scene::Still;
use crate::statistics::quantile;
use crate::terminal::{Failure, input};

/// The values of `--still`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StillArgs {
    /// For each setting: the part of the flag that sets it, for messages, and the assignment, such as `still.samples=64`.
    pub set: Vec<(String, String)>,
    /// Time that the path tracing of a picture may take, s, from which the number of samples follows. None: `set` states the number of samples.
    pub time: Option<f64>,
}

impl StillArgs {
    pub fn parse(text: &str) -> Result<StillArgs, Failure> {
        let mut args = StillArgs::default();
        for part in text.split(',') {
            let flag = format!("--still {part}");
            match part.split_once('=') {
                Some(("time", time)) => args.time = Some(1e-9 * parse_nanoseconds("--still time", time)?),
                Some((key, value)) => args.set.push((flag, format!("still.{key}={value}"))),
                None => {
                    let time = parse_nanoseconds("--still", part);
                    let time = time.map_err(|_| input(format!("{flag}: must be samples=N, or a time such as 20s")))?;
                    args.time = Some(1e-9 * time);
                }
            }
        }
        let has_samples = args.set.iter().any(|(_, set)| set.starts_with("still.samples="));
        match (args.time, has_samples) {
            (Some(_), true) => Err(input(format!("--still {text}: give the samples or a time that chooses them"))),
            (None, false) => Err(input(format!("--still {text}: must give samples=N, or a time such as 20s"))),
            (Some(_), false) => {
                args.set.push(("--still".into(), "still.samples=1".into()));
                Ok(args)
            }
            (None, true) => Ok(args),
        }
    }
}

/// The number of samples per pixel that fits into `time` s. `taken`: draws with the given number of samples and returns the time, s. The first
/// picture also takes time that does not depend on the number, such as compiling shaders; the time of a sample is therefore taken from the
/// additional time of a picture with more samples.
pub fn samples_within(time: f64, mut taken: impl FnMut(u32) -> Result<f64, Failure>) -> Result<u32, Failure> {
    let first = taken(1)?;
    if first >= time {
        return Ok(1);
    }
    let mut samples = 5;
    let each = loop {
        let longer = taken(samples)? - first;
        // Far more than times vary by, and a small part of the whole.
        if longer > time / 64.0 || samples > Still::MAX_SAMPLES / 16 {
            break longer / f64::from(samples - 1);
        }
        samples *= 8;
    };
    // The conversion saturates.
    Ok((1.0 + (time - first) / each.max(1e-12)).clamp(1.0, f64::from(Still::MAX_SAMPLES)) as u32)
}

/// A line about the noise of a path-traced still: median and 95th percentile, over the lit pixels, of the relative standard error of a pixel's
/// luminance. With one sample per pixel the line has no errors. `None` if the scene has no still.
pub fn noise(renderer: &mut Renderer) -> Result<Option<String>, GpuError> {
    let Some(still) = renderer.scene().still().copied() else { return Ok(None) };
    let [light, squares] = final_sums(renderer.scene());
    let (Some(light), Some(squares)) = (renderer.read(light)?, renderer.read(squares)?) else { return Ok(None) };
    let n = f64::from(still.samples);
    let error = |(sum, square): (&[f64], &f64)| {
        let mean = luminance([sum[0], sum[1], sum[2], sum[3]]) / n;
        let variance = (square / n - mean * mean).max(0.0) / (n - 1.0);
        (mean > 0.0).then(|| variance.sqrt() / mean)
    };
    let mut errors: Vec<f64> = light.values.chunks_exact(4).zip(&squares.values).filter_map(error).collect();
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| quantile(&errors, share).map(|e| 100.0 * e);
    let said = format!("still: {} samples a pixel, seed {}", still.samples, still.seed);
    Ok(Some(match (at(0.5), at(0.95)) {
        (Some(half), Some(most)) if still.samples > 1 => {
            format!(
                "{said}; standard error of a pixel's luminance: median {half:.1} %, 95 % of the pixels below {most:.1} %"
            )
        }
        _ => said,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_still_is_asked_for_by_samples_or_by_a_time() {
        let of = |text: &str| StillArgs::parse(text);
        let set = |text: &str| of(text).expect("args").set.into_iter().map(|(_, set)| set).collect::<Vec<_>>();
        assert_eq!(set("samples=64"), ["still.samples=64"]);
        assert_eq!(set("samples=64,seed=3,extinction=4"), ["still.samples=64", "still.seed=3", "still.extinction=4"]);
        for text in ["20s", "time=20s", "seed=2,20s"] {
            assert_eq!(of(text).expect("args").time, Some(20.0), "{text}");
        }
        for text in ["", "seed=3", "samples=4,20s", "20", "time=-1s"] {
            assert!(of(text).is_err(), "{text}");
        }
        let told = "--still bogus: must be samples=N, or a time such as 20s";
        assert!(matches!(of("bogus"), Err(Failure::Input(said)) if said == told));
    }

    /// A device of 10 ms a sample and 3 s of everything else: what is chosen does not take more than asked, nor much less.
    #[test]
    fn the_samples_chosen_fill_the_time() {
        for time in [0.1, 1.0, 20.0, 300.0, 1e9] {
            let chosen = samples_within(time, |n| Ok(0.01 * f64::from(n))).expect("samples");
            let fitting = (time / 0.01).clamp(1.0, f64::from(Still::MAX_SAMPLES));
            assert!((f64::from(chosen) - fitting).abs() <= 1.0, "{time}: {chosen}");
        }
        let chosen = samples_within(300.0, |n| Ok(3.0 + 0.01 * f64::from(n))).expect("samples");
        assert!((10_000..=30_000).contains(&chosen), "{chosen}");
    }
}
