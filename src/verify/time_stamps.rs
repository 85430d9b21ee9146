//! Group "time stamps": their bits and period, that they increase and lie within the interval in which the host waited, and that slower
//! passes have longer times. There are no absolute time limits. Of several runs the least disturbed one counts, so that a busy machine
//! causes no failure.

use super::built_in::{BYTES, scene, wall, wobbler};
use super::compare::{count_figure, expect_same_picture};
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions, TimeStamps};
use crate::passes::times::pass_time_table;
use crate::passes::{PassTime, Span};
use crate::picture::Picture;
use crate::probe::Geometry;
use crate::report::{Fault, Figure, Level, Unit};
use crate::scene::Scene;
use std::sync::Arc;

/// Maximum number of runs until one is undisturbed.
const MAX_RUNS: usize = 15;

pub fn checks(_: Level) -> Vec<Check> {
    let of = |name: &str, work: fn(&mut DeviceUnderTest) -> Result<Findings, GpuError>| {
        Check::new("time stamps", name, work)
    };
    vec![
        of("bits and period", bits_and_period),
        of("within submission and wait", within),
        of("a pass slowed down three times", slowed),
        of("other bits and another period", others),
    ]
}

/// An informative figure that depends on the load of the machine, so it is never compared.
fn load_dependent(what: &str, value: f64, unit: Unit) -> Figure {
    Figure { fleeting: true, ..Figure::informative(what, value, unit) }
}

fn picture_scene(toml: &str) -> Result<Scene, GpuError> {
    scene(Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)
}

fn has_stamps(context: &Context) -> bool {
    context.candidate.valid_bits() > 0
}

/// Each pass is timed.
fn timed() -> RendererOptions {
    RendererOptions { time_stamps: TimeStamps::EachPass, ..RendererOptions::default() }
}

const NONE: &str = "this device has no time stamps";

/// Vulkan allows 0 or 36 to 64 bits; the period must be positive.
fn bits_and_period(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, context) = (Findings::default(), &dut.context);
    for (n, queue) in context.candidate.queues.iter().enumerate() {
        let bits = queue.valid_bits;
        findings.expect(bits == 0 || (36..=64).contains(&bits), || format!("queue {n}: time stamps of {bits} bits"));
        findings.figures.push(count_figure(&format!("bits of queue {n}"), bits as usize));
    }
    let period = f64::from(context.candidate.limits.timestamp_period);
    findings.expect(!has_stamps(context) || (period > 0.0 && period.is_finite()), || format!("a tick of {period} ns"));
    findings.figures.push(Figure::informative("period", period, Unit::Ns));
    if !has_stamps(context) {
        findings.notes.push(NONE.into());
    }
    Ok(findings)
}

/// Checks the spans of one picture: the host spans `submit` and `wait`, and the device spans in running order. Returns two shares of the time
/// from submission to the end of the wait: the sum of all device spans, and the longer of the times by which they begin before it or end after
/// it.
///
/// # Errors
/// One line: what is wrong with the spans.
pub fn check_spans(spans: &[Span]) -> Result<[f64; 2], String> {
    let host = |name: &str| spans.iter().find(|s| s.name == name && !s.on_device).ok_or(format!("no '{name}'"));
    let (from, to) = (host("submit")?.begin, host("wait")?.end);
    let passes: Vec<&Span> = spans.iter().filter(|s| s.on_device).collect();
    let (Some(first), Some(last)) = (passes.first(), passes.last()) else {
        return Err("the device stamped nothing".into());
    };
    let host = to - from;
    for span in &passes {
        let took = span.end - span.begin;
        // A time stamp before its predecessor, or a counter that wrapped.
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

/// The device spans of a submission cover the time from submission to idle and lie within it.
fn within(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let context = &dut.context;
    if !has_stamps(context) {
        return Ok(Findings::left_out(NONE));
    }
    let mut findings = Findings::default();
    let toml = "mode = 'sr'\npicture = { size = [192, 192] }\nslices = { pixels = 64 }\nray = { step = 0.1 }\ndistance = { median = 9 }";
    let scene = picture_scene(toml)?;
    let options = RendererOptions { spans: true, ..timed() };
    // The first picture compiles shaders.
    let mut renderer = render::sent(context, &scene, &wall(&scene, 0), &options)?;
    renderer.picture()?;
    let (mut shares, mut outside) = (Vec::new(), Vec::new());
    for _ in 0..5 {
        renderer.show(0)?;
        renderer.take_spans()?;
        renderer.picture()?;
        let spans = renderer.take_spans()?;
        match check_spans(&spans) {
            Ok([share, out]) => {
                shares.push(share);
                outside.push(out);
            }
            Err(fault) => findings.faults.push(Fault::new(fault)),
        }
        for name in ["raycast_surface", "light"] {
            let counted = spans.iter().find(|s| s.name == name && s.on_device).map(|s| s.invocations);
            let expected = context.candidate.pipeline_statistics.then_some(192 * 192);
            findings.expect(counted == Some(expected), || {
                format!("{name}: expected {expected:?} invocations, got {counted:?}")
            });
        }
    }
    let best = shares.iter().copied().fold(0.0, f64::max);
    let least = outside.iter().copied().fold(f64::INFINITY, f64::min);
    findings.expect(shares.is_empty() || best > 0.2, || {
        format!("at most {best:.3} of the time from submission to idle is stamped")
    });
    if context.candidate.calibrated_timestamps {
        findings.expect(outside.is_empty() || least < 0.5, || {
            format!("by the device's clock passes ran outside submission and wait, by {least:.2} of it at least")
        });
    }
    if best < 0.9 {
        findings.notes.push("the host was not idle, or is slow to submit and to wake up".into());
    }
    findings.figures.push(Figure { samples: shares, ..load_dependent("share that is stamped", best, Unit::Share) });
    findings.figures.push(load_dependent("share outside", if least.is_finite() { least } else { 0.0 }, Unit::Share));
    Ok(findings)
}

/// Time of one pass in one picture, ns; 0 if it did not run.
fn time_of(renderer: &mut Renderer, name: &str) -> Result<f64, GpuError> {
    renderer.take_times()?;
    renderer.show(0)?;
    renderer.picture()?;
    Ok(renderer.take_times()?.iter().find(|t| t.name == name).map_or(0.0, |t| t.total))
}

/// A pass that runs three times takes longer. The minimum times are compared, since other load only adds time.
fn slowed(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let isolated = IsolatedContext::new(dut)?;
    let context = &isolated.context;
    if !has_stamps(context) {
        return Ok(Findings::left_out(NONE));
    }
    let mut findings = Findings::default();
    let scene =
        picture_scene("mode = 'vr'\npicture = { size = [192, 192] }\nslices = { pixels = 64 }\nray = { step = 0.2 }")?;
    let mut renderer = render::sent(context, &scene, &wall(&scene, 0), &timed())?;
    let (mut plain, mut slow, mut runs) = (f64::INFINITY, f64::INFINITY, 0);
    time_of(&mut renderer, "raycast_volume")?;
    while runs < MAX_RUNS && (runs < 3 || slow < 1.5 * plain) {
        context.faults.slow_down("raycast_volume", 1);
        plain = plain.min(time_of(&mut renderer, "raycast_volume")?);
        context.faults.slow_down("raycast_volume", 3);
        slow = slow.min(time_of(&mut renderer, "raycast_volume")?);
        runs += 1;
    }
    context.faults.slow_down("", 1);
    let times = slow / plain;
    findings.expect(times > 1.5, || {
        format!("'raycast_volume' three times takes {slow:.0} ns, once {plain:.0} ns: the least of {runs} runs")
    });
    findings.figures.push(load_dependent("as long as once", times, Unit::Value));
    drop(renderer);
    isolated.report_validation(&mut findings);
    Ok(findings)
}

/// Table, times and picture on a context whose time stamp properties are changed.
fn as_if(
    dut: &DeviceUnderTest,
    findings: &mut Findings,
    change: fn(&mut Context),
) -> Result<(String, Vec<PassTime>, Picture), GpuError> {
    let isolated = IsolatedContext::lacking(dut, change)?;
    let context: &Arc<Context> = &isolated.context;
    let scene = picture_scene("mode = 'vr'\npicture = { size = [96, 96] }")?;
    let mut renderer = render::sent(context, &scene, &wall(&scene, 0), &timed())?;
    let picture = renderer.picture()?;
    let times = renderer.take_times()?;
    drop(renderer);
    isolated.report_validation(findings);
    Ok((pass_time_table(&times, &scene), times, picture))
}

/// Without time stamps the table says so and the picture is the same; with 36 bits or another period there are still times.
fn others(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let (table, own, picture) = as_if(dut, &mut findings, |_| ())?;
    let none = as_if(dut, &mut findings, |c| c.candidate.queues.iter_mut().for_each(|q| q.valid_bits = 0))?;
    expect_same_picture(&mut findings, "without time stamps", &picture, &none.2);
    let says_so = none.1.is_empty() && none.0.contains("no time stamps") && !none.0.contains("raycast");
    findings.expect(says_so, || format!("without time stamps the times are: {}", none.0));
    if !has_stamps(&dut.context) {
        findings.expect(table.contains("no time stamps"), || format!("without time stamps the times are: {table}"));
        findings.notes.push(NONE.into());
        return Ok(findings);
    }
    let masked =
        as_if(dut, &mut findings, |c| c.candidate.queues.iter_mut().for_each(|q| q.valid_bits = q.valid_bits.min(36)))?
            .1;
    let names = |times: &[PassTime]| times.iter().map(|t| t.name).collect::<Vec<_>>();
    findings.expect(names(&masked) == names(&own), || format!("of 36 bits: times of {:?}", names(&masked)));
    // The range of a counter of 36 bits.
    let most = f64::from(dut.context.candidate.limits.timestamp_period) * (1u64 << 36) as f64;
    for time in &masked {
        let holds = (0.0..=most * f64::from(time.runs)).contains(&time.total);
        findings.expect(holds, || format!("of 36 bits: '{}' takes {} ns", time.name, time.total));
    }
    let longer = as_if(dut, &mut findings, |c| c.candidate.limits.timestamp_period *= 1000.0)?.1;
    let sum = |times: &[PassTime]| times.iter().map(|t| t.total).sum::<f64>();
    let times = sum(&longer) / sum(&own);
    // A wide range: there is one run each, and either may be disturbed.
    findings.expect((10.0..100_000.0).contains(&times), || {
        format!("a period of a thousand makes times {times:.1} as long")
    });
    findings.figures.push(load_dependent("a thousandfold period", times, Unit::Value));
    Ok(findings)
}
