//! An error report as text: CSV for other programs, and a summary table for a terminal.

use super::convergence::Fit;
use super::metrics::SurfaceError;
use super::{Errors, Measure, Reference, Report, Time, Times, choose};
use crate::text::csv_field;
use std::fmt::Write as _;

/// The report as CSV (RFC 4180): a header, then one line for each point. Fields that do not apply are empty. Times are in ms. `on_front` is true for
/// the points of the Pareto front of RMSE and time over all dials but looks.
pub fn csv(report: &Report) -> String {
    let front = report.pareto_front(Measure::Rmse);
    let mut text = String::from(
        "dial,unit,value,label,set,default,rmse,max,psnr_db,ssim,levels_rms,levels_median,levels_p95,levels_max,share_over_1_level,share_over_8_levels,\
         mm_rms,mm_median,mm_p95,mm_max,lost,gained,jumps,deg_rms,deg_median,deg_p95,deg_max,time_ms,time_low_ms,time_high_ms,volume_ms,picture_ms,ratio,ratio_low,ratio_high,on_front,\
         reference,reference_rmse,device,driver,date,repeats\r\n",
    );
    for (d, dial) in report.dials.iter().enumerate() {
        for (p, point) in dial.points.iter().enumerate() {
            let (e, number) = (&point.errors, |v: Option<f64>| v.map_or(String::new(), |v| v.to_string()));
            let mut row = vec![dial.name.clone(), dial.unit.clone(), point.value.to_string(), point.label.clone()];
            row.extend([point.set.join("; "), point.is_default.to_string()]);
            row.extend([Some(e.rmse), Some(e.max), e.psnr, e.ssim].map(number));
            let l = e.levels;
            row.extend([l.rms, l.median, l.p95, l.max, l.over_1, l.over_8].map(|v| v.to_string()));
            for (surface, of_rays) in [(e.mm, true), (e.degrees, false)] {
                let spread = surface.and_then(|s| s.error);
                row.extend([spread.map(|s| s.rms), spread.map(|s| s.median)].map(number));
                row.extend([spread.map(|s| s.p95), spread.map(|s| s.max)].map(number));
                if of_rays {
                    row.extend([surface.map(|s| s.missed_hits), surface.map(|s| s.false_hits)].map(number));
                    row.push(number(surface.map(|s| s.jumps)));
                }
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
                Reference::Extrapolated { set, cells, rmse, .. } => {
                    [format!("extrapolated over cells of {}: {}", in_mm(cells), set.join("; ")), rmse.to_string()]
                }
            });
            row.extend([&report.device, &report.driver, &report.date].map(String::clone));
            row.push(report.repeats.to_string());
            text.push_str(&row.iter().map(|field| csv_field(field)).collect::<Vec<_>>().join(","));
            text.push_str("\r\n");
        }
    }
    text
}

fn in_mm([coarse, middle, fine]: &[f64; 3]) -> String {
    format!("{coarse:.3}, {middle:.3} and {fine:.3} mm")
}

/// The reference of a dial or budget, in words.
fn held(reference: &Reference) -> String {
    match reference {
        Reference::F64 => "against the f64 reference".to_string(),
        Reference::Exact { estimate, pieces } => {
            format!("against exact rays of {pieces} pieces, by their own estimate good to {estimate:.1e}")
        }
        Reference::AsItIs => "difference from the scene as it is; another look is no error".to_string(),
        Reference::Converged { set, rmse } => {
            format!("against the device's own at {}, itself off by about {rmse:.1e}", set.join(" "))
        }
        Reference::Extrapolated { set, cells, order, rmse } => format!(
            "against the device's own at {}, extrapolated over light cells of {} with order {order:.1}, itself off by about {rmse:.1e}",
            set.join(" "),
            in_mm(cells)
        ),
    }
}

/// The head of the columns of [`errors_row`].
fn errors_head(measure: Measure, has_surface: bool) -> String {
    // The columns of the picture are always there; those of other measures are of the surface.
    let first = if measure == Measure::Levels { Measure::Rmse } else { measure };
    let first = first.name().split(" of").next().unwrap_or_default();
    // The columns are as wide as those of `errors_row`.
    let surface = if has_surface { " median mm     lost   gained    jumps  deg RMS" } else { "" };
    format!("{first:>10}   largest median lv    p95 lv   > 1 lv   > 8 lv    PSNR    SSIM{surface}")
}

/// The errors of a picture as columns of a table: before tone, in levels of 255 after it, and of the surface.
fn errors_row(e: &Errors, measure: Measure, has_surface: bool) -> String {
    let first = if measure == Measure::Levels { Measure::Rmse } else { measure };
    let or = |v: Option<f64>, digits: usize| v.map_or("-".into(), |v| format!("{v:.digits$}"));
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let mut text = format!(
        "{:>10} {:>9.2e} {:>9.3} {:>9.3} {:>8} {:>8} {:>7} {:>7}",
        first.of(e).map_or("-".into(), |v| format!("{v:.2e}")),
        e.max,
        e.levels.median,
        e.levels.p95,
        percent(e.levels.over_1),
        percent(e.levels.over_8),
        or(e.psnr, 1),
        or(e.ssim, 4),
    );
    if has_surface {
        let spread = |s: &Option<SurfaceError>| s.as_ref().and_then(|s| s.error);
        let share = |of: fn(&SurfaceError) -> f64| e.mm.as_ref().map_or("-".into(), |mm| percent(of(mm)));
        let _ = write!(
            text,
            " {:>9} {:>8} {:>8} {:>8} {:>8}",
            or(spread(&e.mm).map(|s| s.median), 4),
            share(|mm| mm.missed_hits),
            share(|mm| mm.false_hits),
            share(|mm| mm.jumps),
            or(spread(&e.degrees).map(|s| s.rms), 2)
        );
    }
    text
}

/// The report as tables of text. Each point of a dial has its errors, its times of volume and picture, and the ratio of both together to those of the
/// scene's own setting. Then follow the error budget and the Pareto front of the combinations by `measure`.
pub fn summary_table(report: &Report, measure: Measure) -> String {
    let mut text = String::new();
    let [w, h, k] = report.sizes.volume;
    let [x, y] = report.sizes.picture;
    let has_surface =
        report.budget.total.mm.is_some() || report.dials.iter().flat_map(|d| &d.points).any(|p| p.errors.mm.is_some());
    let _ = writeln!(text, "device   {}, {}", report.device, report.driver);
    let interval = if report.repeats < 6 { "from the shortest to the longest" } else { "95 % intervals of the median" };
    let _ = writeln!(
        text,
        "sizes    volume {w} x {h} x {k}, picture {x} x {y}; {} runs a place in turn with the scene as it is, {interval}, {}",
        report.repeats, report.date
    );
    let head = errors_head(measure, has_surface);
    for dial in &report.dials {
        let unit = if dial.unit.is_empty() { String::new() } else { format!(", {}", dial.unit) };
        let _ = writeln!(text, "\n{}{unit}: {}", dial.name, held(&dial.reference));
        let _ = writeln!(text, "  {:<16} {head}   {:>9} {:>9} {:>18}", "", "volume ms", "picture", "ratio");
        for point in &dial.points {
            let time = match (point.times, point.ratios.map(|r| r.total)) {
                (Some(t), Some(r)) => {
                    let (volume, picture) = (t.volume.median * 1e-6, t.picture.median * 1e-6);
                    let ratio = format!("{:.2} ({:.2}..{:.2})", r.median, r.low, r.high);
                    format!("{volume:>9.3} {picture:>9.3} {ratio:>18}")
                }
                _ => format!("{:>9}", "no stamps"),
            };
            let mark = if point.is_default { "*" } else { " " };
            let errors = errors_row(&point.errors, measure, has_surface);
            let _ = writeln!(text, "{mark} {:<16} {errors}   {time}", point.label);
        }
        if let Some(note) = &dial.note {
            let _ = writeln!(text, "  {note}");
        }
        if let Some(Fit { order, standard_error, points, .. }) = &dial.order {
            let _ = writeln!(text, "  order {order:.2} +- {standard_error:.2} over {points} places");
        }
        if let Some(floor) = dial.floor {
            let _ = writeln!(text, "  the device's own floor, its arithmetic and formats alone: RMSE {floor:.1e}");
        }
    }
    text.push_str(
        "\n* the scene as it is; ratio: of volume and picture together to those of the scene as it is, run in turn; lv: levels of 255 after tone\n",
    );
    budget_table(&mut text, report, measure, has_surface);
    let front = choose::front(report, measure);
    if !front.is_empty() {
        let own = report.choices.first().map_or(0.0, |c| c.reference_error.rmse);
        let limit = if own > 0.0 { format!(", itself off by about {own:.1e}") } else { String::new() };
        let _ = writeln!(
            text,
            "\nchoices, {} settings of one dial and of several rendered and measured against the scene's finest picture{limit}; the Pareto front:",
            report.choices.len()
        );
        for choice in front.into_iter().map(|i| &report.choices[i]) {
            let _ = writeln!(text, "  {}", choice.describe(measure));
        }
    }
    text
}

/// What each approximation adds to the error of the scene.
fn budget_table(text: &mut String, report: &Report, measure: Measure, has_surface: bool) {
    let budget = &report.budget;
    let against = held(&budget.reference);
    let _ = writeln!(text, "\nerror budget: each approximation alone, the others as fine as they get; {against}");
    let _ = writeln!(text, "  {:<16} {}", "", errors_head(measure, has_surface));
    for share in &budget.shares {
        let name = format!("{} {}", share.source, if share.source == super::budget::FLOOR { "" } else { &share.label });
        let _ = writeln!(text, "  {:<16} {}", name.trim(), errors_row(&share.errors, measure, has_surface));
    }
    let _ = writeln!(text, "* {:<16} {}", "together", errors_row(&budget.total, measure, has_surface));
    let (sum, together) = (budget.sum(), budget.total.rmse);
    let _ = writeln!(text, "  root of the sum of their squares: RMSE {sum:.2e}; measured together: {together:.2e}");
}
