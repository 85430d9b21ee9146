//! OpenIGTLink: what trackers, scanners and navigation software (PLUS, 3D Slicer) send over TCP.
//!
//! [`decode`] and [`encode`] are pure, and the first is total; [`Client`] keeps a connection and a bounded queue;
//! [`Pairing`] gives tracked 2D frames their poses; [`Network`] makes a live source of all that.
//!
//! The format is OpenIGTLink's protocol 3 (its repository's Documents/Protocol). Where that document and the reference
//! library's bytes differ, the bytes are followed: the document's extended header has 8 or 14 bytes, the library's 12.

mod client;
mod codec;
mod message;
mod network;
mod pairing;
mod wire;

pub use client::{Client, ClientOptions, ClientStatistics, PORT, Received};
pub use codec::{BODY_LIMIT, Decoded, Version, decode, encode};
pub use message::{
    Coordinates, Image, Message, Other, Region, Scalar, Status, Text, Tool, ToolKind, TrackingData, Transform,
};
pub use network::{Network, NetworkOptions, Poses};
pub use pairing::{PairedFrame, Pairing, PairingCounts};
pub use wire::{DecodeError, HEADER, MessageError, crc64};
