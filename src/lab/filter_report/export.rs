//! The comparison of filters as Markdown and as CSV.

use super::{Report, Row, Subject};
use crate::text::{csv_quoted, markdown_table, markdown_text};
use std::fmt::Write as _;

/// A figure of a row, how it is written, and whether a larger one is better.
struct Figure {
    name: &'static str,
    of: fn(&Row) -> Option<f64>,
    digits: usize,
    is_larger_better: bool,
}

const FIGURES: [Figure; 6] = [
    Figure { name: "SNR", of: |r| r.quality.snr, digits: 2, is_larger_better: true },
    Figure { name: "CNR", of: |r| r.quality.cnr, digits: 2, is_larger_better: true },
    Figure { name: "edges", of: |r| r.quality.edges, digits: 3, is_larger_better: true },
    Figure { name: "RMSE", of: |r| r.quality.rmse, digits: 4, is_larger_better: false },
    Figure { name: "SSIM", of: |r| r.quality.ssim, digits: 4, is_larger_better: true },
    Figure { name: "ms", of: |r| r.time.map(|t| t.median), digits: 2, is_larger_better: false },
];

/// The report as Markdown: for each frame a table of the [chosen](Report::chosen) setting of each filter, and one of all settings.
pub fn markdown(report: &Report) -> String {
    let mut text = String::from("# Filters compared\n\n");
    let device = &report.device;
    let [name, driver, program] = [&device.name, &device.driver, &report.program].map(|t| markdown_text(t));
    let _ = writeln!(
        text,
        "Stage 1 on one frame, on {name} ({driver}), by {program}, {}. Made by `tools/filters`.\n\n\
         - SNR: mean over standard deviation of tissue of one kind. CNR: contrast of that tissue to a background over the noise of both.\n\
         - Clean slice: the same slice as the mean over all speckle (`echolume phantom --mean-speckle`). RMSE and SSIM are against it.\n\
         - Edges: how near the edges of the filtered slice are to those of the clean one, by Pratt's figure of merit (1 is best). Of the filtered slice the steepest pixels count, as many as the clean one has edge pixels.\n\
         - ms: the filter's passes for the whole slice, median of {}. Values are 0..1 of the grey scale; sigma and edge too.\n\
         - Of each filter the first table has the setting of the highest SSIM on the phantom. The best figure of a column is bold.",
        report.date, report.repeats
    );
    let chosen = report.chosen();
    for subject in &report.subjects {
        let name = markdown_text(&subject.name);
        let best: Vec<&Row> = chosen.iter().filter_map(|n| subject.rows.get(*n)).collect();
        let [width, height] = subject.size;
        let area = |r: super::Area| {
            let ([left, right], [top, bottom]) = (r.lateral, r.depth);
            format!("lateral {left} to {right}, depth {top} to {bottom} mm")
        };
        let _ = writeln!(
            text,
            "\n## {name}, frame {}\n\n{width} x {height} pixels: {}. Tissue: {}. Background: {}.\n",
            subject.frame,
            area(subject.areas.crop),
            area(subject.areas.region),
            area(subject.areas.background)
        );
        text.push_str(&table(subject, &best));
        let _ = writeln!(text, "\n<details><summary>All settings</summary>\n");
        text.push_str(&table(subject, &subject.rows.iter().collect::<Vec<_>>()));
        text.push_str("\n</details>\n");
    }
    text
}

fn table(subject: &Subject, rows: &[&Row]) -> String {
    let figures: Vec<&Figure> = FIGURES.iter().filter(|f| rows.iter().any(|r| (f.of)(r).is_some())).collect();
    let best = |figure: &Figure| {
        let values = rows.iter().filter_map(|r| (figure.of)(r));
        values.reduce(|a, b| if figure.is_larger_better == (b > a) { b } else { a })
    };
    let mut header = vec!["filter".to_string(), "setting".to_string()];
    header.extend(figures.iter().map(|f| f.name.to_string()));
    let mut lines = vec![header];
    for row in rows {
        let mut line = vec![row.candidate.filter.to_string(), row.candidate.label.clone()];
        for figure in &figures {
            line.push(match (figure.of)(row) {
                None => String::new(),
                // Of times the best says nothing: that of the cheapest filter.
                Some(v) if figure.name != "ms" && Some(v) == best(figure) => format!("**{v:.*}**", figure.digits),
                Some(v) => format!("{v:.*}", figure.digits),
            });
        }
        lines.push(line);
    }
    assert!(rows.iter().all(|r| r.pixels.len() == subject.size[0] * subject.size[1]));
    markdown_table(&lines)
}

/// The report as CSV: a header, and one line for each frame and candidate. A measure that is not known is an empty field.
pub fn csv(report: &Report) -> String {
    let mut text = String::from("recording,frame,filter,setting");
    FIGURES.iter().for_each(|f| text.push_str(&format!(",{}", f.name.to_lowercase())));
    text.push('\n');
    for subject in &report.subjects {
        for row in &subject.rows {
            let [name, filter, label] =
                [subject.name.as_str(), row.candidate.filter, row.candidate.label.as_str()].map(csv_quoted);
            let _ = write!(text, "{name},{},{filter},{label}", subject.frame);
            for figure in &FIGURES {
                let _ = write!(text, ",{}", (figure.of)(row).map_or(String::new(), |v| format!("{v:.6}")));
            }
            text.push('\n');
        }
    }
    text
}
