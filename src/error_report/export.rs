//! An error report as text: CSV for other programs, a summary table for a terminal.

use super::metrics::SurfaceError;
use super::{Measure, Reference, Report, Time, Times, choose};
use std::fmt::Write as _;

/// The report as CSV (RFC 4180): a header, then one line per point. Fields that do not apply are empty; times are in ms. `on_front`:
/// no other point of the report has both a smaller RMSE and a shorter time.
pub fn csv(report: &Report) -> String {
    let front = report.pareto_front(Measure::Rmse);
    let mut text = String::from(
        "dial,unit,value,label,set,default,rmse,max,psnr_db,ssim,mm_rms,mm_median,mm_p95,mm_max,mm_false_hits,mm_missed_hits,\
         deg_rms,deg_median,deg_p95,deg_max,deg_false_hits,deg_missed_hits,time_ms,time_low_ms,time_high_ms,volume_ms,picture_ms,ratio,ratio_low,ratio_high,on_front,\
         reference,reference_rmse,device,driver,date,repeats\r\n",
    );
    for (d, dial) in report.dials.iter().enumerate() {
        for (p, point) in dial.points.iter().enumerate() {
            let (e, number) = (&point.errors, |v: Option<f64>| v.map_or(String::new(), |v| v.to_string()));
            let mut row = vec![dial.name.clone(), dial.unit.clone(), point.value.to_string(), point.label.clone()];
            row.extend([point.set.join("; "), point.is_default.to_string()]);
            row.extend([Some(e.rmse), Some(e.max), e.psnr, e.ssim].map(number));
            for surface in [e.mm, e.degrees] {
                let spread = surface.and_then(|s| s.error);
                row.extend([spread.map(|s| s.rms), spread.map(|s| s.median)].map(number));
                row.extend([spread.map(|s| s.p95), spread.map(|s| s.max)].map(number));
                row.extend([surface.map(|s| s.false_hits), surface.map(|s| s.missed_hits)].map(number));
            }
            let ms = |of: fn(&Times) -> f64| number(point.times.as_ref().map(|t| of(t) * 1e-6));
            row.extend([ms(|t| t.total.median), ms(|t| t.total.low), ms(|t| t.total.high)]);
            row.extend([ms(|t| t.volume.median), ms(|t| t.picture.median)]);
            let ratio = |of: fn(&Time) -> f64| number(point.ratios.as_ref().map(|r| of(&r.total)));
            row.extend([ratio(|r| r.median), ratio(|r| r.low), ratio(|r| r.high)]);
            row.push(front.contains(&(d, p)).to_string());
            row.extend(match &dial.reference {
                Reference::F64 => ["f64".into(), String::new()],
                Reference::Exact { estimate, .. } => ["exact rays".into(), estimate.to_string()],
                Reference::AsItIs => ["the scene as it is: another look, no error".into(), String::new()],
                Reference::Converged { set, rmse } => [format!("converged: {}", set.join("; ")), rmse.to_string()],
            });
            row.extend([&report.device, &report.driver, &report.date].map(String::clone));
            row.push(report.repeats.to_string());
            text.push_str(&row.iter().map(|field| quoted(field)).collect::<Vec<_>>().join(","));
            text.push_str("\r\n");
        }
    }
    text
}

fn quoted(field: &str) -> String {
    match field.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", field.replace('"', "\"\"")),
        false => field.to_string(),
    }
}

/// The points of each dial as a table: errors, time, and the ratio of the time to that of the default.
pub fn summary_table(report: &Report, measure: Measure) -> String {
    let mut text = String::new();
    let [w, h, k] = report.sizes.volume;
    let [x, y] = report.sizes.picture;
    let _ = writeln!(text, "device   {}, {}", report.device, report.driver);
    let _ = writeln!(
        text,
        "sizes    volume {w} x {h} x {k}, picture {x} x {y}; {} runs a place, {}",
        report.repeats, report.date
    );
    for dial in &report.dials {
        let held = match &dial.reference {
            Reference::F64 => "against the f64 reference".to_string(),
            Reference::Exact { estimate, pieces } => {
                format!("against exact rays of {pieces} pieces, by their own estimate good to {estimate:.1e}")
            }
            Reference::AsItIs => "difference from the scene as it is; another look is no error".to_string(),
            Reference::Converged { set, rmse } => {
                format!("against the device's own at {}, itself off by about {rmse:.1e}", set.join(" "))
            }
        };
        let unit = if dial.unit.is_empty() { String::new() } else { format!(", {}", dial.unit) };
        let _ = writeln!(text, "\n{}{unit}: {held}", dial.name);
        let _ = writeln!(
            text,
            "  {:<16} {:>10} {:>10} {:>7} {:>8} {:>9} {:>9}   {:>9} {:>9} {:>18}",
            "",
            measure.name().split(" of").next().unwrap_or_default(),
            "largest",
            "PSNR",
            "SSIM",
            "mm RMS",
            "deg RMS",
            "volume ms",
            "picture",
            "ratio"
        );
        for point in &dial.points {
            let e = &point.errors;
            let or = |v: Option<f64>, digits: usize| v.map_or("-".into(), |v| format!("{v:.digits$}"));
            let rms = |s: &Option<SurfaceError>| s.as_ref().and_then(|s| s.error.as_ref()).map(|s| s.rms);
            let time = match (point.times, point.ratios.map(|r| r.total)) {
                (Some(t), Some(r)) => {
                    let (volume, picture) = (t.volume.median * 1e-6, t.picture.median * 1e-6);
                    let ratio = format!("{:.2} ({:.2}..{:.2})", r.median, r.low, r.high);
                    format!("{volume:>9.3} {picture:>9.3} {ratio:>18}")
                }
                _ => format!("{:>9}", "no stamps"),
            };
            let _ = writeln!(
                text,
                "{} {:<16} {:>10} {:>10.2e} {:>7} {:>8} {:>9} {:>9}   {time}",
                if point.is_default { "*" } else { " " },
                point.label,
                measure.of(e).map_or("-".into(), |v| format!("{v:.2e}")),
                e.max,
                or(e.psnr, 1),
                or(e.ssim, 4),
                or(rms(&e.mm), 3),
                or(rms(&e.degrees), 2),
            );
        }
        if let Some(note) = &dial.note {
            let _ = writeln!(text, "  {note}");
        }
        if let Some(order) = &dial.order {
            let _ = writeln!(
                text,
                "  order {:.2} +- {:.2} over {} places",
                order.order, order.standard_error, order.points
            );
        }
        if let Some(floor) = dial.floor {
            let _ = writeln!(text, "  the device's own floor, its arithmetic and formats alone: RMSE {floor:.1e}");
        }
    }
    text.push_str(
        "\n* the scene as it is; ratio: of volume and picture together to those of the scene as it is, run in turn\n",
    );
    let front = choose::front(report, measure);
    if !front.is_empty() {
        let own = report.choices.first().map_or(0.0, |c| c.reference_error);
        let limit = if own > 0.0 { format!(", itself off by about {own:.1e}") } else { String::new() };
        let _ = writeln!(
            text,
            "\ncombinations, {} rendered and measured against the scene's finest picture{limit}; the Pareto front:",
            report.choices.len()
        );
        for choice in front.into_iter().map(|i| &report.choices[i]) {
            let _ = writeln!(text, "  {}", choice.describe(measure));
        }
    }
    text
}
