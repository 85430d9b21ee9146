//! The worker: a process that runs checks for another process and reports each on its standard output, as one line of JSON behind a mark.
//! Lines without the mark are not messages, because a driver may print there, too.
//!
//! The worker reads the indices of checks from its standard input, one on each line. It ends when its input ends, also if a check hangs:
//! then the other process has ended.

use crate::gpu::calls;
use crate::machine::Device;
use crate::report::{CheckName, Outcome, PictureComparison};
use crate::terminal::Failure;
use crate::tree::{self, FromNode, ToNode};
use crate::{Check, DeviceUnderTest};
use std::io::{BufRead, Write};
use std::sync::mpsc;
use std::time::Duration;

/// Begins each line that is a message.
const MARK: &str = "echolume-verify-worker: ";

/// Time for an idle worker to end by itself once nobody asks any more.
const GRACE: Duration = Duration::from_secs(2);

/// A message from a worker to the process that started it, on a line of standard output.
#[derive(ToNode, FromNode)]
pub(super) enum Message {
    /// A Vulkan call begins: name of the call, and of the shader or device that it is for.
    Calls(String, String),
    /// First message of a worker that has opened its device.
    Ready(Box<Ready>),
    /// First message of a worker without a device. `code`: the exit code that says why ([`Failure::exit_code`]).
    Refused { code: u8, message: String },
    /// The outcome of a check that was run, and its pictures, which the JSON of an outcome leaves out.
    Done(Box<(Outcome, Vec<PictureComparison>)>),
}

/// What a worker says of itself: its device, and the checks that it can run.
#[derive(ToNode, FromNode)]
pub struct Ready {
    pub device: Device,
    /// True if the validation layer is active and detects a missing barrier.
    pub validation: bool,
    /// Lines to print before the first check.
    pub lines: Vec<String>,
    pub checks: Vec<CheckName>,
}

impl Message {
    /// The Vulkan call of a message [`Message::Calls`], as reports quote it; None for other messages.
    pub(super) fn call(&self) -> Option<String> {
        match self {
            Message::Calls(call, of) if of.is_empty() => Some(call.clone()),
            Message::Calls(call, of) => Some(format!("{call} ('{of}')")),
            _ => None,
        }
    }

    /// Parses the message in a line. None if the line has no message's mark, or is damaged.
    pub(super) fn parse(line: &str) -> Option<Message> {
        let (_, json) = line.split_once(MARK)?;
        tree::from_json(json.as_bytes()).inspect_err(|fault| tracing::warn!("a message of a worker: {fault}")).ok()
    }

    fn send(&self) -> Result<(), String> {
        let json = tree::to_json(self).map_err(|e| e.to_string())?;
        // A line break first: the driver may have left its line unfinished.
        let line = format!("\n{MARK}{json}\n");
        let mut out = std::io::stdout().lock();
        out.write_all(line.as_bytes()).and_then(|()| out.flush()).map_err(|e| e.to_string())
    }
}

/// From now on sends a message on standard output before each Vulkan call in which this process may crash.
pub fn tell_calls() {
    // Nobody listens any more if this fails, and the next answer says so.
    calls::tell(|call, of| drop(Message::Calls(call.into(), of.into()).send()));
}

/// Sends the message on standard output that there is no device to run checks on. `failure`: why.
///
/// # Errors
/// One line: standard output is closed.
pub fn refuse(failure: Failure) -> Result<(), String> {
    let code = failure.exit_code();
    Message::Refused { code, message: failure.message() }.send()
}

/// Sends `ready`. Then reads from each line of standard input the index of a check in `checks`, runs it, and sends its outcome on standard output,
/// until standard input ends. If the process still runs two seconds after that, it exits with code 0.
///
/// # Errors
/// One line: standard output is closed, or there is no such check.
pub fn serve(dut: &mut DeviceUnderTest, checks: &[Check], ready: Ready) -> Result<(), String> {
    Message::Ready(Box::new(ready)).send()?;
    let mut group = None;
    for Request { place, waits } in requests() {
        let Some(check) = checks.get(place) else { return Err(format!("there is no check {place}")) };
        let mut outcome = if waits { check.run_waiting(dut) } else { check.run_after(&mut group, dut) };
        let pictures = std::mem::take(&mut outcome.pictures);
        Message::Done(Box::new((outcome, pictures))).send()?;
    }
    Ok(())
}

/// A request to a worker, a line of standard input: the index of a check (`place`), and whether the host waits for each submission before it makes
/// the next (`waits`).
pub(super) struct Request {
    pub place: usize,
    pub waits: bool,
}

impl Request {
    pub(super) fn line(&self) -> String {
        format!("{}{}", self.place, if self.waits { WAITING } else { "" })
    }

    fn parse(line: &str) -> Option<Request> {
        let (place, waits) = line.trim().strip_suffix(WAITING).map_or((line, false), |place| (place, true));
        Some(Request { place: place.trim().parse().ok()?, waits })
    }
}

/// Ends the line of a check whose submissions the host waits for.
const WAITING: &str = " waiting";

/// The requests on standard input. When it ends the process does, too, even if its main thread hangs in the driver.
fn requests() -> mpsc::Receiver<Request> {
    let (send, receive) = mpsc::channel();
    std::thread::spawn(move || {
        let lines = std::io::stdin().lock().lines().map_while(Result::ok);
        for request in lines.filter_map(|line| Request::parse(&line)) {
            if send.send(request).is_err() {
                return;
            }
        }
        drop(send);
        std::thread::sleep(GRACE);
        std::process::exit(0);
    });
    receive
}
