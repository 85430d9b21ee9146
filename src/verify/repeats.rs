//! The same bits whenever the same is drawn: again, by another renderer, in another context, on any number of queues, with frames in
//! any order, and by any number of threads of a software device.

use super::built_in::Noise;
use super::isolated_context::IsolatedContext;
use super::{Bench, Check, Drawn, Found, drawn, modes, shown, threads};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::Slot;
use crate::picture::Picture;
use crate::source::igtl::crc64;
use crate::verify::report::{Fault, Figure, Level, Shown, Unit, Worst};
use std::fmt::Write as _;
use std::sync::Arc;

/// How a volume's frames are sent.
#[derive(Clone, Copy, PartialEq)]
enum Sent {
    InOrder,
    /// In another order.
    Shuffled,
    /// A few lines at a time, with frames that are begun and given up.
    InParts,
}

/// How everything is drawn.
#[derive(Clone, Copy)]
struct Way {
    queues: Option<usize>,
    /// Volume images that take turns: the last is drawn, the others hold another volume.
    images: u32,
    sent: Sent,
}

const PLAIN: Way = Way { queues: Some(1), images: 1, sent: Sent::InOrder };

pub fn checks(level: Level) -> Vec<Check> {
    let of = |name: &str, own: bool, way: Way| {
        Check::new("determinism", name, move |bench: &mut Bench| in_a_way(bench, own, way))
    };
    let mut checks = vec![
        Check::new("determinism", "again in one renderer", again),
        of("another renderer, frames in another order", false, Way { sent: Sent::Shuffled, ..PLAIN }),
        of("another context, lines in parts", true, Way { sent: Sent::InParts, ..PLAIN }),
        of("three queues, three volume images", true, Way { queues: Some(3), images: 3, ..PLAIN }),
    ];
    if level == Level::Full {
        checks.extend([
            of("two queues", true, Way { queues: Some(2), ..PLAIN }),
            of("three queues", true, Way { queues: Some(3), ..PLAIN }),
            of("as many queues as there are", false, Way { queues: None, ..PLAIN }),
            of("two volume images", false, Way { images: 2, ..PLAIN }),
            of("three volume images, lines in parts", false, Way { images: 3, sent: Sent::InParts, ..PLAIN }),
        ]);
    }
    checks.push(Check::new("determinism", "any number of threads", threads::check));
    checks
}

/// Sends a volume's frames, and shows them.
fn send(renderer: &mut Renderer, of: &Drawn, way: Way) -> Result<(), GpuError> {
    let format = Slot::Frames.format(&of.scene);
    let image = way.images - 1;
    for other in 0..image {
        // Backwards, so that what shows through is seen.
        for (k, frame) in of.frames.iter().rev().enumerate() {
            renderer.frame(k as u32, &frame.encode(format), other)?;
        }
    }
    let mut left: Vec<usize> = (0..of.frames.len()).rev().collect();
    let mut noise = Noise(7);
    while !left.is_empty() {
        let next = match way.sent {
            Sent::InOrder => left.len() - 1,
            _ => (noise.next() * left.len() as f64) as usize,
        };
        let slice = left.swap_remove(next);
        let bytes = of.frames[slice].encode(format);
        let line = bytes.len() / of.scene.frame_size()[1] as usize;
        if way.sent != Sent::InParts {
            renderer.frame(slice as u32, &bytes, image)?;
            continue;
        }
        renderer.lines(slice as u32, 0, &bytes[..3 * line], image)?;
        for (n, lines) in bytes.chunks(5 * line).enumerate() {
            renderer.lines(slice as u32, 5 * n as u32, lines, image)?;
        }
    }
    renderer.show(image)
}

/// Every mode, one after the other in one renderer.
fn draw(context: &Arc<Context>, modes: &[Drawn], way: Way) -> Result<Vec<Picture>, GpuError> {
    let options = RendererOptions { queues: way.queues, volume_images: way.images, ..RendererOptions::default() };
    let Some(first) = modes.first() else { return Ok(Vec::new()) };
    let mut renderer = Renderer::new(context, first.scene.clone(), &options)?;
    let picture = |of: &Drawn| {
        renderer.change(of.scene.clone())?;
        send(&mut renderer, of, way)?;
        renderer.picture()
    };
    modes.iter().map(picture).collect()
}

/// Adds a fault where two pictures are not one, to the byte.
pub fn same(found: &mut Found, what: &str, expected: &Picture, got: &Picture) -> bool {
    if expected == got {
        return true;
    }
    let size = |p: &Picture| format!("{}x{}", p.width, p.height);
    if size(expected) != size(got) {
        found.expect(false, || format!("{what}: expected {}, got {}", size(expected), size(got)));
        return false;
    }
    let apart = modes::apart(expected, got);
    let other = expected.rgba.iter().zip(&got.rgba).filter(|(a, b)| a != b).count();
    let values = expected.rgba.len();
    let said = format!("{what}: {other} of {values} values are others, by {} levels at most", apart.largest);
    let fault = Some(found.faults.len());
    found.pictures.push(Shown { fault, ..shown::pictures(what, expected, got) });
    found.faults.push(Fault { worst: Some(Worst { beyond: other, ..apart.worst }), ..Fault::new(said) });
    false
}

/// How many pictures were held against others, and how many differ.
pub fn counted(found: &mut Found, compared: usize, differ: usize) {
    let figure =
        |what: &str, value: usize, allowed| Figure { allowed, ..Figure::error(what, value as f64, 0.0, Unit::Count) };
    found.figures.push(figure("pictures compared", compared, None));
    found.figures.push(figure("pictures that differ", differ, Some(0.0)));
}

fn in_a_way(bench: &mut Bench, own: bool, way: Way) -> Result<Found, GpuError> {
    let (mut found, modes) = (Found::default(), bench.modes()?);
    let aside = own.then(|| IsolatedContext::of_queues(bench, way.queues.unwrap_or(1))).transpose()?;
    let context = aside.as_ref().map_or(&bench.context, |aside| &aside.context);
    let got = draw(context, &modes, way)?;
    let same = modes.iter().zip(&got).filter(|(of, got)| same(&mut found, &of.name, &of.picture, got)).count();
    counted(&mut found, modes.len(), modes.len() - same);
    aside.iter().for_each(|aside| aside.tell(&mut found));
    Ok(found)
}

/// Every mode drawn again, shown again, and sent again.
fn again(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, modes) = (Found::default(), bench.modes()?);
    let options = RendererOptions { queues: Some(1), ..RendererOptions::default() };
    let (mut compared, mut wrong) = (0, 0);
    let Some(first) = modes.first() else { return Ok(found) };
    let mut renderer = Renderer::new(&bench.context, first.scene.clone(), &options)?;
    // The other way round: what a mode finds was left by another.
    for of in modes.iter().rev() {
        renderer.change(of.scene.clone())?;
        for turn in ["drawn", "drawn again", "shown again", "sent again"] {
            match turn {
                "drawn" | "sent again" => drawn::send(&mut renderer, &of.frames, 0)?,
                "shown again" => renderer.show(0)?,
                _ => {}
            }
            let what = format!("{}, {turn}", of.name);
            compared += 1;
            wrong += usize::from(!same(&mut found, &what, &of.picture, &renderer.picture()?));
        }
    }
    counted(&mut found, compared, wrong);
    Ok(found)
}

/// Checksums of the pictures of every mode, a line a mode: the same wherever the same bits come out.
///
/// # Errors
/// A device that fails.
pub fn digest(context: &Arc<Context>) -> Result<String, GpuError> {
    Ok(digest_of(&drawn::modes(context)?))
}

/// The same of pictures that were drawn.
pub(super) fn digest_of(modes: &[Drawn]) -> String {
    modes.iter().fold(String::new(), |mut text, of| {
        let _ = writeln!(text, "{:016x} {}", crc64(&of.picture.rgba), of.name);
        text
    })
}
