//! The filters to compare, each with several windows and strengths.

/// A filter of slices with settings, one of those that are compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Name of the filter; `none` for no filter.
    pub filter: &'static str,
    /// What varies among candidates of the filter: window and strength.
    pub label: String,
    /// Assignments `key=value` of its settings, as for `--set`. Empty for no filter.
    pub set: Vec<String>,
}

/// Windows of the sigma filters, pixels.
const WINDOWS: [u32; 4] = [5, 9, 13, 17];
/// Starting and largest windows of the enhanced sigma filter, pixels (thesis Tables 7-9).
const GROWING: [[u32; 2]; 4] = [[3, 17], [5, 19], [9, 21], [13, 23]];
/// Starting windows and sigma of thesis Figs. 46-53, and how far those of 46-50 grow here: as in Tables 7-9, whose growth of 15 is that of 13.
/// The kernels of 51-53 are fixed: the largest window is the starting one.
const FIGURES: [[u32; 2]; 7] = [[3, 17], [5, 19], [7, 19], [9, 21], [11, 21], [13, 23], [15, 25]];
const FIGURE_SIGMA: f64 = 0.03;
/// Standard deviations of the noise, 0..1. Fully developed speckle has 5.57 dB, which is 0.11 of 50 dB.
const SIGMAS: [f64; 5] = [0.05, 0.1, 0.15, 0.2, 0.3];
/// Edge constants of Perona-Malik diffusion, 0..1.
const EDGES: [f64; 3] = [0.05, 0.1, 0.2];
/// Diffusion times, pixels^2. The Gaussian of the heat equation has the variance 2 t.
const TIMES: [f64; 5] = [2.0, 4.0, 8.0, 16.0, 32.0];
/// Step of the explicit scheme, pixels^2.
const EXPLICIT_STEP: f64 = 0.2;
/// Steps of AOS for any diffusion time.
const AOS_STEPS: u32 = 4;
/// Standard deviations of the Gaussian, pixels.
const DEVIATIONS: [f64; 6] = [0.7, 1.0, 2.0, 3.0, 4.0, 6.0];

/// "No filter", and the candidates whose filter's name contains `only` (all if `only` is empty). Candidates of one filter are consecutive. `pitch`:
/// lateral and depth size of a slice pixel, mm.
pub fn candidates(pitch: [f64; 2], only: &str) -> Vec<Candidate> {
    let mut all = candidates_of_all(pitch);
    all.retain(|candidate| candidate.set.is_empty() || candidate.filter.contains(only));
    all
}

fn candidates_of_all(pitch: [f64; 2]) -> Vec<Candidate> {
    let mut all = Vec::new();
    let mut add = |filter, label: String, set: &[String]| all.push(Candidate { filter, label, set: set.to_vec() });
    add("none", String::new(), &[]);
    add("median", "3x3".into(), &["slices.median=true".into()]);
    add("gradient-inverse", "3x3".into(), &["slices.estimator=gradient-inverse".into()]);
    add("Nagao-Matsuyama", "5x5".into(), &["slices.estimator=nagao-matsuyama".into()]);
    for deviation in DEVIATIONS {
        let [lateral, depth] = pitch.map(|p| p * deviation);
        let set = [format!("slices.smooth={{lateral={lateral:?},depth={depth:?}}}")];
        add("Gaussian", format!("sd {deviation} px"), &set);
    }
    for (window, sigma) in pairs(&WINDOWS, &SIGMAS) {
        let set = [format!("slices.sigma={{window={window},sigma={sigma:?}}}")];
        add("sigma", format!("{window}x{window}, sigma {sigma}"), &set);
    }
    let enhanced = |[window, largest]: [u32; 2], sigma: f64, centre: &str| {
        let growth = if largest == window { String::new() } else { format!(" to {largest}x{largest}") };
        let keys = format!("window={window},largest={largest},sigma={sigma:?},centre='{centre}'");
        let label = format!("{window}x{window}{growth}, sigma {sigma}");
        (label, [format!("slices.enhanced_sigma={{{keys}}}")])
    };
    for (filter, centre) in [("enhanced sigma, median centre", "median"), ("enhanced sigma, PM centre", "perona-malik")]
    {
        for (windows, sigma) in pairs(&GROWING, &SIGMAS) {
            let (label, set) = enhanced(windows, sigma, centre);
            add(filter, label, &set);
        }
    }
    for (filter, centre, is_fixed) in [
        ("thesis Figs. 46-50, median centre", "median", false),
        ("thesis Figs. 46-50, PM centre", "perona-malik", false),
        ("thesis Figs. 51-53, median centre", "median", true),
        ("thesis Figs. 51-53, PM centre", "perona-malik", true),
    ] {
        for [window, largest] in FIGURES {
            let windows = [window, if is_fixed { window } else { largest }];
            let (label, set) = enhanced(windows, FIGURE_SIGMA, centre);
            add(filter, label, &set);
        }
    }
    for (edge, time) in pairs(&EDGES, &TIMES) {
        let steps = (time / EXPLICIT_STEP).round();
        let keys = format!("edge={edge:?},step={EXPLICIT_STEP:?},repeat={steps}");
        add("Perona-Malik", format!("edge {edge}, time {time}"), &[format!("slices.perona_malik={{{keys}}}")]);
    }
    for (edge, time) in pairs(&EDGES, &TIMES) {
        let keys = format!("scheme='aos',edge={edge:?},step={:?},repeat={AOS_STEPS}", time / f64::from(AOS_STEPS));
        add("Perona-Malik by AOS", format!("edge {edge}, time {time}"), &[format!("slices.perona_malik={{{keys}}}")]);
    }
    // What the presets filter slices with, but for smoothing across frames.
    let classic = ["median=true", "sigma={window=9,sigma=0.15}", "smooth={lateral=0.9,depth=0.7}"];
    let classic = classic.map(|set| format!("slices.{set}"));
    add("preset face-classic", "median, sigma 9x9 0.15, Gaussian 0.9 and 0.7 mm".into(), &classic);
    add("preset fetal", "Gaussian 1.4 and 0.8 mm".into(), &["slices.smooth={lateral=1.4,depth=0.8}".into()]);
    add("preset bone", "Gaussian 0.5 mm".into(), &["slices.smooth={lateral=0.5,depth=0.5}".into()]);
    all
}

fn pairs<A: Copy, B: Copy>(first: &[A], second: &[B]) -> Vec<(A, B)> {
    first.iter().flat_map(|a| second.iter().map(move |b| (*a, *b))).collect()
}
