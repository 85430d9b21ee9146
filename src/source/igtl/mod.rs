//! OpenIGTLink: what trackers, scanners and navigation software (PLUS, 3D Slicer) send over TCP.
//!
//! [`decode`] and [`encode`] are pure, and the first is total; [`Client`] keeps a connection and a bounded queue;
//! [`Pairing`] gives tracked 2D frames their poses; [`Network`] makes a live source of all that.
//!
//! The format is OpenIGTLink's protocol 3 (its repository's Documents/Protocol). Where that document and the reference
//! library's bytes differ, the bytes are followed: the document's extended header has 8 or 14 bytes, the library's 12.

mod client;
mod crc;
mod decode;
mod encode;
mod error;
mod fields;
mod header;
mod image;
mod message;
mod network;
mod pairing;
mod queue;

pub use client::{Client, ClientOptions, ClientStatistics, PORT};
pub use crc::crc64;
pub use decode::{BODY_LIMIT, Decoded, decode};
pub use encode::{Version, encode};
pub use error::{DecodeError, MessageError};
pub use header::HEADER;
pub use image::{Coordinates, Image, Region, Scalar};
pub use message::{Message, Other, Status, Text, Tool, ToolKind, TrackingData, Transform};
pub use network::{Network, NetworkOptions, Poses};
pub use pairing::{PairedFrame, Pairing, PairingCounts};
pub use queue::Received;
