//! Group "hazards": frames arrive while pictures are rendered, on one to three queues. Every picture must be identical to the one that is
//! rendered with a wait after every step. Passes are slowed down so that work overlaps.

use super::built_in::{BYTES, Noise, moved, scene, wall, wobbler};
use super::compare::{add_picture_counts, expect_same_picture, texel_comparison};
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::probe::Geometry;
use crate::queues::MAX_QUEUES;
use crate::report::{Fault, Level};
use crate::scene::Scene;
use std::sync::Arc;

/// A scenario on a number of queues. Each of its pictures is compared; the findings count them.
type Scenario = fn(&mut Findings, &IsolatedContext, usize, Level) -> Result<(), GpuError>;

pub fn checks(_: Level) -> Vec<Check> {
    let of = |name: &str, scenario: Scenario| {
        Check::new("hazards", name, move |dut: &mut DeviceUnderTest| on_queues(dut, scenario))
    };
    vec![
        of("a volume arrives while another is drawn", |findings, isolated, queues, level| {
            let rounds = if level == Level::Quick { 6 } else { 60 };
            alternating_images(findings, &isolated.context, queues, rounds, |round| (round as u32 + 1) % 2)
        }),
        of("slices are replaced while they are drawn", replaced),
        of("frames and pictures in any order", any_order),
        of("changes of scene on the way", changes),
    ]
}

/// True if the validation layer reports a barrier that is left out on purpose. A layer may be active and report nothing: since 2024 it ignores what
/// shaders access, unless a setting says otherwise.
///
/// # Errors
/// The device cannot be opened again, or fails.
pub(crate) fn validation_notices_a_dropped_barrier(dut: &DeviceUnderTest) -> Result<bool, GpuError> {
    // The last ones: they lie between passes over the picture.
    const TRIED: usize = 8;
    let isolated = IsolatedContext::of_changes(dut)?;
    let (context, scene) = (&isolated.context, made(PLAIN)?);
    let frames = stored(&scene, 0);
    let barriers_without = |dropped: Option<u32>| {
        let mut renderer = Renderer::new(context, scene.clone(), &RendererOptions::default())?;
        dropped.iter().for_each(|n| renderer.drop_barrier(*n));
        send(&mut renderer, &frames, 0)?;
        renderer.show(0)?;
        renderer.picture()?;
        Ok::<u32, GpuError>(renderer.barriers())
    };
    let count = barriers_without(None)?;
    for n in (1..=count).rev().take(TRIED) {
        barriers_without(Some(n))?;
        if isolated.credible_messages().iter().any(|message| message.contains("SYNC-HAZARD")) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Runs a scenario on one, two and three queues.
fn on_queues(dut: &mut DeviceUnderTest, scenario: Scenario) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    for queues in 1..=MAX_QUEUES {
        let isolated = IsolatedContext::of_queues(dut, queues)?;
        scenario(&mut findings, &isolated, queues, dut.level)?;
        isolated.report_validation(&mut findings);
    }
    add_picture_counts(&mut findings);
    let there = dut.context.queue_count();
    if there < MAX_QUEUES {
        findings.notes.push(format!("queues for different work: {there} of {MAX_QUEUES}; one does what several would"));
    }
    Ok(findings)
}

/// The wobbler with a motor that moves during a frame.
fn moving() -> Geometry {
    Geometry::Sweep(moved(wobbler(), 0.3))
}

const PLAIN: &str = "mode = 'vr'\npicture = { size = [24, 24] }\nslices = { pixels = 40, format = 'r8' }";
const SMOOTH: &str =
    "mode = 'sr'\npicture = { size = [24, 24] }\nslices = { pixels = 40, format = 'r8', smooth = { elevation = 1.0 } }";

fn made(toml: &str) -> Result<Scene, GpuError> {
    scene(moving(), BYTES, toml).map_err(GpuError::Broken)
}

/// The frames of a volume as stored bytes.
fn stored(scene: &Scene, number: u32) -> Vec<Vec<u8>> {
    wall(scene, number).iter().map(|frame| frame.encode(Slot::Frames.format(scene))).collect()
}

fn send(renderer: &mut Renderer, frames: &[Vec<u8>], image: u32) -> Result<(), GpuError> {
    frames.iter().enumerate().try_for_each(|(k, frame)| renderer.frame(k as u32, frame, image))
}

/// The picture of these frames by a new renderer that waits after each step.
fn waited_for(context: &Arc<Context>, scene: &Scene, frames: &[Vec<u8>]) -> Result<Picture, GpuError> {
    Ok(volume_waited_for(context, scene, frames)?.0)
}

/// The same, with the volume.
fn volume_waited_for(
    context: &Arc<Context>,
    scene: &Scene,
    frames: &[Vec<u8>],
) -> Result<(Picture, Option<Texels>), GpuError> {
    let mut renderer =
        Renderer::new(context, scene.clone(), &RendererOptions { queues: Some(1), ..RendererOptions::default() })?;
    for (k, frame) in frames.iter().enumerate() {
        renderer.frame(k as u32, frame, 0)?;
        renderer.take_times()?;
    }
    renderer.show(0)?;
    Ok((renderer.picture()?, renderer.read(Slot::Volume)?))
}

/// Renders `rounds` pictures on `queues` queues from two volume images in turn: round n, counted from 0, renders image n % 2. During each round the
/// next volume is sent into the image `into(n)`. If this is the image that is not being rendered, all pictures are right; otherwise some show the
/// wrong volume. Each picture is counted in `findings`, and each wrong one is a fault there.
///
/// # Errors
/// The device fails.
pub fn alternating_images(
    findings: &mut Findings,
    context: &Arc<Context>,
    queues: usize,
    rounds: usize,
    into: impl Fn(usize) -> u32,
) -> Result<(), GpuError> {
    let scene = made(SMOOTH)?;
    let volumes: Vec<_> = (0..3).map(|number| stored(&scene, number)).collect();
    let expected: Result<Vec<_>, _> = volumes.iter().map(|frames| waited_for(context, &scene, frames)).collect();
    let expected = expected?;
    let options = RendererOptions { volume_images: 2, queues: Some(queues), ..RendererOptions::default() };
    let mut renderer = Renderer::new(context, scene, &options)?;
    send(&mut renderer, &volumes[0], 0)?;
    for round in 0..rounds {
        let slow = if round % 2 == 0 { "raycast_surface" } else { "scan_convert" };
        context.faults.slow_down(slow, 12);
        renderer.show(round as u32 % 2)?;
        renderer.begin_picture()?;
        // More frames than the upload ring has lanes, while the picture is being rendered.
        send(&mut renderer, &volumes[(round + 1) % 3], into(round))?;
        let what = format!("volume {round}, {queues} queues, '{slow}' slowed down");
        expect_same_picture(findings, &what, &expected[round % 3], &renderer.end_picture()?);
    }
    context.faults.slow_down("", 1);
    Ok(())
}

/// Slices of the only volume image are replaced while it is rendered: they wait for the picture, and the next picture shows them.
fn replaced(findings: &mut Findings, isolated: &IsolatedContext, queues: usize, level: Level) -> Result<(), GpuError> {
    let context = &isolated.context;
    let (scene, mut noise) = (made(PLAIN)?, Noise(5));
    let volumes: Vec<_> = (0..3).map(|number| stored(&scene, number)).collect();
    let options = RendererOptions { queues: Some(queues), ..RendererOptions::default() };
    let mut renderer = Renderer::new(context, scene.clone(), &options)?;
    let mut there = volumes[0].clone();
    send(&mut renderer, &there, 0)?;
    for round in 0..if level == Level::Quick { 4 } else { 40 } {
        let expected = waited_for(context, &scene, &there)?;
        context.faults.slow_down("raycast_volume", 12);
        renderer.show(0)?;
        renderer.begin_picture()?;
        for _ in 0..7 {
            let slice = (noise.next() * there.len() as f64) as usize;
            there[slice] = volumes[(round + 1) % 3][slice].clone();
            renderer.frame(slice as u32, &there[slice], 0)?;
        }
        let what = format!("round {round}, {queues} queues");
        expect_same_picture(findings, &what, &expected, &renderer.end_picture()?);
        context.faults.slow_down("", 1);
    }
    renderer.show(0)?;
    let what = format!("after all rounds, {queues} queues");
    expect_same_picture(findings, &what, &waited_for(context, &scene, &there)?, &renderer.picture()?);
    Ok(())
}

/// Frames of two volumes in random order, some of them after others for the same slice, into two volume images, while pictures
/// are begun and ended in between.
fn any_order(findings: &mut Findings, isolated: &IsolatedContext, queues: usize, level: Level) -> Result<(), GpuError> {
    let (context, mut noise) = (&isolated.context, Noise(17));
    for toml in [PLAIN, SMOOTH] {
        let scene = made(toml)?;
        let options = RendererOptions { volume_images: 2, queues: Some(queues), ..RendererOptions::default() };
        let mut renderer = Renderer::new(context, scene.clone(), &options)?;
        context.faults.slow_down("scan_convert", 4);
        for round in 0..if level == Level::Quick { 1 } else { 12 } {
            let volumes = [stored(&scene, 2 * round), stored(&scene, 2 * round + 1)];
            let mut left: Vec<(usize, usize)> =
                (0..2).flat_map(|i| (0..volumes[i].len()).map(move |k| (i, k))).collect();
            let mut drawing = false;
            while !left.is_empty() {
                let (image, slice) = left.swap_remove((noise.next() * left.len() as f64) as usize);
                let (frame, k, image) = (&volumes[image][slice], slice as u32, image as u32);
                if noise.next() < 0.5 {
                    renderer.frame(k, &vec![200; frame.len()], image)?;
                }
                renderer.frame(k, frame, image)?;
                if noise.next() < 0.3 {
                    match std::mem::replace(&mut drawing, noise.next() < 0.7) {
                        true => drop(renderer.end_picture()?),
                        false => renderer.show((noise.next() * 2.0) as u32)?,
                    }
                    renderer.begin_picture()?;
                }
            }
            for (image, frames) in volumes.iter().enumerate() {
                let (expected, volume) = volume_waited_for(context, &scene, frames)?;
                renderer.show(image as u32)?;
                let what = format!("image {image} of round {round}, {queues} queues, {:?}", scene.settings.mode);
                expect_same_picture(findings, &what, &expected, &renderer.picture()?);
                let there = renderer.read(Slot::Volume)?;
                if there != volume {
                    findings.faults.push(Fault::new(format!("{what}: the volume differs")));
                    if let (Some(volume), Some(there)) = (&volume, &there) {
                        let plane = volume.size[0] * volume.size[1] * volume.channels;
                        let other = volume.values.iter().zip(&there.values).position(|(e, g)| e != g);
                        let slice = other.map_or(0, |i| i / plane.max(1));
                        findings.show(texel_comparison("volume", volume, there, slice));
                    }
                }
            }
        }
        context.faults.slow_down("", 1);
    }
    Ok(())
}

/// The scene changes while a picture and frames are in flight: another view, other frame filters, another size.
fn changes(findings: &mut Findings, isolated: &IsolatedContext, queues: usize, level: Level) -> Result<(), GpuError> {
    let context = &isolated.context;
    let scenes = [
        made(PLAIN)?,
        made(&format!("{PLAIN}\ncamera = {{ azimuth = 40 }}"))?,
        made(SMOOTH)?,
        made(&PLAIN.replace("[24, 24]", "[31, 17]"))?,
        made(&PLAIN.replace("'r8'", "'r8', median = true"))?,
    ];
    let frames: [Vec<Texels>; 2] = [wall(&scenes[0], 0), wall(&scenes[0], 1)];
    let mut expected = Vec::new();
    for scene in &scenes {
        expected.push([render::picture(context, scene, &frames[0])?, render::picture(context, scene, &frames[1])?]);
    }
    let options = RendererOptions { volume_images: 2, queues: Some(queues), ..RendererOptions::default() };
    let mut renderer = Renderer::new(context, scenes[0].clone(), &options)?;
    let mut noise = Noise(23);
    for round in 0..if level == Level::Quick { 8 } else { 80 } {
        let at = if round < scenes.len() { round } else { (noise.next() * scenes.len() as f64) as usize };
        context.faults.slow_down("tone", 8);
        // Frames and a picture of the previous scene are still in flight.
        renderer.begin_picture()?;
        renderer.change(scenes[at].clone())?;
        for (image, volume) in frames.iter().enumerate() {
            render::send(&mut renderer, volume, image as u32)?;
        }
        renderer.show(round as u32 % 2)?;
        renderer.begin_picture()?;
        let late = frames[round % 2][3].encode(Slot::Frames.format(&scenes[at]));
        renderer.frame(3, &late, round as u32 % 2)?;
        let what = format!("round {round}, scene {at}, {queues} queues");
        expect_same_picture(findings, &what, &expected[at][round % 2], &renderer.end_picture()?);
    }
    context.faults.slow_down("", 1);
    Ok(())
}
