//! How far the windows of the enhanced sigma filter grow: the share of pixels whose window grew by +0, +2, +4 ... pixels
//! (thesis 5.5, Tables 7-9).

use std::fmt::Write as _;

/// Starting windows of Tables 7-9 and where their growth stops, pixels.
pub const WINDOWS: [[u32; 2]; 6] = [[3, 17], [5, 19], [7, 19], [9, 21], [11, 21], [13, 23]];
/// Standard deviations of the noise that the thesis measures with, 0..1.
pub const SIGMAS: [f64; 3] = [0.03, 0.1, 0.17];

/// The growth of one picture's windows.
#[derive(Clone, Debug, PartialEq)]
pub struct Growth {
    pub sigma: f64,
    /// Starting and largest window, pixels.
    pub windows: [u32; 2],
    /// Pixels whose window grew by n rings, at place n.
    pub counts: Vec<u64>,
}

impl Growth {
    /// From the number of rings that each pixel's window grew by.
    pub fn new(sigma: f64, windows: [u32; 2], rings: &[f64]) -> Growth {
        let most = (windows[1] - windows[0]) / 2;
        let mut counts = vec![0; most as usize + 1];
        for ring in rings {
            counts[(ring.round().max(0.0) as usize).min(most as usize)] += 1;
        }
        Growth { sigma, windows, counts }
    }

    /// Share of the pixels that grew by n rings, 0..1.
    pub fn share(&self, rings: usize) -> Option<f64> {
        let all: u64 = self.counts.iter().sum();
        self.counts.get(rings).map(|n| *n as f64 / all.max(1) as f64)
    }
}

fn columns(rows: &[Growth]) -> usize {
    rows.iter().map(|r| r.counts.len()).max().unwrap_or(0)
}

/// One line a starting window, in percent.
pub fn table(rows: &[Growth]) -> String {
    let mut text = format!("{:>6} {:>7} {:>7}", "sigma", "window", "largest");
    for n in 0..columns(rows) {
        let _ = write!(text, " {:>7}", format!("+{}", 2 * n));
    }
    text.push('\n');
    for row in rows {
        let _ = write!(text, "{:>6} {:>7} {:>7}", row.sigma, row.windows[0], row.windows[1]);
        for n in 0..columns(rows) {
            let share = row.share(n).map_or(String::new(), |s| format!("{:.2} %", 100.0 * s));
            let _ = write!(text, " {share:>7}");
        }
        let kept = text.trim_end().len();
        text.truncate(kept);
        text.push('\n');
    }
    text
}

/// The same with shares in 0..1; a window that cannot grow so far has an empty field.
pub fn csv(rows: &[Growth]) -> String {
    let mut text = "sigma,window,largest".to_string();
    (0..columns(rows)).for_each(|n| text.push_str(&format!(",grew {}", 2 * n)));
    text.push('\n');
    for row in rows {
        let _ = write!(text, "{},{},{}", row.sigma, row.windows[0], row.windows[1]);
        for n in 0..columns(rows) {
            let _ = write!(text, ",{}", row.share(n).map_or(String::new(), |s| format!("{s:.6}")));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_all_pixels_and_a_window_that_cannot_grow_has_none() {
        let wide = Growth::new(0.1, [3, 7], &[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 0.0, 0.0]);
        assert_eq!(wide.counts, [5, 1, 2]);
        let narrow = Growth::new(0.1, [5, 7], &[1.0, 0.0]);
        let csv = csv(&[wide.clone(), narrow.clone()]);
        assert_eq!(
            csv,
            "sigma,window,largest,grew 0,grew 2,grew 4\n0.1,3,7,0.625000,0.125000,0.250000\n0.1,5,7,0.500000,0.500000,\n"
        );
        let table = table(&[wide, narrow]);
        assert!(table.contains("62.50 %") && table.lines().count() == 3, "{table}");
    }
}
