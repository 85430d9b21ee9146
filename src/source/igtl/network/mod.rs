//! OpenIGTLink as a live source: Cartesian volumes, and tracked 2D frames that are compounded into a volume.
//!
//! An IMAGE of several slices is a Cartesian volume; one with only some complete slices of it updates those. An IMAGE of one slice is a
//! frame of a freehand sweep. After a change, all slices of the volume are emitted under a new volume number, so that the receiver
//! always gets complete volumes and need not know their origin.

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

/// How often the statistics are checked while nothing arrives.
const POLL: Duration = Duration::from_millis(100);
/// Messages that are processed even if no time is left, so that a caller with zero patience makes progress.
const MAX_AT_ONCE: usize = 256;

/// A live source: the images of an OpenIGTLink server. It reconnects whenever the connection is lost, and never ends by itself.
///
/// No messages are processed while slices are emitted; messages that then exceed the client's queue are dropped and counted. Faults are
/// reported as [`Event::Fault`], each kind at most once a second and with its count.
///
/// Memory: that of the [`Client`], one volume of at most `volume_bytes` and its message, the first frames of a sweep (256 MiB), and that
/// of a [`Compounder`](crate::source::freehand::Compounder) and a [`Pairing`](super::Pairing).
pub struct Network {
    client: Client,
    /// Statistics that were reported as faults.
    known: ClientStatistics,
    last_error: Option<String>,
    /// There was at least one connection.
    connected: bool,
    /// Lost connections.
    lost: u64,
    faults: Faults,
    whole: Option<CartesianVolume>,
    sweep: FreehandSweep,
    volume_bytes: usize,
    /// Header of the last `Begin`.
    begun: Option<Header>,
    output: Option<VolumeOutput>,
    volumes: u32,
}

/// A volume whose slices are being emitted.
struct VolumeOutput {
    of_sweep: bool,
    begin: bool,
    volume: u32,
    next: usize,
    time: Option<f64>,
}

impl Network {
    /// Starts to connect, as [`Client::connect`].
    ///
    /// # Errors
    /// The thread cannot be started.
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

    /// Statistics of the connection.
    pub fn statistics(&self) -> ClientStatistics {
        self.client.statistics()
    }

    /// Records what happened to the connection since the last call.
    fn check_connection(&mut self) {
        let now = self.client.statistics();
        let error = self.client.last_error();
        let why = error.as_deref().unwrap_or("no reason is known");
        let (known, faults) = (&self.known, &mut self.faults);
        faults.note(FaultKind::Checksum, now.checksum_failures - known.checksum_failures, why);
        faults.note(FaultKind::Malformed, now.malformed - known.malformed, why);
        faults.note(FaultKind::Dropped, now.dropped - known.dropped, "they came faster than they were taken");
        faults.note(FaultKind::Again, now.reconnects - known.reconnects, "");
        // Every connection except the present one was lost.
        self.connected |= now.connected || now.bytes > 0 || now.reconnects > 0;
        let lost = now.reconnects + u64::from(self.connected) - u64::from(now.connected);
        faults.note(FaultKind::Lost, lost.saturating_sub(self.lost), why);
        let is_reported = lost > self.lost || error == self.last_error;
        if !now.connected && !is_reported && error.is_some() {
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
                        self.start_output(false, time);
                    }
                    Err(fault) => self.faults.note(FaultKind::Image, 1, &fault),
                }
            }
            other => self.sweep.take(other, &mut self.faults),
        }
    }

    /// Starts to emit a volume.
    fn start_output(&mut self, of_sweep: bool, time: Option<f64>) {
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

    /// The next event of the volume that is being emitted.
    fn next_output(&mut self) -> Option<Event> {
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
            self.check_connection();
            if let Some(fault) = self.faults.due() {
                return Event::Fault(fault);
            }
            if let Some(event) = self.next_output() {
                return event;
            }
            if let Some(time) = self.sweep.update(&mut self.faults) {
                self.start_output(true, time);
                continue;
            }
            let left = patience.saturating_sub(started.elapsed());
            // Poses alone may arrive without end.
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
