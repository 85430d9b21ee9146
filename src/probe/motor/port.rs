//! The serial port of one TMCL module: requests and replies, all with a time-out.
//!
//! A TMCL reply names its command but not the parameter, so a late reply could be mistaken for the reply to the next request. Therefore
//! the port's input is discarded before each request, and after a time-out also what still arrives. Only requests that may be carried
//! out twice are sent again ([`Request::repeatable`]).

use super::Fault;
use super::tmcl::{LENGTH, Reply, Request, SUCCESS};
use serialport::{ClearBuffer, SerialPort};
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

pub use serialport::{Parity, StopBits};

/// Shortest time between two requests for the motor's position.
pub(super) const PERIOD: Duration = Duration::from_millis(5);
/// Most attempts of a repeatable request.
const MAX_TRIES: usize = 3;

/// Settings of the serial port. TMCL modules have 9600 baud, no parity and one stop bit unless they were set to others.
#[derive(Clone, Debug)]
pub struct PortSettings {
    /// Name of the serial port, for example `/dev/ttyUSB0` or `COM3`.
    pub path: String,
    /// Baud rate, bits a second.
    pub baud: u32,
    pub parity: Parity,
    pub stop_bits: StopBits,
    /// Longest time to wait for a reply of the module.
    pub timeout: Duration,
}

impl PortSettings {
    /// Time that the transmission of a request and its reply takes at this baud rate.
    pub fn round_trip(&self) -> Duration {
        let parity = u32::from(self.parity != Parity::None);
        let stop = if self.stop_bits == StopBits::Two { 2 } else { 1 };
        Duration::from_secs_f64(f64::from((9 + parity + stop) * 2 * LENGTH as u32) / f64::from(self.baud.max(1)))
    }
}

/// A reply that reports success.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    pub value: i32,
    /// Time of the value: the middle between sending the request and receiving the reply.
    pub at: Instant,
    /// True if the request was sent more than once, so that `at` may belong to another reply than `value`.
    pub repeated: bool,
}

/// An open serial port.
pub(crate) struct Port {
    serial: Box<dyn SerialPort>,
    settings: PortSettings,
    /// The reply to an earlier request may still arrive.
    late: bool,
}

impl Port {
    /// Opens the port, exclusively for this process.
    ///
    /// # Errors
    /// [`Fault::NotOpened`].
    pub fn open(settings: &PortSettings) -> Result<Port, Fault> {
        let builder = serialport::new(&settings.path, settings.baud).parity(settings.parity);
        let builder = builder.stop_bits(settings.stop_bits).timeout(settings.timeout);
        let serial = builder.open().map_err(|e| Fault::NotOpened(e.to_string()))?;
        Ok(Port { serial, settings: settings.clone(), late: false })
    }

    pub fn settings(&self) -> &PortSettings {
        &self.settings
    }

    /// Sends a request and waits for its reply. Requests that can be repeated without harm are tried up to three times, others once.
    ///
    /// # Errors
    /// [`Fault::NoReply`] or [`Fault::Checksum`] after the last try; [`Fault::Refused`]; [`Fault::Unplugged`].
    pub fn ask(&mut self, request: &Request) -> Result<Answer, Fault> {
        let tries = if request.repeatable() { MAX_TRIES } else { 1 };
        let mut fault = None;
        for attempt in 0..tries {
            match self.ask_once(request) {
                Ok((reply, at)) if reply.status == SUCCESS => {
                    // This may be the reply to an earlier attempt, and that to the last may still arrive.
                    self.late |= attempt > 0;
                    return Ok(Answer { value: reply.value, at, repeated: attempt > 0 });
                }
                // Status 1: the module received a wrong checksum and did nothing.
                Ok((reply, _)) => fault = Some(Fault::Refused { request: request.to_string(), status: reply.status }),
                Err(gone @ Fault::Unplugged(_)) => return Err(gone),
                Err(other) => fault = Some(other),
            }
            if matches!(fault, Some(Fault::Refused { status, .. }) if status != 1) {
                break;
            }
            tracing::debug!("{}: try {} of {request}: {fault:?}", self.settings.path, attempt + 1);
        }
        Err(fault.unwrap_or(Fault::NoReply { request: request.to_string(), timeout: self.settings.timeout }))
    }

    /// Sends a request whose reply of nine bytes has no checksum. Returns the bytes.
    ///
    /// # Errors
    /// [`Fault::NoReply`], [`Fault::Unplugged`].
    pub(crate) fn ask_raw(&mut self, request: &Request) -> Result<[u8; LENGTH], Fault> {
        let mut received = self.send(request)?;
        let until = Instant::now() + self.settings.timeout;
        while received.len() < LENGTH && self.receive(&mut received, until)? {}
        self.late = received.len() < LENGTH;
        let bytes = received.get(..LENGTH).and_then(|b| b.try_into().ok());
        bytes.ok_or(Fault::NoReply { request: request.to_string(), timeout: self.settings.timeout })
    }

    /// Makes the next request be sent at once, even if the reply to an earlier one may still arrive.
    pub(crate) fn hurry(&mut self) {
        self.late = false;
    }

    fn ask_once(&mut self, request: &Request) -> Result<(Reply, Instant), Fault> {
        let sent = Instant::now();
        let mut received = self.send(request)?;
        let until = Instant::now() + self.settings.timeout;
        loop {
            if let Some(reply) = Reply::find(&received, request) {
                return Ok((reply, sent + sent.elapsed() / 2));
            }
            // Noise may precede the reply, but only so much.
            if received.len() > 64 * LENGTH || !self.receive(&mut received, until)? {
                break;
            }
        }
        self.late = true;
        match received.len() < LENGTH {
            true => Err(Fault::NoReply { request: request.to_string(), timeout: self.settings.timeout }),
            false => Err(Fault::Checksum { request: request.to_string() }),
        }
    }

    /// Discards pending input, then sends a request.
    fn send(&mut self, request: &Request) -> Result<Vec<u8>, Fault> {
        if self.late {
            self.drain()?;
        }
        self.serial.clear(ClearBuffer::Input).map_err(gone)?;
        let until = Instant::now() + self.settings.timeout;
        let bytes = request.bytes();
        let mut left = &bytes[..];
        while !left.is_empty() {
            match self.timed(until, |port| port.write(left))? {
                Some(written) if written > 0 => left = &left[written..],
                _ => return Err(Fault::NoReply { request: request.to_string(), timeout: self.settings.timeout }),
            }
        }
        Ok(Vec::with_capacity(2 * LENGTH))
    }

    /// Waits for more bytes until `until`; false if none arrived. After the length of a reply, a short pause ends the wait.
    fn receive(&mut self, received: &mut Vec<u8>, until: Instant) -> Result<bool, Fault> {
        let pause = (self.settings.round_trip() + Duration::from_millis(40)).min(self.settings.timeout);
        let until = if received.len() < LENGTH { until } else { until.min(Instant::now() + pause) };
        let mut bytes = [0; 64];
        let count = self.timed(until, |port| port.read(&mut bytes))?;
        if count == Some(0) {
            return Err(Fault::Unplugged("end of file".into()));
        }
        received.extend_from_slice(&bytes[..count.unwrap_or(0)]);
        Ok(count.is_some())
    }

    /// Discards what still arrives until nothing did for one time-out, for at most three.
    fn drain(&mut self) -> Result<(), Fault> {
        let (start, timeout) = (Instant::now(), self.settings.timeout);
        while start.elapsed() < 3 * timeout && self.receive(&mut Vec::new(), Instant::now() + timeout)? {}
        self.late = false;
        Ok(())
    }

    /// Reads or writes until `until`; None if that has passed.
    fn timed(
        &mut self,
        until: Instant,
        mut act: impl FnMut(&mut dyn SerialPort) -> io::Result<usize>,
    ) -> Result<Option<usize>, Fault> {
        loop {
            let left = until.saturating_duration_since(Instant::now());
            self.serial.set_timeout(left).map_err(gone)?;
            match act(&mut *self.serial) {
                Ok(count) => return Ok(Some(count)),
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => return Ok(None),
                // A signal. It is handled elsewhere.
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(Fault::Unplugged(e.to_string())),
            }
        }
    }
}

fn gone(error: serialport::Error) -> Fault {
    Fault::Unplugged(error.to_string())
}

/// The serial ports of this machine: name and description.
///
/// # Errors
/// One line: the system cannot list them.
pub fn list() -> Result<Vec<(String, String)>, String> {
    let ports = serialport::available_ports().map_err(|e| format!("the serial ports cannot be listed: {e}"))?;
    let about = |kind| match kind {
        serialport::SerialPortType::UsbPort(usb) => {
            let words: Vec<String> = [usb.manufacturer, usb.product].into_iter().flatten().collect();
            format!("USB {:04x}:{:04x} {}", usb.vid, usb.pid, words.join(" ")).trim_end().to_string()
        }
        serialport::SerialPortType::PciPort => "built in".to_string(),
        serialport::SerialPortType::BluetoothPort => "Bluetooth".to_string(),
        serialport::SerialPortType::Unknown => "of unknown kind".to_string(),
    };
    Ok(ports.into_iter().map(|p| (p.port_name, about(p.port_type))).collect())
}
