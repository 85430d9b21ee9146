//! The compositing rules on profiles whose light is known: what a step that is thick optically costs each rule.

use crate::common::figures::figure;
use echolume::low_level::passes::raycast::composite::{March, Medium, Place, Rule};
use echolume::low_level::scene::{self_attenuation, transfer};
use std::cell::OnceCell;

/// Values along a ray, and the transfer table that they go through.
struct Profile {
    /// Length, voxels.
    path: f64,
    value: fn(f64) -> f64,
    table: Vec<[f64; 4]>,
    /// Made where a rule asks for it.
    pre_integrated: OnceCell<Vec<[f64; 4]>>,
    /// Light and opacity of steps of `step` voxels, by the value at their front; each row is made where a step asks for it.
    self_attenuated: Vec<OnceCell<Vec<[f64; 4]>>>,
    step: f64,
}

impl Profile {
    /// Grey that is as bright as the value is large; `kappa`: absorption of a voxel over the value.
    fn new(path: f64, value: fn(f64) -> f64, kappa: fn(f64) -> f64, step: f64) -> Profile {
        let n = transfer::ENTRIES;
        let entry = |i: usize| i as f64 / (n - 1) as f64;
        let table: Vec<[f64; 4]> = (0..n).map(entry).map(|v| [v, v, v, kappa(v)]).collect();
        Profile { path, value, table, pre_integrated: OnceCell::new(), self_attenuated: vec![OnceCell::new(); n], step }
    }

    fn pre_integrated(&self, front: usize, back: usize) -> [f64; 4] {
        let table = self.pre_integrated.get_or_init(|| transfer::pre_integrated(&self.table));
        table[front * transfer::ENTRIES + back]
    }

    fn self_attenuated(&self, front: usize, back: usize) -> [f64; 4] {
        let row = self.self_attenuated[front].get_or_init(|| self_attenuation::row(&self.table, front, self.step));
        row[back]
    }

    fn mean(values: &[([f64; 4], f64)]) -> [f64; 4] {
        std::array::from_fn(|c| values.iter().map(|(value, weight)| weight * value[c]).sum())
    }

    fn placed(value: f64) -> (usize, f64) {
        let at = value * (transfer::ENTRIES - 1) as f64;
        let n = (at as usize).min(transfer::ENTRIES - 2);
        (n, at - n as f64)
    }

    fn between_in(&self, table: impl Fn(usize, usize) -> [f64; 4], from: Place, to: Place) -> [f64; 4] {
        let ((row, down), (column, along)) =
            (Profile::placed((self.value)(from.offset)), Profile::placed((self.value)(to.offset)));
        Profile::mean(&[
            (table(row, column), (1.0 - down) * (1.0 - along)),
            (table(row, column + 1), (1.0 - down) * along),
            (table(row + 1, column), down * (1.0 - along)),
            (table(row + 1, column + 1), down * along),
        ])
    }

    fn light(&self, rule: Rule) -> f64 {
        let march = March { rule, path: self.path, reference_length: 1.0, early_end: 0.0, hit: f64::INFINITY };
        march.through(self, |n| n * self.step).0[0]
    }

    /// By half a million homogeneous parts.
    fn truth(&self) -> f64 {
        let parts = 500_000;
        let (mut light, mut depth) = (0.0, 0.0f64);
        for i in 0..parts {
            let [v, _, _, kappa] = self.at_value((self.value)((f64::from(i) + 0.5) / f64::from(parts) * self.path));
            let y = kappa * self.path / f64::from(parts);
            light += v * transfer::opacity(y) * (-depth).exp();
            depth += y;
        }
        light
    }

    fn at_value(&self, value: f64) -> [f64; 4] {
        let (n, share) = Profile::placed(value);
        Profile::mean(&[(self.table[n], 1.0 - share), (self.table[n + 1], share)])
    }
}

impl Medium for Profile {
    fn at(&self, place: Place) -> Option<[f64; 4]> {
        Some(self.at_value((self.value)(place.offset)))
    }

    fn between(&self, from: Place, to: Place) -> Option<[f64; 4]> {
        Some(self.between_in(|front, back| self.pre_integrated(front, back), from, to))
    }

    fn self_attenuated(&self, from: Place, to: Place, length: f64) -> Option<[f64; 4]> {
        Some(match length > self.step * (1.0 - 1e-9) {
            true => self.between_in(|front, back| self.self_attenuated(front, back), from, to),
            false => self_attenuation::step(&self.table, (self.value)(from.offset), (self.value)(to.offset), length),
        })
    }
}

const STEPS: [f64; 4] = [8.0, 4.0, 2.0, 1.0];

fn errors(name: &'static str, path: f64, value: fn(f64) -> f64, kappa: fn(f64) -> f64, rule: Rule) -> [f64; 4] {
    let truth = Profile::new(path, value, kappa, STEPS[0]).truth();
    let errors = STEPS.map(|step| (Profile::new(path, value, kappa, step).light(rule) - truth).abs());
    println!("{name}, {rule:?}: errors at steps of 8, 4, 2, 1 voxels {errors:.5?}");
    errors
}

fn ramp(s: f64) -> f64 {
    (s / 8.0).min(1.0)
}

/// A ramp of 1/8 a voxel in opaque matter: the eye sees its dark face. The mean colour of a step is that of its middle.
#[test]
fn pre_integration_shows_the_middle_of_an_opaque_step_and_self_attenuation_its_face() {
    let off = errors("ramp", 8.0, ramp, |_| 14.0, Rule::PreIntegrated);
    for ((got, stated), name) in off.iter().zip([0.49, 0.24, 0.12, 0.05]).zip(["ramp-8", "ramp-4", "ramp-2", "ramp-1"])
    {
        assert!((got - stated).abs() < 0.006, "{got} for {stated}");
        figure(name, &format!("{got:.3}"));
    }
    let off = errors("ramp", 8.0, ramp, |_| 14.0, Rule::Exponential);
    assert!(off.iter().all(|e| *e < 1e-6), "the value is linear in every step: {off:?}");
    // Absorption that grows along the ramp too, and steps that leave a part of one at the end.
    for kappa in [(|v| 14.0 * v) as fn(f64) -> f64, |v| 0.3 * v, |v| if v < 0.5 { 0.0 } else { 40.0 }] {
        for path in [8.0, 7.3] {
            let off = errors("ramp of absorption", path, ramp, kappa, Rule::Exponential);
            // The table is interpolated between entries 1/255 apart: at the step in kappa that is 1/255 of the colour.
            assert!(off.iter().all(|e| *e < 4e-3), "{off:?}");
        }
    }
}

/// A sine of 16 voxels is linear in no step: the error falls with the step, and below the pre-integrated one.
#[test]
fn a_sine_is_better_self_attenuated_and_exact_by_neither() {
    let sine = |s: f64| 0.5 - 0.5 * (std::f64::consts::TAU * s / 16.0).cos();
    let kappa = |v: f64| 14.0 * v;
    let mean = errors("sine", 32.0, sine, kappa, Rule::PreIntegrated);
    let own = errors("sine", 32.0, sine, kappa, Rule::Exponential);
    let midpoint = errors("sine", 32.0, sine, kappa, Rule::Corrected);
    assert!(own.iter().zip(mean).all(|(own, mean)| *own < 0.8 * mean), "{own:?}, {mean:?}");
    assert!(own[3] < midpoint[3] && own[3] < 0.05 && own[0] > 1e-3, "{own:?}, {midpoint:?}");
}
