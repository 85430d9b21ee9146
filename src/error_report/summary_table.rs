//! A report of errors as text, one line a place of a dial.

use super::{Measure, Reference, Report};
use std::fmt::Write as _;

/// Places by dial: error, time, and both in shares of the scene's as it is.
pub fn table(report: &Report, measure: Measure) -> String {
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
            Reference::F64 => "the f64 reference".to_string(),
            Reference::Converged { set, rmse } => {
                format!("the device's own at {}, itself off by about {rmse:.1e}", set.join(" "))
            }
        };
        let unit = if dial.unit.is_empty() { String::new() } else { format!(", {}", dial.unit) };
        let _ = writeln!(text, "\n{}{unit}: against {held}", dial.name);
        let _ = writeln!(
            text,
            "  {:<16} {:>10} {:>10} {:>7} {:>8} {:>9} {:>9}   {:>9} {:>19} {:>6}",
            "",
            measure.name(),
            "largest",
            "PSNR",
            "SSIM",
            "mm RMS",
            "deg RMS",
            "ms",
            "least..most",
            "ratio"
        );
        let base = dial.points.iter().find(|p| p.is_default).and_then(|p| p.time);
        for point in &dial.points {
            let e = &point.errors;
            let or = |v: Option<f64>, digits: usize| v.map_or("-".into(), |v| format!("{v:.digits$}"));
            let rms =
                |s: &Option<super::metrics::SurfaceError>| s.as_ref().and_then(|s| s.error.as_ref()).map(|s| s.rms);
            let time = match point.time {
                Some(t) => {
                    let ratio = base.filter(|b| b.median > 0.0).map(|b| t.median / b.median);
                    let span = format!("{:.3}..{:.3}", t.low * 1e-6, t.high * 1e-6);
                    format!("{:>9.3} {span:>19} {:>6}", t.median * 1e-6, or(ratio, 2))
                }
                None => format!("{:>9}", "no stamps"),
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
    text.push_str("\n* the scene as it is\n");
    text
}
