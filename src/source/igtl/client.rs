//! A connection on a thread of its own, which reconnects, and the queue that the thread fills.

use super::begun::{Begun, is_passing, longest};
use super::codec::{BODY_LIMIT, DecodeError, Decoded, decode_with};
use super::message::Message;
use crate::files::escaped;
use crate::sync::locked;
use crate::tree::Defaults;
use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, ErrorKind};
use std::net::{IpAddr, Shutdown, TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Prefix of the addresses of OpenIGTLink servers, as users write them.
pub const SCHEME: &str = "igtl://";
/// Default TCP port of OpenIGTLink servers.
pub const PORT: u16 = 18944;
/// How often the waiting thread checks whether it is to stop.
const POLL: Duration = Duration::from_millis(100);
/// Shortest time of an attempt, and between two, whatever the options are: a refused connection fails at once.
const MIN_WAIT: Duration = Duration::from_millis(10);
/// How long dropping a client waits for its thread, which may be resolving a name.
const STOP: Duration = Duration::from_secs(1);
/// Largest buffer that is kept for the next message, bytes.
const MAX_KEPT_BYTES: usize = 16 << 20;
/// Most addresses of one name that are tried.
const MAX_ADDRESSES: usize = 8;
/// Longest description of an error, characters.
const MAX_ERROR_CHARACTERS: usize = 600;

/// Options of a [`Client`]. Every value is accepted: the time-out of an attempt to connect, and the wait before the next attempt, count as 10 ms if
/// they are shorter.
#[derive(Clone, Debug, Defaults)]
pub struct ClientOptions {
    /// Longest time for connecting to one address.
    #[value(Duration::from_secs(2))]
    pub connect_timeout: Duration,
    /// Longest time without a byte within a message, after which the connection is closed.
    #[value(Duration::from_secs(5))]
    pub stall_timeout: Duration,
    /// Longest time from the first byte of a message to its last, to which a second is added for each megabyte of the message. After it the
    /// connection is closed, so that a peer that sends a byte now and then does not keep the connection open.
    #[value(Duration::from_secs(10))]
    pub message_timeout: Duration,
    /// Longest time without a byte between two messages, after which the connection is closed: a peer that lost power does not close it.
    #[value(Duration::from_secs(30))]
    pub silence_timeout: Duration,
    /// Wait before the first attempt to reconnect. It doubles with every attempt that brings no message.
    #[value(Duration::from_millis(250))]
    pub first_wait: Duration,
    /// Longest wait before an attempt to reconnect, unless `first_wait` is longer.
    #[value(Duration::from_secs(5))]
    pub longest_wait: Duration,
    /// Largest body of a message, bytes. After the header of a larger one the connection is closed.
    #[value(BODY_LIMIT)]
    pub body_limit: usize,
    /// Largest number of messages in the queue; at least the newest is always kept.
    #[value(256)]
    pub queue_messages: usize,
    /// Largest memory of the queued messages, bytes. The newest message is kept even if it alone is larger.
    #[value(BODY_LIMIT)]
    pub queue_bytes: usize,
    /// True if messages whose checksum is 0 are accepted without verifying it: some senders compute none.
    pub takes_no_checksum: bool,
}

/// Counts since the client was created, and whether it is connected.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ClientStatistics {
    /// True while a connection exists.
    pub connected: bool,
    /// Number of decoded messages of all types.
    pub messages: u64,
    /// Number of bytes received.
    pub bytes: u64,
    /// Number of messages that were skipped because of a wrong checksum.
    pub checksum_failures: u64,
    /// Number of messages that were skipped because their body is invalid for their type.
    pub malformed: u64,
    /// Number of decoded messages of types that the program does not use. They are queued as [`Message::Other`].
    pub skipped: u64,
    /// Number of decoded messages that were dropped from the queue in favour of newer ones.
    pub dropped: u64,
    /// Number of connections that ended within a message.
    pub cut_short: u64,
    /// Number of connections that were closed because the bytes where a header had to be were none, or because the header stated too large a body.
    pub lost_framing: u64,
    /// Number of connections after the first.
    pub reconnects: u64,
}

/// A client of an OpenIGTLink server, which reconnects whenever the connection breaks. Dropping it ends the connection within a second.
///
/// Memory: at most [`ClientOptions::queue_bytes`] or the newest message in the queue, and three times the body of a message while it is decoded.
pub struct Client {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    options: ClientOptions,
}

#[derive(Default)]
struct State {
    queue: Queue,
    statistics: ClientStatistics,
    connections: u64,
    last_error: Option<String>,
    socket: Option<TcpStream>,
    stop: bool,
    finished: bool,
}

impl Client {
    /// Starts to connect to `address`: a host name or an IP address, followed by a colon and the port unless it is [`PORT`]. If the server cannot be
    /// reached, the client keeps trying, and [`last_error`](Client::last_error) says why.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn connect(address: &str, options: ClientOptions) -> io::Result<Client> {
        let shared = Arc::new(Shared { state: Mutex::default(), changed: Condvar::new(), options });
        let (theirs, address) = (FinishOnExit(shared.clone()), with_port(address));
        let thread = thread::Builder::new().name("igtl".into()).spawn(move || theirs.0.run(&address))?;
        Ok(Client { shared, thread: Some(thread) })
    }

    /// Takes the oldest message from the queue. If the queue is empty, waits for a message for at most `timeout`; None if none arrives.
    pub fn next(&self, timeout: Duration) -> Option<Received> {
        let started = Instant::now();
        let mut state = locked(&self.shared.state);
        loop {
            if let Some(received) = state.queue.pop() {
                return Some(received);
            }
            let left = timeout.saturating_sub(started.elapsed());
            if left.is_zero() || state.finished {
                return None;
            }
            state = self.shared.wait(state, left);
        }
    }

    /// Counts since the client was created.
    pub fn statistics(&self) -> ClientStatistics {
        locked(&self.shared.state).statistics.clone()
    }

    /// The last error of the connection or of a message that was skipped, on one line; None if there was none since the client was created.
    pub fn last_error(&self) -> Option<String> {
        locked(&self.shared.state).last_error.clone()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let asked = Instant::now();
        let mut state = locked(&self.shared.state);
        state.stop = true;
        if let Some(socket) = &state.socket {
            // Wakes the thread from reading. It may fail if the peer has closed the connection.
            let _ = socket.shutdown(Shutdown::Both);
        }
        self.shared.changed.notify_all();
        while !state.finished && asked.elapsed() < STOP {
            state = self.shared.wait(state, STOP.saturating_sub(asked.elapsed()));
        }
        let finished = state.finished;
        drop(state);
        // A thread that is still resolving a name or connecting ends by itself later.
        if let Some(thread) = self.thread.take().filter(|_| finished) {
            let _ = thread.join();
        }
    }
}

/// Marks the thread as finished, also after a panic.
struct FinishOnExit(Arc<Shared>);

impl Drop for FinishOnExit {
    fn drop(&mut self) {
        locked(&self.0.state).finished = true;
        self.0.changed.notify_all();
    }
}

impl Shared {
    fn wait<'a>(&self, state: MutexGuard<'a, State>, most: Duration) -> MutexGuard<'a, State> {
        self.changed.wait_timeout(state, most).unwrap_or_else(PoisonError::into_inner).0
    }

    fn run(&self, address: &str) {
        let first_wait = self.options.first_wait.max(MIN_WAIT);
        let mut wait = first_wait;
        while !locked(&self.state).stop {
            let before = locked(&self.state).statistics.messages;
            let why = match self.open(address) {
                Ok(stream) => self.receive(&stream),
                Err(error) if error.kind() == ErrorKind::ConnectionRefused => {
                    format!("cannot connect: the connection was refused: no server listens at {address}")
                }
                Err(error) => format!("cannot connect: {error}"),
            };
            let mut state = locked(&self.state);
            state.socket = None;
            state.statistics.connected = false;
            if state.statistics.messages > before {
                wait = first_wait;
            }
            if !state.stop {
                let why = escaped(&why, MAX_ERROR_CHARACTERS);
                tracing::info!("OpenIGTLink from {address}: {why}; trying again in {} ms", wait.as_millis());
                state.last_error = Some(why);
            }
            let since = Instant::now();
            while !state.stop && since.elapsed() < wait {
                state = self.wait(state, wait.saturating_sub(since.elapsed()));
            }
            wait = wait.saturating_mul(2).min(self.options.longest_wait.max(first_wait));
        }
    }

    fn open(&self, address: &str) -> io::Result<TcpStream> {
        let mut last = io::Error::new(ErrorKind::NotFound, "the name has no address");
        for address in address.to_socket_addrs()?.take(MAX_ADDRESSES) {
            if locked(&self.state).stop {
                break;
            }
            match TcpStream::connect_timeout(&address, self.options.connect_timeout.max(MIN_WAIT)) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(POLL))?;
                    let mut state = locked(&self.state);
                    state.socket = Some(stream.try_clone()?);
                    state.statistics.connected = true;
                    state.statistics.reconnects = state.connections;
                    state.connections += 1;
                    return Ok(stream);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    /// Receives messages until the connection breaks, its framing is lost, or the client is dropped. Returns the reason.
    fn receive(&self, stream: &TcpStream) -> String {
        let options = &self.options;
        let mut input = BufReader::with_capacity(1 << 16, stream);
        // Holds one message at most, so that no bytes have to be moved.
        let mut bytes = Vec::new();
        let (mut last, mut begun) = (Instant::now(), Begun::default());
        loop {
            let missing = match decode_with(&bytes, options.body_limit, options.takes_no_checksum) {
                Ok(Decoded::Need(missing)) => missing,
                Ok(Decoded::Message { message, .. }) => {
                    self.deliver(message);
                    0
                }
                Err(lost @ DecodeError::Framing { .. }) => {
                    locked(&self.state).statistics.lost_framing += 1;
                    return lost.to_string();
                }
                Err(skipped) => {
                    self.skip(&skipped);
                    0
                }
            };
            // A message ended, was skipped or refused: more is needed otherwise.
            if missing == 0 {
                bytes.clear();
                bytes.shrink_to(MAX_KEPT_BYTES);
                begun = Begun::default();
                continue;
            }
            // What is known of its length.
            let length = bytes.len() + missing;
            let read = input.fill_buf().map(|there| {
                let came = &there[..there.len().min(missing)];
                bytes.extend_from_slice(came);
                came.len()
            });
            let came = *read.as_ref().unwrap_or(&0);
            input.consume(came);
            let mut state = locked(&self.state);
            state.statistics.bytes += came as u64;
            if state.stop {
                return "stopped".into();
            }
            let most = longest(options.message_timeout, length);
            let is_late = begun.is_late(!bytes.is_empty(), Instant::now(), most);
            let why = match read {
                _ if came > 0 && came == missing => None,
                _ if is_late => Some(format!("a message did not end within {} ms", most.as_millis())),
                Ok(1..) => None,
                Ok(0) if bytes.is_empty() => Some("the peer closed the connection".into()),
                Ok(0) => Some(format!("the peer closed the connection {} bytes into a message", bytes.len())),
                Err(e) if is_passing(&e) => {
                    let most = if bytes.is_empty() { options.silence_timeout } else { options.stall_timeout };
                    (last.elapsed() > most).then(|| format!("nothing came for {} ms", most.as_millis()))
                }
                Err(e) => Some(format!("cannot be read: {e}")),
            };
            if let Some(why) = why {
                state.statistics.cut_short += u64::from(!bytes.is_empty());
                return why;
            }
            if came > 0 {
                last = Instant::now();
            }
        }
    }

    fn deliver(&self, message: Message) {
        let mut state = locked(&self.state);
        state.statistics.messages += 1;
        state.statistics.skipped += u64::from(matches!(message, Message::Other(_)));
        let dropped = state.queue.push(Received { message, arrived: Instant::now() }, &self.options);
        state.statistics.dropped += dropped;
        self.changed.notify_all();
    }

    fn skip(&self, refused: &DecodeError) {
        let mut state = locked(&self.state);
        match refused {
            DecodeError::Checksum { .. } => state.statistics.checksum_failures += 1,
            DecodeError::Content { .. } | DecodeError::Framing { .. } => state.statistics.malformed += 1,
        }
        state.last_error = Some(refused.to_string());
    }
}

/// The address with its port: [`PORT`] is added if there is none.
pub fn with_port(address: &str) -> String {
    match address.parse::<IpAddr>() {
        Ok(IpAddr::V6(number)) => format!("[{number}]:{PORT}"),
        Err(_) if address.contains(':') && !address.ends_with(']') => address.to_string(),
        _ => format!("{address}:{PORT}"),
    }
}

/// The port of an address, [`PORT`] if it has none. None if what follows the colon is not a port number.
pub fn port(address: &str) -> Option<u16> {
    with_port(address).rsplit(':').next()?.parse().ok()
}

/// A message and the time of its arrival.
#[derive(Clone, Debug)]
pub struct Received {
    pub message: Message,
    /// When the message was put into the queue, which is after it was received and decoded.
    pub arrived: Instant,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<(Received, usize)>,
    /// Memory of all queued messages.
    bytes: usize,
}

impl Queue {
    /// Adds a message and returns how many older ones were dropped. The new one is always kept: otherwise, with a limit below its size,
    /// none would ever be delivered.
    fn push(&mut self, received: Received, options: &ClientOptions) -> u64 {
        let weight = received.message.weight();
        self.bytes = self.bytes.saturating_add(weight);
        self.waiting.push_back((received, weight));
        let mut dropped = 0;
        let is_full = |queue: &Queue| queue.waiting.len() > options.queue_messages || queue.bytes > options.queue_bytes;
        while self.waiting.len() > 1 && is_full(self) {
            self.pop();
            dropped += 1;
        }
        dropped
    }

    fn pop(&mut self) -> Option<Received> {
        let (received, weight) = self.waiting.pop_front()?;
        self.bytes = self.bytes.saturating_sub(weight);
        Some(received)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_without_a_port_gets_the_usual_one() {
        for (given, whole) in [
            ("127.0.0.1", "127.0.0.1:18944"),
            ("scanner", "scanner:18944"),
            ("scanner:7", "scanner:7"),
            ("::1", "[::1]:18944"),
            ("[::1]", "[::1]:18944"),
            ("[::1]:7", "[::1]:7"),
        ] {
            assert_eq!(with_port(given), whole);
            assert_eq!(port(given), if whole.ends_with(":7") { Some(7) } else { Some(PORT) });
        }
        assert!(["scanner:99999", "scanner:", "scanner:-1", "scanner:igtl"].iter().all(|given| port(given).is_none()));
    }
}

#[cfg(test)]
mod queue_tests {
    use super::*;
    use crate::igtl::Text;

    fn text(length: usize) -> Received {
        let text = Text { device: String::new(), time: length as f64, text: "x".repeat(length) };
        Received { message: Message::Text(text), arrived: Instant::now() }
    }

    #[test]
    fn the_oldest_go_by_number_and_by_bytes_and_the_newest_stays() {
        let options = ClientOptions { queue_messages: 2, queue_bytes: 10_000, ..ClientOptions::default() };
        let mut queue = Queue::default();
        assert_eq!([1, 2, 3].map(|n| queue.push(text(n), &options)), [0, 0, 1]);
        assert_eq!(queue.push(text(9_000), &options), 1);
        assert_eq!(queue.push(text(20_000), &options), 2);
        assert_eq!(queue.pop().map(|r| r.message.time()), Some(20_000.0));
        assert!(queue.pop().is_none());
        assert_eq!(queue.bytes, 0);
    }
}
