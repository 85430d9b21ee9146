//! The message about a picture in which nothing is visible: it has a single colour, or shows the ground alone. Each possible cause is
//! tested on the data that the rays meet, in the order of the stages of a picture.

use crate::gpu::{GpuError, Renderer};
use crate::passes::light_volume::bare_ground;
use crate::passes::postprocess::toned;
use crate::passes::raycast::survey::{self, Survey, survey};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::scene::{Layout, Mode, Scene, transfer};
use crate::source::StoredType;
use crate::source::describe::number;

/// What fills the picture, in words, if nothing is visible in it: all pixels have one colour, or show the ground. None otherwise, and for a picture
/// of one pixel.
fn of(scene: &Scene, picture: &Picture) -> Option<String> {
    let mut pixels = picture.rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]]);
    let first = pixels.next().filter(|_| picture.rgba.len() > 4)?;
    if !pixels.all(|p| p == first) {
        return is_ground(scene, picture).then(|| "the ground alone (light.volume.ground)".into());
    }
    Some(match first {
        [0, 0, 0] => "wholly black".into(),
        [255, 255, 255] => "wholly white".into(),
        [r, g, b] => format!("wholly of one colour (red {r}, green {g}, blue {b})"),
    })
}

/// True if every pixel has the colour of the ground, to a level.
fn is_ground(scene: &Scene, picture: &Picture) -> bool {
    // Where tiles share the picture, others are full.
    if scene.settings.layout != Layout::Single || [picture.width, picture.height] != scene.picture_size() {
        return false;
    }
    let [across, down] = [0, 1].map(|a| f64::from(scene.ray_size()[a]) / f64::from(scene.picture_size()[a]));
    let width = picture.width as usize;
    picture.rgba.chunks_exact(4).enumerate().all(|(n, pixel)| {
        let at = [((n % width) as f64 + 0.5) * across, ((n / width) as f64 + 0.5) * down];
        let shown = bare_ground(scene, at).map(|ground| toned(scene, ground));
        shown.is_some_and(|shown| shown.iter().zip(pixel).all(|(c, byte)| (255.0 * c - f64::from(*byte)).abs() <= 1.0))
    })
}

/// The warning about a picture of the renderer in which nothing is visible, with the cause; None for any other picture. `shift`: stored sample minus
/// the value in the file; `name`: of the picture. An error if the volume cannot be read from the device.
pub fn warning(renderer: &mut Renderer, picture: &Picture, shift: f64, name: &str) -> Result<Option<String>, GpuError> {
    let Some(shown) = of(renderer.scene(), picture) else { return Ok(None) };
    let volume = renderer.read(Slot::Volume)?;
    let why = volume.map_or("the scene has no volume".into(), |volume| cause(renderer.scene(), &volume, shift));
    Ok(Some(format!("{name}: is {shown}: {why}")))
}

/// The reason in words why nothing is visible. `volume`: texels of the scene's volume; `shift`: stored sample minus the value in the file.
fn cause(scene: &Scene, volume: &Texels, shift: f64) -> String {
    let seen = survey(scene, volume);
    if seen.met == 0 {
        return nothing_met(scene, volume);
    }
    let Some(values) = seen.values else { return nothing_insonified(scene) };
    let [low, high] = scene.input.range.map(|v| v - shift);
    let in_file = |v: f64| number(low + v * (high - low));
    // Bytes are stored in 11 bits or more, which give them back exactly.
    let sample = |v: f64| match scene.input.stored {
        StoredType::U8 => number((low + v * (high - low)).round()),
        StoredType::U16 | StoredType::F32 => in_file(v),
    };
    let found = match values {
        // R16F and the sums of a filter keep a constant to their last bits.
        [least, most] if most - least < 2e-6 => format!("every sample that it shows is {}", sample(least)),
        [least, most] => format!("the samples that it shows are {} .. {}", sample(least), sample(most)),
    };
    let (key, window) = window(scene);
    let [dark, bright] = window;
    let place = match values {
        [_, most] if most <= dark => Some("below"),
        [least, _] if least >= bright => Some("above"),
        _ => None,
    };
    if let Some(place) = place {
        let [from, to] = window.map(in_file);
        let constant = if values[1] - values[0] < 2e-6 { ", a constant volume" } else { "" };
        return format!("{found}{constant}, {place} the grey window {key}=[{dark}, {bright}], which is {from} .. {to}");
    }
    if values[1] - values[0] < 2e-6 {
        return format!("{found}, a constant volume");
    }
    let windowed = values.map(|v| ((v - dark) / (bright - dark)).clamp(0.0, 1.0));
    match scene.settings.mode {
        Mode::Volume if is_transparent(scene, windowed) => {
            format!(
                "{found}, for which volume.transfer with volume.threshold={} is transparent",
                scene.settings.volume.threshold
            )
        }
        Mode::Surface | Mode::Mixed if seen.edge <= scene.settings.surface.threshold => no_edge(scene, &seen, &found),
        _ => toned_away(scene).unwrap_or_else(|| format!("{found}; no single setting explains it")),
    }
}

/// Name and limits of the mode's grey window.
fn window(scene: &Scene) -> (&'static str, [f64; 2]) {
    let key = match scene.settings.mode {
        Mode::Volume => "volume.window",
        Mode::Surface | Mode::Mixed => "surface.window",
        Mode::Mip | Mode::MinIp | Mode::Mean => "projection.window",
        Mode::Plane | Mode::Orthogonal | Mode::Tomography => "planes.window",
        Mode::Cube => "cube.window",
    };
    (key, survey::view(scene).window)
}

/// No ray and no point of a plane lies in the box within the clip planes.
fn nothing_met(scene: &Scene, volume: &Texels) -> String {
    let unclipped =
        Scene { settings: crate::scene::Settings { clip: Vec::new(), ..scene.settings.clone() }, ..scene.clone() };
    if !scene.settings.clip.is_empty() && survey(&unclipped, volume).met > 0 {
        return "the clip planes (clip) leave nothing of the rendered box".into();
    }
    if scene.is_flat() {
        return "no plane passes through the rendered box: see planes.position".into();
    }
    let rays = &scene.rays;
    let extent = scene.high - scene.low;
    let middle = (scene.low + scene.high) / 2.0;
    let distance = if rays.is_perspective { (middle - rays.origin).dot(rays.forward) } else { 1.0 };
    let thin = [
        (rays.right, rays.origin_dx + rays.direction_dx * distance),
        (rays.up, rays.origin_dy + rays.direction_dy * distance),
    ]
    .map(|(axis, pixel)| (axis.abs().dot(extent), pixel.length()))
    .into_iter()
    .find(|(across, pixel)| across < pixel);
    match thin {
        Some((across, pixel)) => format!(
            "the rendered box is seen edge-on, {} mm thin between rays that are {} mm apart; turn it (camera.azimuth, camera.elevation)",
            number(across),
            number(pixel)
        ),
        None => "no ray meets the rendered box: the camera looks past it (camera.target, camera.zoom)".into(),
    }
}

/// Rays pass through the box but meet no place that the probe insonified.
fn nothing_insonified(scene: &Scene) -> String {
    let region = &scene.settings.region;
    let has_region = region.lateral.is_some() || region.depth.is_some() || region.elevation.is_some();
    match (has_region, scene.settings.clip.is_empty(), scene.is_flat()) {
        (_, _, true) => {
            "the planes meet no place of the insonified sector in the region of interest and within the clip planes"
                .into()
        }
        (true, true, _) => "the region of interest (region) holds no place of the insonified sector".into(),
        (true, false, _) => {
            "the region of interest (region) within the clip planes (clip) holds no place of the insonified sector"
                .into()
        }
        (false, false, _) => "the clip planes (clip) leave no place of the insonified sector".into(),
        (false, true, _) => "no ray meets the insonified sector: see camera.target and camera.zoom".into(),
    }
}

/// True if the transfer function has no opacity between two windowed values.
fn is_transparent(scene: &Scene, [low, high]: [f64; 2]) -> bool {
    let entries = scene.transfer_entries();
    let table = transfer::table(&transfer::of(&scene.settings.volume), scene.settings.volume.threshold, entries);
    let last = entries - 1;
    let [from, to] = [low, high].map(|v| v * last as f64);
    let touched = (from.floor() as usize).min(last)..=(to.ceil() as usize).min(last);
    table.get(touched).is_some_and(|entries| entries.iter().all(|entry| entry[3] == 0.0))
}

fn no_edge(scene: &Scene, seen: &Survey, found: &str) -> String {
    let surface = &scene.settings.surface;
    let length = number(f64::from(scene.ring.half) * scene.ring.step);
    format!(
        "{found}, and no edge is as high as surface.threshold={}: the largest over {length} mm is {}",
        surface.threshold,
        number(seen.edge)
    )
}

/// Stage 4 maps every value to one.
fn toned_away(scene: &Scene) -> Option<String> {
    let post = &scene.settings.post;
    if post.contrast == 0.0 {
        return Some("post.contrast=0 maps every value to one".into());
    }
    (post.brightness.abs() >= 0.9).then(|| format!("post.brightness={} leaves one level", post.brightness))
}
