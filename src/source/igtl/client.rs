//! A connection that is kept up by a thread of its own, and the queue that the thread fills.

use super::codec::{BODY_LIMIT, Decoded, decode};
use super::message::Message;
use super::wire::DecodeError;
use crate::files::escaped;
use std::collections::VecDeque;
use std::io::{self, BufReader, ErrorKind, Read};
use std::net::{IpAddr, Shutdown, TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Where OpenIGTLink servers listen by custom, and a client connects unless told otherwise.
pub const PORT: u16 = 18944;
/// How often a waiting thread looks whether it shall stop.
const POLL: Duration = Duration::from_millis(100);
/// Shortest time for a try, and between two, whatever the options say: a refused one comes back at once.
const MIN_WAIT: Duration = Duration::from_millis(10);
/// How long dropping a client waits for its thread, which may be looking up a name.
const STOP: Duration = Duration::from_secs(1);
/// A message is read in steps of so many bytes: memory follows what came, not what was claimed.
const STEP: usize = 1 << 20;
/// What a large message leaves allocated for the next, bytes.
const MAX_KEPT_BYTES: usize = 16 << 20;
/// Addresses of one name that are tried.
const MAX_ADDRESSES: usize = 8;
/// Longest description of a fault, in characters.
const MAX_ERROR_CHARACTERS: usize = 600;

/// How a [`Client`] behaves. Every number may be anything; zeros make little sense but do no harm: tries take and are apart 10 ms at least.
#[derive(Clone, Debug)]
pub struct ClientOptions {
    /// How long one address may take to answer.
    pub connect_timeout: Duration,
    /// How long a message that has begun may stand still before the connection is given up.
    pub stall_timeout: Duration,
    /// How long nothing at all may come; a peer that lost its power says no good-bye.
    pub silence_timeout: Duration,
    /// Before the first new try; doubled with every try that brings no message.
    pub first_wait: Duration,
    pub longest_wait: Duration,
    /// Largest body, bytes.
    pub body_limit: usize,
    /// Most messages that wait to be taken; at least one always may.
    pub queue_messages: usize,
    /// Most memory of the messages that wait, bytes. A single larger one still waits.
    pub queue_bytes: usize,
}

impl Default for ClientOptions {
    fn default() -> ClientOptions {
        ClientOptions {
            connect_timeout: Duration::from_secs(2),
            stall_timeout: Duration::from_secs(5),
            silence_timeout: Duration::from_secs(30),
            first_wait: Duration::from_millis(250),
            longest_wait: Duration::from_secs(5),
            body_limit: BODY_LIMIT,
            queue_messages: 256,
            queue_bytes: BODY_LIMIT,
        }
    }
}

/// What has happened since the client was made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ClientStatistics {
    /// There is a connection now.
    pub connected: bool,
    /// Decoded, of all types.
    pub messages: u64,
    /// Received, whatever came of them.
    pub bytes: u64,
    /// Passed over because their checksum was wrong.
    pub checksum_failures: u64,
    /// Passed over because their body was none that their type allows.
    pub malformed: u64,
    /// Of the decoded: of types that are not read.
    pub skipped: u64,
    /// Of the decoded: pushed out of the queue by newer ones.
    pub dropped: u64,
    /// Connections that ended within a message.
    pub cut_short: u64,
    /// Connections given up because no header was where one must be.
    pub lost_framing: u64,
    /// Connections after the first.
    pub reconnects: u64,
}

/// A connection to an OpenIGTLink server, made again whenever it breaks. Dropping it ends it within a second.
///
/// Memory: at most the queue's bytes or its newest message, and while one is decoded three times its body.
pub struct Client {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    queue: Queue,
    statistics: ClientStatistics,
    connections: u64,
    last_error: Option<String>,
    socket: Option<TcpStream>,
    stop: bool,
    finished: bool,
}

/// Why a connection ended, in words.
struct ConnectionEnd {
    why: String,
    /// It had brought a message.
    useful: bool,
}

impl Client {
    /// Starts connecting to `address`: a name or number, with a port behind a colon unless it is [`PORT`]. A server that is
    /// not there is waited for; [`last_error`](Client::last_error) says what is amiss.
    ///
    /// # Errors
    /// The operating system starts no thread.
    pub fn connect(address: &str, options: ClientOptions) -> io::Result<Client> {
        let state = State {
            queue: Queue::new(options.queue_messages, options.queue_bytes),
            statistics: ClientStatistics::default(),
            connections: 0,
            last_error: None,
            socket: None,
            stop: false,
            finished: false,
        };
        let shared = Arc::new(Shared { state: Mutex::new(state), changed: Condvar::new() });
        let (theirs, address) = (FinishOnExit(shared.clone()), with_port(address));
        let thread = thread::Builder::new().name("igtl".into()).spawn(move || theirs.0.run(&address, &options))?;
        Ok(Client { shared, thread: Some(thread) })
    }

    /// The oldest message that waits, if there is one.
    pub fn try_next(&self) -> Option<Received> {
        self.shared.lock().queue.pop()
    }

    /// The oldest message that waits; if there is none, the next to come within `timeout`.
    pub fn next(&self, timeout: Duration) -> Option<Received> {
        let started = Instant::now();
        let mut state = self.shared.lock();
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

    pub fn statistics(&self) -> ClientStatistics {
        self.shared.lock().statistics.clone()
    }

    /// What last went wrong, on one line.
    pub fn last_error(&self) -> Option<String> {
        self.shared.lock().last_error.clone()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let asked = Instant::now();
        let mut state = self.shared.lock();
        state.stop = true;
        if let Some(socket) = &state.socket {
            // Wakes the thread from reading; it does not matter if the peer has gone already.
            let _ = socket.shutdown(Shutdown::Both);
        }
        self.shared.changed.notify_all();
        while !state.finished && asked.elapsed() < STOP {
            state = self.shared.wait(state, STOP.saturating_sub(asked.elapsed()));
        }
        let finished = state.finished;
        drop(state);
        // One that is still looking up a name or connecting ends by itself when that has come to an end.
        if let Some(thread) = self.thread.take().filter(|_| finished) {
            let _ = thread.join();
        }
    }
}

/// Says that the thread is done, however it came to that.
struct FinishOnExit(Arc<Shared>);

impl Drop for FinishOnExit {
    fn drop(&mut self) {
        self.0.lock().finished = true;
        self.0.changed.notify_all();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock, and the state is whole between any two lines if something did.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State>, most: Duration) -> MutexGuard<'a, State> {
        self.changed.wait_timeout(state, most).unwrap_or_else(PoisonError::into_inner).0
    }

    fn run(&self, address: &str, options: &ClientOptions) {
        let first_wait = options.first_wait.max(MIN_WAIT);
        let mut wait = first_wait;
        while !self.lock().stop {
            let ended = match self.open(address, options) {
                Ok(stream) => self.receive(&stream, options),
                Err(error) => ConnectionEnd { why: format!("cannot connect: {error}"), useful: false },
            };
            if ended.useful {
                wait = first_wait;
            }
            let mut state = self.lock();
            state.socket = None;
            state.statistics.connected = false;
            if !state.stop {
                let why = escaped(&ended.why, MAX_ERROR_CHARACTERS);
                tracing::info!("OpenIGTLink from {address}: {why}; trying again in {} ms", wait.as_millis());
                state.last_error = Some(why);
            }
            let since = Instant::now();
            while !state.stop && since.elapsed() < wait {
                state = self.wait(state, wait.saturating_sub(since.elapsed()));
            }
            wait = wait.saturating_mul(2).min(options.longest_wait.max(first_wait));
        }
    }

    fn open(&self, address: &str, options: &ClientOptions) -> io::Result<TcpStream> {
        let mut last = io::Error::new(ErrorKind::NotFound, "the name has no address");
        for address in address.to_socket_addrs()?.take(MAX_ADDRESSES) {
            if self.lock().stop {
                break;
            }
            match TcpStream::connect_timeout(&address, options.connect_timeout.max(MIN_WAIT)) {
                Ok(stream) => {
                    stream.set_read_timeout(Some(POLL))?;
                    let mut state = self.lock();
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

    /// Until the connection breaks, or cannot be understood any more, or the client is dropped.
    fn receive(&self, stream: &TcpStream, options: &ClientOptions) -> ConnectionEnd {
        let mut input = BufReader::with_capacity(1 << 16, stream);
        // Never more than one message, so that none has to be moved.
        let mut bytes = Vec::new();
        let mut useful = false;
        let mut last = Instant::now();
        loop {
            let missing = match decode(&bytes, options.body_limit) {
                Ok(Decoded::Need(missing)) => missing,
                Ok(Decoded::Message { message, .. }) => {
                    self.deliver(message);
                    useful = true;
                    clear(&mut bytes);
                    continue;
                }
                Err(DecodeError::Framing { error }) => {
                    self.lock().statistics.lost_framing += 1;
                    return ConnectionEnd { why: DecodeError::Framing { error }.to_string(), useful };
                }
                Err(passed_over) => {
                    self.pass_over(&passed_over);
                    clear(&mut bytes);
                    continue;
                }
            };
            let before = bytes.len();
            let step = missing.min(STEP);
            let read = Read::take(&mut input, step as u64).read_to_end(&mut bytes);
            let came = bytes.len() - before;
            let mut state = self.lock();
            state.statistics.bytes += came as u64;
            if state.stop {
                return ConnectionEnd { why: "stopped".into(), useful };
            }
            let why = match read {
                _ if came > 0 && came == step => None,
                Ok(_) if bytes.is_empty() => Some("the peer closed the connection".into()),
                Ok(_) => Some(format!("the peer closed the connection {} bytes into a message", bytes.len())),
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    let most = if bytes.is_empty() { options.silence_timeout } else { options.stall_timeout };
                    (came == 0 && last.elapsed() > most).then(|| format!("nothing came for {} ms", most.as_millis()))
                }
                Err(e) => Some(format!("cannot be read: {e}")),
            };
            if let Some(why) = why {
                state.statistics.cut_short += u64::from(!bytes.is_empty());
                return ConnectionEnd { why, useful };
            }
            if came > 0 {
                last = Instant::now();
            }
        }
    }

    fn deliver(&self, message: Message) {
        let mut state = self.lock();
        state.statistics.messages += 1;
        state.statistics.skipped += u64::from(matches!(message, Message::Other(_)));
        let dropped = state.queue.push(Received { message, arrived: Instant::now() });
        state.statistics.dropped += dropped;
        self.changed.notify_all();
    }

    fn pass_over(&self, refused: &DecodeError) {
        let mut state = self.lock();
        match refused {
            DecodeError::Checksum { .. } => state.statistics.checksum_failures += 1,
            DecodeError::Content { .. } | DecodeError::Framing { .. } => state.statistics.malformed += 1,
        }
        state.last_error = Some(refused.to_string());
    }
}

fn clear(bytes: &mut Vec<u8>) {
    bytes.clear();
    bytes.shrink_to(MAX_KEPT_BYTES);
}

/// The address with [`PORT`] where it names none.
fn with_port(address: &str) -> String {
    match address.parse::<IpAddr>() {
        Ok(IpAddr::V6(number)) => format!("[{number}]:{PORT}"),
        Err(_) if address.contains(':') && !address.ends_with(']') => address.to_string(),
        _ => format!("{address}:{PORT}"),
    }
}

/// A message and when it came.
#[derive(Clone, Debug)]
pub struct Received {
    pub message: Message,
    /// When its last byte was there.
    pub arrived: Instant,
}

struct Queue {
    waiting: VecDeque<(Received, usize)>,
    /// Of memory, of all that wait.
    bytes: usize,
    max_messages: usize,
    max_bytes: usize,
}

impl Queue {
    fn new(max_messages: usize, max_bytes: usize) -> Queue {
        Queue { waiting: VecDeque::new(), bytes: 0, max_messages, max_bytes }
    }

    /// How many had to go for it. The newest itself always stays: with a limit below its size nothing would ever come.
    fn push(&mut self, received: Received) -> u64 {
        let weight = received.message.weight();
        self.bytes = self.bytes.saturating_add(weight);
        self.waiting.push_back((received, weight));
        let mut dropped = 0;
        while self.waiting.len() > 1 && (self.waiting.len() > self.max_messages || self.bytes > self.max_bytes) {
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
        }
    }
}

#[cfg(test)]
mod queue_tests {
    use super::*;
    use crate::source::igtl::Text;

    fn text(length: usize) -> Received {
        let text = Text { device: String::new(), time: length as f64, text: "x".repeat(length) };
        Received { message: Message::Text(text), arrived: Instant::now() }
    }

    #[test]
    fn the_oldest_go_by_number_and_by_bytes_and_the_newest_stays() {
        let mut queue = Queue::new(2, 10_000);
        assert_eq!([1, 2, 3].map(|n| queue.push(text(n))), [0, 0, 1]);
        assert_eq!(queue.push(text(9_000)), 1);
        assert_eq!(queue.push(text(20_000)), 2);
        assert_eq!(queue.pop().map(|r| r.message.time()), Some(20_000.0));
        assert!(queue.pop().is_none());
        assert_eq!(queue.bytes, 0);
    }
}
