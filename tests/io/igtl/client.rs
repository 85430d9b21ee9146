//! The client against servers of the tests on the loopback interface.

use super::messages::*;
use crate::common::wait;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc;
use std::thread;

/// The script of a server for one connection.
pub type Script = Box<dyn FnOnce(TcpStream) + Send>;

/// A server that plays one script per connection, one after the other; its address.
pub fn serve(scripts: Vec<Script>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || {
        for script in scripts {
            let Ok((stream, _)) = listener.accept() else { return };
            script(stream);
        }
    });
    address
}

/// An address that nothing listens at.
fn nowhere() -> String {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}

/// Sends and closes.
pub fn send(bytes: Vec<u8>) -> Script {
    Box::new(move |mut stream| stream.write_all(&bytes).unwrap())
}

/// Sends and waits until the client closes.
pub fn send_and_stay(bytes: Vec<u8>) -> Script {
    Box::new(move |mut stream| {
        stream.write_all(&bytes).unwrap();
        stay(&mut stream);
    })
}

pub fn stay(stream: &mut TcpStream) {
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let _ = stream.read(&mut [0]);
}

pub fn quick() -> ClientOptions {
    ClientOptions {
        first_wait: Duration::from_millis(20),
        longest_wait: Duration::from_millis(200),
        ..ClientOptions::default()
    }
}

pub fn bytes(message: &Message) -> Vec<u8> {
    encode(message, Version::V1).unwrap()
}

fn take(client: &Client) -> Message {
    let received = client.next(Duration::from_secs(10));
    received.unwrap_or_else(|| panic!("nothing came: {:?}, {:?}", client.statistics(), client.last_error())).message
}

fn until(client: &Client, reached: impl Fn(&ClientStatistics) -> bool) -> ClientStatistics {
    wait::until("such statistics", || Some(client.statistics()).filter(&reached))
}

/// Drops the client, which may take a second.
fn gone(client: Client) {
    let started = Instant::now();
    drop(client);
    assert!(started.elapsed() < Duration::from_millis(1500), "{:?}", started.elapsed());
}

#[test]
fn messages_come_in_order_whatever_the_pieces() {
    for piece in [1, 7, 58, 1000] {
        let all: Vec<u8> = FILES.iter().flat_map(|f| stored(f)).collect();
        let length = all.len() as u64;
        let script: Script = Box::new(move |mut stream| {
            stream.set_nodelay(true).unwrap();
            all.chunks(piece).for_each(|piece| stream.write_all(piece).unwrap());
            stay(&mut stream);
        });
        let client = Client::connect(&serve(vec![script]), quick()).unwrap();
        for file in FILES {
            assert_eq!(take(&client), whole(&stored(file)));
        }
        let expected = ClientStatistics { connected: true, messages: 5, bytes: length, ..ClientStatistics::default() };
        assert_eq!(client.statistics(), expected);
        assert!(client.next(Duration::ZERO).is_none());
        gone(client);
    }
}

#[test]
fn a_large_image_comes_whole() {
    let message = Message::Image(image(1.0, [300, 200, 60]));
    let client = Client::connect(&serve(vec![send_and_stay(bytes(&message))]), quick()).unwrap();
    assert_eq!(take(&client), message);
}

#[test]
fn damaged_and_unknown_messages_are_passed_over_and_counted() {
    let mut damaged = stored("Image_Motor_v1.bin");
    damaged[100] ^= 1;
    let all =
        [damaged, raw(1, "TRANSFORM", &[0; 47]), raw(1, "VIDEO", &[1; 5000]), bytes(&transform("Probe", 1.0, 2.0))]
            .concat();
    let client = Client::connect(&serve(vec![send_and_stay(all)]), quick()).unwrap();
    let Message::Other(other) = take(&client) else { panic!("VIDEO is known") };
    assert_eq!((other.kind.as_str(), other.bytes), ("VIDEO", 5000));
    assert_eq!(take(&client), transform("Probe", 1.0, 2.0));
    let statistics = client.statistics();
    assert_eq!((statistics.checksum_failures, statistics.malformed, statistics.skipped), (1, 1, 1));
    assert_eq!((statistics.messages, statistics.reconnects), (2, 0));
    let error = client.last_error().unwrap();
    assert!(error.contains("TRANSFORM from 'Device': matrix: is cut short"), "{error}");
}

#[test]
fn a_checksum_of_zero_is_taken_where_that_is_asked_for() {
    let mut unchecked = bytes(&transform("Probe", 1.0, 2.0));
    unchecked[50..58].fill(0);
    let mut wrong = unchecked.clone();
    wrong[57] = 1;
    let all = [wrong, unchecked, bytes(&transform("Probe", 2.0, 3.0))].concat();
    for (takes_no_checksum, expected) in [(false, vec![(2.0, 3.0)]), (true, vec![(1.0, 2.0), (2.0, 3.0)])] {
        let options = ClientOptions { takes_no_checksum, ..quick() };
        let client = Client::connect(&serve(vec![send_and_stay(all.clone())]), options).unwrap();
        for (time, x) in &expected {
            assert_eq!(take(&client), transform("Probe", *time, *x));
        }
        assert_eq!(client.statistics().checksum_failures, 3 - expected.len() as u64);
    }
}

#[test]
fn a_peer_killed_within_a_message_is_connected_to_again() {
    let image = stored("Image_Motor_v1.bin");
    for cut in [30, 100] {
        let first = [bytes(&transform("Probe", 1.0, 1.0)), image[..cut].to_vec()].concat();
        let address = serve(vec![send(first), send_and_stay(bytes(&transform("Probe", 2.0, 2.0)))]);
        let client = Client::connect(&address, quick()).unwrap();
        assert_eq!(take(&client), transform("Probe", 1.0, 1.0));
        assert_eq!(take(&client), transform("Probe", 2.0, 2.0));
        let statistics = client.statistics();
        assert_eq!((statistics.cut_short, statistics.reconnects, statistics.connected), (1, 1, true));
        let error = client.last_error().unwrap();
        assert!(error.ends_with(&format!("{cut} bytes into a message")), "{error}");
        gone(client);
    }
}

#[test]
fn garbage_and_absurd_claims_end_the_connection_and_a_new_one_is_made() {
    let mut absurd = stored("Image_Motor_v1.bin")[..HEADER].to_vec();
    absurd[42..50].copy_from_slice(&(1u64 << 60).to_be_bytes());
    let garbage = b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\n\r\nwhat do you want?".to_vec();
    let last = send_and_stay(bytes(&transform("Probe", 1.0, 1.0)));
    let address = serve(vec![send_and_stay(absurd), send_and_stay(garbage), last]);
    let client = Client::connect(&address, quick()).unwrap();
    assert_eq!(take(&client), transform("Probe", 1.0, 1.0));
    let statistics = client.statistics();
    assert_eq!((statistics.lost_framing, statistics.reconnects), (2, 2));
    let error = client.last_error().unwrap();
    assert!(error.contains("version: is 18516") && error.ends_with("cannot be re-synchronised"), "{error}");
}

#[test]
fn a_slow_consumer_loses_the_oldest_and_the_count_says_so() {
    let all = (0..50).flat_map(|n| bytes(&transform("Probe", f64::from(n), 0.0))).collect();
    let options = ClientOptions { queue_messages: 4, ..quick() };
    let client = Client::connect(&serve(vec![send_and_stay(all)]), options).unwrap();
    let statistics = until(&client, |s| s.messages == 50);
    assert_eq!(statistics.dropped, 46);
    let left: Vec<f64> = std::iter::from_fn(|| client.next(Duration::ZERO)).map(|r| r.message.time()).collect();
    assert_eq!(left, [46.0, 47.0, 48.0, 49.0]);
}

#[test]
fn the_queue_is_bounded_in_bytes_as_well() {
    let all = (0..20).flat_map(|n| bytes(&Message::Image(image(f64::from(n), [100, 100, 10])))).collect();
    let options = ClientOptions { queue_bytes: 350_000, ..quick() };
    let client = Client::connect(&serve(vec![send_and_stay(all)]), options).unwrap();
    assert_eq!(until(&client, |s| s.messages == 20).dropped, 17);
    assert_eq!(take(&client).time(), 17.0);
}

#[test]
fn a_stalled_peer_is_given_up() {
    let half = stored("Image_Motor_v1.bin")[..90].to_vec();
    let whole = bytes(&transform("Probe", 1.0, 1.0));
    let scripts = vec![send_and_stay(half), send_and_stay(whole.clone()), send_and_stay(whole)];
    let short = Duration::from_millis(300);
    let options = ClientOptions { stall_timeout: short, silence_timeout: short * 2, ..quick() };
    let client = Client::connect(&serve(scripts), options).unwrap();
    take(&client);
    let error = client.last_error().unwrap();
    assert_eq!(error, "nothing came for 300 ms");
    // And again before a message has begun.
    take(&client);
    assert_eq!(client.last_error().unwrap(), "nothing came for 600 ms");
    assert_eq!(client.statistics().cut_short, 1);
}

/// Prevents a peer that sends a byte again and again, so that it is never silent, from being waited for.
#[test]
fn a_message_without_an_end_is_given_up() {
    let drips: Script = Box::new(|mut stream| {
        let message = stored("Image_Motor_v1.bin");
        // After the end of the connection nothing can be sent.
        let _ = message.iter().try_for_each(|byte| {
            wait::pace(Duration::from_millis(20));
            stream.write_all(&[*byte])
        });
    });
    let whole = bytes(&transform("Probe", 1.0, 1.0));
    let options = ClientOptions { message_timeout: Duration::from_millis(300), ..quick() };
    let client = Client::connect(&serve(vec![drips, send_and_stay(whole)]), options).unwrap();
    assert_eq!(take(&client).time(), 1.0);
    assert_eq!(client.last_error().unwrap(), "a message did not end within 300 ms");
    assert_eq!(client.statistics().cut_short, 1);
}

#[test]
fn tries_come_apart_and_no_further_than_the_longest_wait() {
    let (sender, accepted) = mpsc::channel();
    let scripts = (0..6).map(|_| {
        let sender = sender.clone();
        Box::new(move |_: TcpStream| sender.send(Instant::now()).unwrap()) as Script
    });
    let options =
        ClientOptions { first_wait: Duration::from_millis(50), longest_wait: Duration::from_millis(200), ..quick() };
    let client = Client::connect(&serve(scripts.collect()), options).unwrap();
    let times: Vec<Instant> = (0..6).map(|_| accepted.recv_timeout(Duration::from_secs(10)).unwrap()).collect();
    let gaps: Vec<u128> = times.windows(2).map(|t| (t[1] - t[0]).as_millis()).collect();
    for (gap, least) in gaps.iter().zip([45, 95, 195, 195, 195]) {
        assert!((least..least + 1000).contains(gap), "{gaps:?}");
    }
    gone(client);
}

#[test]
fn a_server_that_comes_later_is_found() {
    let address = nowhere();
    let client = Client::connect(&address, quick()).unwrap();
    wait::until("an error", || client.last_error());
    assert!(!client.statistics().connected && client.next(Duration::from_millis(20)).is_none());
    let listener = TcpListener::bind(&address).unwrap();
    thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        stream.write_all(&bytes(&transform("Probe", 5.0, 0.0))).unwrap();
        stay(&mut stream);
    });
    assert_eq!(take(&client).time(), 5.0);
}

#[test]
fn dropping_ends_the_thread_in_every_state() {
    let image = stored("Image_Motor_v1.bin");
    // Silent, within a header, within a body.
    for cut in [0, 20, 100] {
        let client =
            Client::connect(&serve(vec![send_and_stay(image[..cut].to_vec())]), ClientOptions::default()).unwrap();
        until(&client, |s| s.connected && s.bytes == cut as u64);
        gone(client);
    }
    // Waiting to retry, and with an invalid address.
    for address in [nowhere().as_str(), "not an address", "", "127.0.0.1:99999"] {
        let client = Client::connect(address, ClientOptions::default()).unwrap();
        let error = wait::until("an error", || client.last_error());
        assert!(error.starts_with("cannot connect: "), "{address}: {error}");
        gone(client);
    }
    // At once.
    gone(Client::connect(&nowhere(), ClientOptions::default()).unwrap());
}

#[test]
fn options_of_zero_do_no_harm() {
    let zero = Duration::ZERO;
    let options = ClientOptions {
        connect_timeout: zero,
        stall_timeout: zero,
        message_timeout: zero,
        silence_timeout: zero,
        first_wait: zero,
        longest_wait: zero,
        body_limit: 0,
        queue_messages: 0,
        queue_bytes: 0,
        takes_no_checksum: false,
    };
    // Several connections, since no silence at all is allowed.
    let server = || serve((0..100).map(|_| send_and_stay(bytes(&transform("Probe", 1.0, 1.0)))).collect());
    let client = Client::connect(&server(), options.clone()).unwrap();
    until(&client, |s| s.lost_framing > 0);
    assert!(client.next(Duration::ZERO).is_none() && client.last_error().is_some());
    gone(client);
    let client = Client::connect(&server(), ClientOptions { body_limit: 48, ..options }).unwrap();
    assert_eq!(take(&client).time(), 1.0);
}
