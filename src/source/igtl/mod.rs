//! OpenIGTLink, the protocol of trackers, scanners and navigation software (PLUS, 3D Slicer) over TCP.
//!
//! [`decode`] and [`encode`] are pure, and [`decode`] accepts any bytes. [`Client`] maintains a connection and a bounded queue, [`Pairing`]
//! gives tracked 2D frames their poses, and [`Network`] is the live source that combines them.
//!
//! The format is OpenIGTLink's protocol 3 (its repository's Documents/Protocol). Where that document and the bytes of
//! the reference library differ, this module follows the bytes: the document's extended header has 8 or 14 bytes, the library's 12.

mod begun;
mod cartesian;
mod client;
mod codec;
mod faults;
mod message;
mod names;
mod network;
mod pairing;
mod pixels;
mod publish;
mod server;

pub use client::{Client, ClientOptions, ClientStatistics, PORT, Received, SCHEME, port, with_port};
pub use codec::{BODY_LIMIT, DecodeError, Decoded, HEADER, MessageError, Version, crc64, decode, encode};
pub use message::{
    Coordinates, Image, Message, Other, Region, Scalar, Status, Text, Tool, ToolKind, TrackingData, Transform,
};
pub use network::{Network, NetworkOptions, Poses};
pub use pairing::{PairedFrame, Pairing, PairingCounts};
pub use publish::{PICTURE, Publisher, PublisherStatistics, VOLUME};
pub use server::{Server, ServerOptions, ServerStatistics};
