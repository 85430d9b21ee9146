//! The simulated module as any TMCL client meets it: raw bytes on its port, the kinds of requests that a stock client sends.

use crate::common::motor::simulated;
use echolume::low_level::probe::motor::tmcl::{LENGTH, Reply, Request, checksum, version_text};
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};

fn asked(port: &mut File, request: &[u8; LENGTH]) -> [u8; LENGTH] {
    port.write_all(request).expect("sent");
    let mut reply = [0; LENGTH];
    port.read_exact(&mut reply).expect("answered");
    reply
}

fn value(port: &mut File, request: Request) -> Reply {
    Reply::parse(&asked(port, &request.bytes())).expect("a reply with its checksum")
}

#[test]
fn every_request_is_answered_in_its_form() {
    let simulator = simulated(None);
    let port = &mut OpenOptions::new().read(true).write(true).open(simulator.path()).expect("the port");
    let text = asked(port, &Request::version_text(1).bytes());
    assert_eq!(version_text(&text), Some((1140, "116".into())), "{text:?}");
    assert_eq!(value(port, Request::version(1)).value, 1140 << 16 | 0x0110);

    let mut wrong = Request::get_axis(1, 0, 1).bytes();
    wrong[8] ^= 0x10;
    let reply = Reply::parse(&asked(port, &wrong)).expect("a reply with its checksum");
    assert_eq!((reply.status, reply.command, reply.module), (1, 6, 1));
    assert_eq!(value(port, Request::get_axis(1, 0, 1)).status, 100, "the next request is answered as usual");

    for (parameter, usual, set, refused) in
        [(6, 128, 200, 256), (7, 8, 16, -1), (12, 0, 1, 2), (13, 0, 1, -1), (140, 4, 4, 8), (204, 0, 100, 65536)]
    {
        assert_eq!(value(port, Request::get_axis(1, 0, parameter)).value, usual, "{parameter}");
        assert_eq!(value(port, Request::set_axis(1, 0, parameter, set)).status, 100, "{parameter}");
        assert_eq!(value(port, Request::get_axis(1, 0, parameter)).value, set, "{parameter}");
        assert_eq!(value(port, Request::set_axis(1, 0, parameter, refused)).status, 4, "{parameter}");
    }
    assert_eq!(value(port, Request::get_axis(1, 0, 2)).value, 0);
    assert_eq!(value(port, Request::set_axis(1, 0, 2, 5)).status, 100, "a target speed turns the motor");
    assert_eq!(value(port, Request::get_axis(1, 0, 2)).value, 5);
    assert_eq!(value(port, Request::stop(1, 0)).status, 100);
    assert_eq!(value(port, Request::get_axis(1, 0, 99)).status, 3);
    let unknown = [1, 77, 0, 0, 0, 0, 0, 0, checksum(&[1, 77])];
    assert_eq!(Reply::parse(&asked(port, &unknown)).map(|r| r.status), Some(2));
}

/// Bytes before a request, some of them like its beginning, do not make it unreadable.
#[test]
fn a_request_behind_noise_is_answered() {
    let simulator = simulated(None);
    let port = &mut OpenOptions::new().read(true).write(true).open(simulator.path()).expect("the port");
    let request = Request::version(1).bytes();
    port.write_all(&[&[1, 1, 7], &request[..]].concat()).expect("sent");
    let mut reply = [0; LENGTH];
    port.read_exact(&mut reply).expect("answered");
    assert_eq!(Reply::parse(&reply).map(|r| (r.status, r.command)), Some((100, 136)));
}
