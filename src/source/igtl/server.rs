//! A server on threads of its own. It sends each message to all connected clients. If a client is slow, the oldest messages of its own
//! queue are dropped.

use super::begun::{Begun, is_passing, longest};
use super::codec::{self, BODY_LIMIT, DecodeError, Decoded, MessageError, Version, decode, encode};
use super::message::{Message, Status, Text};
use crate::sync::locked;
use crate::tree::Defaults;
use std::collections::{BTreeMap, VecDeque};
use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// How often waiting threads check whether they are to stop.
const POLL: Duration = Duration::from_millis(50);
/// Largest body of a message from a client, bytes: queries are short, and nothing else is asked for.
const QUERY_LIMIT: usize = 1 << 20;
/// Most answers that wait for a client. One that asks and does not read is disconnected.
const MAX_ANSWERS: usize = 64;
/// What the server can send, as the answer to GET_CAPABIL.
const CAPABILITIES: [&str; 4] = ["IMAGE", "STATUS", "STRING", "CAPABILITY"];
/// Result of a query, in an RTS_ message.
const SUCCESS: u8 = 0;
const ERROR: u8 = 1;

/// Options of a [`Server`].
#[derive(Clone, Debug, Defaults)]
pub struct ServerOptions {
    /// Largest number of clients at a time. Further ones are disconnected at once.
    #[value(16)]
    pub clients: usize,
    /// Largest number of messages of each device that wait for a client; the oldest are dropped in favour of newer ones.
    #[value(2)]
    pub queue_messages: usize,
    /// Largest number of bytes that wait for a client. The newest message is always kept.
    #[value(BODY_LIMIT)]
    pub queue_bytes: usize,
    /// Longest time in which a client reads nothing of a message that is being sent to it; after it the client is disconnected.
    #[value(Duration::from_secs(10))]
    pub stall_timeout: Duration,
    /// Longest time from the first byte of a message of a client, such as a query, to its last; after it the client is disconnected. A message to a
    /// client may take a second more for each megabyte.
    #[value(Duration::from_secs(10))]
    pub message_timeout: Duration,
    /// Longest time that dropping the server waits until its last messages are sent.
    #[value(Duration::from_secs(2))]
    pub last: Duration,
    /// Name of the server: device name in its answers to queries, except for images, and text of its STRING message.
    #[value("Echolume".into())]
    pub name: String,
}

/// Counts since the server was started, and the number of clients.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ServerStatistics {
    /// Number of clients that are connected now.
    pub clients: usize,
    /// Number of clients that have connected so far.
    pub connections: u64,
    /// Number of clients that were disconnected at once because the largest number was reached.
    pub refused: u64,
    /// Number of messages that were sent completely, over all clients.
    pub sent: u64,
    /// Number of messages that were dropped from a client's queue in favour of newer ones.
    pub dropped: u64,
    /// Number of clients that were disconnected because they read nothing or too slowly, asked and did not read the answers, or sent something that
    /// is not a message or did not end in time.
    pub disconnected: u64,
}

/// An OpenIGTLink server. Dropping it sends the waiting messages, for [`ServerOptions::last`] at most, and ends all connections.
///
/// Memory: the last message of each device, and [`ServerOptions::queue_bytes`] a client; messages are shared among clients.
pub struct Server {
    shared: Arc<Shared>,
    address: SocketAddr,
    thread: Mutex<Option<JoinHandle<()>>>,
}

struct Shared {
    state: Mutex<State>,
    /// Signalled when a message is queued, a client leaves, or the server is dropped.
    changed: Condvar,
    options: ServerOptions,
}

#[derive(Default)]
struct State {
    clients: BTreeMap<u64, Queue>,
    /// The last message of each device, for those who ask.
    last: BTreeMap<String, Packet>,
    statistics: ServerStatistics,
    /// Send what waits, then end.
    stop: bool,
    /// End at once.
    abort: bool,
}

/// An encoded message.
#[derive(Clone)]
struct Packet {
    /// None: a short answer, which is never dropped.
    device: Option<String>,
    bytes: Arc<[u8]>,
}

/// What waits for a client.
#[derive(Default)]
struct Queue {
    waiting: VecDeque<Packet>,
    bytes: usize,
    /// It asked for no images, by STP_IMAGE.
    is_paused: bool,
    answers: usize,
}

impl Queue {
    /// Adds a message. Returns how many older ones were dropped.
    fn push(&mut self, packet: Packet, options: &ServerOptions) -> u64 {
        let mut dropped = 0;
        if packet.device.is_some() {
            let alike = |there: &Packet| there.device == packet.device;
            while self.waiting.iter().filter(|there| alike(there)).count() >= options.queue_messages.max(1) {
                dropped += u64::from(self.remove(alike));
            }
            let is_image = |there: &Packet| there.device.is_some();
            while self.bytes + packet.bytes.len() > options.queue_bytes && self.remove(is_image) {
                dropped += 1;
            }
        } else {
            self.answers += 1;
        }
        self.bytes += packet.bytes.len();
        self.waiting.push_back(packet);
        dropped
    }

    /// Removes the oldest message of a kind. False if there is none.
    fn remove(&mut self, is_it: impl Fn(&Packet) -> bool) -> bool {
        let Some(at) = self.waiting.iter().position(is_it) else { return false };
        if let Some(removed) = self.waiting.remove(at) {
            self.bytes -= removed.bytes.len();
        }
        true
    }

    fn pop(&mut self) -> Option<Packet> {
        let packet = self.waiting.pop_front()?;
        self.bytes -= packet.bytes.len();
        self.answers -= usize::from(packet.device.is_none());
        Some(packet)
    }
}

impl Server {
    /// Listens at `address`, a host name or an IP address with a port; port 0 takes a free one.
    ///
    /// # Errors
    /// An address that is not of this machine, a port that is in use or not allowed, a thread that cannot be started.
    pub fn bind(address: &str, options: ServerOptions) -> io::Result<Server> {
        let addresses: Vec<SocketAddr> = address.to_socket_addrs()?.collect();
        let listener = TcpListener::bind(&addresses[..])?;
        // `accept` must not block: the thread is to end with the server.
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared { state: Mutex::default(), changed: Condvar::new(), options });
        let theirs = shared.clone();
        let thread = thread::Builder::new().name("igtl server".into()).spawn(move || theirs.listen(&listener))?;
        Ok(Server { shared, address, thread: Mutex::new(Some(thread)) })
    }

    /// The address and port at which the server listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// True if at least one client is connected.
    pub(crate) fn has_clients(&self) -> bool {
        locked(&self.shared.state).statistics.clients > 0
    }

    /// Queues a message for every client except those that asked for no images (STP_IMAGE), and returns at once.
    ///
    /// # Errors
    /// A message that the format cannot hold.
    pub fn send(&self, message: &Message) -> Result<(), MessageError> {
        let bytes: Arc<[u8]> = encode(message, Version::V1)?.into();
        let device = message.device().to_string();
        let packet = Packet { device: Some(device.clone()), bytes };
        let mut state = locked(&self.shared.state);
        let State { clients, last, statistics, .. } = &mut *state;
        for queue in clients.values_mut().filter(|queue| !queue.is_paused) {
            statistics.dropped += queue.push(packet.clone(), &self.shared.options);
        }
        last.insert(device, packet);
        drop(state);
        self.shared.changed.notify_all();
        Ok(())
    }

    /// Counts since the server was started.
    pub fn statistics(&self) -> ServerStatistics {
        locked(&self.shared.state).statistics.clone()
    }

    /// Sends the waiting messages, for [`ServerOptions::last`] at most, and ends all connections. The statistics remain available.
    pub fn finish(&self) {
        let mut state = locked(&self.shared.state);
        state.stop = true;
        self.shared.changed.notify_all();
        let asked = Instant::now();
        while !state.clients.is_empty() && asked.elapsed() < self.shared.options.last {
            state = self.shared.wait(state, POLL);
        }
        state.abort = true;
        drop(state);
        self.shared.changed.notify_all();
        let thread = locked(&self.thread).take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Shared {
    fn wait<'a>(&self, state: MutexGuard<'a, State>, most: Duration) -> MutexGuard<'a, State> {
        self.changed.wait_timeout(state, most).unwrap_or_else(PoisonError::into_inner).0
    }

    /// Accepts clients until the server is dropped, and waits for their threads.
    fn listen(self: &Arc<Self>, listener: &TcpListener) {
        let mut threads: Vec<JoinHandle<()>> = Vec::new();
        let mut number = 0;
        loop {
            threads.retain(|thread| !thread.is_finished());
            let state = locked(&self.state);
            if state.stop {
                break;
            }
            let is_full = state.clients.len() >= self.options.clients;
            drop(state);
            match listener.accept() {
                Ok((stream, peer)) if is_full => {
                    tracing::warn!("OpenIGTLink: {peer} is refused, {} clients are connected", self.options.clients);
                    locked(&self.state).statistics.refused += 1;
                    drop(stream);
                }
                Ok((stream, peer)) => {
                    number += 1;
                    match self.clone().start(stream, peer, number) {
                        Ok(started) => threads.extend(started),
                        Err(e) => tracing::warn!("OpenIGTLink: {peer} cannot be served: {e}"),
                    }
                }
                // No client, or one that went away at once.
                Err(_) => thread::sleep(POLL),
            }
        }
        for thread in threads {
            let _ = thread.join();
        }
    }

    /// Starts the two threads of a client.
    fn start(self: Arc<Self>, stream: TcpStream, peer: SocketAddr, number: u64) -> io::Result<[JoinHandle<()>; 2]> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(POLL))?;
        stream.set_write_timeout(Some(POLL))?;
        let theirs = stream.try_clone()?;
        let mut state = locked(&self.state);
        state.clients.insert(number, Queue::default());
        state.statistics.connections += 1;
        state.statistics.clients = state.clients.len();
        drop(state);
        tracing::info!("OpenIGTLink: {peer} is connected");
        let (reads, writes) = (self.clone(), self.clone());
        let reader = thread::Builder::new().name("igtl reader".into()).spawn(move || reads.read(&theirs, number));
        let writer = thread::Builder::new().name("igtl writer".into()).spawn(move || {
            let why = writes.write(&stream, number);
            tracing::info!("OpenIGTLink: {peer} is disconnected: {why}");
            // Also ends the other thread.
            let _ = stream.shutdown(Shutdown::Both);
            writes.leave(number);
        });
        if reader.is_err() || writer.is_err() {
            self.leave(number);
        }
        Ok([reader?, writer?])
    }

    fn leave(&self, number: u64) {
        let mut state = locked(&self.state);
        state.clients.remove(&number);
        state.statistics.clients = state.clients.len();
        drop(state);
        self.changed.notify_all();
    }

    /// Sends what is queued for a client, until it leaves or the server ends. Returns the reason.
    fn write(&self, mut stream: &TcpStream, number: u64) -> String {
        loop {
            let mut state = locked(&self.state);
            let packet = loop {
                if state.abort {
                    return "the server ends".into();
                }
                let stop = state.stop;
                let Some(queue) = state.clients.get_mut(&number) else { return "it left or was refused".into() };
                match queue.pop() {
                    Some(packet) => break packet,
                    None if stop => return "the server ends".into(),
                    None => state = self.wait(state, POLL),
                }
            };
            drop(state);
            let (begun, most) = (Instant::now(), longest(self.options.message_timeout, packet.bytes.len()));
            let (mut rest, mut moved) = (&packet.bytes[..], begun);
            while !rest.is_empty() {
                match stream.write(rest) {
                    Ok(0) => return "it is closed".into(),
                    Ok(n) => (rest, moved) = (&rest[n..], Instant::now()),
                    Err(e) if is_passing(&e) => {}
                    Err(e) => return e.to_string(),
                }
                let mut state = locked(&self.state);
                if state.abort || !state.clients.contains_key(&number) {
                    return "the server ends, or it left or was refused".into();
                }
                if moved.elapsed() > self.options.stall_timeout {
                    state.statistics.disconnected += 1;
                    return format!("it read nothing for {} ms", self.options.stall_timeout.as_millis());
                }
                if !rest.is_empty() && begun.elapsed() > most {
                    state.statistics.disconnected += 1;
                    return format!("it did not read a message within {} ms", most.as_millis());
                }
            }
            locked(&self.state).statistics.sent += 1;
        }
    }

    /// Reads queries of a client and answers them, until it leaves.
    fn read(&self, mut stream: &TcpStream, number: u64) {
        let (mut bytes, mut begun) = (Vec::new(), Begun::default());
        let mut block = [0; 4096];
        loop {
            let skipped = match decode(&bytes, QUERY_LIMIT) {
                Ok(Decoded::Need(_)) => 0,
                Ok(Decoded::Message { message, length }) => {
                    if !self.answer(&message, number) {
                        return self.refuse(stream, number, "it asks and does not read");
                    }
                    length
                }
                Err(DecodeError::Checksum { length, .. } | DecodeError::Content { length, .. }) => length,
                // Something else than a client.
                Err(DecodeError::Framing { .. }) => return self.refuse(stream, number, "it speaks another protocol"),
            };
            if skipped > 0 {
                bytes.drain(..skipped);
                begun = Begun::default();
                continue;
            }
            if begun.is_late(!bytes.is_empty(), Instant::now(), self.options.message_timeout) {
                let why = format!("its message did not end within {} ms", self.options.message_timeout.as_millis());
                return self.refuse(stream, number, &why);
            }
            match stream.read(&mut block) {
                // It has closed the connection.
                Ok(0) => return self.leave(number),
                Ok(n) => bytes.extend_from_slice(&block[..n]),
                Err(e) if is_passing(&e) => {}
                Err(_) => return self.leave(number),
            }
            let state = locked(&self.state);
            if state.abort || !state.clients.contains_key(&number) {
                return;
            }
        }
    }

    /// Disconnects a client that is none, and says why.
    fn refuse(&self, stream: &TcpStream, number: u64, why: &str) {
        let peer = stream.peer_addr().map_or_else(|_| "a client".to_string(), |peer| peer.to_string());
        tracing::warn!("OpenIGTLink: {peer} is refused: {why}");
        locked(&self.state).statistics.disconnected += 1;
        self.leave(number);
    }

    /// Answers a query. False if too many answers wait.
    fn answer(&self, query: &Message, number: u64) -> bool {
        let Some((what, kind)) = query.kind().split_once('_') else { return true };
        let mut state = locked(&self.state);
        let State { clients, last, statistics, .. } = &mut *state;
        let Some(queue) = clients.get_mut(&number) else { return true };
        let name = query.device();
        if let ("STT" | "STP", "IMAGE") = (what, kind) {
            queue.is_paused = what == "STP";
        }
        let image = last.get(name).or_else(|| last.values().next().filter(|_| name.is_empty()));
        let packet = match image.filter(|_| (what, kind) == ("GET", "IMAGE")) {
            // The image itself, queued as if it were new: a client that asks faster than it reads loses the oldest.
            Some(image) => image.clone(),
            None => {
                // RTS_ is as long as what it replaces, so that only a name of this server that no message holds leaves a query without an answer.
                let Some(Ok(bytes)) = self.short_answer(what, kind) else { return true };
                Packet { device: None, bytes: bytes.into() }
            }
        };
        statistics.dropped += queue.push(packet, &self.options);
        let is_bearable = queue.answers <= MAX_ANSWERS;
        drop(state);
        self.changed.notify_all();
        is_bearable
    }

    /// The answer to a query for anything but an image that is there; None if it is no query.
    fn short_answer(&self, what: &str, kind: &str) -> Option<Result<Vec<u8>, MessageError>> {
        let (device, time) = (self.options.name.clone(), now());
        let result = |kind: &str, result| codec::packed(kind, &self.options.name, time, &[result]);
        Some(match (what, kind) {
            ("GET", "CAPABIL" | "CAPABILITY") => {
                // Fields of 12 bytes, filled with zeros; no name is longer.
                let names = CAPABILITIES.map(|name| format!("{name:\0<12}")).concat();
                codec::packed("CAPABILITY", &device, time, names.as_bytes())
            }
            ("GET", "STATUS") => {
                let (name, text) = (String::new(), "sending pictures".into());
                encode(&Message::Status(Status { device, time, code: 1, subcode: 0, name, text }), Version::V1)
            }
            ("GET", "STRING") => encode(&Message::Text(Text { text: device.clone(), device, time }), Version::V1),
            ("STT" | "STP", "IMAGE") => result("RTS_IMAGE", SUCCESS),
            ("GET" | "STT" | "STP", other) => result(&format!("RTS_{other}"), ERROR),
            _ => return None,
        })
    }
}

/// The current time as a time stamp, s since 1970; 0, which means none, if the clock is before that.
pub(super) fn now() -> f64 {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(device: Option<&str>, bytes: usize) -> Packet {
        Packet { device: device.map(str::to_string), bytes: vec![0; bytes].into() }
    }

    /// Prevents that a client which asks for the last image again and again, and reads slowly, pins a copy of each that there was.
    #[test]
    fn images_that_are_asked_for_are_bounded_as_others_are() {
        let options = ServerOptions { queue_messages: 2, queue_bytes: 1000, ..ServerOptions::default() };
        let shared = Shared { state: Mutex::default(), changed: Condvar::new(), options };
        locked(&shared.state).clients.insert(1, Queue::default());
        let ask = |kind: &str, device: &str| {
            let bytes = codec::packed(kind, device, 0.0, &[]).expect("a query");
            let Ok(Decoded::Message { message, .. }) = decode(&bytes, QUERY_LIMIT) else { panic!("a query") };
            shared.answer(&message, 1)
        };
        for n in 0..500 {
            // A new image each time, so that none of the bytes are shared.
            let device = ["a", "b", "c"][n % 3];
            locked(&shared.state).last.insert(device.into(), packet(Some(device), 400));
            assert!(ask("GET_IMAGE", device), "{n}");
            assert!(locked(&shared.state).clients[&1].bytes <= 1000, "{n}");
        }
        let dropped = locked(&shared.state).statistics.dropped;
        let held = locked(&shared.state).clients[&1].waiting.len();
        assert_eq!((dropped + held as u64, held), (500, 2), "what is lost is counted");
        // Short answers are bounded by their number.
        assert_eq!((0..500).take_while(|_| ask("GET_STATUS", "")).count(), MAX_ANSWERS);
    }

    #[test]
    fn the_oldest_of_a_device_go_and_answers_stay() {
        let options = ServerOptions { queue_messages: 2, queue_bytes: 1000, ..ServerOptions::default() };
        let mut queue = Queue::default();
        assert_eq!(queue.push(packet(None, 10), &options), 0);
        let pushed =
            [("a", 100), ("b", 100), ("a", 200), ("a", 300)].map(|(d, n)| queue.push(packet(Some(d), n), &options));
        assert_eq!(pushed, [0, 0, 0, 1]);
        // What is too large for the queue is kept alone, with the answers.
        assert_eq!(queue.push(packet(Some("c"), 5000), &options), 3);
        let left: Vec<_> = std::iter::from_fn(|| queue.pop()).map(|packet| packet.bytes.len()).collect();
        assert_eq!((left, queue.bytes, queue.answers), (vec![10, 5000], 0, 0));
    }
}
