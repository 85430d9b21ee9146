//! The messages, as the user of a client receives them.

use crate::tree::All;
use glam::{DMat4, DVec3, DVec4};

/// Number type of an image's samples. The protocol has no integers of 64 bits.
pub use crate::pixel::Number as Scalar;

/// An OpenIGTLink message, as it was decoded or is to be encoded.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    Transform(Transform),
    TrackingData(TrackingData),
    Image(Image),
    Status(Status),
    Text(Text),
    Other(Other),
}

/// TRANSFORM: a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Transform {
    /// Name of the sending device, at most 20 bytes on the wire.
    pub device: String,
    /// Time stamp, s since 1970; 0 if it has none.
    pub time: f64,
    /// Upper three rows of the 4 x 4 matrix, all finite. Its last column is a translation in mm.
    pub matrix: [[f32; 4]; 3],
}

/// TDATA: the poses of a tracker's tools at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingData {
    pub device: String,
    /// Time stamp, s since 1970; 0 if it has none.
    pub time: f64,
    /// The tools that the tracker sees at that time; may be empty.
    pub tools: Vec<Tool>,
}

/// A tool of a [`TrackingData`] and its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// Name of the tool, at most 20 bytes on the wire.
    pub name: String,
    pub kind: ToolKind,
    /// Pose of the tool: upper three rows of the 4 x 4 matrix, all finite. Its last column is a translation in mm.
    pub matrix: [[f32; 4]; 3],
}

/// Which degrees of freedom of a tool are known. The numbers are those on the wire (trackingdata.md of the protocol's documents).
#[derive(Clone, Copy, Debug, PartialEq, Eq, All)]
pub enum ToolKind {
    /// The tracker itself.
    Tracker = 1,
    /// A tool with all six degrees of freedom.
    SixD = 2,
    /// Only the tip.
    ThreeD = 3,
    /// Tip and handle, but not the rotation about the line between them.
    FiveD = 4,
}

/// STATUS: the state of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    pub device: String,
    /// Time stamp, s since 1970; 0 if it has none.
    pub time: f64,
    /// Status code: 1 is OK, 2 to 19 are the faults that status.md of the protocol's documents lists.
    pub code: u16,
    /// Code whose meaning the device defines.
    pub subcode: i64,
    /// Name of the fault, at most 20 bytes on the wire.
    pub name: String,
    pub text: String,
}

/// STRING: a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    pub device: String,
    /// Time stamp, s since 1970; 0 if it has none.
    pub time: f64,
    /// The text, decoded from Latin-1 if the message says so, otherwise from UTF-8. At most 65535 bytes on the wire.
    pub text: String,
}

/// A message of a type that the program does not use. Its body was received, but is not kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Other {
    pub device: String,
    /// Time stamp, s since 1970; 0 if it has none.
    pub time: f64,
    /// Name of the message type, at most 12 bytes on the wire.
    pub kind: String,
    /// Length of the body, bytes.
    pub bytes: usize,
}

impl Message {
    /// Device and time stamp, which all messages have.
    fn origin(&self) -> (&str, f64) {
        match self {
            Message::Transform(Transform { device, time, .. })
            | Message::TrackingData(TrackingData { device, time, .. })
            | Message::Image(Image { device, time, .. })
            | Message::Status(Status { device, time, .. })
            | Message::Text(Text { device, time, .. })
            | Message::Other(Other { device, time, .. }) => (device, *time),
        }
    }

    pub fn device(&self) -> &str {
        self.origin().0
    }

    /// Time stamp of the message, s since 1970; 0 if it has none.
    pub fn time(&self) -> f64 {
        self.origin().1
    }

    /// Name of the message type on the wire, such as IMAGE.
    pub fn kind(&self) -> &str {
        match self {
            Message::Transform(_) => "TRANSFORM",
            Message::TrackingData(_) => "TDATA",
            Message::Image(_) => "IMAGE",
            Message::Status(_) => "STATUS",
            Message::Text(_) => "STRING",
            Message::Other(m) => &m.kind,
        }
    }

    /// Memory that the message takes, approximately, bytes.
    pub(super) fn weight(&self) -> usize {
        let held = match self {
            Message::TrackingData(m) => m.tools.iter().map(|t| size_of::<Tool>() + t.name.len()).sum(),
            Message::Image(m) => m.bytes.len(),
            Message::Status(m) => m.name.len() + m.text.len(),
            Message::Text(m) => m.text.len(),
            Message::Other(m) => m.kind.len(),
            Message::Transform(_) => 0,
        };
        size_of::<Message>() + self.device().len() + held
    }
}

/// IMAGE: a 2D image, a volume, or a part of one. On the wire: 72 bytes that describe the samples, then the samples (image.md of the protocol's
/// documents).
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub device: String,
    /// Time stamp, s since 1970; 0 if it has none.
    pub time: f64,
    /// Pixels of the whole image along i (fastest), j and k, each at least 1.
    pub size: [u16; 3],
    /// The part of the image that this message contains; usually all of it.
    pub region: Region,
    pub scalar: Scalar,
    /// Number of values of a pixel, which are interleaved; at least 1.
    pub components: u8,
    /// Coordinate system of `axes` and `centre`.
    pub coordinates: Coordinates,
    /// Vectors from a pixel to the next along i, j and k, mm. Finite; 0 is possible for an axis of one pixel.
    pub axes: [[f32; 3]; 3],
    /// Centre of the whole image, mm. Finite.
    pub centre: [f32; 3],
    /// Samples of the region, converted to little-endian, i fastest.
    pub bytes: Vec<u8>,
}

/// A rectangular part of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Index (i, j, k) of the first pixel in the whole image, from 0.
    pub offset: [u16; 3],
    pub size: [u16; 3],
}

/// Coordinate system of the patient: x to the right or left, y to the front or back, z to the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// Right, anterior, superior.
    Ras,
    /// Left, posterior, superior.
    Lps,
}

impl Image {
    /// The map from a pixel's index (of its centre, from 0, in the whole image) to its position in mm in the given coordinate system.
    ///
    /// The position that the message states is the centre of the image, index (size - 1) / 2 (image.md of the protocol's documents, note of 2011).
    pub fn index_to_mm(&self, coordinates: Coordinates) -> DMat4 {
        let axes = self.axes.map(|a| DVec3::from(a.map(f64::from)));
        let middle = self.size.map(|n| (f64::from(n) - 1.0) / 2.0);
        let first =
            DVec3::from(self.centre.map(f64::from)) - axes[0] * middle[0] - axes[1] * middle[1] - axes[2] * middle[2];
        let own = DMat4::from_cols(axes[0].extend(0.0), axes[1].extend(0.0), axes[2].extend(0.0), first.extend(1.0));
        match coordinates == self.coordinates {
            true => own,
            false => DMat4::from_diagonal(DVec4::new(-1.0, -1.0, 1.0, 1.0)) * own,
        }
    }

    /// Distance between neighbouring pixels along i, j and k, mm.
    pub fn spacing(&self) -> [f64; 3] {
        self.axes.map(|a| DVec3::from(a.map(f64::from)).length())
    }
}
