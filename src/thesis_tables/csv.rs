//! A report of the thesis' tables as CSV.

use super::{Grown, Report, Row, SAMPLES, Spread, Table};
use std::fmt::Write as _;

/// A text as one field.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// One line a row of Tables 3-6; a time that was not measured is an empty field.
pub fn tables(report: &Report) -> String {
    let mut text = String::from(
        "table,varied,value,usual,picture_ms,picture_least_ms,picture_most_ms,ratio,thesis_ms,thesis_ratio,stage_1_ms,\
         stage_1_least_ms,stage_1_most_ms,surface_mm,surface_share,repeats,frames,lines,samples,volume,filter_3d,filter_2d,device,driver,date\n",
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
        [spread.map(|s| s.median), spread.map(|s| s.least), spread.map(|s| s.most)].map(number)
    };
    let mut fields = vec![table.number.to_string(), table.varied.into(), quoted(&row.label), usual.to_string()];
    fields.extend(three(&row.times.picture));
    fields.extend([number(table.ratio(row)), row.thesis.ms.to_string(), number(table.thesis_ratio(row))]);
    fields.extend(three(&row.times.preprocess));
    fields.extend([row.reached.map(|r| r.depth), row.reached.map(|r| r.share)].map(number));
    fields.extend([report.repeats, c.frames, c.lines, SAMPLES].map(|n| n.to_string()));
    fields.extend([c.volume.to_string(), c.filter_3d.name(), c.filter_2d.to_string()]);
    fields.extend([&report.device.name, &report.device.driver, &report.date].map(|t| quoted(t)));
    fields.join(",") + "\n"
}

/// One line a picture, sigma and starting window of Tables 7-9 and a step of growth; shares in 0..1.
pub fn growth(grown: &[Grown]) -> String {
    let mut text = String::from("picture,sigma,window,largest,grew,share\n");
    for picture in grown {
        for row in &picture.rows {
            for n in 0..row.counts.len() {
                let share = row.share(n).unwrap_or(0.0);
                let [window, largest] = row.windows;
                let name = quoted(&picture.picture);
                let _ = writeln!(text, "{name},{},{window},{largest},{},{share:.6}", row.sigma, 2 * n);
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thesis_tables::tests::{measured, report};
    use crate::thesis_tables::window_growth::Growth;

    #[test]
    fn csv_has_a_line_a_row_and_as_many_fields_in_each() {
        let text = tables(&measured());
        assert_eq!(text.lines().count(), 1 + 4 + 4 + 5 + 5);
        // Commas within quotes are not separators.
        let fields = |line: &str| {
            let outside = line.split('"').step_by(2).map(|part| part.matches(',').count());
            outside.sum::<usize>() + 1
        };
        let counts: Vec<_> = text.lines().map(fields).collect();
        assert!(counts.iter().all(|n| *n == 25), "{counts:?}");
        assert!(
            text.contains("3,frames,\"37\",true,8.000000,4.000000,12.000000,1.000000,54.6,1.000000,80.000000"),
            "{text}"
        );
        assert!(text.contains("\"Some, \"\"device\"\" | one\""), "{text}");
    }

    #[test]
    fn what_was_not_measured_is_an_empty_field() {
        let csv = tables(&report());
        assert!(csv.lines().nth(1).is_some_and(|l| l.starts_with("3,frames,\"27\",false,,,,,53.7,")), "{csv}");
    }

    #[test]
    fn growth_has_a_line_a_step() {
        let rows = [0.03, 0.1].map(|sigma| Growth::new(sigma, [3, 7], &[0.0, 1.0, 2.0, 2.0]));
        let grown = vec![Grown { picture: "a|b.png".into(), rows: rows.to_vec() }];
        let csv = growth(&grown);
        assert_eq!(csv.lines().count(), 1 + 2 * 3);
        assert!(csv.contains("\"a|b.png\",0.03,3,7,4,0.500000\n"), "{csv}");
    }
}
