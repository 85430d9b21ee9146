//! OpenIGTLink as a live source: whole volumes as they come, and tracked 2D frames compounded into one.
//!
//! An IMAGE of several slices is a Cartesian volume; one that brings only some whole slices of it updates those. An IMAGE of one slice is a
//! frame of a freehand sweep. Whichever changed is then given slice by slice under a new volume's number, always all of its slices, so that
//! whoever receives them has a whole volume every time and need not know what is behind it.

mod assembly;
mod faults;

pub use assembly::{NetworkOptions, Poses};

use super::client::{Client, ClientStatistics};
use super::message::Message;
use crate::source::frame::{Frame, Header};
use crate::source::live::{Event, Live};
use assembly::{CartesianVolume, FreehandSweep};
use faults::{FaultKind, Faults};
use std::io;
use std::time::{Duration, Instant};

/// How often statistics are looked at while nothing comes.
const POLL: Duration = Duration::from_millis(100);
/// Messages that are looked through although patience is at its end, so that one who never waits gets on, too.
const MAX_AT_ONCE: usize = 256;

/// What comes from an OpenIGTLink server, which is connected to again whenever it is lost.
///
/// Nothing is taken from the client while slices are given out; what then does not fit its queue is lost by whole messages, and counted.
/// What is amiss comes as [`Event::Fault`], each kind at most once a second and with how often it was. It never ends by itself.
///
/// Memory: the [`Client`]'s, one volume of at most `volume_bytes` and the message it came in, the first frames of a sweep (256 MiB), and
/// what a [`Compounder`](freehand::Compounder) and a [`Pairing`](super::Pairing) take.
pub struct Network {
    client: Client,
    /// What the faults have been told of.
    known: ClientStatistics,
    last_error: Option<String>,
    /// There ever was a connection.
    connected: bool,
    /// Connections.
    lost: u64,
    faults: Faults,
    whole: Option<CartesianVolume>,
    sweep: FreehandSweep,
    volume_bytes: usize,
    /// Given with the last `Begin`.
    begun: Option<Header>,
    output: Option<VolumeOutput>,
    volumes: u32,
}

/// A volume whose slices are given out.
struct VolumeOutput {
    of_sweep: bool,
    begin: bool,
    volume: u32,
    next: usize,
    time: Option<f64>,
}

impl Network {
    /// Starts connecting, as [`Client::connect`] does.
    ///
    /// # Errors
    /// The operating system starts no thread.
    pub fn connect(address: &str, options: NetworkOptions) -> io::Result<Network> {
        Ok(Network {
            client: Client::connect(address, options.client.clone())?,
            known: ClientStatistics::default(),
            last_error: None,
            connected: false,
            lost: 0,
            faults: Faults::new(address),
            whole: None,
            volume_bytes: options.volume_bytes,
            sweep: FreehandSweep::new(options),
            begun: None,
            output: None,
            volumes: 0,
        })
    }

    /// Of the connection.
    pub fn statistics(&self) -> ClientStatistics {
        self.client.statistics()
    }

    /// Tells the faults what has happened to the connection since the last time.
    fn look(&mut self) {
        let now = self.client.statistics();
        let error = self.client.last_error();
        let why = error.as_deref().unwrap_or("no reason is known");
        let (known, faults) = (&self.known, &mut self.faults);
        faults.note(FaultKind::Checksum, now.checksum_failures - known.checksum_failures, why);
        faults.note(FaultKind::Malformed, now.malformed - known.malformed, why);
        faults.note(FaultKind::Dropped, now.dropped - known.dropped, "they came faster than they were taken");
        faults.note(FaultKind::Again, now.reconnects - known.reconnects, "");
        // Every connection but the one that stands was lost, however short it was.
        self.connected |= now.connected || now.bytes > 0 || now.reconnects > 0;
        let lost = now.reconnects + u64::from(self.connected) - u64::from(now.connected);
        faults.note(FaultKind::Lost, lost.saturating_sub(self.lost), why);
        let is_told = lost > self.lost || error == self.last_error;
        if !now.connected && !is_told && error.is_some() {
            faults.note(FaultKind::Unreachable, 1, why);
        }
        (self.known, self.last_error, self.lost) = (now, error, lost);
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Image(image) if image.size[2] > 1 => {
                let time = (image.time > 0.0).then_some(image.time);
                match CartesianVolume::take(&mut self.whole, image, self.volume_bytes) {
                    Ok(replaced) => {
                        self.faults.note(FaultKind::Samples, replaced, "they read as 0");
                        self.give(false, time);
                    }
                    Err(fault) => self.faults.note(FaultKind::Image, 1, &fault),
                }
            }
            other => self.sweep.take(other, &mut self.faults),
        }
    }

    /// Begins to give a volume out.
    fn give(&mut self, of_sweep: bool, time: Option<f64>) {
        let header = if of_sweep { self.sweep.header() } else { self.whole.as_ref().map(CartesianVolume::header) };
        let Some(header) = header else { return };
        if let Err((field, fault)) = header.check() {
            return self.faults.note(FaultKind::Image, 1, &format!("{field} {fault}"));
        }
        let begin = self.begun.as_ref() != Some(&header);
        self.begun = Some(header);
        self.output = Some(VolumeOutput { of_sweep, begin, volume: self.volumes, next: 0, time });
        self.volumes = self.volumes.wrapping_add(1);
    }

    /// What is next of the volume that is given out.
    fn given(&mut self) -> Option<Event> {
        let output = self.output.as_mut()?;
        if std::mem::take(&mut output.begin) {
            return self.begun.clone().map(|header| Event::Begin(Box::new(header)));
        }
        let k = output.next;
        output.next += 1;
        let slice = match output.of_sweep {
            true => self.sweep.slice(k),
            false => self.whole.as_ref().and_then(|whole| whole.slice(k)),
        };
        let Some(slice) = slice else {
            self.output = None;
            return None;
        };
        let (volume, time, bytes) = (output.volume, output.time, slice.to_vec());
        Some(Event::Frame(Frame { volume, number: k as u32, slice: k, backward: false, time, bytes }))
    }
}

impl Live for Network {
    fn next(&mut self, patience: Duration) -> Event {
        let started = Instant::now();
        let mut taken = 0;
        loop {
            self.look();
            if let Some(fault) = self.faults.due() {
                return Event::Fault(fault);
            }
            if let Some(event) = self.given() {
                return event;
            }
            if let Some(time) = self.sweep.update(&mut self.faults) {
                self.give(true, time);
                continue;
            }
            let left = patience.saturating_sub(started.elapsed());
            // Poses alone may come without end.
            if left.is_zero() && taken >= MAX_AT_ONCE {
                return Event::Idle;
            }
            match self.client.next(left.min(POLL)) {
                Some(received) => self.take(received.message),
                None if left.is_zero() => return Event::Idle,
                None => {}
            }
            taken += 1;
        }
    }

    fn can_wait(&self) -> bool {
        false
    }
}
