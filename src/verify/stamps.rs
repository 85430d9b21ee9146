//! Time stamps: what the device says of them, that they run forwards and lie where the host waited, and that what takes longer takes
//! longer by them. No time is a pass mark: of several runs the least disturbed counts, so that a busy machine fails nothing.

use super::built_in::{BYTES, scene, wall, wobbler};
use super::failing::count;
use super::isolated_context::IsolatedContext;
use super::repeats::same;
use super::{Bench, Check, Found, drawn};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::{PassTime, Span};
use crate::picture::Picture;
use crate::probe::Geometry;
use crate::profile::export::pass_time_table;
use crate::scene::Scene;
use crate::verify::report::{Fault, Figure, Level, Unit};
use std::sync::Arc;

/// Most runs of one thing until one of them was not disturbed.
const RUNS: usize = 15;

pub fn checks(_: Level) -> Vec<Check> {
    let of = |name: &str, work: fn(&mut Bench) -> Result<Found, GpuError>| Check::new("time stamps", name, work);
    vec![
        of("bits and period", said),
        of("within submission and wait", within),
        of("a pass slowed down three times", slowed),
        of("other bits and another period", others),
    ]
}

fn told(what: &str, value: f64, unit: Unit) -> Figure {
    Figure { allowed: None, ..Figure::error(what, value, 0.0, unit) }
}

/// One that the machine's load decides.
fn passing(what: &str, value: f64, unit: Unit) -> Figure {
    Figure { fleeting: true, ..told(what, value, unit) }
}

fn picture_scene(toml: &str) -> Result<Scene, GpuError> {
    scene(Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)
}

fn has_stamps(context: &Context) -> bool {
    context.candidate.valid_bits() > 0
}

const NONE: &str = "this device has no time stamps";

/// What Vulkan allows: no bits, or 36 to 64; and a period that is a time.
fn said(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, context) = (Found::default(), &bench.context);
    for (n, queue) in context.candidate.queues.iter().enumerate() {
        let bits = queue.valid_bits;
        found.expect(bits == 0 || (36..=64).contains(&bits), || format!("queue {n}: time stamps of {bits} bits"));
        found.figures.push(count(&format!("bits of queue {n}"), bits as usize));
    }
    let period = f64::from(context.limits.timestamp_period);
    found.expect(!has_stamps(context) || (period > 0.0 && period.is_finite()), || format!("a tick of {period} ns"));
    found.figures.push(told("period", period, Unit::Ns));
    if !has_stamps(context) {
        found.notes.push(NONE.into());
    }
    Ok(found)
}

/// What is wrong with the spans of one picture: host spans `submit` and `wait`, and the device's, in the order in which they ran. Else
/// the share of the time from submission to wait that they fill, and by how much of it they lie outside.
pub fn looked_at(spans: &[Span]) -> Result<[f64; 2], String> {
    let host = |name: &str| spans.iter().find(|s| s.name == name && !s.on_device).ok_or(format!("no '{name}'"));
    let (from, to) = (host("submit")?.begin, host("wait")?.end);
    let passes: Vec<&Span> = spans.iter().filter(|s| s.on_device).collect();
    let (Some(first), Some(last)) = (passes.first(), passes.last()) else {
        return Err("the device stamped nothing".into());
    };
    let host = to - from;
    for span in &passes {
        let took = span.end - span.begin;
        // A stamp before the one it follows is a counter that wrapped: longer than anything.
        if !(0.0..=1.02 * host).contains(&took) {
            return Err(format!("'{}' took {took:.0} ns of the {host:.0} ns that the host waited", span.name));
        }
    }
    for pair in passes.windows(2) {
        let gap = pair[1].begin - pair[0].end;
        if gap.abs() > 1e-3 * host {
            return Err(format!("{gap:.0} ns lie between '{}' and '{}'", pair[0].name, pair[1].name));
        }
    }
    let sum: f64 = passes.iter().map(|s| s.end - s.begin).sum();
    if !(0.0..=1.02 * host).contains(&sum) || sum == 0.0 {
        return Err(format!("all passes took {sum:.0} ns of the {host:.0} ns that the host waited"));
    }
    let outside = (from - first.begin).max(last.end - to).max(0.0);
    Ok([sum / host, outside / host])
}

/// Stamps from the first of a submission to its last add up to the time from submission to idle, and lie within it.
fn within(bench: &mut Bench) -> Result<Found, GpuError> {
    let context = &bench.context;
    if !has_stamps(context) {
        return Ok(Found::left_out(NONE));
    }
    let mut found = Found::default();
    let toml = "mode = 'sr'\npicture = { size = [192, 192] }\nslices = { pixels = 64 }\nray = { step = 0.1 }\ndistance = { median = 9 }";
    let scene = picture_scene(toml)?;
    let options = RendererOptions { spans: true, ..RendererOptions::default() };
    // The first picture compiles shaders.
    let mut renderer = drawn::sent(context, &scene, &wall(&scene, 0), &options)?;
    renderer.picture()?;
    let (mut shares, mut outside) = (Vec::new(), Vec::new());
    for _ in 0..5 {
        renderer.show(0)?;
        renderer.take_spans()?;
        renderer.picture()?;
        let spans = renderer.take_spans()?;
        match looked_at(&spans) {
            Ok([share, out]) => {
                shares.push(share);
                outside.push(out);
            }
            Err(fault) => found.faults.push(Fault::new(fault)),
        }
        for name in ["raycast_surface", "light"] {
            let counted = spans.iter().find(|s| s.name == name && s.on_device).map(|s| s.invocations);
            let expected = context.candidate.pipeline_statistics.then_some(192 * 192);
            found.expect(counted == Some(expected), || {
                format!("{name}: expected {expected:?} invocations, got {counted:?}")
            });
        }
    }
    let best = shares.iter().copied().fold(0.0, f64::max);
    let least = outside.iter().copied().fold(f64::INFINITY, f64::min);
    found.expect(shares.is_empty() || best > 0.2, || {
        format!("at most {best:.3} of the time from submission to idle is stamped")
    });
    if context.candidate.calibrated_timestamps {
        found.expect(outside.is_empty() || least < 0.5, || {
            format!("by the device's clock passes ran outside submission and wait, by {least:.2} of it at least")
        });
    }
    if best < 0.9 {
        found.notes.push("the host was not idle, or is slow to submit and to wake up".into());
    }
    found.figures.push(Figure { samples: shares, ..passing("share that is stamped", best, Unit::Share) });
    found.figures.push(passing("share outside", if least.is_finite() { least } else { 0.0 }, Unit::Share));
    Ok(found)
}

/// Time of one pass in one picture, ns.
fn time_of(renderer: &mut Renderer, name: &str) -> Result<f64, GpuError> {
    renderer.take_times()?;
    renderer.show(0)?;
    renderer.picture()?;
    Ok(renderer.take_times()?.iter().find(|t| t.name == name).map_or(0.0, |t| t.total))
}

/// The least time of each counts: whatever else the machine does only adds to it.
fn slowed(bench: &mut Bench) -> Result<Found, GpuError> {
    let aside = IsolatedContext::new(bench)?;
    let context = &aside.context;
    if !has_stamps(context) {
        return Ok(Found::left_out(NONE));
    }
    let mut found = Found::default();
    let scene =
        picture_scene("mode = 'vr'\npicture = { size = [192, 192] }\nslices = { pixels = 64 }\nray = { step = 0.2 }")?;
    let mut renderer = drawn::sent(context, &scene, &wall(&scene, 0), &RendererOptions::default())?;
    let (mut plain, mut slow, mut runs) = (f64::INFINITY, f64::INFINITY, 0);
    time_of(&mut renderer, "raycast_volume")?;
    while runs < RUNS && (runs < 3 || slow < 1.5 * plain) {
        context.faults.slow_down("raycast_volume", 1);
        plain = plain.min(time_of(&mut renderer, "raycast_volume")?);
        context.faults.slow_down("raycast_volume", 3);
        slow = slow.min(time_of(&mut renderer, "raycast_volume")?);
        runs += 1;
    }
    context.faults.slow_down("", 1);
    let times = slow / plain;
    found.expect(times > 1.5, || {
        format!("'raycast_volume' three times takes {slow:.0} ns, once {plain:.0} ns: the least of {runs} runs")
    });
    found.figures.push(passing("as long as once", times, Unit::Value));
    drop(renderer);
    aside.tell(&mut found);
    Ok(found)
}

/// Table, times and picture of a device whose stamps are said to be others.
fn as_if(
    bench: &Bench,
    found: &mut Found,
    change: fn(&mut Context),
) -> Result<(String, Vec<PassTime>, Picture), GpuError> {
    let aside = IsolatedContext::lacking(bench, change)?;
    let context: &Arc<Context> = &aside.context;
    let scene = picture_scene("mode = 'vr'\npicture = { size = [96, 96] }")?;
    let mut renderer = drawn::sent(context, &scene, &wall(&scene, 0), &RendererOptions::default())?;
    let picture = renderer.picture()?;
    let times = renderer.take_times()?;
    drop(renderer);
    aside.tell(found);
    Ok((pass_time_table(&times, &scene), times, picture))
}

/// A device without time stamps says so and draws the same; one of 36 bits, or with another period, has its times all the same.
fn others(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let (table, own, picture) = as_if(bench, &mut found, |_| ())?;
    let none = as_if(bench, &mut found, |c| c.candidate.queues.iter_mut().for_each(|q| q.valid_bits = 0))?;
    same(&mut found, "without time stamps", &picture, &none.2);
    let says_so = none.1.is_empty() && none.0.contains("no time stamps") && !none.0.contains("raycast");
    found.expect(says_so, || format!("without time stamps the times are: {}", none.0));
    if !has_stamps(&bench.context) {
        found.expect(table.contains("no time stamps"), || format!("without time stamps the times are: {table}"));
        found.notes.push(NONE.into());
        return Ok(found);
    }
    let masked =
        as_if(bench, &mut found, |c| c.candidate.queues.iter_mut().for_each(|q| q.valid_bits = q.valid_bits.min(36)))?
            .1;
    let names = |times: &[PassTime]| times.iter().map(|t| t.name).collect::<Vec<_>>();
    found.expect(names(&masked) == names(&own), || format!("of 36 bits: times of {:?}", names(&masked)));
    // Ticks of a counter of 36 bits, whatever the period.
    let most = f64::from(bench.context.limits.timestamp_period) * (1u64 << 36) as f64;
    for time in &masked {
        let holds = (0.0..=most * f64::from(time.runs)).contains(&time.total);
        found.expect(holds, || format!("of 36 bits: '{}' takes {} ns", time.name, time.total));
    }
    let longer = as_if(bench, &mut found, |c| c.limits.timestamp_period *= 1000.0)?.1;
    let sum = |times: &[PassTime]| times.iter().map(|t| t.total).sum::<f64>();
    let times = sum(&longer) / sum(&own);
    // One run each: the machine may have done something else in either.
    found.expect((10.0..100_000.0).contains(&times), || {
        format!("a period of a thousand makes times {times:.1} as long")
    });
    found.figures.push(passing("a thousandfold period", times, Unit::Value));
    Ok(found)
}
