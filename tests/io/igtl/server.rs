//! The server: what clients get, what they may ask, and that none of them holds up the others.

use super::messages::*;
use crate::common::probes::wobbler;
use crate::common::wait::until;
use echolume::low_level::probe::{Axis, Geometry, Grid, Probe, World};
use echolume::low_level::source::convert::{Volume, lattice};
use echolume::low_level::source::igtl;
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::source::recorder::Header;
use echolume::low_level::source::{Frame, StoredType};
use glam::{DAffine3, DMat3, DVec3};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::thread;

const HERE: &str = "127.0.0.1:0";

fn server(options: ServerOptions) -> Server {
    Server::bind(HERE, options).expect("a free port")
}

fn client(server: &Server) -> Client {
    let before = server.statistics().connections;
    let client = Client::connect(&server.address().to_string(), super::client::quick()).expect("a thread");
    until("a client", || (server.statistics().connections > before).then_some(()));
    client
}

fn take(client: &Client) -> Message {
    client.next(Duration::from_secs(20)).expect("a message").message
}

/// A connection that the test reads and writes itself.
fn by_hand(server: &Server) -> TcpStream {
    let before = server.statistics().connections;
    let stream = TcpStream::connect(server.address()).expect("a connection");
    until("a client", || (server.statistics().connections > before).then_some(()));
    stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a time-out");
    stream
}

/// The next message of a connection.
fn read(stream: &mut TcpStream) -> (String, Vec<u8>) {
    let mut head = [0; HEADER];
    stream.read_exact(&mut head).expect("a header");
    let length = u64::from_be_bytes(head[42..50].try_into().expect("8 bytes")) as usize;
    let mut body = vec![0; length];
    stream.read_exact(&mut body).expect("a body");
    assert_eq!(head[50..58], crc64(&body).to_be_bytes(), "the checksum");
    let kind = String::from_utf8_lossy(&head[2..14]).trim_end_matches('\0').to_string();
    (kind, body)
}

#[test]
fn every_client_gets_every_message_and_may_come_and_go() {
    let server = server(ServerOptions::default());
    let first = client(&server);
    let one = Message::Image(image(1.0, [4, 3, 2]));
    server.send(&one).expect("an image");
    assert_eq!(take(&first), one);
    let second = client(&server);
    let two = Message::Image(image(2.0, [4, 3, 2]));
    server.send(&two).expect("an image");
    assert_eq!((take(&first), take(&second)), (two.clone(), two));
    drop(first);
    until("one client", || (server.statistics().clients == 1).then_some(()));
    let three = Message::Image(image(3.0, [4, 3, 2]));
    server.send(&three).expect("an image");
    assert_eq!(take(&second), three);
    let counts = server.statistics();
    assert_eq!((counts.connections, counts.dropped, counts.disconnected), (2, 0, 0));
}

/// A client that reads nothing loses the oldest of its own messages, and is disconnected at last.
#[test]
fn a_dead_client_stalls_nobody() {
    let options = ServerOptions { stall_timeout: Duration::from_millis(600), ..ServerOptions::default() };
    let server = server(options);
    let (dead, alive) = (by_hand(&server), client(&server));
    // More than the buffers of a connection hold.
    let message = |n: u32| Message::Image(Image { device: "Volume".into(), ..image(f64::from(n), [256, 256, 64]) });
    let begun = Instant::now();
    for n in 1..=6 {
        server.send(&message(n)).expect("an image");
        assert_eq!(take(&alive).time(), f64::from(n));
    }
    assert!(begun.elapsed() < Duration::from_secs(60));
    let counts = server.statistics();
    // On a busy machine it may be given up before it loses a message.
    assert!(counts.dropped + counts.disconnected >= 1, "{counts:?}");
    until("the dead client is given up", || (server.statistics().clients == 1).then_some(()));
    assert_eq!(server.statistics().disconnected, 1);
    server.send(&message(7)).expect("an image");
    assert_eq!(take(&alive).time(), 7.0);
    drop(dead);
}

/// A client that reads a little again and again does not keep its place for ever: each message to it has a time, too.
#[test]
fn a_message_that_is_not_read_to_its_end_costs_the_client_its_place() {
    let (long, short) = (Duration::from_secs(600), Duration::from_millis(200));
    let server = server(ServerOptions { stall_timeout: long, message_timeout: short, ..ServerOptions::default() });
    let mut slow = by_hand(&server);
    // More than the buffers of a connection hold.
    server.send(&Message::Image(image(1.0, [256, 256, 100]))).expect("an image");
    until("it is given up", || {
        let _ = slow.read(&mut [0; 16]);
        (server.statistics().clients == 0).then_some(())
    });
    assert_eq!(server.statistics().disconnected, 1);
}

/// A client that sends a byte again and again, and never a whole message, does not keep its place; one that sends nothing does.
#[test]
fn a_message_without_an_end_costs_the_client_its_place() {
    let options = ServerOptions { message_timeout: Duration::from_millis(200), clients: 2, ..ServerOptions::default() };
    let server = server(options);
    let (listens, mut drips) = (by_hand(&server), by_hand(&server));
    let status = query("GET_STATUS", "");
    let mut drops = status[..50].chunks(1);
    until("it is given up", || {
        // After the end of the connection nothing can be sent.
        let _ = drops.next().map(|drop| drips.write_all(drop));
        (server.statistics().clients == 1).then_some(())
    });
    assert_eq!(server.statistics().disconnected, 1);
    server.send(&Message::Image(image(1.0, [4, 3, 2]))).expect("an image");
    assert_eq!(read(&mut { listens }).0, "IMAGE");
}

#[test]
fn queries_are_answered() {
    let server = server(ServerOptions::default());
    let mut stream = by_hand(&server);
    let ask = |stream: &mut TcpStream, kind: &str, device: &str| {
        stream.write_all(&query(kind, device)).expect("sent");
        read(stream)
    };
    let (kind, body) = ask(&mut stream, "GET_CAPABIL", "");
    let names: Vec<_> =
        body.chunks(12).map(|n| String::from_utf8_lossy(n).trim_end_matches('\0').to_string()).collect();
    assert_eq!(
        (kind.as_str(), names),
        ("CAPABILITY", ["IMAGE", "STATUS", "STRING", "CAPABILITY"].map(String::from).to_vec())
    );
    let (kind, body) = ask(&mut stream, "GET_STATUS", "");
    assert_eq!((kind.as_str(), &body[..2]), ("STATUS", &[0, 1][..]));
    assert_eq!(ask(&mut stream, "GET_STRING", "").0, "STRING");
    assert_eq!(ask(&mut stream, "GET_IMAGE", "Image"), ("RTS_IMAGE".into(), vec![1]), "there is none yet");
    assert_eq!(ask(&mut stream, "STP_IMAGE", ""), ("RTS_IMAGE".into(), vec![0]));
    // Not sent while it is stopped, but there for who asks.
    server.send(&Message::Image(image(1.0, [4, 3, 2]))).expect("an image");
    assert_eq!(ask(&mut stream, "GET_STATUS", "").0, "STATUS");
    for device in ["Image", ""] {
        let (kind, body) = ask(&mut stream, "GET_IMAGE", device);
        assert_eq!((kind.as_str(), body.len()), ("IMAGE", 72 + 24));
    }
    assert_eq!(ask(&mut stream, "GET_IMAGE", "Other"), ("RTS_IMAGE".into(), vec![1]));
    assert_eq!(ask(&mut stream, "STT_IMAGE", ""), ("RTS_IMAGE".into(), vec![0]));
    server.send(&Message::Image(image(2.0, [4, 3, 2]))).expect("an image");
    assert_eq!(read(&mut stream).0, "IMAGE");
    assert_eq!(ask(&mut stream, "GET_TDATA", ""), ("RTS_TDATA".into(), vec![1]));
    // A message that asks for nothing, and one that is damaged, are passed over.
    let transform = encode(&transform("Stylus", 1.0, 2.0), Version::V1).expect("a transform");
    let mut damaged = query("GET_STATUS", "");
    damaged[50] ^= 1;
    stream.write_all(&[transform, damaged].concat()).expect("sent");
    assert_eq!(ask(&mut stream, "GET_STATUS", "").0, "STATUS");
    assert_eq!(server.statistics().clients, 1);
}

#[test]
fn what_is_no_client_is_disconnected_and_too_many_are_refused() {
    let server = server(ServerOptions { clients: 2, ..ServerOptions::default() });
    let mut browser = by_hand(&server);
    browser
        .write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\nUser-Agent: a browser of some other protocol\r\n\r\n")
        .expect("sent");
    assert_eq!(browser.read(&mut [0]).unwrap_or(0), 0, "closed");
    until("it is gone", || (server.statistics().clients == 0).then_some(()));
    assert_eq!(server.statistics().disconnected, 1);
    let (_one, _two) = (by_hand(&server), by_hand(&server));
    let mut third = TcpStream::connect(server.address()).expect("a connection");
    third.set_read_timeout(Some(Duration::from_secs(20))).expect("a time-out");
    assert_eq!(third.read(&mut [0]).unwrap_or(0), 0, "closed");
    until("it is counted", || (server.statistics().refused == 1).then_some(()));
}

#[test]
fn what_waits_is_sent_before_the_end_and_a_port_is_taken_once() {
    let server = server(ServerOptions::default());
    let address = server.address().to_string();
    let again = Server::bind(&address, ServerOptions::default()).err().expect("refused");
    assert_eq!(again.kind(), std::io::ErrorKind::AddrInUse);
    let client = client(&server);
    let last = Message::Image(image(9.0, [200, 200, 50]));
    server.send(&last).expect("an image");
    drop(server);
    assert_eq!(take(&client), last);
    // Free again at once.
    Server::bind(&address, ServerOptions::default()).expect("the port is free");
}

/// Volumes again and again, until the test has seen enough.
struct Sweeps {
    header: Header,
    frames: Vec<Frame>,
    next: usize,
}

impl Live for Sweeps {
    fn next(&mut self, _: Duration) -> Event {
        let n = self.next;
        self.next += 1;
        let Some(n) = n.checked_sub(1) else { return Event::Begin(Box::new(self.header.clone())) };
        let (volume, frame) = (n / self.frames.len(), &self.frames[n % self.frames.len()]);
        Event::Frame(Frame { volume: volume as u32, ..frame.clone() })
    }

    fn can_wait(&self) -> bool {
        true
    }
}

fn sweeps(geometry: &Geometry, stored: StoredType, pose: Option<DAffine3>) -> Sweeps {
    let [samples, lines] = geometry.frame_size();
    let frame = |slice: usize| {
        let bytes = (0..samples * lines * stored.bytes()).map(|n| ((n * 7 + slice * 31) % 251) as u8).collect();
        Frame { volume: 0, number: slice as u32, slice, backward: false, time: None, pose, bytes }
    };
    let frames = (0..geometry.slices()).map(frame).collect();
    let (forward, backward) = (geometry.clone(), geometry.clone());
    Sweeps {
        header: Header { forward, backward, stored, range: [10.0, 200.0], posed: pose.is_some(), synthetic: false },
        frames,
        next: 0,
    }
}

/// The first volume that a client gets of a stream, and the first picture.
fn published(geometry: &Geometry, stored: StoredType, pose: Option<DAffine3>, spacing: Option<f64>) -> [Image; 2] {
    let publisher = Publisher::bind(HERE, spacing, ServerOptions::default()).expect("a free port");
    let client = Client::connect(&publisher.address().to_string(), super::client::quick()).expect("a thread");
    let (mut source, mut listener) = (sweeps(geometry, stored, pose), publisher.listener());
    let (mut volume, mut picture) = (None, None);
    let begun = Instant::now();
    while volume.is_none() || picture.is_none() {
        assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", publisher.statistics());
        listener(&source.next(Duration::ZERO));
        publisher.picture([3, 2], (0..24).collect());
        match client.next(Duration::from_millis(1)).map(|received| received.message) {
            Some(Message::Image(image)) if image.device == igtl::VOLUME => volume = Some(image),
            Some(Message::Image(image)) if image.device == igtl::PICTURE => picture = Some(image),
            Some(other) => panic!("{other:?}"),
            None => thread::yield_now(),
        }
    }
    let (Some(volume), Some(picture)) = (volume, picture) else { panic!("both are there") };
    drop(listener);
    let counts = publisher.finish();
    assert!(counts.pictures > 0 && counts.volumes > 0 && counts.fault.is_none(), "{counts:?}");
    [volume, picture]
}

/// The volume has the voxels of a conversion, and each of them lies where the conversion has it.
#[test]
fn volumes_are_those_of_a_conversion_in_their_place() {
    let probe = Probe {
        lines: Axis::centred(0.05, 12),
        sample_pitch: 2.0,
        samples: 24,
        slices: Axis::centred(0.08, 6),
        ..wobbler()
    };
    let grid = Grid { size: [9, 7, 5], spacing: [0.5, 0.25, 2.0], origin: [-2.0, 10.0, 30.0] };
    let turned = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
    let pose = DAffine3::from_mat3_translation(turned, DVec3::new(40.0, -70.0, 15.0));
    for (geometry, stored, pose, spacing) in [
        (Geometry::Sweep(probe.clone()), StoredType::U8, None, Some(2.5)),
        (Geometry::Sweep(probe), StoredType::U16, Some(pose), Some(2.5)),
        (Geometry::Cartesian(grid), StoredType::U8, Some(pose), None),
    ] {
        let [image, picture] = published(&geometry, stored, pose, spacing);
        let target = match &geometry {
            Geometry::Cartesian(own) => *own,
            sweep => lattice(sweep, 2.5).expect("a lattice"),
        };
        assert_eq!((image.size.map(usize::from), image.components, image.scalar), (target.size, 1, Scalar::U8));
        let mut volume = Volume::new(geometry.clone(), stored);
        sweeps(&geometry, stored, pose).frames.into_iter().for_each(|frame| volume.take(frame));
        let mut inside = 0;
        for (n, shown) in image.bytes.iter().enumerate() {
            let cell = [n % target.size[0], n / target.size[0] % target.size[1], n / (target.size[0] * target.size[1])];
            let at =
                DVec3::from(target.origin) + DVec3::from(target.spacing) * DVec3::from_array(cell.map(|n| n as f64));
            let expected =
                volume.at(at).map_or(0.0, |value| (255.0 * (value - 10.0) / 190.0).round().clamp(0.0, 255.0));
            inside += usize::from(expected > 0.0);
            assert!((f64::from(*shown) - expected).abs() <= 1.0, "voxel {cell:?}: {shown}, {expected}");
        }
        assert!(inside > 50, "{inside}");
        let world = pose.map_or(World::of(&target), |pose| World::posed(&pose, &target).expect("rigid"));
        let there = image.index_to_mm(Coordinates::Lps);
        assert_eq!(image.coordinates, Coordinates::Ras, "what receivers take it for");
        for cell in [DVec3::ZERO, DVec3::from_array(target.size.map(|n| n as f64 - 1.0))] {
            let (read, meant) = (there.transform_point3(cell), world.at(cell));
            // f32 on the wire.
            assert!(read.distance(meant) < 1e-4, "{read} {meant}");
        }
        assert_eq!((picture.size, picture.components), ([3, 2, 1], 3));
        let rgb: Vec<u8> = (0..24u8).filter(|n| n % 4 != 3).collect();
        assert_eq!(picture.bytes, rgb);
    }
}

/// Prevents that a stream reads a whole volume for nobody, or a volume that began before the client came.
#[test]
fn a_publisher_without_clients_does_nothing() {
    let grid = Grid { size: [4, 3, 2], spacing: [1.0; 3], origin: [0.0; 3] };
    let publisher = Publisher::bind(HERE, None, ServerOptions::default()).expect("a free port");
    let (mut source, mut listener) = (sweeps(&Geometry::Cartesian(grid), StoredType::U8, None), publisher.listener());
    for _ in 0..9 {
        listener(&source.next(Duration::ZERO));
    }
    publisher.picture([1, 1], vec![0; 4]);
    drop(listener);
    let counts = publisher.finish();
    assert_eq!((counts.pictures, counts.volumes, counts.replaced), (0, 0, 0));
}
