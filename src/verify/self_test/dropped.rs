//! Barriers and waits that are left out, one at a time: the oracle must notice each, and synchronization validation, where its layer is
//! there, some. Recorded is what a renderer does for two volumes that take turns, drawn while the other is filled.

use super::Caught;
use crate::gpu::{Context, ContextOptions, GpuError, Renderer, RendererOptions};
use crate::passes::Texels;
use crate::probe::Geometry;
use crate::queues::oracle::SubmissionLog;
use crate::scene::Scene;
use crate::verify::built_in::{ALL_FILTERS, BYTES, frames, scene, wobbler};
use crate::verify::{drawn, isolated_context};
use std::sync::Arc;
use std::time::Instant;

/// Contexts that the layer watches, each with one barrier left out.
const WATCHED: usize = 6;

const SMALL: &str = "picture = { size = [12, 9] }\nslices = { pixels = 12 }";

/// What is recorded: a name, settings, and on how many queues.
fn scenes() -> Vec<(&'static str, String, Vec<usize>)> {
    let of = |mode: &str, rest: &str| format!("mode = '{mode}'\n{rest}\n{SMALL}");
    vec![
        ("surface", of("sr", "light = { shadow = {}, occlusion = {} }\ndistance = { median = 3 }"), vec![1, 2, 3]),
        ("volume", of("vr", ""), vec![1, 3]),
        ("lit volume", of("vr", "volume = { shading = 'first-hit' }"), vec![1]),
        ("projection", of("mip", ""), vec![1, 2]),
        ("mixed", of("mixed", ""), vec![1]),
        ("plane", of("plane", ""), vec![1]),
        ("orthogonal", of("orthogonal", "post = { floats = true }"), vec![1]),
        ("tomography", of("tomography", ""), vec![1]),
        ("cube", of("cube", ""), vec![1]),
        ("4-up", of("vr", "layout = 'four'"), vec![1]),
        ("every filter", format!("mode = 'sr'\n{ALL_FILTERS}"), vec![1, 3]),
    ]
}

/// A line for what the oracle saw, and one for what the layer did.
///
/// # Errors
/// A device that fails.
pub(super) fn all(options: &ContextOptions) -> Result<Vec<Caught>, GpuError> {
    Ok(vec![by_oracle(options)?, by_layer(options)?])
}

fn made(toml: &str) -> Result<(Scene, Vec<Texels>), GpuError> {
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)?;
    let frames = frames(&scene, |[x, y, z]| ((7 * x + 3 * y + 11 * z) % 32) as f64 / 31.0);
    Ok((scene, frames))
}

/// Volumes that are filled while the one before is drawn.
fn streamed(renderer: &mut Renderer, frames: &[Texels]) -> Result<(), GpuError> {
    drawn::send(renderer, frames, 0)?;
    renderer.begin_picture()?;
    drawn::send(renderer, frames, 1)?;
    renderer.end_picture()?;
    renderer.begin_picture()?;
    drawn::send(renderer, frames, 0)?;
    renderer.end_picture()?;
    renderer.picture().map(|_| ())
}

fn logged(context: &Arc<Context>, toml: &str, queues: usize) -> Result<(Scene, SubmissionLog), GpuError> {
    let (scene, frames) = made(toml)?;
    let options = RendererOptions { volume_images: 2, queues: Some(queues), log: true, ..RendererOptions::default() };
    let mut renderer = Renderer::new(context, scene, &options)?;
    streamed(&mut renderer, &frames)?;
    let log = renderer.log().cloned().unwrap_or_default();
    Ok((renderer.scene().clone(), log))
}

fn by_oracle(options: &ContextOptions) -> Result<Caught, GpuError> {
    let begun = Instant::now();
    let context = Context::new(&ContextOptions { validation: false, ..options.clone() })?;
    let (mut barriers, mut waits, mut runs, mut implied, mut missed) = (0, 0, 0, 0, None);
    for (name, toml, counts) in scenes() {
        for queues in counts {
            let (scene, log) = logged(&context, &toml, queues)?;
            let of = |what: String| format!("{name}, {queues} queues: {what}");
            if let Some(found) = log.find_hazard(&scene) {
                missed.get_or_insert(of(format!("nothing is left out, and {found:?}")));
            }
            for barrier in log.barriers() {
                let unseen = log.without_barrier(barrier).find_hazard(&scene).is_none();
                // What a submission waits for may have waited for the same itself.
                let may_be = !log.submissions[barrier.0].waits.is_empty();
                implied += usize::from(unseen && may_be);
                if unseen && !may_be {
                    missed.get_or_insert(of(format!("barrier {barrier:?} is not missed")));
                }
            }
            let unseen = |wait: &(usize, usize)| log.without_wait(*wait).find_hazard(&scene).is_none();
            missed = missed.or(log.waits().into_iter().find(unseen).map(|w| of(format!("wait {w:?} is not missed"))));
            (barriers, waits, runs) = (barriers + log.barriers().len(), waits + log.waits().len(), runs + 1);
        }
    }
    Ok(Caught {
        fault: "dropped barrier".into(),
        what: "every barrier and every wait for another queue is left out once".into(),
        by: missed.is_none().then(|| "the barrier oracle".into()),
        found: missed.unwrap_or_else(|| {
            let missed = barriers - implied;
            format!("{missed} of {barriers} barriers and {waits} of {waits} waits in {runs} recordings; the rest stand where a queue waits for another")
        }),
        left_out: false,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

/// Of one scene: with all barriers nothing is said, with one left out something is, now and then. Not every one is seen: the layer does
/// not look at writes after writes through storage images.
fn by_layer(options: &ContextOptions) -> Result<Caught, GpuError> {
    let begun = Instant::now();
    let toml = format!("mode = 'mip'\n{SMALL}");
    let caught = |by: Option<&str>, found: String| Caught {
        fault: "dropped barrier, watched".into(),
        what: "barriers are left out while synchronization validation looks on".into(),
        by: by.map(String::from),
        found,
        left_out: false,
        seconds: begun.elapsed().as_secs_f64(),
    };
    let recorded = |dropped: Option<u32>| -> Result<(u32, Vec<String>), GpuError> {
        let context = Context::new(options)?;
        let (scene, frames) = made(&toml)?;
        let mut renderer = Renderer::new(&context, scene, &RendererOptions::default())?;
        dropped.iter().for_each(|n| renderer.drop_barrier(*n));
        drawn::send(&mut renderer, &frames, 0)?;
        renderer.picture()?;
        let barriers = renderer.barriers();
        drop(renderer);
        Ok((barriers, isolated_context::told(&context, context.messages(), true)))
    };
    if !options.validation {
        let why = "the validation layer does not watch".to_string();
        return Ok(Caught { left_out: true, ..caught(None, why) });
    }
    let (barriers, messages) = recorded(None)?;
    if let Some(message) = messages.first() {
        return Ok(caught(None, format!("nothing is left out, and validation says {message}")));
    }
    let mut seen = 0;
    for n in 0..WATCHED {
        let dropped = 1 + n as u32 * barriers / WATCHED as u32;
        let (_, messages) = recorded(Some(dropped))?;
        seen += usize::from(messages.iter().any(|m| m.contains("SYNC-HAZARD")));
    }
    let by = (seen > 0).then_some("synchronization validation");
    Ok(caught(by, format!("{seen} of {WATCHED} that were left out, of {barriers}")))
}
