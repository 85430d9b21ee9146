//! Tasks of cuts and of looks.

use super::*;

/// The fetal head, which lies still.
fn head() -> Phantom {
    let options = PhantomOptions { lines: 96, samples: 384, still: true, ..PhantomOptions::default() };
    Phantom::new(options).expect("a phantom")
}

/// What each ray of a rendering meets first, by the phantom's labels: what the surface is at the place that mode surface finds.
fn met(device: &Arc<Context>, phantom: &Phantom, scene: &Scene) -> Vec<Option<Label>> {
    let mut settings = Settings { mode: Mode::Surface, ..scene.settings.clone() };
    (settings.surface.threshold, settings.ray.subsampling) = (0.18, 1);
    let scene = Scene::new(scene.geometry.clone(), scene.input, settings).expect("a scene");
    let mut renderer = Renderer::new(device, scene.clone(), &RendererOptions::default()).expect("a renderer");
    for frame in phantom.volume(0) {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("a frame");
    }
    renderer.show(0).expect("a volume");
    renderer.picture().expect("a picture");
    let distances = renderer.read(Slot::Distance).expect("read").expect("distances");
    let width = distances.size[0];
    let label = |n: usize| {
        let distance = distances.values[n];
        let (origin, direction) = scene.rays.at((n % width) as f64 + 0.5, (n / width) as f64 + 0.5);
        // The surface that is found lies up to a few mm in front of the skin: so wide is the beam.
        let mut behind =
            (0..8).map(|n| phantom.label(0, origin + direction * (distance + 0.5 * f64::from(n))).expect("a label"));
        is_hit(distance).then(|| behind.find(|label| *label != Label::Fluid).unwrap_or(Label::Fluid))
    };
    (0..distances.values.len()).map(label).collect()
}

/// Rays of the largest part of a picture that meets this: the end of the cord lies in the wall, where nobody sees that it is there.
fn largest_part(met: &[Option<Label>], width: usize, label: Label) -> Vec<bool> {
    let mut seen = vec![false; met.len()];
    let mut largest = Vec::new();
    for first in 0..met.len() {
        let mut part = Vec::new();
        let mut waiting = vec![first];
        while let Some(n) = waiting.pop() {
            if met.get(n) == Some(&Some(label)) && !seen[n] {
                seen[n] = true;
                part.push(n);
                waiting.extend([n + 1, n + width].into_iter().chain(n.checked_sub(1)).chain(n.checked_sub(width)));
            }
        }
        if part.len() > largest.len() {
            largest = part;
        }
    }
    let mut is_in = vec![false; met.len()];
    largest.into_iter().for_each(|n| is_in[n] = true);
    is_in
}

/// The front of the ball, as seen, is brushed away as deep as the brush reaches.
pub(super) fn speck(user: &mut User) -> String {
    let scene = user.scene();
    let front = user.ball.0 - scene.rays.forward * user.ball.1;
    let middle = Picker::of(&scene).project(front).expect("in front");
    user.letter('z');
    let way: Vec<_> = (-10..=10).map(|n| in_window([middle[0] + 2.0 * f64::from(n), middle[1]])).collect();
    user.drag(&way);
    let scene = user.scene();
    let shape = scene.cuts().next().expect("a cut");
    let deeper = |mm: f64| front + scene.rays.forward * mm;
    // The surface is found within the width of a sample and of a slice.
    assert!(shape.removes(deeper(0.0)) && shape.removes(deeper(2.5)) && !shape.removes(deeper(6.0)));
    user.count()
}

pub(super) fn bone(user: &mut User) -> String {
    user.control('p');
    user.letter('5');
    let settings = user.console.controls().settings();
    assert_eq!((settings.surface.threshold, settings.distance.median), (0.08, 15), "those of preset bone");
    user.count()
}

pub(super) fn kept_look(user: &mut User) -> String {
    user.console.execute(&Command::Mode(Mode::Mip), Instant::now());
    user.settle();
    user.control('p');
    user.letter('s');
    user.types("thin");
    user.key(Key::Enter);
    let kept = echolume::low_level::user_presets::read(&user.folder.0.join("presets.toml")).expect("presets");
    assert_eq!((kept[0].name.as_str(), kept[0].look().expect("a look").mode), ("thin", Mode::Mip));
    let actions = user.count();
    user.press(Modifiers::default(), Key::Escape);
    actions
}

/// At another console, of the fetal head, from the front: by the phantom's labels the cord is gone from the picture, and the rest is as before.
pub(super) fn cord(user: &mut User) -> String {
    let phantom = head();
    let mut layers = Layers::default();
    layers.preset("face").expect("the preset");
    let mut settings = layers.finish().expect("settings");
    settings.ray.subsampling = 4;
    let kept = user.at_another(settings, head);
    let scene = user.scene();
    let before = met(&user.device, &phantom, &scene);
    let [width, height] = scene.picture_size().map(|n| n as usize);
    assert_eq!(before.len(), width * height);
    let cord = largest_part(&before, width, Label::Cord);
    // Down along the cord, and up again, a little beside it, and over the edge of the picture.
    let rows: Vec<[f64; 3]> = (0..height)
        .filter_map(|y| {
            let of_cord = |x: &usize| cord[y * width + x];
            let ends = [(0..width).find(of_cord)?, (0..width).rev().find(of_cord)?];
            Some([y, ends[0], ends[1]].map(|n| n as f64 + 0.5))
        })
        .collect();
    let ends = [rows[0][0] - BESIDE, rows[rows.len() - 1][0] + BESIDE];
    let around: Vec<[[f64; 2]; 2]> = (0..=(ends[1] - ends[0]) as usize)
        .map(|n| {
            let y = ends[0] + n as f64;
            let near = rows.iter().filter(|row| (row[0] - y).abs() <= BESIDE);
            let wide = near.map(|[at, left, right]| {
                let by = (BESIDE * BESIDE - (at - y) * (at - y)).sqrt();
                [left - by, right + by]
            });
            let [left, right] = wide.fold([f64::INFINITY, 0.0], |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
            [[left, y], [right, y]].map(in_window)
        })
        .collect();
    let way: Vec<_> = around.iter().map(|row| row[1]).chain(around.iter().rev().map(|row| row[0])).collect();
    user.letter('f');
    user.drag(&way);
    user.until("cut", |user| (user.scene().settings.cuts.len() == 1).then_some(()));
    let scene = user.scene();
    let after = met(&user.device, &phantom, &scene);
    let was = cord.iter().filter(|of_cord| **of_cord).count();
    let is = cord.iter().zip(&after).filter(|(of_cord, met)| **of_cord && **met == Some(Label::Cord)).count();
    assert!(was > 2000 && is < was / 50, "{was} rays met the cord, {is} do");
    // Along the contour the smallest part of a slice may be missing.
    for label in [Label::Skin, Label::Hand] {
        let seen = || before.iter().zip(&after).filter(|(before, _)| **before == Some(label));
        let (all, stay) = (seen().count(), seen().filter(|(before, after)| before == after).count());
        assert!(all > 2000 && stay as f64 > 0.99 * all as f64, "{}: {stay} of {all} rays", label.name());
    }
    user.console = kept;
    user.count()
}

/// How far beside the cord the contour is drawn, pixels.
const BESIDE: f64 = 10.0;
