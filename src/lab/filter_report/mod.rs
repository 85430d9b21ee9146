//! Compares the 2D filters of slices: how well each reduces speckle and preserves edges, for its windows and strengths, and how long it
//! takes (as thesis Figs. 46-53, but with numbers). [`candidates`] lists the settings, [`quality`] has the measures, [`candidate_runs`]
//! runs them on a device, and [`export`] and [`contact_sheet`] write tables and pictures.

pub mod candidate_runs;
pub mod candidates;
pub mod contact_sheet;
pub mod export;
pub mod quality;

use crate::machine::Device;
use crate::thesis_tables::Spread;
use quality::Quality;

/// A rectangle of a slice, mm: first and last lateral position, and first and last depth, below the probe's face as in `region.depth`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    pub lateral: [f64; 2],
    pub depth: [f64; 2],
}

/// The parts of a slice that are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Areas {
    /// Where all measures except SNR and CNR are taken; the contact sheet shows it. It must lie inside the sector.
    pub crop: Area,
    /// Tissue of one kind, for SNR, and for CNR against `background`. Both must lie within `crop`.
    pub region: Area,
    pub background: Area,
}

/// The measurements of one candidate on one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    pub candidate: candidates::Candidate,
    pub quality: Quality,
    /// GPU time of the filter's passes for one slice, ms. None without a filter or without time stamps.
    pub time: Option<Spread>,
    /// The filtered slice within `Areas::crop`, row by row, 0..1.
    pub pixels: Vec<f64>,
}

/// All candidates measured on one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// Name of the recording, or `phantom`.
    pub name: String,
    pub areas: Areas,
    /// Index of the frame in the volume, from 0.
    pub frame: usize,
    /// Columns and rows of the slice within `Areas::crop`.
    pub size: [usize; 2],
    /// The slice within `Areas::crop` as the mean over all speckle, row by row. None if it is not known.
    pub clean: Option<Vec<f64>>,
    pub rows: Vec<Row>,
}

/// The comparison of filters on several frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    pub device: Device,
    /// Name, version and build of the program.
    pub program: String,
    /// When it was measured, RFC 3339.
    pub date: String,
    /// Number of time measurements for each candidate.
    pub repeats: usize,
    /// The measured frames. The first is the phantom's, which has a clean frame.
    pub subjects: Vec<Subject>,
}

impl Report {
    /// For every filter, the index in `Subject::rows` of the candidate whose slice is most similar to the clean one (SSIM), in the order of the rows.
    /// The first subject with a clean slice decides, and the indices are valid for the rows of all subjects. Empty if no subject has a clean slice.
    pub fn chosen(&self) -> Vec<usize> {
        let Some(subject) = self.subjects.iter().find(|s| s.clean.is_some()) else { return Vec::new() };
        let ssim = |n: &usize| subject.rows[*n].quality.ssim.unwrap_or(f64::NEG_INFINITY);
        let mut chosen: Vec<usize> = Vec::new();
        for n in 0..subject.rows.len() {
            let filter = subject.rows[n].candidate.filter;
            match chosen.iter_mut().find(|c| subject.rows[**c].candidate.filter == filter) {
                Some(best) if ssim(&n) > ssim(best) => *best = n,
                Some(_) => {}
                None => chosen.push(n),
            }
        }
        chosen
    }
}
