//! Group "determinism": the same input gives the same bits if it is rendered again, by another renderer, in another context, on any number
//! of queues, with frames in any order, and with any number of threads of a software device.

use super::built_in::Noise;
use super::compare::{add_picture_counts, count_figure, expect_same_picture};
use super::render::Drawn;
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::Slot;
use crate::picture::Picture;
use crate::report::{Fault, Level};
use crate::source::igtl::crc64;
use std::fmt::Write as _;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How pictures are rendered.
#[derive(Clone, Copy)]
struct RenderVariant {
    queues: Option<usize>,
    /// Number of volume images: the last one is rendered, the others hold another volume.
    images: u32,
    /// True if the frames of a volume are sent in random order.
    shuffled: bool,
}

const PLAIN: RenderVariant = RenderVariant { queues: Some(1), images: 1, shuffled: false };

pub fn checks(level: Level) -> Vec<Check> {
    let of = |name: &str, own: bool, variant: RenderVariant| {
        Check::new("determinism", name, move |dut: &mut DeviceUnderTest| render_variant(dut, own, variant))
    };
    let mut checks = vec![
        Check::new("determinism", "again in one renderer", again),
        of("another renderer, frames in another order", false, RenderVariant { shuffled: true, ..PLAIN }),
        of("another context, frames in another order", true, RenderVariant { shuffled: true, ..PLAIN }),
        of("three queues, three volume images", true, RenderVariant { queues: Some(3), images: 3, ..PLAIN }),
    ];
    if level == Level::Full {
        checks.extend([
            of("two queues", true, RenderVariant { queues: Some(2), ..PLAIN }),
            of("three queues", true, RenderVariant { queues: Some(3), ..PLAIN }),
            of("as many queues as there are", false, RenderVariant { queues: None, ..PLAIN }),
            of("two volume images", false, RenderVariant { images: 2, ..PLAIN }),
            of(
                "three volume images, frames in another order",
                false,
                RenderVariant { images: 3, shuffled: true, ..PLAIN },
            ),
        ]);
    }
    checks.push(Check::new("determinism", "any number of threads", threads));
    checks
}

/// Sends the frames of a volume and selects its image.
fn send(renderer: &mut Renderer, of: &Drawn, variant: RenderVariant) -> Result<(), GpuError> {
    let format = Slot::Frames.format(&of.scene);
    let image = variant.images - 1;
    for other in 0..image {
        // In reverse order, so that a wrong image is visible.
        for (k, frame) in of.frames.iter().rev().enumerate() {
            renderer.frame(k as u32, &frame.encode(format), other)?;
        }
    }
    let mut left: Vec<usize> = (0..of.frames.len()).rev().collect();
    let mut noise = Noise(7);
    while !left.is_empty() {
        let next = if variant.shuffled { (noise.next() * left.len() as f64) as usize } else { left.len() - 1 };
        let slice = left.swap_remove(next);
        let bytes = of.frames[slice].encode(format);
        renderer.frame(slice as u32, &bytes, image)?;
    }
    renderer.show(image)
}

/// Renders every mode, one after the other in one renderer.
fn draw(context: &Arc<Context>, modes: &[Drawn], variant: RenderVariant) -> Result<Vec<Picture>, GpuError> {
    let options =
        RendererOptions { queues: variant.queues, volume_images: variant.images, ..RendererOptions::default() };
    let Some(first) = modes.first() else { return Ok(Vec::new()) };
    let mut renderer = Renderer::new(context, first.scene.clone(), &options)?;
    let picture = |of: &Drawn| {
        renderer.change(of.scene.clone())?;
        send(&mut renderer, of, variant)?;
        renderer.picture()
    };
    modes.iter().map(picture).collect()
}

fn render_variant(dut: &mut DeviceUnderTest, own: bool, variant: RenderVariant) -> Result<Findings, GpuError> {
    let (mut findings, modes) = (Findings::default(), dut.modes()?);
    let isolated = own.then(|| IsolatedContext::of_queues(dut, variant.queues.unwrap_or(1))).transpose()?;
    let context = isolated.as_ref().map_or(&dut.context, |isolated| &isolated.context);
    for (of, got) in modes.iter().zip(draw(context, &modes, variant)?) {
        expect_same_picture(&mut findings, &of.name, &of.picture, &got);
    }
    add_picture_counts(&mut findings);
    isolated.iter().for_each(|isolated| isolated.report_validation(&mut findings));
    Ok(findings)
}

/// Renders every mode again: without changes, after selecting its image again, and after sending its frames again.
fn again(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, modes) = (Findings::default(), dut.modes()?);
    let options = RendererOptions { queues: Some(1), ..RendererOptions::default() };
    let Some(first) = modes.first() else { return Ok(findings) };
    let mut renderer = Renderer::new(&dut.context, first.scene.clone(), &options)?;
    // In reverse order, so that state left by another mode differs.
    for of in modes.iter().rev() {
        renderer.change(of.scene.clone())?;
        for step in ["drawn", "drawn again", "shown again", "sent again"] {
            match step {
                "drawn" | "sent again" => render::send(&mut renderer, &of.frames, 0)?,
                "shown again" => renderer.show(0)?,
                _ => {}
            }
            let what = format!("{}, {step}", of.name);
            expect_same_picture(&mut findings, &what, &of.picture, &renderer.picture()?);
        }
    }
    add_picture_counts(&mut findings);
    Ok(findings)
}

/// Checksums of the pictures of every mode, one line for each mode: CRC-64 in hexadecimal, and the name of the mode.
///
/// # Errors
/// The device fails.
pub fn digest(context: &Arc<Context>) -> Result<String, GpuError> {
    Ok(digest_of(&render::modes(context)?))
}

/// The digest of rendered pictures.
fn digest_of(modes: &[Drawn]) -> String {
    modes.iter().fold(String::new(), |mut text, of| {
        let _ = writeln!(text, "{:016x} {}", crc64(&of.picture.rgba), of.name);
        text
    })
}

/// Environment variable for the number of threads of lavapipe. 0: only the calling thread.
const VARIABLE: &str = "LP_NUM_THREADS";

/// Maximum time of one child process; a busy machine needs seconds.
const MAX_CHILD_TIME: Duration = Duration::from_secs(120);

/// Arguments of a child process of this program that prints the [`digest`] of the context's device.
pub fn arguments(context: &Context) -> Vec<String> {
    ["verify", "--digest", "--device", &context.candidate.name].map(String::from).into()
}

/// Numbers of threads to try; None is the default of the driver.
fn numbers(level: Level) -> &'static [Option<u32>] {
    match level {
        Level::Quick => &[Some(1), Some(7)],
        Level::Full => &[Some(0), Some(1), Some(2), Some(7), None],
    }
}

fn threads(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let candidate = &dut.context.candidate;
    if !candidate.is_software() || !candidate.name.contains("llvmpipe") {
        return Ok(Findings::left_out("only lavapipe is told how many threads to have"));
    }
    let Some(program) = dut.program.clone() else {
        return Ok(Findings::left_out("this program cannot be started again"));
    };
    let (mut findings, expected) = (Findings::default(), digest_of(&dut.modes()?));
    let mut compared = 0;
    for number in numbers(dut.level) {
        let said = match begin(&program, &arguments(&dut.context), *number) {
            Ok(child) => end(child),
            Err(fault) => return Ok(Findings::left_out(format!("{} does not start: {fault}", program.display()))),
        };
        let threads = number.map_or("as many threads as it likes".into(), |n| format!("{VARIABLE}={n}"));
        match said {
            Err(fault) => findings.faults.push(Fault::new(format!("{threads}: {fault}"))),
            Ok(said) => {
                compared += 1;
                findings
                    .faults
                    .extend(digest_difference(&expected, &said).map(|what| Fault::new(format!("{threads}: {what}"))));
            }
        }
    }
    findings.figures.push(count_figure("numbers of threads compared", compared));
    Ok(findings)
}

/// The first mode whose pictures differ.
fn digest_difference(expected: &str, got: &str) -> Option<String> {
    let differ = |(e, g): &(&str, &str)| e != g;
    let pair = expected.lines().zip(got.lines()).find(differ);
    let lines = |text: &str| text.lines().count();
    match pair {
        Some((e, g)) => Some(format!("another picture: expected {e}, got {g}")),
        None if lines(expected) != lines(got) => Some(format!("{} modes of {}", lines(got), lines(expected))),
        None => None,
    }
}

fn begin(program: &Path, arguments: &[String], number: Option<u32>) -> std::io::Result<Child> {
    let mut command = Command::new(program);
    command.args(arguments).env_remove(VARIABLE);
    command.envs(number.map(|n| (VARIABLE, n.to_string())));
    // The child must not receive signals that a terminal sends to the process group; this process handles them.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()
}

/// The output of a child process after it has succeeded. A child that does not end in time is killed.
fn end(mut child: Child) -> Result<String, String> {
    let begun = Instant::now();
    // A digest fits into the buffer of a pipe, so the child can end before its output is read.
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if begun.elapsed() < MAX_CHILD_TIME => std::thread::sleep(Duration::from_millis(20)),
            other => {
                let _ = child.kill();
                let _ = child.wait();
                let fault = other.err().map(|e| e.to_string());
                return Err(fault.unwrap_or(format!("not done after {} s, killed", MAX_CHILD_TIME.as_secs())));
            }
        }
    };
    let mut said = String::new();
    let read = child.stdout.take().map_or(Ok(0), |mut out| out.read_to_string(&mut said));
    match (status.success(), read) {
        (false, _) => Err(format!("the child process failed: {status}")),
        (true, Err(fault)) => Err(format!("the output of the child process: {fault}")),
        (true, Ok(_)) => Ok(said),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_different_checksum_a_missing_mode_and_an_empty_digest_are_reported() {
        let expected = "01 vr\n02 sr\n";
        assert_eq!(digest_difference(expected, expected), None);
        assert_eq!(
            digest_difference(expected, "01 vr\n03 sr\n").as_deref(),
            Some("another picture: expected 02 sr, got 03 sr")
        );
        assert_eq!(digest_difference(expected, "01 vr\n").as_deref(), Some("1 modes of 2"));
        assert_eq!(digest_difference(expected, "").as_deref(), Some("0 modes of 2"));
    }
}
