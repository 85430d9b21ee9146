//! Property tests: after any sequence of commands and inputs the settings can be drawn, and numbers are finite.

use super::*;
use crate::command::{KEY_BINDINGS, Viewpoint};
use crate::input::Phase;
use crate::keys::HeldKeys;
use crate::scene::{Body, BodyMark, ColourMap, TransferName};
use proptest::prelude::*;

/// Numbers of users, and of broken drivers.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -3.0..3.0, 4 => -200.0..200.0, 1 => any::<f64>(), 1 => Just(f64::NAN), 1 => Just(f64::INFINITY)]
}

fn mode() -> impl Strategy<Value = Mode> {
    use Mode::*;
    prop::sample::select(vec![Volume, Surface, Mixed, Mip, MinIp, Mean, Plane, Orthogonal, Tomography, Cube])
}

fn tool() -> impl Strategy<Value = Tool> {
    let all =
        [Tool::Rotate, Tool::Light, Tool::Region, Tool::Clip, Tool::Cut, Tool::Plane, Tool::Curve, Tool::BodyMark];
    prop::sample::select(all.to_vec())
}

fn command() -> impl Strategy<Value = Command> {
    let two = || [number(), number()];
    prop_oneof![
        3 => mode().prop_map(Command::Mode),
        2 => prop::sample::select(vec![Layout::Single, Layout::Four, Layout::Beside, Layout::Pair]).prop_map(Command::Layout),
        1 => tool().prop_map(Command::Tool),
        1 => two().prop_map(Command::Rotate),
        1 => prop::sample::select(Body::ALL.to_vec()).prop_map(Command::AddBodyMark),
        1 => (0usize..6, two(), two(), number(), number()).prop_map(|(n, at, probe, size, angle)| {
            Command::ChangeBodyMark(n, BodyMark { at, probe, size, angle, ..BodyMark::default() })
        }),
        1 => (0usize..6).prop_map(Command::RemoveBodyMark),
        1 => prop::sample::select(vec![Viewpoint::Left, Viewpoint::Top]).prop_map(Command::LookFrom),
        1 => number().prop_map(Command::Roll),
        1 => number().prop_map(Command::Zoom),
        1 => two().prop_map(Command::Pan),
        1 => two().prop_map(Command::MoveLight),
        4 => (0usize..4, any::<bool>(), number()).prop_map(|(axis, high, by)| Command::MoveFace(Face { axis, high }, by)),
        1 => [number(), number(), number()].prop_map(Command::MoveRegion),
        2 => Just(Command::ToggleStartCurve),
        4 => (0usize..5, two()).prop_map(|(n, to)| Command::MoveStartHandle(n, to)),
        2 => prop::option::of(number()).prop_map(Command::AddStartHandle),
        1 => prop::option::of(0usize..5).prop_map(Command::RemoveStartHandle),
        3 => number().prop_map(Command::MoveClip),
        1 => prop::sample::select(vec![PlaneName::A, PlaneName::B, PlaneName::C]).prop_map(Command::Plane),
        1 => number().prop_map(Command::StepPlane),
        1 => [number(), number(), number()].prop_map(Command::MoveCrossing),
        1 => two().prop_map(Command::RotatePlanes),
        3 => two().prop_map(|point| Command::CurvePoint(PlaneName::B, point)),
        2 => Just(Command::EndCurve),
        1 => (0usize..3, two()).prop_map(|(index, to)| Command::MoveCurvePoint(index, to)),
        6 => (0..SLIDERS.len() + 1, number()).prop_map(|(place, value)| Command::SetSlider(place, value)),
        4 => (0..SLIDERS.len() + 1, any::<i32>()).prop_map(|(place, steps)| Command::StepSlider(place, steps % 20)),
        1 => prop::sample::select(vec![TransferName::Grey, TransferName::Bone]).prop_map(Command::Transfer),
        1 => prop::option::of(Just(TransferName::Bone)).prop_map(Command::Opacity),
        1 => prop::sample::select(vec![ColourMap::None, ColourMap::Ice]).prop_map(Command::ColourMap),
        1 => any::<bool>().prop_map(Command::Shadow),
        1 => Just(Command::Reset),
        1 => Just(Command::Freeze),
    ]
}

fn place() -> impl Strategy<Value = [f64; 2]> {
    prop_oneof![12 => [50.0..700.0, 0.0..600.0], 1 => [number(), number()]]
}

fn input() -> impl Strategy<Value = Input> {
    let button = prop::sample::select(vec![Button::Left, Button::Right, Button::Middle]);
    let phase = prop::sample::select(vec![Phase::Down, Phase::Moved, Phase::Moved, Phase::Up, Phase::Cancelled]);
    let modifiers = any::<[bool; 3]>().prop_map(|[shift, control, alt]| Modifiers { shift, control, alt });
    let key = prop::sample::select(KEY_BINDINGS.iter().map(|b| b.key).collect::<Vec<_>>());
    prop_oneof![
        8 => place().prop_map(Input::Moved),
        4 => (button, any::<bool>()).prop_map(|(button, pressed)| Input::Button { button, pressed }),
        2 => number().prop_map(Input::Scroll),
        3 => (key, any::<bool>()).prop_map(|(key, pressed)| Input::Key { key, pressed }),
        1 => modifiers.prop_map(Input::Modifiers),
        8 => (0u64..4, phase, place()).prop_map(|(finger, phase, at)| Input::Touch { finger, phase, at }),
        1 => Just(Input::PointerLeft),
        1 => Just(Input::FocusLost),
    ]
}

fn is_finite(command: &Command) -> bool {
    let all = |numbers: &[f64]| numbers.iter().all(|n| n.is_finite());
    match command {
        Command::MoveStartHandle(_, n) => all(n),
        Command::ChangeBodyMark(_, mark) => all(&mark.at) && all(&mark.probe) && all(&[mark.size, mark.angle]),
        Command::AddStartHandle(lateral) => lateral.is_none_or(f64::is_finite),
        Command::Rotate(n) | Command::Pan(n) | Command::MoveLight(n) | Command::RotatePlanes(n) => all(n),
        Command::Roll(n)
        | Command::Zoom(n)
        | Command::MoveFace(_, n)
        | Command::MoveClip(n)
        | Command::StepPlane(n) => n.is_finite(),
        Command::MoveCrossing(n) | Command::PointOnCurve(n) => all(n),
        Command::CurvePoint(_, n) | Command::MoveCurvePoint(_, n) => all(n),
        Command::SetSlider(_, n) => n.is_finite(),
        _ => true,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn settings_can_be_drawn_after_any_commands(
        commands in prop::collection::vec(command(), 1..60), size in any::<[u32; 2]>(), lag in 1usize..5,
    ) {
        for geometry in geometries() {
            for preset in presets() {
                let mut controls = Controls::new(settings(preset, ""));
                let Ok(mut shown) = Scene::new(geometry.clone(), BYTES, controls.settings().clone()) else { continue };
                controls.resize(size.map(|edge| edge % 3000));
                for (n, command) in commands.iter().enumerate() {
                    controls.apply(command, Some(&shown));
                    let drawn = Scene::new(geometry.clone(), BYTES, controls.settings().clone());
                    prop_assert!(drawn.is_ok(), "{preset} {command:?}: {}", drawn.unwrap_err());
                    // The scene on the screen lags behind.
                    if n % lag == 0 {
                        shown = drawn.unwrap();
                    }
                }
            }
        }
    }

}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn settings_are_valid_after_any_slider_values(
        slid in prop::collection::vec((0..SLIDERS.len(), number()), 1..40), mode in mode(),
    ) {
        for preset in presets() {
            let mut set = Settings { mode, ..settings(preset, "") };
            for (place, value) in &slid {
                SLIDERS[*place].set(&mut set, *value);
                prop_assert!(SLIDERS[*place].get(&set).is_finite());
            }
            // Checks that need no geometry.
            prop_assert!(set.surface.window[0] < set.surface.window[1] && set.volume.window[0] < set.volume.window[1]);
            prop_assert!(set.distance.median == 0 || set.distance.median % 2 == 1);
        }
    }

    #[test]
    fn any_inputs_give_commands_with_finite_numbers(
        inputs in prop::collection::vec((input(), tool(), any::<bool>()), 1..120), size in [0.0..900.0, 0.0..900.0],
    ) {
        for geometry in geometries() {
            for preset in ["", "fetal", "bone"] {
                let mut controls = Controls::new(settings(preset, "body_marks=[{at=[0.4,0.5],size=0.5}]"));
                let Ok(mut shown) = Scene::new(geometry.clone(), BYTES, controls.settings().clone()) else { continue };
                let (mut gestures, mut keys, mut now) = (Gestures::default(), HeldKeys::default(), Duration::ZERO);
                for (input, tool, follows) in &inputs {
                    now += Duration::from_millis(30);
                    let scene = Some(&shown).filter(|_| now.as_millis() % 11 != 0);
                    let measures = controls.measures().to_vec();
                    let body_marks = controls.body_marks().to_vec();
                    let (corner, has_work) = ([60.0, 5.0], controls.work().is_some());
                    let start_line = &controls.start_line().to_vec();
                    let is_covered = !follows;
                    let on =
                        Viewport { corner, size, scene, volume: None, measures: &measures, body_marks: &body_marks, start_line, has_work, is_covered, now };
                    let mut commands = gestures.input(input, &on, *tool, keys.modifiers);
                    commands.extend(keys.input(input));
                    for command in commands {
                        prop_assert!(is_finite(&command), "{input:?}: {command:?}");
                        controls.apply(&command, Some(&shown));
                    }
                    if *follows {
                        shown = scene_of(&geometry, controls.settings())?;
                    }
                }
            }
        }
    }
}

fn scene_of(geometry: &Geometry, settings: &Settings) -> Result<Scene, TestCaseError> {
    Scene::new(geometry.clone(), BYTES, settings.clone()).map_err(|e| TestCaseError::fail(e.to_string()))
}
