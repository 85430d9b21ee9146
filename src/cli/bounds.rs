//! `echolume report bounds`: proven bounds of a picture.

use crate::args::{InputArgs, check_number, make_folder};
use crate::bounds::{Effort, PictureBounds, Proof, fault, picture, proven};
use crate::dump::npy;
use crate::gpu::{Renderer, RendererOptions};
use crate::passes::raycast::tolerance::LEVELS;
use crate::passes::{Slot, Texels, rendered};
use crate::picture::{Picture, replace};
use crate::reference;
use crate::scene::Scene;
use crate::source::Frame;
use crate::statistics::quantile_of;
use crate::terminal::{Failure, failed, input, say};
use serde_json::json;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(
    after_help = "For every ray of volume rendering, low and high enclose the exact integral of the sampled field: computed on the CPU in interval \
                  arithmetic, with the volume that stage 1 makes in f64, before the tone mapping of stage 4. With ray.tolerance the scene is also drawn on the \
                  device, and of each pixel it is said whether its error is within the tolerance by proof, or by its own estimate.\n\n\
                  Examples:\n  \
                  echolume report bounds --mode vr --size 64x64 -o bounds\n  \
                  echolume report bounds bone.mha --preset bone --mode vr --size 128x128 --width 0.02 -o bounds\n  \
                  echolume report bounds bone.mha --preset bone --mode vr --size 96x96 --set light.volume=none --set ray.tolerance=1 -o bounds"
)]
pub struct BoundsReport {
    #[command(flatten)]
    input: InputArgs,
    /// Write low.png, high.png, width.png, low.npy, high.npy and bounds.json into this folder
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Difference of the bounds of a ray's widest channel (0..1) below which its parts are no longer halved
    #[arg(long, value_name = "WIDTH", default_value_t = 0.01)]
    width: f64,
    /// Largest number of parts of a ray, 16..=1000000
    #[arg(long, value_name = "N", default_value_t = 8000, value_parser = clap::value_parser!(u32).range(16..=1_000_000))]
    parts: u32,
}

/// What is known of the errors of a picture: by bounds, else by the estimates of its pixels. `errors`: what each pixel states, 0..1 of the screen;
/// `tolerance`: levels of 255.
fn certificate(proofs: &[Proof], errors: &Texels, tolerance: f64) -> String {
    // As the shader compares them.
    let allowed = f64::from((tolerance / LEVELS) as f32);
    let share = |is_one: &dyn Fn(Proof, f64) -> bool| {
        let pairs = proofs.iter().zip(&errors.values);
        pairs.filter(|(proof, error)| is_one(**proof, **error)).count() as f64 / proofs.len().max(1) as f64
    };
    // Shares of all pixels. An estimate counts only where nothing is proven.
    let proven = share(&|proof, _| proof == Proof::Kept);
    let estimated = share(&|proof, error| proof == Proof::Open && error <= allowed);
    let broken = share(&|proof, _| proof == Proof::Broken);
    let open = (1.0 - proven - estimated - broken).max(0.0);
    let [proven, estimated, broken, open] = [proven, estimated, broken, open].map(|share| 100.0 * share);
    let levels = if tolerance == 1.0 { "level" } else { "levels" };
    format!(
        "the picture: at most {tolerance} {levels} of 255 in {proven:.1} % of the pixels by proof, in {estimated:.1} % by estimate; {open:.1} % may \
         have more, {broken:.1} % have more by proof"
    )
}

/// Median and 95th percentile of widths, and the share of them within a limit.
fn summary(widths: &[f64], limit: f64) -> [f64; 3] {
    let at = |share: f64| quantile_of(widths.iter().copied(), share).unwrap_or(0.0);
    let within = widths.iter().filter(|w| **w <= limit).count() as f64 / widths.len().max(1) as f64;
    [at(0.5), at(0.95), within]
}

impl BoundsReport {
    pub fn run(&self) -> Result<(), Failure> {
        check_number("--width", self.width, |width| (1e-6..=1.0).contains(&width), "must lie in 1e-6..=1")?;
        let (mut source, drawn) = self.input.open()?;
        let tolerance = drawn.tolerance();
        // The integral has no steps.
        let mut scene = drawn.clone();
        scene.settings.ray.tolerance = 0.0;
        if let Some(why) = fault(&scene) {
            return Err(input(format!("report bounds: {why}")));
        }
        make_folder(&self.output)?;
        let frames = self.input.frames(&mut *source)?;
        let shown =
            tolerance.map(|tolerance| self.drawn(drawn, &frames).map(|of_it| (tolerance, of_it))).transpose()?;
        // Pixels whose error is close to the tolerance need bounds that are narrow beside it.
        let narrow = tolerance.map_or(self.width, |levels| levels / LEVELS / 16.0);
        let effort = Effort { width: self.width.min(narrow), parts: self.parts as usize };
        let begun = std::time::Instant::now();
        let mut found = None;
        let frames = reference::decoded(&scene, &frames);
        reference::render_with(&scene, &frames, &mut |pass, reads, _| {
            if pass == "raycast_volume" {
                let volume = reads.get("volume");
                found = Some(match &shown {
                    None => Ok((picture(&scene, volume, effort), Vec::new())),
                    Some((tolerance, [texels, _])) => proven(&scene, volume, effort, texels, *tolerance),
                });
            }
            found.is_some()
        });
        let Some(found) = found else { return Err(failed("report bounds: no ray is cast in this scene")) };
        let (bounds, proofs) = found.map_err(|why| input(format!("report bounds: {why}")))?;
        let hit = bounds.widths_of_hits();
        let [median, p95, within] = summary(&hit, self.width);
        self.write(&bounds, hit.len(), [median, p95, within])?;
        say!(
            "bounds of {} rays that meet something: median width {median:.4}, 95th percentile {p95:.4}, {:.1} % of the rays within {}; \
             {} parts, {:.1} s",
            hit.len(),
            100.0 * within,
            self.width,
            bounds.parts,
            begun.elapsed().as_secs_f64()
        );
        if let Some((tolerance, [_, errors])) = &shown {
            say!("{}", certificate(&proofs, errors, *tolerance));
        }
        say!("written: low, high and width as .png, low.npy, high.npy, bounds.json in {}", self.output.display());
        Ok(())
    }

    /// A scene with a tolerance drawn on the device: colours before stage 4, and the errors that its pixels state.
    fn drawn(&self, scene: Scene, frames: &[Frame]) -> Result<[Texels; 2], Failure> {
        let context = self.input.open_device(false)?;
        let slot = rendered(&scene);
        let mut renderer = Renderer::new(&context, scene, &RendererOptions::default()).map_err(failed)?;
        renderer.volume(frames).map_err(failed)?;
        renderer.picture().map_err(failed)?;
        let [colours, errors] = [slot, Slot::PixelErrors].map(|slot| renderer.read(slot));
        match (colours.map_err(failed)?, errors.map_err(failed)?) {
            (Some(colours), Some(errors)) => Ok([colours, errors]),
            _ => Err(failed("report bounds: the picture states no errors")),
        }
    }

    /// `hit`: number of rays that meet something, of which `figures` are the [`summary`].
    fn write(&self, bounds: &PictureBounds, hit: usize, figures: [f64; 3]) -> Result<(), Failure> {
        let [width, height, _] = bounds.low.size;
        let widths = bounds.widths();
        let widest = widths.iter().fold(0.0, |most: f64, w| most.max(*w)).max(1e-300);
        colours(&bounds.low).save(&self.output.join("low.png")).map_err(failed)?;
        colours(&bounds.high).save(&self.output.join("high.png")).map_err(failed)?;
        let grey = Texels {
            size: bounds.low.size,
            channels: 4,
            values: widths.iter().flat_map(|w| [w / widest, w / widest, w / widest, 1.0]).collect(),
        };
        colours(&grey).save(&self.output.join("width.png")).map_err(failed)?;
        for (name, map) in [("low.npy", &bounds.low), ("high.npy", &bounds.high)] {
            replace(&self.output.join(name), &npy(&[height, width, 4], &map.values, true)).map_err(failed)?;
        }
        let [median, p95, within] = figures;
        let about = json!({
            "format": "echolume bounds 1",
            "input": self.input.name(),
            "axes": ["row", "column", "channel"],
            "channels": ["red", "green", "blue", "opacity"],
            "unit": "share, 0..1, before stage 4",
            "target_width": self.width,
            "rays_that_meet_something": hit,
            "median_width": median,
            "p95_width": p95,
            "largest_width": widest,
            "share_within_target": within,
            "parts": bounds.parts,
            "white_of_width_png": widest,
        });
        replace(&self.output.join("bounds.json"), format!("{about:#}\n").as_bytes()).map_err(failed)
    }
}

fn colours(map: &Texels) -> Picture {
    let byte = |v: f64| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let rgba = map.values.chunks_exact(4).flat_map(|p| [byte(p[0]), byte(p[1]), byte(p[2]), 255]).collect();
    Picture { width: map.size[0] as u32, height: map.size[1] as u32, rgba }
}
