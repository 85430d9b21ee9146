//! Simulated runs with a known truth.

use echolume::low_level::baselines::Stored;
use echolume::low_level::machine::Device;
use echolume::low_level::profile::{Acquisition, Ceiling, Ceilings, PassProfile, Profile, Sizes, settings_hash};
use echolume::low_level::statistics::mix;

/// Vigna's splitmix64: the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Box and Muller.
    pub fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.unit()).ln()).sqrt() * (std::f64::consts::TAU * self.unit()).cos()
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// How times deviate from their median, as logarithms.
#[derive(Clone, Copy, Default)]
pub struct Noise {
    /// Standard deviation of one repeat.
    pub spread: f64,
    /// Correlation of neighbouring repeats, 0..1.
    pub memory: f64,
    /// Largest drift from the first repeat to the last, in either direction, common to all passes.
    pub drift: f64,
    /// The same for each pass separately.
    pub own_drift: f64,
    /// Standard deviation that a random walk of all passes reaches at the end.
    pub walk: f64,
    /// Share of repeats that take 1.3 to 3 times as long.
    pub outliers: f64,
}

/// `count` passes between 0.05 and 5 ms in `repeats` repeats.
pub fn run(random: &mut Random, count: usize, repeats: usize, noise: Noise) -> Profile {
    let slope = random.between(-noise.drift, noise.drift);
    let mut walk = vec![0.0; repeats];
    for i in 1..repeats {
        walk[i] = walk[i - 1] + noise.walk / (repeats as f64).sqrt() * random.normal();
    }
    let series = |random: &mut Random, median: f64| {
        let own = random.between(-noise.own_drift, noise.own_drift);
        let mut before = random.normal();
        let time = |i: usize| {
            before = noise.memory * before + (1.0 - noise.memory.powi(2)).sqrt() * random.normal();
            let mut log = noise.spread * before + (slope + own) * i as f64 / repeats as f64 + walk[i];
            if random.unit() < noise.outliers {
                log += random.between(1.3, 3.0).ln();
            }
            (median * log.exp()).round()
        };
        (0..repeats).map(time).collect::<Vec<f64>>()
    };
    let median = |k: usize| 5e4 * 100f64.powf((k * 5 % count) as f64 / count as f64);
    let passes = (0..count).map(|k| pass(&format!("pass {k}"), series(random, median(k)))).collect();
    let mut profile = profile(repeats);
    profile.passes = passes;
    profile.device_ns = profile.pass_sums().iter().map(|ns| ns + 2000.0).collect();
    profile.wall_ns = profile.device_ns.iter().map(|ns| ns + 1e5 * (noise.spread * random.normal()).exp()).collect();
    profile
}

pub fn pass(name: &str, samples_ns: Vec<f64>) -> PassProfile {
    PassProfile {
        name: name.into(),
        stage: "raycast".into(),
        runs_per_picture: 1,
        samples_ns,
        cpu_ns: Vec::new(),
        bytes_read: 3_000_000,
        bytes_written: 1_000_000,
        fetches: None,
        filtered: Some(8_000_000),
        dispatched: Some(262_144),
        invocations: Some(262_144),
    }
}

/// A profile without passes, its wall time 2 ms.
pub fn profile(repeats: usize) -> Profile {
    let scene = "mode = \"vr\"\n[ray]\nstep = 0.5\n";
    let ceiling = |median: f64| Ceiling { median, low: 0.97 * median, high: 1.02 * median };
    Profile {
        format: Profile::FORMAT.into(),
        program: "echolume 0.1.0, release".into(),
        date: "2026-01-02T03:04:05Z".into(),
        device: Device {
            name: "simulated".into(),
            driver: "none 1.0".into(),
            api: "1.3.0".into(),
            is_software: false,
            timestamp_period_ns: 1.0,
            valid_bits: 64,
            calibrated: true,
            clocks: Some("graphics 1.5 GHz".into()),
        },
        scene: scene.into(),
        settings_hash: settings_hash(scene),
        input: "phantom".into(),
        sizes: Sizes { frame: [512, 128], slices: 60, volume: [256, 256, 60], picture: [512, 512] },
        acquisition: Some(Acquisition { seconds: 0.8, sound_speed: 1540.0 }),
        repeats,
        warm_up: 3,
        turn: 0.0,
        passes: Vec::new(),
        host: Vec::new(),
        wall_ns: vec![2e6; repeats],
        cpu_ns: vec![3e6; repeats],
        device_ns: vec![0.0; repeats],
        ceilings: Some(Ceilings { copy: ceiling(4e11), sampling: ceiling(1e11), exact: None, fetch: ceiling(2e11) }),
        sampling: None,
        clock_deviation_ns: Some(250),
    }
}
