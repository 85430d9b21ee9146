//! TMCL, Trinamic's binary serial protocol: requests and replies of nine bytes. Pure.
//!
//! A request is {address, command, type, motor or bank, value as big-endian i32, checksum}, a reply {host, module, status,
//! command, value as big-endian i32, checksum}; the checksum is the sum of the first eight bytes modulo 256. Source: the
//! TMCL firmware manuals of the TMCM modules, chapters "Binary command format" and "Reply format".

/// Length of a request and of a reply, bytes.
pub const LENGTH: usize = 9;

/// Numbers of the TMCL commands.
pub mod command {
    pub(crate) const ROTATE_RIGHT: u8 = 1;
    pub(crate) const ROTATE_LEFT: u8 = 2;
    pub const STOP: u8 = 3;
    pub const MOVE_TO: u8 = 4;
    pub(crate) const SET_AXIS: u8 = 5;
    pub const GET_AXIS: u8 = 6;
    pub const SET_GLOBAL: u8 = 9;
    pub(crate) const GET_GLOBAL: u8 = 10;
    pub(crate) const REFERENCE_SEARCH: u8 = 13;
    pub(crate) const GET_INPUT: u8 = 15;
    pub const VERSION: u8 = 136;
}

/// Numbers of the TMCL axis parameters. Positions are in microsteps, speeds and accelerations in the module's own units.
pub mod axis {
    pub const TARGET: u8 = 0;
    pub const POSITION: u8 = 1;
    pub(crate) const TARGET_SPEED: u8 = 2;
    pub const SPEED: u8 = 3;
    pub const MAX_SPEED: u8 = 4;
    pub(crate) const MAX_ACCELERATION: u8 = 5;
    pub(crate) const RUN_CURRENT: u8 = 6;
    pub(crate) const STANDBY_CURRENT: u8 = 7;
    pub(crate) const REACHED: u8 = 8;
    pub(crate) const HOME_SWITCH: u8 = 9;
    pub(crate) const RIGHT_LIMIT: u8 = 10;
    pub(crate) const LEFT_LIMIT: u8 = 11;
    pub(crate) const RIGHT_LIMIT_OFF: u8 = 12;
    pub(crate) const LEFT_LIMIT_OFF: u8 = 13;
    /// Axis parameter with the number of microsteps in a full step, as exponent of 2.
    pub(crate) const MICROSTEPS: u8 = 140;
    pub(crate) const SEARCH_MODE: u8 = 193;
    pub(crate) const SEARCH_SPEED: u8 = 194;
    pub(crate) const SWITCH_SPEED: u8 = 195;
    pub(crate) const FREEWHEELING: u8 = 204;
}

/// The global parameter (bank 0) of the module's own watchdog, the "serial heartbeat": milliseconds without a command after
/// which the module stops its motors; 0 is off.
pub(crate) const WATCHDOG: u8 = 68;

/// Status of a reply: the command was carried out.
pub const SUCCESS: u8 = 100;

/// Status of a reply: the checksum of the request was wrong.
pub(crate) const WRONG_CHECKSUM: u8 = 1;

/// What the status code of a reply means, in words.
pub fn status_words(status: u8) -> &'static str {
    match status {
        SUCCESS => "carried out",
        101 => "stored in the module's program instead of carried out",
        WRONG_CHECKSUM => "it received a wrong checksum",
        2 => "it does not know this command",
        3 => "it does not know this parameter",
        4 => "the value is out of its range",
        5 => "its configuration memory is locked",
        6 => "the command is not available at present",
        128 => "the target was reached; this was not requested",
        _ => "a status that no TMCL manual lists",
    }
}

/// The sum of bytes modulo 256.
pub fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, b| sum.wrapping_add(*b))
}

/// A TMCL request to a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Address of the module, 1 to 255.
    pub address: u8,
    pub command: u8,
    /// Field "type" of the request: the number of a parameter, the kind of a move (0: to an absolute position), or the action of a reference search.
    pub kind: u8,
    /// Number of the axis, or of the bank of global parameters or inputs.
    pub motor: u8,
    pub value: i32,
}

impl Request {
    fn new(address: u8, motor: u8, command: u8, kind: u8, value: i32) -> Request {
        Request { address, command, kind, motor, value }
    }

    /// ROR: rotates right, towards larger positions, until another command. `velocity` is in the module's unit.
    pub fn rotate_right(address: u8, motor: u8, velocity: i32) -> Request {
        Request::new(address, motor, command::ROTATE_RIGHT, 0, velocity)
    }

    /// ROL: rotates left, towards smaller positions, until another command. `velocity` is in the module's unit.
    pub fn rotate_left(address: u8, motor: u8, velocity: i32) -> Request {
        Request::new(address, motor, command::ROTATE_LEFT, 0, velocity)
    }

    /// MST: decelerates to a stop.
    pub fn stop(address: u8, motor: u8) -> Request {
        Request::new(address, motor, command::STOP, 0, 0)
    }

    /// MVP ABS: moves to a position in microsteps.
    pub fn move_to(address: u8, motor: u8, position: i32) -> Request {
        Request::new(address, motor, command::MOVE_TO, 0, position)
    }

    /// SAP: sets an axis parameter, see [`axis`].
    pub fn set_axis(address: u8, motor: u8, parameter: u8, value: i32) -> Request {
        Request::new(address, motor, command::SET_AXIS, parameter, value)
    }

    /// GAP: reads an axis parameter, see [`axis`].
    pub fn get_axis(address: u8, motor: u8, parameter: u8) -> Request {
        Request::new(address, motor, command::GET_AXIS, parameter, 0)
    }

    /// SGP: sets a global parameter of bank 0, which the module stores permanently.
    pub fn set_global(address: u8, parameter: u8, value: i32) -> Request {
        Request::new(address, 0, command::SET_GLOBAL, parameter, value)
    }

    /// GGP: reads a global parameter of bank 0.
    pub fn get_global(address: u8, parameter: u8) -> Request {
        Request::new(address, 0, command::GET_GLOBAL, parameter, 0)
    }

    /// RFS START: the module starts its own reference search.
    pub fn search_start(address: u8, motor: u8) -> Request {
        Request::new(address, motor, command::REFERENCE_SEARCH, 0, 0)
    }

    /// RFS STOP: ends the reference search.
    pub fn search_stop(address: u8, motor: u8) -> Request {
        Request::new(address, motor, command::REFERENCE_SEARCH, 1, 0)
    }

    /// RFS STATUS: asks whether a reference search is in progress; the value of the reply is 0 if none is.
    pub fn search_status(address: u8, motor: u8) -> Request {
        Request::new(address, motor, command::REFERENCE_SEARCH, 2, 0)
    }

    /// Asks for the version of the firmware as a number: module type in the upper 16 bits (0 if the module omits it), version in the lower ones.
    pub fn version(address: u8) -> Request {
        Request::new(address, 0, command::VERSION, 1, 0)
    }

    /// Asks for the version of the firmware as text. The reply has a format of its own: see [`version_text`].
    pub fn version_text(address: u8) -> Request {
        Request::new(address, 0, command::VERSION, 0, 0)
    }

    /// The nine bytes of the request, with the checksum.
    pub fn bytes(&self) -> [u8; LENGTH] {
        let [a, b, c, d] = self.value.to_be_bytes();
        let mut bytes = [self.address, self.command, self.kind, self.motor, a, b, c, d, 0];
        bytes[8] = checksum(&bytes[..8]);
        bytes
    }

    /// Parses the bytes of a request; None if the checksum is wrong.
    pub fn parse(bytes: &[u8; LENGTH]) -> Option<Request> {
        let [address, command, kind, motor, a, b, c, d, sum] = *bytes;
        let value = i32::from_be_bytes([a, b, c, d]);
        (checksum(&bytes[..8]) == sum).then_some(Request { address, command, kind, motor, value })
    }

    /// True if the request may set the motor in motion.
    pub fn moves(&self) -> bool {
        match self.command {
            command::ROTATE_RIGHT | command::ROTATE_LEFT | command::MOVE_TO => true,
            command::REFERENCE_SEARCH => self.kind == 0,
            // In the module's position mode the motor follows these two.
            command::SET_AXIS => [axis::TARGET, axis::POSITION].contains(&self.kind),
            _ => false,
        }
    }

    /// True if sending the request twice has the same effect as once: it reads, or stops.
    pub fn repeatable(&self) -> bool {
        use command::*;
        match self.command {
            GET_AXIS | GET_GLOBAL | GET_INPUT | VERSION | STOP => true,
            REFERENCE_SEARCH => self.kind != 0,
            _ => false,
        }
    }
}

/// In the notation of the manuals: `MVP 0, 0, -800`.
impl std::fmt::Display for Request {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        use command::*;
        let Request { command, kind, motor, value, .. } = *self;
        match command {
            ROTATE_RIGHT => write!(f, "ROR {motor}, {value}"),
            ROTATE_LEFT => write!(f, "ROL {motor}, {value}"),
            STOP => write!(f, "MST {motor}"),
            MOVE_TO => write!(f, "MVP {kind}, {motor}, {value}"),
            SET_AXIS => write!(f, "SAP {kind}, {motor}, {value}"),
            GET_AXIS => write!(f, "GAP {kind}, {motor}"),
            SET_GLOBAL => write!(f, "SGP {kind}, {motor}, {value}"),
            GET_GLOBAL => write!(f, "GGP {kind}, {motor}"),
            REFERENCE_SEARCH => write!(f, "RFS {kind}, {motor}"),
            GET_INPUT => write!(f, "GIO {kind}, {motor}"),
            VERSION => write!(f, "the request for its version"),
            other => write!(f, "command {other}, type {kind}"),
        }
    }
}

/// A module's reply to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reply {
    pub host: u8,
    pub module: u8,
    /// Status code, see [`status_words`].
    pub status: u8,
    /// Command of the request that is answered.
    pub command: u8,
    pub value: i32,
}

impl Reply {
    /// The nine bytes of the reply, with the checksum.
    pub fn bytes(&self) -> [u8; LENGTH] {
        let [a, b, c, d] = self.value.to_be_bytes();
        let mut bytes = [self.host, self.module, self.status, self.command, a, b, c, d, 0];
        bytes[8] = checksum(&bytes[..8]);
        bytes
    }

    /// Parses the bytes of a reply; None if the checksum is wrong.
    pub fn parse(bytes: &[u8; LENGTH]) -> Option<Reply> {
        let [host, module, status, command, a, b, c, d, sum] = *bytes;
        let value = i32::from_be_bytes([a, b, c, d]);
        (checksum(&bytes[..8]) == sum).then_some(Reply { host, module, status, command, value })
    }

    /// The first reply to this request in the received bytes, which may have noise before and after it. None if there is none.
    pub fn find(received: &[u8], request: &Request) -> Option<Reply> {
        let replies = received.windows(LENGTH).filter_map(|w| Reply::parse(w.try_into().ok()?));
        let mut ours = replies.filter(|r| r.module == request.address && r.command == request.command);
        ours.find(|r| r.status != 128)
    }
}

/// Type and firmware version of the module from a reply to [`Request::version_text`]: the host's address and eight characters such as
/// `1161V115`, without a checksum. None if the bytes have another format.
pub fn version_text(bytes: &[u8; LENGTH]) -> Option<(u16, String)> {
    let text = std::str::from_utf8(&bytes[1..]).ok()?.trim_end_matches('\0');
    let (module, version) = text.split_once(['V', 'v'])?;
    let plain = !version.is_empty() && version.chars().all(|c| c.is_ascii_digit() || c == '.');
    plain.then_some((module.parse().ok()?, version.to_string()))
}
