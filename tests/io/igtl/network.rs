//! OpenIGTLink as a live source: volumes and freehand frames with known values, and faults.

use super::client::*;
use super::messages::*;
use crate::common::wait;
use echolume::low_level::probe::{Geometry, Grid, World};
use echolume::low_level::source::freehand::{self, Schedule};
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::source::recorder::Header;
use echolume::low_level::source::{Frame, StoredType};
use glam::DVec3;

fn options() -> NetworkOptions {
    NetworkOptions { client: quick(), ..NetworkOptions::default() }
}

fn connect(messages: Vec<u8>, options: NetworkOptions) -> Network {
    Network::connect(&serve(vec![send_and_stay(messages)]), options).unwrap()
}

/// Events up to the awaited one, for 10 s at most.
fn until(network: &mut Network, is_last: impl Fn(&Event) -> bool) -> Vec<Event> {
    let (mut events, started) = (Vec::new(), Instant::now());
    while !events.last().is_some_and(&is_last) {
        match network.next(Duration::from_millis(50)) {
            Event::Idle => assert!(started.elapsed() < Duration::from_secs(10), "{events:?}"),
            event => events.push(event),
        }
    }
    events
}

fn received(network: &Network, messages: u64) {
    wait::until("the messages", || (network.statistics().messages >= messages).then_some(()));
}

fn is_fault(named: &str) -> impl Fn(&Event) -> bool + use<'_> {
    move |event| matches!(event, Event::Fault(fault) if fault.contains(named))
}

/// The next volume: its header, if it begins a stream, and its frames.
fn volume(network: &mut Network, slices: usize) -> (Option<Header>, Vec<Frame>) {
    let events = until(network, |e| matches!(e, Event::Frame(frame) if frame.slice + 1 == slices));
    let (mut header, mut frames) = (None, Vec::new());
    for event in events {
        match event {
            Event::Begin(begun) => header = Some(*begun),
            Event::Frame(frame) => frames.push(frame),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(frames.len(), slices);
    for (k, frame) in frames.iter().enumerate() {
        assert_eq!((frame.number as usize, frame.slice, frame.volume), (k, k, frames[0].volume));
    }
    (header, frames)
}

fn grid(header: Option<Header>) -> Grid {
    let header = header.expect("a volume that begins");
    assert_eq!(header.forward, header.backward);
    let Geometry::Cartesian(grid) = header.forward else { panic!("a Cartesian volume") };
    grid
}

fn all(frames: &[Frame]) -> Vec<u8> {
    frames.iter().flat_map(|f| f.bytes.clone()).collect()
}

#[test]
fn volumes_keep_their_values_and_only_a_changed_geometry_begins_a_new_stream() {
    let first = image(5.0, [4, 3, 2]);
    let second = Image { bytes: vec![9; 24], time: 6.0, ..first.clone() };
    let turned = Image { axes: [[0.0, 0.3, 0.4], [0.25, 0.0, 0.0], [0.0, 0.8, -0.6]], ..second.clone() };
    let wider = Image { axes: [[0.6, 0.0, 0.0], turned.axes[1], turned.axes[2]], ..second.clone() };
    let words: Vec<u8> = (0..24i16).flat_map(|v| (v * 100 - 1000).to_le_bytes()).collect();
    let signed = Image { scalar: Scalar::I16, bytes: words, ..wider.clone() };
    let colours = Image { components: 3, bytes: [100, 200, 50].repeat(24), ..wider.clone() };
    let every = [&first, &second, &turned, &wider, &signed, &colours];
    let messages = every.into_iter().flat_map(|i| bytes(&Message::Image(i.clone()))).collect();
    let mut network = connect(messages, options());
    assert!(!network.can_wait());
    let (header, frames) = volume(&mut network, 2);
    assert_eq!((all(&frames), frames[0].volume, frames[1].time), (first.bytes, 0, Some(5.0)));
    assert_eq!(header.as_ref().map(|h| (h.stored, h.range)), Some((StoredType::U8, [0.0, 255.0])));
    let expected = Grid { size: [4, 3, 2], spacing: [0.5, 0.25, 1.0], origin: [-0.75, 0.0, -0.5] };
    assert_eq!(grid(header), expected);
    for number in 1..3 {
        let (header, frames) = volume(&mut network, 2);
        assert_eq!((header, all(&frames), frames[0].volume), (None, vec![9; 24], number), "only its place changed");
    }
    let (header, frames) = volume(&mut network, 2);
    assert_eq!(frames[0].volume, 3);
    assert!((grid(header).spacing[0] - 0.6).abs() < 1e-6);
    let (header, frames) = volume(&mut network, 2);
    let header = header.expect("another type");
    assert_eq!((header.stored, header.range), (StoredType::U16, [31768.0, 34068.0]));
    let expected: Vec<u8> = (0..24u16).flat_map(|v| (v * 100 + 31768).to_le_bytes()).collect();
    assert_eq!(all(&frames), expected);
    let (header, frames) = volume(&mut network, 2);
    // 29.9 + 117.4 + 5.7.
    assert_eq!((header.map(|h| h.stored), all(&frames)), (Some(StoredType::U8), vec![153; 24]));
}

#[test]
fn a_left_handed_image_is_not_shown_mirrored() {
    let plain = image(1.0, [4, 3, 2]);
    let [i, j, k] = plain.axes;
    let mirrored = Image { axes: [i.map(|v| -v), j, k], ..plain.clone() };
    let turned = Image { axes: [i.map(|v| -v), j.map(|v| -v), k], ..plain.clone() };
    let every = [&plain, &mirrored, &turned];
    let mut network = connect(every.into_iter().flat_map(|i| bytes(&Message::Image(i.clone()))).collect(), options());
    let reversed: Vec<u8> = plain.bytes.chunks(4).flat_map(|row| row.iter().rev().copied()).collect();
    for expected in [&plain.bytes, &reversed, &plain.bytes] {
        let (_, frames) = volume(&mut network, 2);
        assert_eq!(all(&frames), *expected);
    }
}

#[test]
fn a_volume_in_parts_shows_when_all_its_slices_came() {
    let whole = image(1.0, [4, 3, 4]);
    let part = |first: u16, count: u16, value: u8| Image {
        region: Region { offset: [0, 0, first], size: [4, 3, count] },
        bytes: vec![value; 12 * usize::from(count)],
        ..whole.clone()
    };
    // Twice in parts and in any order, once with a slice that was lost, and once more.
    let parts = [part(2, 2, 5), part(0, 1, 3), part(1, 1, 4)];
    let again = [part(0, 2, 8), part(2, 2, 9)];
    let lost = [part(0, 1, 20), part(2, 2, 21)];
    let last = [part(0, 1, 30), part(1, 3, 31)];
    let every = [parts.to_vec(), again.to_vec(), lost.to_vec(), last.to_vec()].concat();
    let mut network = connect(every.into_iter().flat_map(|i| bytes(&Message::Image(i))).collect(), options());
    let of = |values: [u8; 4]| values.iter().flat_map(|v| vec![*v; 12]).collect::<Vec<_>>();
    assert_eq!(all(&volume(&mut network, 4).1), of([3, 4, 5, 5]));
    assert_eq!(all(&volume(&mut network, 4).1), of([8, 8, 9, 9]));
    let events = until(&mut network, |e| matches!(e, Event::Frame(frame) if (frame.volume, frame.slice) == (2, 3)));
    let frames: Vec<Frame> =
        events.iter().filter_map(|e| if let Event::Frame(f) = e { Some(f.clone()) } else { None }).collect();
    assert_eq!(all(&frames), of([30, 31, 31, 31]));
    let is_told = events.iter().any(is_fault("incomplete volumes left out: 1 of its slices did not come"));
    assert!(is_told, "{events:?}");
}

#[test]
fn complete_slices_are_placed_and_smaller_parts_are_refused() {
    let whole = image(1.0, [4, 3, 4]);
    let part = |offset: [u16; 3], size: [u16; 3], value: u8| Image {
        region: Region { offset, size },
        bytes: vec![value; size.iter().map(|n| usize::from(*n)).product()],
        ..whole.clone()
    };
    let two = Image { components: 2, bytes: vec![0; 96], ..whole.clone() };
    let flat = Image { axes: [[0.5, 0.0, 0.0], [0.0; 3], [0.0, 0.0, 1.0]], ..whole.clone() };
    let first = part([0, 0, 1], [4, 3, 2], 77);
    let refused = [part([0, 1, 0], [4, 2, 4], 1), two, flat];
    let every = [vec![first], refused.to_vec(), vec![whole.clone(), part([0, 0, 3], [4, 3, 1], 200)]].concat();
    let messages = every.into_iter().flat_map(|i| bytes(&Message::Image(i))).collect();
    let mut network = connect(messages, options());
    // Slices 1 and 2 alone are no volume.
    let events = until(&mut network, |e| matches!(e, Event::Frame(frame) if (frame.volume, frame.slice) == (1, 3)));
    let frames: Vec<Frame> =
        events.iter().filter_map(|e| if let Event::Frame(f) = e { Some(f.clone()) } else { None }).collect();
    assert_eq!(all(&frames[..4]), whole.bytes);
    assert_eq!(all(&frames[4..]), [&whole.bytes[..36], &[200; 12]].concat());
    let faults: Vec<&Event> = events.iter().filter(|e| matches!(e, Event::Fault(_))).collect();
    assert!(is_fault("images passed over: a part of 4 x 2 of 4 x 3 pixels")(faults[0]), "{faults:?}");
    // The others a second later, together.
    until(&mut network, is_fault("images passed over (2): spacing is 0e0 mm"));
}

#[test]
fn a_volume_that_is_claimed_and_does_not_come_takes_no_memory() {
    let mut claim = image(1.0, [4, 3, 1]);
    claim.size[2] = 65535;
    let mut network = connect(bytes(&Message::Image(claim)), NetworkOptions { volume_bytes: 100_000, ..options() });
    until(&mut network, is_fault("a volume of 4 x 3 x 65535 voxels; at most 100000 bytes"));
}

/// Frame k of a sweep along z, 1 mm apart: pixels of 0.5 x 0.25 mm, the value of each 10 k + 10.
fn tracked(k: u8) -> Image {
    Image { bytes: vec![k.wrapping_mul(10).wrapping_add(10); 30], ..image(f64::from(k), [6, 5, 1]) }
}

fn moved(k: u8) -> Message {
    let mut matrix = IDENTITY;
    matrix[2][3] = f32::from(k);
    Message::Transform(Transform { device: "Probe".into(), time: f64::from(k), matrix })
}

fn sweep_options() -> NetworkOptions {
    let freehand =
        freehand::CompoundingOptions { margin: 1.0, spacing: Some(0.5), ..freehand::CompoundingOptions::default() };
    let silence = Duration::from_secs(60);
    let schedule = Schedule { first: 4, silence, interval: Duration::from_millis(200), pictures: 2 };
    NetworkOptions { freehand, schedule, ..options() }
}

/// The values in the middle of each slice.
fn middles(grid: &Grid, frames: &[Frame]) -> Vec<u8> {
    let [x, y, _] = grid.size;
    frames.iter().map(|f| f.bytes[y / 2 * x + x / 2]).collect()
}

#[test]
fn tracked_frames_become_a_volume_that_goes_on_growing() {
    for poses in [Poses::Messages { device: Some("Probe".into()), tolerance: 0.1, patience: 1.0 }, Poses::Image] {
        let by_messages = poses != Poses::Image;
        let message = move |k: u8| match by_messages {
            true => [bytes(&moved(k)), bytes(&Message::Image(tracked(k)))].concat(),
            false => bytes(&Message::Image(Image { centre: [0.0, 0.0, f32::from(k)], ..tracked(k) })),
        };
        let script: Script = Box::new(move |mut stream| {
            use std::io::Write;
            stream.write_all(&[0, 1, 2, 4].map(message).concat()).unwrap();
            wait::pace(Duration::from_millis(300));
            stream.write_all(&[3, 9].map(message).concat()).unwrap();
            stay(&mut stream);
        });
        let options = NetworkOptions { poses: poses.clone(), ..sweep_options() };
        let mut network = Network::connect(&serve(vec![script]), options).unwrap();
        // 2.5 x 1 x 4 mm and 1 mm around, voxels of 0.5 mm.
        let (header, frames) = volume(&mut network, 13);
        let grid = grid(header);
        assert_eq!(grid.size, [10, 7, 13]);
        assert!(grid.origin.iter().zip([-2.25, -1.0, -2.75]).all(|(a, b)| (a - b).abs() < 1e-6), "{grid:?}");
        // Frames fill the slices that they lie on, holes of up to 2 mm are bridged: 3 mm lies in one of 1.5 mm. Nothing is beyond.
        let expected = [0, 0, 10, 15, 20, 25, 30, 35, 40, 45, 50, 0, 0];
        assert_eq!(middles(&grid, &frames), expected, "{poses:?}");
        assert_eq!((frames[0].bytes[0], frames[0].volume), (0, 0));
        // The volume grows to 9 mm, and a quarter of its length beyond; what it had stays where it was. The frame at 3 mm replaces only bridged
        // voxels.
        let (header, frames) = volume(&mut network, 25);
        let larger = self::grid(header);
        assert_eq!((larger.size, larger.spacing, larger.origin), ([10, 7, 25], grid.spacing, grid.origin));
        let expected = [&expected[..11], &[0; 9], &[100], &[0; 4]].concat();
        assert_eq!((middles(&larger, &frames), frames[0].volume, network.left_out()), (expected, 1, 0));
    }
}

#[test]
fn frames_without_a_pose_are_reported_and_do_not_wait_for_ever() {
    let early = |k: u8| bytes(&Message::Image(tracked(k)));
    let messages = [early(1), early(20), bytes(&moved(20)), early(30), bytes(&moved(30)), bytes(&moved(31))].concat();
    // Two have a pose, four are awaited.
    let mut network = connect(messages, sweep_options());
    until(&mut network, is_fault("frames without a pose left out: no transform came; --tool image"));
    until(&mut network, is_fault("images of one slice have no place"));
    let started = Instant::now();
    assert!(matches!(network.next(Duration::from_millis(50)), Event::Idle));
    assert!((50..5000).contains(&started.elapsed().as_millis()), "{:?}", started.elapsed());
}

#[test]
fn pictures_without_a_place_of_their_own_are_said_at_once() {
    let pictures = |count: u8| (0..count).flat_map(|_| bytes(&Message::Image(tracked(1)))).collect::<Vec<u8>>();
    let still = |count: u8| (0..count).flat_map(|_| [bytes(&moved(7)), bytes(&Message::Image(tracked(7)))].concat());
    let slow = NetworkOptions { schedule: Schedule { first: 100, ..Schedule::default() }, ..options() };
    let by_matrix = NetworkOptions { poses: Poses::Image, ..slow.clone() };
    let what_to_do =
        "--tool NAME), or IMAGEs with its matrix (--tool image); frames of a probe with a motor come by a pipe";
    for (messages, options, said) in [
        (pictures(2), slow.clone(), "images of one slice have no place: no transform came with them"),
        (pictures(10), by_matrix.clone(), "have no place: the matrix of the first 10 is the same"),
        (still(10).collect(), slow.clone(), "have no place: the transform of the first 10 is the same"),
    ] {
        let mut network = connect(messages, options);
        let events = until(&mut network, |event| matches!(event, Event::Fault(_)));
        assert!(events.len() == 1 && is_fault(said)(&events[0]) && is_fault(what_to_do)(&events[0]), "{events:?}");
    }
    // One picture may come before its transform, and a probe may rest for some.
    let moving =
        [pictures(1), (0..12).flat_map(|k| [bytes(&moved(k)), bytes(&Message::Image(tracked(k)))].concat()).collect()];
    let resting = [pictures(9), bytes(&Message::Image(Image { centre: [0.0, 0.0, 1.0], ..tracked(1) })), pictures(9)];
    for (messages, options, count) in [(moving.concat(), slow, 25), (resting.concat(), by_matrix, 19)] {
        let mut network = connect(messages, options);
        received(&network, count);
        for _ in 0..count {
            let event = network.next(Duration::ZERO);
            assert!(matches!(event, Event::Idle), "{event:?}");
        }
    }
}

#[test]
fn transforms_that_came_are_listed_where_none_fits() {
    let frame = |k: u8| bytes(&Message::Image(tracked(k)));
    let named = |device: &str| bytes(&transform(device, 1.0, 0.0));
    for (tool, said) in [
        (Some("Needle"), "no transform of 'Needle' came; --tool takes one of 'Probe', 'Stylus'"),
        (Some("Probe"), "no pose came within 0.1 s of their time; the transforms are 'Probe', 'Stylus'"),
    ] {
        let messages = [named("Probe"), named("Stylus"), frame(20), frame(200)].concat();
        let poses = Poses::Messages { device: tool.map(str::to_string), tolerance: 0.1, patience: 0.1 };
        let mut network = connect(messages, NetworkOptions { poses, ..options() });
        until(&mut network, is_fault(said));
    }
}

#[test]
fn one_device_of_several_is_picked_and_the_others_are_named() {
    let of = |device: &str, value: u8| {
        let image = Image { device: device.into(), bytes: vec![value; 24], ..image(f64::from(value), [4, 3, 2]) };
        bytes(&Message::Image(image))
    };
    let messages = || [of("Left", 1), of("Right", 2), of("Left", 3)].concat();
    let mut network = connect(messages(), NetworkOptions { device: Some("Right".into()), ..options() });
    let events = until(&mut network, |e| matches!(e, Event::Frame(frame) if frame.slice == 1));
    assert!(events.iter().all(|e| !matches!(e, Event::Frame(frame) if frame.bytes != [2; 12])), "{events:?}");
    let mut network = connect(messages(), options());
    until(&mut network, is_fault("images of several devices: 'Left', 'Right'; --device-name takes one of them"));
    let mut network = connect(messages(), NetworkOptions { device: Some("Middle".into()), ..options() });
    until(&mut network, is_fault("no image of 'Middle' came; there are 'Left'"));
}

/// A volume's place is that of its message, also of one whose rows are reversed.
#[test]
fn volumes_have_the_place_of_their_message() {
    let plain = image(1.0, [4, 3, 2]);
    let [i, j, k] = plain.axes;
    let oblique = [[0.3, 0.4, 0.0], [-0.2, 0.15, 0.0], [0.0, 0.0, 1.0]];
    for (axes, coordinates) in [
        ([i, j, k], Coordinates::Lps),
        (oblique, Coordinates::Ras),
        ([oblique[0].map(|v| -v), oblique[1], oblique[2]], Coordinates::Lps),
    ] {
        let sent = Image { axes, coordinates, centre: [10.0, -20.0, 30.0], ..plain.clone() };
        let (header, frames) = volume(&mut connect(bytes(&Message::Image(sent.clone())), options()), 2);
        let (grid, to_world) = (grid(header), sent.index_to_mm(Coordinates::Lps));
        let world = World::posed(&frames[0].pose.expect("a place"), &grid).expect("rigid");
        for (n, value) in all(&frames).into_iter().enumerate() {
            // The samples of the message are their own numbers.
            let stored = usize::from(value);
            let cell = |n: usize| DVec3::from([n % 4, n / 4 % 3, n / 12].map(|n| n as f64));
            let (there, here) = (to_world.transform_point3(cell(stored)), world.at(cell(n)));
            assert!(there.distance(here) < 1e-5, "{coordinates:?} voxel {n}: {there} {here}");
        }
    }
}

#[test]
fn poses_without_end_do_not_use_up_more_than_the_patience() {
    let script: Script = Box::new(|mut stream| {
        use std::io::Write;
        let many: Vec<u8> = (0..1000).flat_map(|n| bytes(&transform("Probe", f64::from(n), 0.0))).collect();
        while stream.write_all(&many).is_ok() {}
    });
    let mut network = Network::connect(&serve(vec![script]), options()).unwrap();
    received(&network, 1000);
    for patience in [0, 20] {
        let started = Instant::now();
        while !matches!(network.next(Duration::from_millis(patience)), Event::Idle) {}
        assert!(started.elapsed() < Duration::from_secs(5), "{:?}", started.elapsed());
    }
}

#[test]
fn a_killed_peer_is_reported_and_frames_resume() {
    let good = bytes(&Message::Image(image(1.0, [4, 3, 2])));
    let cut = [good.clone(), good[..100].to_vec()].concat();
    let mut network = Network::connect(&serve(vec![send(cut), send_and_stay(good)]), options()).unwrap();
    let events = until(&mut network, |e| matches!(e, Event::Frame(frame) if (frame.volume, frame.slice) == (1, 1)));
    let at = |named: &str| events.iter().position(is_fault(named)).unwrap_or_else(|| panic!("{named}: {events:?}"));
    let lost = at("connection lost: the peer closed the connection 100 bytes into a message");
    assert!(lost < at("connected again"));
    assert_eq!(events.iter().filter(|e| matches!(e, Event::Begin(_))).count(), 1, "the same geometry goes on");
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let mut network = Network::connect(&nobody, options()).unwrap();
    until(&mut network, is_fault("not connected: cannot connect: "));
}

#[test]
fn damaged_messages_are_counted_and_reported_once_a_second() {
    let good = bytes(&Message::Image(image(1.0, [4, 3, 2])));
    let mut damaged = good.clone();
    damaged[120] ^= 1;
    let malformed = raw(1, "IMAGE", &[0; 30]);
    let messages = [damaged.repeat(50), malformed, good].concat();
    let mut network = connect(messages, options());
    received(&network, 1);
    let events = until(&mut network, |e| matches!(e, Event::Frame(_)));
    let faults: Vec<&Event> = events.iter().filter(|e| matches!(e, Event::Fault(_))).collect();
    assert_eq!(faults.len(), 2, "{faults:?}");
    assert!(is_fault("messages with a wrong checksum passed over (50): ")(faults[0]), "{faults:?}");
    assert!(is_fault("malformed messages passed over: IMAGE")(faults[1]), "{faults:?}");
}

#[test]
fn unread_messages_are_dropped_completely_and_reported() {
    let image = |n: u8| Image { bytes: vec![n; 24], ..image(f64::from(n) + 1.0, [4, 3, 2]) };
    let messages = (0..50).flat_map(|n| bytes(&Message::Image(image(n)))).collect();
    let mut client = quick();
    client.queue_messages = 4;
    let mut network = connect(messages, NetworkOptions { client, ..options() });
    received(&network, 50);
    let events = until(&mut network, |e| matches!(e, Event::Frame(frame) if (frame.volume, frame.slice) == (3, 1)));
    assert!(events.iter().any(is_fault("messages dropped (46)")), "{events:?}");
    for event in events {
        if let Event::Frame(frame) = event {
            assert_eq!(frame.bytes, vec![46 + frame.volume as u8; 12], "two volumes are mixed");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_message_causes_a_panic(
        size in prop::array::uniform3(1u16..5),
        numbers in prop::collection::vec(prop_oneof![-3.0f32..3.0, Just(0.0), Just(1e30), Just(-1e-30)], 12),
        scalar in prop::sample::select(vec![Scalar::I8, Scalar::U16, Scalar::I32, Scalar::F32, Scalar::F64]),
        components in 1u8..5,
        samples in prop::collection::vec(any::<u8>(), 4 * 4 * 4 * 4 * 8),
    ) {
        let axes = [[numbers[0], numbers[1], numbers[2]], [numbers[3], numbers[4], numbers[5]], [numbers[6], numbers[7], numbers[8]]];
        let count = size.iter().map(|n| usize::from(*n)).product::<usize>() * usize::from(components) * scalar.bytes();
        let any = Image {
            scalar, components, axes, centre: [numbers[9], numbers[10], numbers[11]],
            bytes: samples[..count].to_vec(), ..image(1.0, size)
        };
        let end = Message::Image(Image { bytes: vec![7; 3 * 3 * 3], ..image(2.0, [3, 3, 3]) });
        let messages = [bytes(&transform("P", 1.0, 0.0)), bytes(&Message::Image(any)), bytes(&transform("P", 3.0, 0.0)), bytes(&end)];
        let mut network = connect(messages.concat(), NetworkOptions { schedule: Schedule { first: 1, pictures: 1, ..Schedule::default() }, ..options() });
        until(&mut network, |e| matches!(e, Event::Frame(frame) if frame.bytes == [7; 9] && frame.slice == 2));
    }
}
