//! Sends the output of a stream to the clients of a [`Server`]: each picture, and each complete volume as a Cartesian lattice in its place.
//!
//! A thread of its own converts volumes and encodes messages, so that the stream does not wait. Pictures and volumes that this thread
//! cannot keep up with are replaced by newer ones and counted.

use super::message::{Coordinates, Image, Message, Region, Scalar};
use super::server::{Server, ServerOptions, ServerStatistics, now};
use crate::convert::{Volume, lattice};
use crate::live::Event;
use crate::probe::{Geometry, Grid, World};
use crate::sync::locked;
use crate::{Frame, Header};
use glam::{DAffine3, DVec3};
use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

/// Device name of messages with pictures. [`VOLUME`] is the device name of messages with volumes.
pub const PICTURE: &str = "EcholumePicture";
pub const VOLUME: &str = "EcholumeVolume";
/// Most voxels of a volume, one byte each: 255 MiB. Clients take 256 MiB in one message, with its headers.
const MAX_VOXELS: f64 = (255u64 << 20) as f64;
/// Longest axis of an image on the wire.
const MAX_EDGE: usize = 65_535;

/// Counts since the publisher was started, and its last fault.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PublisherStatistics {
    pub server: ServerStatistics,
    /// Number of pictures that were passed to the server; `volumes` is the number of volumes.
    pub pictures: u64,
    pub volumes: u64,
    /// Number of pictures and volumes that were not sent because a newer one came before they were converted.
    pub replaced: u64,
    /// Why the last picture or volume that failed could not be sent; None if none failed.
    pub fault: Option<String>,
}

/// Sends pictures and volumes to the clients of an OpenIGTLink server of its own. Dropping it sends what still waits, and ends all connections unless
/// a [`Publisher::listener`] still exists.
///
/// Memory: the volume that is collected, one that waits, one that is converted, its voxels, and that of the [`Server`].
pub struct Publisher {
    shared: Arc<Shared>,
    server: Arc<Server>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    mail: Mutex<Mail>,
    changed: Condvar,
    /// Distance between the voxels of a sweep, mm.
    spacing: Option<f64>,
}

/// What waits for the thread, the newest of each kind.
#[derive(Default)]
struct Mail {
    picture: Option<Rgba>,
    volume: Option<Box<Whole>>,
    /// Without those of the server.
    statistics: PublisherStatistics,
    stop: bool,
}

/// One of what waits.
enum Letter {
    Picture(Rgba),
    Volume(Box<Whole>),
}

impl Mail {
    /// Takes what is sent next: a picture and a volume in turn where both wait, so that neither holds up the other for ever.
    fn next(&mut self, was_picture: bool) -> Option<Letter> {
        match self.volume.take_if(|_| was_picture || self.picture.is_none()) {
            Some(whole) => Some(Letter::Volume(whole)),
            None => self.picture.take().map(Letter::Picture),
        }
    }
}

struct Rgba {
    size: [u32; 2],
    pixels: Vec<u8>,
}

/// A volume, to be sent when all of its frames have arrived.
struct Whole {
    volume: Volume,
    /// Stored values that become 0 and 255.
    range: [f64; 2],
    pose: Option<DAffine3>,
}

impl Publisher {
    /// Starts a server that listens at `address`, a host name or an IP address with a port; port 0 takes a free one. `spacing`: voxel spacing of
    /// the volumes that are sent, mm; None: for a Cartesian volume its own, for a sweep 1 mm.
    ///
    /// # Errors
    /// An address that is not of this machine, a port that is in use or not allowed, a thread that cannot be started.
    pub fn bind(address: &str, spacing: Option<f64>, options: ServerOptions) -> io::Result<Publisher> {
        let server = Arc::new(Server::bind(address, options)?);
        let shared = Arc::new(Shared { mail: Mutex::default(), changed: Condvar::new(), spacing });
        let (theirs, sends) = (shared.clone(), server.clone());
        let thread = thread::Builder::new().name("igtl publisher".into()).spawn(move || theirs.run(&sends))?;
        Ok(Publisher { shared, server, thread: Some(thread) })
    }

    /// The address and port at which the server listens.
    pub fn address(&self) -> SocketAddr {
        self.server.address()
    }

    /// Counts since the publisher was started.
    pub fn statistics(&self) -> PublisherStatistics {
        let own = locked(&self.shared.mail).statistics.clone();
        PublisherStatistics { server: self.server.statistics(), ..own }
    }

    /// Queues a picture of 8-bit red, green, blue, alpha, rows from the top; ignored while no client is connected. `size`: width and height.
    pub fn picture(&self, size: [u32; 2], pixels: Vec<u8>) {
        if self.server.has_clients() {
            let mut mail = locked(&self.shared.mail);
            mail.statistics.replaced += u64::from(mail.picture.replace(Rgba { size, pixels }).is_some());
            drop(mail);
            self.shared.changed.notify_all();
        }
    }

    /// Sends what still waits, ends all connections, and returns the counts.
    pub fn finish(mut self) -> PublisherStatistics {
        self.stop();
        self.server.finish();
        self.statistics()
    }

    fn stop(&mut self) {
        locked(&self.shared.mail).stop = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }

    /// A function to be called with every event of a source. While a client is connected it collects frames and queues each complete volume.
    pub fn listener(&self) -> impl FnMut(&Event) + Send + use<> {
        let (shared, server) = (self.shared.clone(), self.server.clone());
        let mut listener = Listener { shared, server, header: None, filling: None };
        move |event| listener.look_at(event)
    }
}

impl Drop for Publisher {
    /// Sends what waits.
    fn drop(&mut self) {
        self.stop();
    }
}

impl Shared {
    /// Converts and sends what is handed over. What waits when the publisher is dropped is still sent.
    fn run(&self, server: &Server) {
        let mut is_picture = false;
        loop {
            let mut mail = locked(&self.mail);
            let letter = loop {
                match mail.next(is_picture) {
                    Some(letter) => break letter,
                    None if mail.stop => return,
                    None => mail = self.changed.wait(mail).unwrap_or_else(PoisonError::into_inner),
                }
            };
            drop(mail);
            is_picture = matches!(letter, Letter::Picture(_));
            let image = match letter {
                Letter::Picture(picture) => picture.image(),
                Letter::Volume(whole) => whole.image(self.spacing),
            };
            let sent = image.and_then(|image| server.send(&Message::Image(image)).map_err(|e| e.to_string()));
            let mut mail = locked(&self.mail);
            match sent {
                Ok(()) if is_picture => mail.statistics.pictures += 1,
                Ok(()) => mail.statistics.volumes += 1,
                Err(fault) => mail.statistics.fault = Some(fault),
            }
        }
    }
}

impl Rgba {
    /// One pixel is 1 mm: a picture has no place in the world.
    fn image(&self) -> Result<Image, String> {
        let [width, height] = self.size;
        let (Ok(columns), Ok(rows)) = (u16::try_from(width), u16::try_from(height)) else {
            let what = format!("a picture of {width} x {height} pixels");
            return Err(format!("{what}; OpenIGTLink holds {MAX_EDGE} along an axis: take a smaller --size"));
        };
        let size = [columns, rows, 1];
        let rgb = self.pixels.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        let grid = Grid { size: size.map(usize::from), spacing: [1.0; 3], origin: [0.0; 3] };
        // Columns to the left of the patient and rows to posterior: an axial view shows the picture as it is.
        Ok(image(PICTURE, size, 3, &World::of(&grid), rgb))
    }
}

impl Whole {
    /// The volume on a Cartesian lattice, 8 bits, 0 outside of the insonified region.
    fn image(&self, spacing: Option<f64>) -> Result<Image, String> {
        let grid = match (self.volume.geometry(), spacing) {
            (Geometry::Cartesian(own), None) => *own,
            (geometry, spacing) => {
                lattice(geometry, spacing.unwrap_or(1.0)).map_err(|why| format!("--serve-spacing {why}"))?
            }
        };
        let [x, y, z] = grid.size;
        let is_long = grid.size.iter().any(|n| *n > MAX_EDGE);
        if is_long || x as f64 * y as f64 * z as f64 > MAX_VOXELS {
            let most = if is_long { format!("{MAX_EDGE} along an axis") } else { format!("{MAX_VOXELS} of them") };
            let what = format!("a volume of {x} x {y} x {z} voxels");
            return Err(format!("{what}; OpenIGTLink holds {most}: take a larger --serve-spacing"));
        }
        let [low, high] = self.range;
        let mut slice = vec![0.0; x * y];
        let mut bytes = Vec::with_capacity(x * y * z);
        for k in 0..z {
            self.volume.slice(&grid, k, &mut slice);
            let grey = |value: &f64| (255.0 * (value - low) / (high - low)).round().clamp(0.0, 255.0);
            // Outside it is NaN, which becomes 0.
            bytes.extend(slice.iter().map(|value| grey(value) as u8));
        }
        let world = self.pose.and_then(|pose| World::posed(&pose, &grid)).unwrap_or_else(|| World::of(&grid));
        Ok(image(VOLUME, grid.size.map(|n| n as u16), 1, &world, bytes))
    }
}

/// An image of 8 bits in its place, in RAS: receivers take it for that, whatever a message says.
fn image(device: &str, size: [u16; 3], components: u8, world: &World, bytes: Vec<u8>) -> Image {
    let ras = |v: DVec3| [-v.x, -v.y, v.z].map(|v| (v + 0.0) as f32);
    let middle = size.map(|n| (f64::from(n) - 1.0) / 2.0);
    Image {
        device: device.into(),
        time: now(),
        size,
        region: Region { offset: [0; 3], size },
        scalar: Scalar::U8,
        components,
        coordinates: Coordinates::Ras,
        axes: [0, 1, 2].map(|n| ras(world.axis(n))),
        centre: ras(world.at(middle.into())),
        bytes,
    }
}

/// Collects the volumes of a source and hands them over.
struct Listener {
    shared: Arc<Shared>,
    server: Arc<Server>,
    header: Option<Header>,
    /// The volume that is being collected, and its number.
    filling: Option<(u32, Box<Whole>)>,
}

impl Listener {
    fn look_at(&mut self, event: &Event) {
        match event {
            Event::Begin(header) => {
                self.header = Some((**header).clone());
                self.filling = None;
            }
            _ if !self.server.has_clients() => self.filling = None,
            Event::Frame(frame) => self.frame(frame.clone()),
            _ => {}
        }
    }

    fn frame(&mut self, frame: Frame) {
        let Some(header) = &self.header else { return };
        if self.filling.as_ref().is_none_or(|(number, _)| *number != frame.volume) {
            let geometry = if frame.backward { &header.backward } else { &header.forward };
            let volume = Volume::new(geometry.clone(), header.stored);
            self.filling = Some((frame.volume, Box::new(Whole { volume, range: header.range, pose: None })));
        }
        let Some((_, filling)) = &mut self.filling else { return };
        filling.pose = filling.pose.or(frame.pose);
        filling.volume.take(frame);
        let Some((_, whole)) = self.filling.take_if(|(_, filling)| filling.volume.is_whole()) else { return };
        let mut mail = locked(&self.shared.mail);
        mail.statistics.replaced += u64::from(mail.volume.replace(whole).is_some());
        drop(mail);
        self.shared.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StoredType;

    /// Prevents that pictures, which come faster than they are sent, hold up volumes for ever.
    #[test]
    fn pictures_and_volumes_are_sent_in_turn() {
        let grid = Grid { size: [2, 2, 2], spacing: [1.0; 3], origin: [0.0; 3] };
        let geometry = Geometry::Cartesian(grid);
        let volume = || {
            let volume = Volume::new(geometry.clone(), StoredType::U8);
            Some(Box::new(Whole { volume, range: [0.0, 255.0], pose: None }))
        };
        let mut mail = Mail::default();
        let (mut was_picture, mut sent) = (false, String::new());
        for _ in 0..6 {
            // Both are there again before the next is taken.
            mail.picture = Some(Rgba { size: [1, 1], pixels: vec![0; 4] });
            mail.volume = volume();
            let letter = mail.next(was_picture).expect("something waits");
            was_picture = matches!(letter, Letter::Picture(_));
            sent.push(if was_picture { 'p' } else { 'v' });
        }
        assert_eq!(sent, "pvpvpv");
        // One kind alone is not held up.
        (mail.picture, mail.volume, was_picture) = (None, volume(), false);
        assert!(matches!(mail.next(was_picture), Some(Letter::Volume(_))) && mail.next(was_picture).is_none());
    }
}
