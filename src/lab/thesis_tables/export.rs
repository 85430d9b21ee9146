//! The thesis' tables as Markdown and as CSV.

use super::growth::{Grown, Growth, THESIS};
use super::{
    Conditions, DEPTH, FAN_ANGLE, Filter3d, Report, Row, SAMPLES, SECTOR_ANGLE, SOUND_SPEED, Spread, THESIS_BANDWIDTH,
    Table,
};
use crate::passes::times::acquisition_floor;
use crate::scene::Estimator;
use crate::text::{csv_quoted, markdown_table, markdown_text};
use std::fmt::Write as _;

/// Tables 3-6 and the comparison of pipelines as CSV: a header, and one line for each row. Times are in ms; a missing one is an empty field.
pub fn tables_csv(report: &Report) -> String {
    let mut text = String::from(
        "table,varied,value,usual,picture_ms,picture_least_ms,picture_most_ms,ratio,thesis_ms,thesis_ratio,stage_1_ms,\
         stage_1_least_ms,stage_1_most_ms,surface_mm,surface_share,repeats,frames,lines,samples,volume,picture,filter_3d,filter_2d,composited,\
         device,driver,date\n",
    );
    for table in &report.tables {
        for (n, row) in table.rows.iter().enumerate() {
            text.push_str(&csv_row(report, table, row, n == table.usual));
        }
    }
    text
}

fn csv_row(report: &Report, table: &Table, row: &Row, usual: bool) -> String {
    let c = row.conditions;
    let number = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.6}"));
    let three = |ns: &[f64]| {
        let spread = Spread::new(ns);
        [spread.map(|s| s.median), spread.map(|s| s.min), spread.map(|s| s.max)].map(number)
    };
    let table_number = table.number.map_or(String::new(), |n| n.to_string());
    let mut fields = vec![table_number, table.varied.into(), csv_quoted(&row.label), usual.to_string()];
    fields.extend(three(&row.times.picture));
    fields.extend([number(table.ratio(row)), row.thesis.ms.to_string(), number(table.thesis_ratio(row))]);
    fields.extend(three(&row.times.preprocess));
    fields.extend([row.reached.map(|r| r.depth), row.reached.map(|r| r.share)].map(number));
    fields.extend([report.repeats, c.frames, c.lines, SAMPLES].map(|n| n.to_string()));
    fields.extend([c.volume, c.picture].map(|n| n.to_string()));
    fields.extend([c.filter_3d.name(), c.filter_2d.to_string(), c.is_composited.to_string()]);
    fields.extend([&report.device.name, &report.device.driver, &report.date].map(|t| csv_quoted(t)));
    fields.join(",") + "\n"
}

/// Tables 7-9 as CSV: a header, and one line for each picture, centre, sigma, pair of starting and largest window, and number of pixels by which the
/// window's edge grew. Shares are 0..1.
pub fn growth_csv(grown: &[Grown]) -> String {
    let mut text = String::from("picture,centre,sigma,window,largest,grew,share\n");
    for picture in grown {
        for row in &picture.rows {
            for n in 0..row.counts.len() {
                let share = row.share(n).unwrap_or(0.0);
                let [window, largest] = row.windows;
                let name = csv_quoted(&picture.picture);
                let (centre, sigma) = (row.centre.name(), row.sigma);
                let _ = writeln!(text, "{name},{centre},{sigma},{window},{largest},{},{share:.6}", 2 * n);
            }
        }
    }
    text
}

/// The thesis' example of the acquisition floor: frames, lines.
const THESIS_FLOOR: [usize; 2] = [35, 64];

/// Travel time of sound for a volume, s: 2 d / c per line (thesis 4.5).
fn acquisition(frames: usize, lines: usize) -> f64 {
    (frames * lines) as f64 * 2.0 * DEPTH * 1e-3 / SOUND_SPEED
}

fn ms(value: f64) -> String {
    format!("{value:.3}")
}

/// The report as Markdown: conditions, Tables 3-6 with the values of the thesis, notes, and Tables 7-9 for every picture.
pub fn markdown(report: &Report) -> String {
    let mut text = String::from("# Tables of the thesis on this device\n\n");
    conditions(&mut text, report);
    for table in &report.tables {
        let title = table.number.map_or("The usual row".into(), |n| format!("Table {n}"));
        let _ = write!(text, "\n## {title}: {}\n\n{}", table.varied, markdown_table(&rows(table)));
    }
    text.push('\n');
    for note in notes(report) {
        let _ = writeln!(text, "- {note}");
    }
    report.grown.iter().for_each(|grown| growth(&mut text, grown));
    text
}

fn conditions(text: &mut String, report: &Report) {
    let device = &report.device;
    let software = if device.is_software { " (software: computes on the CPU)" } else { "" };
    let clocks = device.clocks.as_deref().map_or(String::new(), |c| format!("; {c}"));
    let usual = Conditions::usual(report.quick);
    let n = usual.volume;
    let [name, driver, api, clocks, program, date] =
        [&device.name, &device.driver, &device.api, &clocks, &report.program, &report.date].map(|t| markdown_text(t));
    let _ = writeln!(text, "- device: {name}{software}, {driver}, Vulkan {api}{clocks}; {program}; {date}");
    if report.quick {
        let _ = writeln!(
            text,
            "- quick: every volume has a quarter of the thesis' edge, so the times do not compare with its figures"
        );
    }
    let _ = writeln!(
        text,
        "- conditions, each unless varied: surface mode, {} frames of {} lines x {SAMPLES} samples, sector {SECTOR_ANGLE} deg, \
         fan {FAN_ANGLE} deg, depth {DEPTH} mm; volume {n}^3: slices of {n} x {n}, {n} samples on a ray from the face to the \
         last sample, picture {n} x {n}; 3D filter {}; 2D filter {m}x{m}",
        usual.frames,
        usual.lines,
        usual.filter_3d.name(),
        m = usual.filter_2d,
    );
    let _ = writeln!(
        text,
        "- input: a synthetic sweep, a ball of 90 mm before a wall in fluid; surface: the mean depth below the face at which \
         rays met one, and the share of the rays that did"
    );
    let _ = match report.has_times() {
        true => writeln!(
            text,
            "- times: on the device, ms, median (least..most) of {} after {} to warm up, the rows of a table in turns; \
             * is the row that ratios are to",
            report.repeats, report.warm_up
        ),
        false => writeln!(text, "- times: not known, this device has no time stamps; * is the row that ratios are to"),
    };
}

fn rows(table: &Table) -> Vec<Vec<String>> {
    let head = "stages 2-4, ms|least..most|ratio|thesis, ms|ratio|stage 1, ms|least..most|surface";
    let mut rows = vec![[table.varied].into_iter().chain(head.split('|')).map(String::from).collect()];
    for (n, row) in table.rows.iter().enumerate() {
        let mark = if n == table.usual { " *" } else { "" };
        let ratio = |ratio: Option<f64>| ratio.map_or("-".into(), |r| format!("{r:.2}"));
        let mut cells = vec![format!("{}{mark}", row.label)];
        cells.extend(spread(&row.times.picture));
        cells.push(ratio(table.ratio(row)));
        let thesis = format!("{:.1}", row.thesis.ms);
        cells.push(if row.thesis.from_others { format!("({thesis})") } else { thesis });
        cells.push(ratio(table.thesis_ratio(row)));
        cells.extend(spread(&row.times.preprocess));
        let met = row.reached.map(|r| format!("{:.1} mm, {:.1} %", r.depth, 100.0 * r.share));
        cells.push(met.unwrap_or("-".into()));
        rows.push(cells);
    }
    rows
}

fn spread(ns: &[f64]) -> [String; 2] {
    match Spread::new(ns) {
        Some(s) => [ms(s.median), format!("{}..{}", ms(s.min), ms(s.max))],
        None => ["-".into(), "-".into()],
    }
}

fn notes(report: &Report) -> Vec<String> {
    let usual = Conditions::usual(report.quick);
    let [frames, lines] = THESIS_FLOOR;
    let mut notes = vec![
        "thesis: times on a GTX 650 (4.5; 3.8 says GT 630), per rendered volume. Here that is taken as the time of stages 2-4. Stage 1 of all \
         frames has a column of its own, since frames go through it while they arrive"
            .into(),
        "3D filter along the ray: that of the thesis, computed again for every picture. Slice by slice: a separable Gaussian in stage 1, computed \
         once for each frame"
            .into(),
        "2D filter: the sigma filter on the distance map, in stage 3. The thesis' figures show that its filter ran on pictures: from 3x3 to 11x11 \
         they rise by 2.5 ms. The 112 more fetches of 512 x 512 pixels in that time are 12 G/s, of the 34 G/s of a GTX 650 (32 texture units \
         at 1058 MHz); on 37 slices they would be 430 G/s"
            .into(),
        "brackets: the thesis has no such row. In Table 5 the figure is that of its filter along the ray. Elsewhere it is that of the same \
         conditions in its Tables 3-5, which lies below its 5x5 and 7x7 of Table 6"
            .into(),
        "the thesis composites each ray and filters with the enhanced sigma filter in stages 1, 3 and 4 (4.1, chapter 6), but the tables do \
         not say what was on: the usual row is measured as the least that they name, and as that pipeline"
            .into(),
        "Table 4: 4.5 calls it linear in the volume's size, O(n). Of its figures those of 256, 384 and 512 lie on a line within 0.6 %, which \
         is below 0 at 128. Whether the picture grew with the volume it does not say: both are measured, and neither reading is proven"
            .into(),
        format!("lines: the thesis has 64 to 256; here {}. Stages 2-4 take samples of slices, so that their time does not depend on lines", usual.lines),
        format!("for the usual row {}", acquisition_floor(acquisition(usual.frames, usual.lines), SOUND_SPEED)),
        format!(
            "for the thesis' example, {frames} frames of {lines} lines to {DEPTH} mm, sound needs {:.1} ms (thesis: around 466 ms)",
            acquisition(frames, lines) * 1e3
        ),
    ];
    notes.extend(other_surface(report));
    notes.extend(hardware(report));
    if report.device.is_software && report.has_times() {
        notes.push("a software device stamps times by the CPU's clock, and shares the CPU with everything else".into());
    }
    notes
}

/// What the filter kept slice by slice finds, beside the one along the ray.
fn other_surface(report: &Report) -> Option<String> {
    let table = report.tables.iter().find(|t| t.number == Some(5))?;
    let depths = |is_wanted: fn(&Filter3d) -> bool| -> Option<String> {
        let rows = table.rows.iter().filter(|r| is_wanted(&r.conditions.filter_3d));
        Some(rows.map(|r| Some(format!("{:.1}", r.reached?.depth))).collect::<Option<Vec<_>>>()?.join(" and "))
    };
    let stored = depths(|f| matches!(f, Filter3d::Stored(_)))?;
    let along = depths(|f| matches!(f, Filter3d::Sliding(_)))?;
    Some(format!(
        "3D filter slice by slice: its taps are pixels and slices, those of the other filter are samples of the ray. So it is wider, above all \
         across slices, and finds another surface ({stored} mm against {along} mm): its times are not those of the thesis' filter"
    ))
}

/// The times of the usual row, and the bandwidths of both memories: a ratio of times says little without the other.
fn hardware(report: &Report) -> Option<String> {
    let table = report.tables.first()?;
    let row = table.rows.get(table.usual)?;
    let (time, copy) = (Spread::new(&row.times.picture)?.median, report.copy?.median * 1e-9);
    Some(format!(
        "hardware: the usual row takes {:.3} times the thesis' {} ms, on {:.3} times the memory bandwidth (copying reaches {copy:.2} GB/s here; \
         the GTX 650 has {THESIS_BANDWIDTH} by its data sheet)",
        time / row.thesis.ms,
        row.thesis.ms,
        copy / THESIS_BANDWIDTH
    ))
}

fn growth(text: &mut String, grown: &Grown) {
    let picture = markdown_text(&grown.picture);
    let _ = writeln!(text, "\n## Tables 7-9: growth of the enhanced sigma filter's windows, {picture}");
    let mut tables: Vec<(Estimator, f64)> = grown.rows.iter().map(|r| (r.centre, r.sigma)).collect();
    tables.dedup();
    for (centre, sigma) in tables {
        let of: Vec<&Growth> = grown.rows.iter().filter(|r| (r.centre, r.sigma) == (centre, sigma)).collect();
        let columns = of.iter().map(|r| r.counts.len()).max().unwrap_or(0);
        let mut rows = vec![vec!["window".to_string(), "largest".to_string()]];
        rows[0].extend((0..columns).map(|n| format!("+{}, %", 2 * n)));
        for row in of {
            let mut cells = vec![row.windows[0].to_string(), row.windows[1].to_string()];
            cells.extend((0..columns).map(|n| row.share(n).map_or(String::new(), |s| format!("{:.2}", 100.0 * s))));
            rows.push(cells);
        }
        let _ = write!(text, "\ncentre {}, sigma {sigma}\n\n{}", centre.name(), markdown_table(&rows));
    }
    let _ = writeln!(text, "\nThe thesis, on pictures of its own, rows of 3x3 and 7x7:\n");
    let mut rows = vec![["table", "window", "+0, %", "+2, %", "+4, %"].map(str::to_string).to_vec()];
    for (table, window, shares) in THESIS {
        let mut cells = vec![table.to_string(), window.to_string()];
        cells.extend(shares.map(|s| format!("{s:.2}")));
        rows.push(cells);
    }
    text.push_str(&markdown_table(&rows));
    text.push_str(
        "\n+n is the share of the pixels whose window became n pixels wider, up to the largest. A window grows while fewer pixels than it had at first \
         lie within 2 sigma of the centre. So the shares tell more of the picture than of the filter: how much of it is edge or speckle, and the \
         ratio of its noise to sigma.\n",
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thesis_tables::tests::{measured, report};

    #[test]
    fn markdown_has_every_row_under_aligned_pipes() {
        let text = markdown(&measured());
        for number in 3..=6 {
            let head = format!("\n## Table {number}: ");
            assert_eq!(text.matches(&head).count(), 1, "{text}");
        }
        let lines: Vec<&str> = text.lines().filter(|l| l.starts_with('|')).collect();
        assert_eq!(lines.len(), 4 + 7 + 5 + 5 + 2 + 2 * 5, "{text}");
        let pipes = |l: &str| l.chars().enumerate().filter(|c| c.1 == '|').map(|c| c.0).collect::<Vec<_>>();
        for table in text.split("\n## ").skip(1) {
            let rows: Vec<_> = table.lines().filter(|l| l.starts_with('|')).map(pipes).collect();
            assert!(rows.iter().all(|r| r.len() == 10 && *r == rows[0]), "{table}");
        }
        // The second of Table 5: of its own usual row, and of the thesis' that is not its own in Table 6.
        let cells = |start: &str| -> Vec<Vec<String>> {
            let of = lines.iter().filter(|l| l.starts_with(start));
            of.map(|l| l.trim_matches('|').split('|').map(|c| c.trim().to_string()).collect()).collect()
        };
        assert_eq!(
            cells("| 5x5x5 along")[0][1..],
            ["6.000", "3.000..9.000", "1.50", "187.0", "3.42", "60.000", "60.000..60.000", "71.2 mm, 98.7 %"]
        );
        assert_eq!(cells("| 9x9 *")[0][3..6], ["1.00", "(54.6)", "1.00"]);
        assert_eq!(cells("| 3x3x3 slice")[0][4], "(54.6)");
        assert_eq!(cells("| composited")[0][3..5], ["2.00", "(54.6)"]);
        assert_eq!(cells("| 128^3, picture 512^2")[0][3..5], ["1.25", "13.2"]);
        assert!(text.contains("465.5 ms (thesis: around 466 ms)"), "{text}");
        assert!(text.contains("another surface (71.2 and 71.2 mm against 71.2 and 71.2 mm)"), "{text}");
        // 8 of 54.6 ms, 8 of 80 GB/s.
        assert!(
            text.contains(
                "takes 0.147 times the thesis' 54.6 ms, on 0.100 times the memory bandwidth (copying reaches 8.00 GB/s"
            ),
            "{text}"
        );
        assert!(text.contains("Some, \"device\" \\| one (software") && text.contains("2026-01-02"), "{text}");
    }

    #[test]
    fn without_time_stamps_no_time_is_printed_and_the_text_says_so() {
        let text = markdown(&report());
        assert!(text.contains("this device has no time stamps"), "{text}");
        for row in text.lines().filter(|l| l.starts_with("| 27") || l.starts_with("| 512^3")) {
            assert_eq!(row.matches(" - ").count(), 6, "{row}");
        }
    }

    #[test]
    fn growth_has_a_table_a_sigma() {
        let rows = [0.03, 0.1].map(|sigma| Growth::new(Estimator::Median, sigma, [3, 7], &[0.0, 1.0, 2.0, 2.0]));
        let grown = vec![Grown { picture: "a|b.png".into(), rows: rows.to_vec() }];
        let text = markdown(&Report { grown, ..report() });
        assert!(
            text.contains("windows, a\\|b.png\n\ncentre median, sigma 0.03\n")
                && text.contains("\ncentre median, sigma 0.1\n"),
            "{text}"
        );
        assert_eq!(
            text.lines().filter(|l| l.starts_with("| 3      |       7 | 25.00 | 25.00 | 50.00 |")).count(),
            2,
            "{text}"
        );
    }

    #[test]
    fn csv_has_a_line_a_row_and_as_many_fields_in_each() {
        let text = tables_csv(&measured());
        assert_eq!(text.lines().count(), 1 + 4 + 7 + 5 + 5 + 2);
        // Commas within quotes are not separators.
        let fields = |line: &str| {
            let outside = line.split('"').step_by(2).map(|part| part.matches(',').count());
            outside.sum::<usize>() + 1
        };
        let counts: Vec<_> = text.lines().map(fields).collect();
        assert!(counts.iter().all(|n| *n == 27), "{counts:?}");
        assert!(
            text.contains("3,frames,\"37\",true,8.000000,4.000000,12.000000,1.000000,54.6,1.000000,80.000000"),
            "{text}"
        );
        assert!(text.contains("\"Some, \"\"device\"\" | one\""), "{text}");
    }

    #[test]
    fn what_was_not_measured_is_an_empty_field() {
        let csv = tables_csv(&report());
        assert!(csv.lines().nth(1).is_some_and(|l| l.starts_with("3,frames,\"27\",false,,,,,53.7,")), "{csv}");
    }

    #[test]
    fn growth_has_a_line_a_step() {
        let rows = [0.03, 0.1].map(|sigma| Growth::new(Estimator::Median, sigma, [3, 7], &[0.0, 1.0, 2.0, 2.0]));
        let grown = vec![Grown { picture: "a|b.png".into(), rows: rows.to_vec() }];
        let csv = growth_csv(&grown);
        assert_eq!(csv.lines().count(), 1 + 2 * 3);
        assert!(csv.contains("\"a|b.png\",median,0.03,3,7,4,0.500000\n"), "{csv}");
    }
}
