//! The dials of a scene: settings with the values to measure. Most dials trade error for time: their values compute the same picture more
//! or less accurately, and the dial has settings for a reference. Other dials choose another look, such as another filter: their pictures
//! differ from that of the scene's own setting, and none of them is the correct one.

use super::Kind;
use crate::error_map::step_fault;
use crate::passes::light_volume;
use crate::scene::{Compositing, Edge, Mode, PeronaMalik, Sampling, Scene, Scheme, Volume, VolumeFormat, transfer};
use crate::tree::{FromNode, ToNode};

/// One setting of a dial.
#[derive(Clone, Debug)]
pub struct DialSetting {
    /// Short label of the setting, for plots.
    pub label: String,
    /// Assignments `key=value` as for `--set`; empty for the scene's own setting.
    pub set: Vec<String>,
    /// Value on the dial's axis, in the dial's unit. For names it is a number that only gives their order in a plot.
    pub value: f64,
}

/// One key of the scene's settings, or a few that are varied together, with the values to measure. A dial trades error for time, or chooses a look.
#[derive(Clone, Debug)]
pub struct Dial {
    pub name: &'static str,
    pub unit: &'static str,
    /// The settings to measure; the first is the scene's own.
    pub settings: Vec<DialSetting>,
    pub kind: Kind,
    /// True if the values lie on an axis; false if they are names.
    pub is_ordered: bool,
    /// Assignments `key=value` of the reference that errors are measured against. Empty for a look.
    pub best: Vec<String>,
    /// Assignments `key=value` of the setting that is one step coarser than the reference, or the same if there is none. Where the device renders the
    /// reference, because exact rays and f64 do not serve, the difference of the two pictures estimates the error of the reference. Empty for a look.
    pub nearly: Vec<String>,
}

impl Dial {
    /// True if its settings are ways to take samples along rays, so that exact rays can be its reference.
    pub(crate) fn samples_rays(&self) -> bool {
        let names = [
            "step",
            "tolerance",
            "compositing",
            "sampling",
            "termination",
            "adaptive",
            "lut",
            "brick",
            "transfer",
            "pipeline",
        ];
        names.contains(&self.name)
    }
}

/// Cells of the finest light volume that is measured, nearly: 1.8 GB of a device's memory.
const MOST_LIGHT_CELLS: f64 = 4e7;

/// Samples of the picture with the finest step: some ten seconds of two cores. A sample in a light volume counts as six.
const MOST_SAMPLES: f64 = 6e8;

/// How many times as fine as the scene's step the finest is that is measured, and the next one; powers of two from 8.
fn fineness(scene: &Scene) -> [f64; 2] {
    let rays = scene.ray_size().iter().map(|n| f64::from(*n)).product::<f64>();
    let each = if scene.lit_by_volume().is_some() { 6.0 } else { 1.0 };
    let samples = rays * (scene.high - scene.low).length() / scene.step * each;
    let most = [32.0, 16.0].into_iter().find(|factor| samples * factor <= MOST_SAMPLES).unwrap_or(8.0);
    [most, most / 2.0]
}

/// The names of all dials.
pub const NAMES: &[&str] = &[
    "step",
    "tolerance",
    "compositing",
    "format",
    "sampling",
    "filter3d",
    "termination",
    "sigma",
    "perona-malik",
    "adaptive",
    "resolution",
    "rays",
    "lut",
    "half",
    "brick",
    "transfer",
    "light-cell",
    "light-taps",
    "light-widening",
    "pipeline",
];

/// The dial with this name, for a scene.
///
/// # Errors
/// The scene has no such dial, or the name is unknown. The text is the end of a sentence that begins with "this scene".
pub fn dial(name: &str, scene: &Scene) -> Result<Dial, String> {
    let name = NAMES.iter().copied().find(|known| *known == name).unwrap_or_default();
    let s = &scene.settings;
    let step = scene.step;
    let [finest_step, next_step] = fineness(scene).map(f64::recip);
    let marches = !scene.is_flat() && s.mode != Mode::Cube;
    let composites = scene.composites();
    let need = |there: bool, why: &str| if there { Ok(()) } else { Err(why.to_string()) };
    let is_one_picture = || match step_fault(scene) {
        Some(why) => Err(format!("has another picture at another step: {why}")),
        None => Ok(()),
    };
    let made = |unit, default: DialSetting, others: Vec<DialSetting>, best: &[String], nearly: &[String]| Dial {
        name,
        unit,
        settings: std::iter::once(default).chain(others).collect(),
        kind: match name {
            "resolution" | "rays" => Kind::Pixels,
            "pipeline" => Kind::Several,
            _ => Kind::Numerical,
        },
        is_ordered: !["compositing", "format", "sampling", "perona-malik", "half", "brick"].contains(&name),
        best: best.to_vec(),
        nearly: nearly.to_vec(),
    };
    let look = |unit, others: Vec<DialSetting>| {
        let as_it_is = DialSetting { label: "as it is".into(), set: Vec::new(), value: 0.0 };
        Dial { kind: Kind::Look, is_ordered: false, ..made(unit, as_it_is, others, &[], &[]) }
    };
    let is = |label: String, value: f64| DialSetting { label, set: Vec::new(), value };
    let at = |label: String, set: &[String], value: f64| DialSetting { label, set: set.to_vec(), value };
    let dial = match name {
        "step" => {
            need(marches, "casts no ray")?;
            is_one_picture()?;
            // Down to an eighth of the step; the reference is four times as fine as the finest, or finer.
            let settings = [4.0, 2.83, 2.0, 1.41, 0.707, 0.5, 0.354, 0.25, 0.177, 0.125];
            let settings = settings.into_iter().filter(|f| *f >= 4.0 * finest_step);
            // Steps with the same samples of the surface detector give the same picture.
            let ring_half = |f: f64| match (s.mode, s.surface.edge) {
                (Mode::Surface, None | Some(Edge::Length(_))) if !composites => scene.ring.half_at(f * step),
                _ => 0,
            };
            let mut halves = vec![ring_half(1.0)];
            let settings = settings.filter(|f| {
                let half = ring_half(*f);
                let is_new = half == 0 || !halves.contains(&half);
                halves.push(half);
                is_new
            });
            let others: Vec<_> = settings
                .map(|f| at(format!("{:.3} mm", f * step), &[format!("ray.step={}", f * step)], f * step))
                .collect();
            let fine = |f: f64| [format!("ray.step={}", step * f)];
            made("mm", is(format!("{step:.3} mm"), step), others, &fine(finest_step), &fine(next_step))
        }
        "tolerance" => {
            let alone = s.mode == Mode::Volume && !scene.lights_volume() && scene.still().is_none();
            need(alone, "does not show the colour along each ray alone")?;
            is_one_picture()?;
            need(!s.ray.adaptive || s.ray.rays == 1, "chooses the rays of each pixel")?;
            let fine = |f: f64| ["ray.tolerance=0".to_string(), format!("ray.step={}", step * f)];
            let now = s.ray.tolerance;
            let label = |n: f64| match n {
                0.0 => "one step".to_string(),
                1.0 => "1 level".into(),
                n => format!("{n} levels"),
            };
            let others = [0.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25].into_iter().filter(|n| *n != now);
            let others = others.map(|n| at(label(n), &[format!("ray.tolerance={n}")], n)).collect();
            made("levels", is(label(now), now), others, &fine(finest_step), &fine(next_step))
        }
        "compositing" => {
            need(composites, "composites nothing")?;
            is_one_picture()?;
            let kinds = ["riemann", "corrected", "pre-integrated", "exponential"];
            let now = word(&s.volume.compositing);
            // The table of pairs is refused for points that are very close.
            let pairs = Volume { compositing: Compositing::PreIntegrated, ..s.volume.clone() };
            let finest = if transfer::entries(&pairs).is_ok() { "pre-integrated" } else { "corrected" };
            let pairs_fit = finest == "pre-integrated";
            // Exponential needs steps of one length, too, and takes the light of a step from a table.
            let possible = |k: &str| match k {
                "pre-integrated" => pairs_fit,
                "exponential" => {
                    pairs_fit && !scene.spreads() && scene.lit_by_volume().is_none() && scene.region_fade().is_none()
                }
                _ => true,
            };
            let others = kinds.iter().enumerate().filter(|(_, k)| **k != now && possible(k));
            let others = others.map(|(n, k)| at(k.to_string(), &[format!("volume.compositing={k}")], n as f64));
            let best = |f: f64| [format!("volume.compositing={finest}"), format!("ray.step={}", step * f)];
            let value = kinds.iter().position(|k| *k == now).unwrap_or(0) as f64;
            made("", is(now.clone(), value), others.collect(), &best(finest_step), &best(next_step))
        }
        "format" => {
            let bits = |f: VolumeFormat| match f {
                VolumeFormat::R8 => 8.0,
                VolumeFormat::Auto | VolumeFormat::R16 | VolumeFormat::R16f => 16.0,
                VolumeFormat::R32f => 32.0,
            };
            // `auto` is resolved to one of them.
            let now = scene.volume_format();
            let all = [VolumeFormat::R8, VolumeFormat::R16, VolumeFormat::R16f, VolumeFormat::R32f];
            let others = all.into_iter().filter(|f| *f != now);
            let others = others.map(|f| at(word(&f), &[format!("slices.format={}", word(&f))], bits(f)));
            let best = ["slices.format=r32f".to_string(), "ray.sampling=exact".into()];
            let nearly = ["slices.format=r16".to_string(), "ray.sampling=exact".into()];
            made("bits", is(word(&now), bits(now)), others.collect(), &best, &nearly)
        }
        "sampling" => {
            let all = [Sampling::Hardware, Sampling::Exact, Sampling::PackedNeighbours];
            let others = all.iter().enumerate().filter(|(_, w)| **w != s.ray.sampling);
            let set = |w: &Sampling| [format!("ray.sampling={}", word(w))];
            let others = others.map(|(n, w)| at(word(w), &set(w), n as f64));
            // `auto` is resolved to one of them.
            let value = all.iter().position(|w| *w == scene.sampling).unwrap_or(0) as f64;
            let exact = set(&Sampling::Exact);
            made("", is(word(&s.ray.sampling), value), others.collect(), &exact, &exact)
        }
        "filter3d" => {
            need(marches, "casts no ray")?;
            let ahead = |n: u32| ["slices.smooth=none".to_string(), format!("slices.smooth={{kernel={n}}}")];
            let sliding = |n: u32| ["slices.smooth=none".to_string(), format!("ray.sliding={n}")];
            let others = vec![
                at("none".into(), &["slices.smooth=none".into(), "ray.sliding=0".into()], 1.0),
                at("ahead 3".into(), &ahead(3), 3.0),
                at("ahead 5".into(), &ahead(5), 5.0),
                at("sliding 3".into(), &sliding(3), 3.0),
                at("sliding 5".into(), &sliding(5), 5.0),
            ];
            look("samples", others)
        }
        "termination" => {
            need(composites, "composites nothing")?;
            let now = s.ray.early_end;
            let others =
                [0.0, 1e-4, 1.0 / 2048.0, 1.0 / 512.0, 1.0 / 128.0, 0.03, 0.1].into_iter().filter(|v| *v != now);
            let others = others.map(|v| at(format!("{v:.4}"), &[format!("ray.early_end={v:.9}")], v));
            let fine = |left: &str| [format!("ray.early_end={left}")];
            made("light left", is(format!("{now:.4}"), now), others.collect(), &fine("0.0"), &fine("0.0001"))
        }
        "sigma" => {
            let (unfixed, ungrown) = ("slices.sigma=none".to_string(), "slices.enhanced_sigma=none".to_string());
            let fixed = |n: u32| {
                let set = [ungrown.clone(), format!("slices.sigma={{window={n},sigma=0.1}}")];
                at(format!("fixed {n}"), &set, f64::from(n))
            };
            let grown = |[n, most]: [u32; 2]| {
                let enhanced = format!("slices.enhanced_sigma={{window={n},largest={most},sigma=0.1}}");
                at(format!("growing {n}"), &[unfixed.clone(), enhanced], f64::from(n))
            };
            let mut others = vec![at("none".into(), &[unfixed.clone(), ungrown.clone()], 1.0)];
            others.extend([3, 5, 7, 9, 11].map(fixed));
            others.extend([[3, 17], [5, 19], [7, 19]].map(grown));
            look("pixels", others)
        }
        "perona-malik" => {
            // The same equation and diffusion time in different numbers of steps: those of the scene, or T = 2 if it has no diffusion. That is
            // another look then.
            let now = s.slices.perona_malik;
            let p = now.unwrap_or(PeronaMalik { edge: 0.1, step: 0.25, repeat: 8, ..PeronaMalik::default() });
            let time = p.step * f64::from(p.repeat);
            let diffused = |scheme: Scheme, n: u32| {
                let (scheme, conductance, step) = (word(&scheme), word(&p.conductance), time / f64::from(n));
                let steps = format!("edge={:?},conductance='{conductance}',step={step:?},repeat={n}", p.edge);
                [format!("slices.perona_malik={{scheme='{scheme}',{steps}}}")]
            };
            let place = |scheme: Scheme, n: u32| {
                at(format!("{} {n}", word(&scheme)), &diffused(scheme, n), time / f64::from(n))
            };
            // The explicit scheme is stable up to steps of 1/4.
            let least = (4.0 * time).ceil().clamp(1.0, 100.0) as u32;
            let explicit = |f: f64| place(Scheme::Explicit, (f64::from(least) * f).ceil() as u32);
            let mut others = Vec::from([1.0, 1.25, 2.5, 5.0].map(explicit));
            others.extend([1, 2, 4, 8, 16].map(|n| place(Scheme::Aos, n)));
            others.extend([1, 2, 4, 8].map(|n| place(Scheme::AosRichardson, n)));
            // A step of RKL1 has about sqrt(8 step) stages.
            let stepped = [1, 2, 4, 8].into_iter().filter(|n| time / f64::from(*n) <= 200.0);
            others.extend(stepped.map(|n| place(Scheme::Rkl1, n)));
            match now {
                None => look("step", others),
                Some(_) => {
                    let label = format!("{} {}", word(&p.scheme), p.repeat);
                    others.retain(|other| other.label != label);
                    let fine = |f: u32| diffused(Scheme::Explicit, least * f);
                    made("step", is(label, p.step), others, &fine(10), &fine(5))
                }
            }
        }
        "adaptive" => {
            need(marches, "casts no ray")?;
            need(
                scene.probe().is_some_and(|p| matches!(p.array, crate::probe::Array::Curved { .. })),
                "has no convex sweep",
            )?;
            is_one_picture()?;
            let now = s.ray.spread;
            let others = [0.0, 0.25, 0.5, 0.75, 1.0].into_iter().filter(|v| *v != now);
            let others = others.map(|v| at(format!("{v:.2}"), &[format!("ray.spread={v:.2}")], v));
            let best = |f: f64| ["ray.spread=0.0".to_string(), format!("ray.step={}", step * f)];
            made("share", is(format!("{now:.2}"), now), others.collect(), &best(finest_step), &best(next_step))
        }
        "resolution" => {
            let [w, h] = scene.picture_size();
            need(w >= 16 && h >= 16, "is smaller than 16 pixels")?;
            let sized = |share: f64| [w, h].map(|n| ((f64::from(n) * share).round() as u32).max(1));
            let others = [0.75, 0.5, 0.35, 0.25];
            let others = others.map(|f| {
                let [x, y] = sized(f);
                at(format!("{x} x {y}"), &[format!("picture.size=[{x},{y}]")], f)
            });
            let best = ["ray.rays=3".to_string()];
            made("share", is(format!("{w} x {h}"), 1.0), others.into(), &best, &["ray.rays=2".into()])
        }
        "rays" => {
            let now = s.ray.rays;
            let others = [1, 2, 3].into_iter().filter(|n| *n != now);
            let others = others.map(|n| at(format!("{n} x {n}"), &[format!("ray.rays={n}")], f64::from(n)));
            let fine = |n: u32| [format!("ray.rays={n}")];
            let now = is(format!("{now} x {now}"), f64::from(now));
            made("along an edge", now, others.collect(), &fine(4), &fine(3))
        }
        "lut" => {
            need(scene.probe().is_some(), "has no sweep")?;
            let now = s.ray.entries;
            let with = |n: u32| ["ray.slice_index='table'".to_string(), format!("ray.entries={n}")];
            let others = [3, 5, 9, 17, 33, 65, 129, 257, 1025, 4097].into_iter();
            let others = others.filter(|n| scene.slice_terms() > 0 || *n != now);
            let others = others.map(|n| at(n.to_string(), &with(n), f64::from(n)));
            // A polynomial has no entries.
            let default = match scene.slice_terms() {
                0 => is(now.to_string(), f64::from(now)),
                terms => is(format!("polynomial of {terms} terms"), 0.0),
            };
            made("entries", default, others.collect(), &with(65536), &with(16385))
        }
        "brick" => {
            need(marches, "leaps over nothing")?;
            let now = scene.brick();
            let word = |n: u32| if n == 0 { "none".to_string() } else { format!("{n} texels") };
            let others = [0, 4, 8, 16, 32].into_iter().filter(|n| *n != now);
            let others = others.map(|n| at(word(n), &[format!("ray.brick={n}")], f64::from(n)));
            // The reference takes every sample.
            let all = ["ray.brick=0".to_string()];
            made("texels", is(word(now), f64::from(now)), others.collect(), &all, &all)
        }
        "transfer" => {
            need(composites, "composites nothing")?;
            let now = scene.transfer_entries();
            // Assigning the rule too keeps the two dials from being combined: the table of pairs has a limit of its own.
            let rule = word(&s.volume.compositing);
            let set = |n: usize| [format!("volume.entries={n}"), format!("volume.compositing={rule}")];
            let pairs = matches!(s.volume.compositing, Compositing::PreIntegrated | Compositing::Exponential);
            let most = if pairs { 1024 } else { 4096 };
            // Sizes that the points of the transfer function allow.
            let allowed = |n: &usize| {
                let volume = Volume { entries: u32::try_from(*n).ok(), ..s.volume.clone() };
                *n <= most && transfer::entries(&volume).is_ok()
            };
            let others = [16, 32, 64, 128, 256, 512, 1024, 2048, 4096].into_iter().filter(|n| *n != now && allowed(n));
            let others = others.map(|n| at(n.to_string(), &set(n), n as f64)).collect();
            made("entries", is(now.to_string(), now as f64), others, &set(most), &set(most - most / 4))
        }
        "half" => {
            need(!scene.is_flat(), "casts no ray")?;
            need(s.ray.rays == 1, "casts several rays for each pixel")?;
            need(s.ray.subsampling <= 2, "casts one ray for 16 pixels or more")?;
            // Assigning `ray.rays` too keeps the two dials from being combined.
            let apart = |n: u32| [format!("ray.subsampling={n}"), "ray.rays=1".to_string()];
            let (word, value) = if s.ray.subsampling == 2 { ("half", 0.25) } else { ("whole", 1.0) };
            let other = match s.ray.subsampling {
                2 => at("whole".into(), &apart(1), 1.0),
                _ => at("half".into(), &apart(2), 0.25),
            };
            let best = |n: u32| ["ray.subsampling=1".to_string(), format!("ray.rays={n}")];
            made("rays a pixel", is(word.into(), value), vec![other], &best(3), &best(2))
        }
        "light-cell" => {
            need(scene.lit_by_volume().is_some(), "has no light volume")?;
            let lattice = scene.light_lattice();
            let (now, counts) = (lattice.cell, lattice.count.map(f64::from));
            let (total, along) = (counts.iter().product::<f64>(), counts.into_iter().fold(1.0, f64::max));
            // The finest lattice that a device is asked for, at most four times as fine as the scene's. Every point is coarser than it and the next one.
            let finest = now * (f64::max(total / MOST_LIGHT_CELLS, 1.0 / 64.0)).cbrt().max(along / 1000.0);
            let finest = finest.max(light_volume::least_cell(scene));
            need(
                finest * 2.0 <= now * (1.0 + 1e-9),
                "has a light volume of which none with cells half as large is measured: set light.volume.cell to more",
            )?;
            let set =
                |cell: f64| [format!("light.volume.cell={cell}"), format!("light.volume.cells={MOST_LIGHT_CELLS}")];
            let others =
                [4.0, 2.83, 2.0, 1.41, 0.707, 0.5].map(|f| f * now).into_iter().filter(|cell| *cell > 1.99 * finest);
            let others = others.map(|cell| at(format!("{cell:.3} mm"), &set(cell), cell)).collect();
            made("mm", is(format!("{now:.3} mm"), now), others, &set(finest), &set(finest * 2.0))
        }
        "light-taps" => {
            let Some(light) = scene.lit_by_volume() else { return Err("has no light volume".into()) };
            let set = |taps: u32| [format!("light.volume.taps={taps}")];
            let others = [1, 2, 3].into_iter().filter(|taps| *taps != light.taps);
            let others = others.map(|taps| at(taps.to_string(), &set(taps), f64::from(taps))).collect();
            let now = is(light.taps.to_string(), f64::from(light.taps));
            made("samples along the edge of a cell", now, others, &set(4), &set(3))
        }
        "light-widening" => {
            let Some(light) = scene.lit_by_volume() else { return Err("has no light volume".into()) };
            let others = [0.0, 0.2, 0.35, 0.5, 0.7, 1.0].into_iter().filter(|w| (*w - light.widening).abs() > 1e-9);
            let others = others.map(|w| at(format!("{w} mm"), &[format!("light.volume.widening={w}")], w));
            look("mm after 1 mm", others.collect())
        }
        "pipeline" => {
            need(marches, "casts no ray")?;
            is_one_picture()?;
            let format = s.slices.format;
            let lit = scene.lit_by_volume().map(|_| scene.light_lattice().cell);
            // Steps, cells of light and bits together: coarse ones are stored in 8 bits, fine ones in 32.
            let set = |factor: f64| {
                let format = match factor {
                    f if f >= 4.0 => VolumeFormat::R8,
                    f if f <= 0.25 => VolumeFormat::R32f,
                    _ => format,
                };
                let mut set = vec![format!("ray.step={}", step * factor), format!("slices.format={}", word(&format))];
                if let Some(cell) = lit {
                    set.push(format!("light.volume.cell={}", cell * factor));
                    set.push(format!("light.volume.cells={MOST_LIGHT_CELLS}"));
                }
                set
            };
            let others = [8.0, 4.0, 2.0, 0.5, 0.25, 0.125].into_iter().filter(|f| *f >= 4.0 * finest_step);
            let others = others.map(|f| at(format!("x {f}"), &set(f), f)).collect();
            let fine = |f: f64| set(f);
            made("times step and cell", is("x 1".into(), 1.0), others, &fine(finest_step), &fine(next_step))
        }
        _ => return Err(format!("is unknown; there are: {}, all", NAMES.join(", "))),
    };
    Ok(dial)
}

/// The name of a setting value as in a scene file.
fn word(value: &impl ToNode) -> String {
    String::from_node(value.to_node()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::{Geometry, Grid};
    use crate::scene::Input;
    use crate::scene::load::Layers;
    use crate::source::StoredType;

    /// Prevents a dial whose reference, with finer steps, is another filter.
    #[test]
    fn dials_of_steps_refuse_a_filter_along_the_ray() {
        let scene = |set: &str| {
            let mut layers = Layers::default();
            set.split_whitespace().for_each(|set| layers.set(set).expect("a setting"));
            let grid = Grid { size: [20; 3], spacing: [1.0; 3], origin: [0.0; 3] };
            let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
            Scene::new(Geometry::Cartesian(grid), input, layers.finish().expect("settings")).expect("a scene")
        };
        for name in ["step", "compositing"] {
            let said = dial(name, &scene("mode=volume ray.sliding=3")).expect_err(name);
            assert!(said.contains("ray.sliding=0"), "{said}");
            assert!(dial(name, &scene("mode=volume")).is_ok(), "{name}");
        }
    }
}
