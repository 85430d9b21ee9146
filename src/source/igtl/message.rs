//! What a consumer gets.

use super::image::Image;

/// A decoded message.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    Transform(Transform),
    TrackingData(TrackingData),
    Image(Image),
    Status(Status),
    Text(Text),
    Other(Other),
}

/// TRANSFORM: one pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Transform {
    /// At most 20 bytes on the wire.
    pub device: String,
    /// Since 1970, s; 0: not stamped.
    pub time: f64,
    /// Upper three rows of the 4 x 4 matrix; the last column in mm. Finite.
    pub matrix: [[f32; 4]; 3],
}

/// TDATA: the poses of a tracker's tools at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingData {
    pub device: String,
    /// Since 1970, s; 0: not stamped.
    pub time: f64,
    /// Those that are seen at the moment; may be none.
    pub tools: Vec<Tool>,
}

/// One tool of a [`TrackingData`].
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// At most 20 bytes on the wire.
    pub name: String,
    pub kind: ToolKind,
    /// As in [`Transform`].
    pub matrix: [[f32; 4]; 3],
}

/// What of a tool's pose is known (trackingdata.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolKind {
    /// 1: the tracker itself.
    Tracker,
    /// 2: a tool with all six degrees of freedom.
    SixD,
    /// 3: only the tip.
    ThreeD,
    /// 4: tip and handle, but not the turn about the line between them.
    FiveD,
}

/// STATUS: how a device is.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    pub device: String,
    /// Since 1970, s; 0: not stamped.
    pub time: f64,
    /// 1 is well, 2 to 19 are faults that status.md lists.
    pub code: u16,
    /// The device's own.
    pub subcode: i64,
    /// At most 20 bytes on the wire.
    pub name: String,
    pub text: String,
}

/// STRING.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    pub device: String,
    /// Since 1970, s; 0: not stamped.
    pub time: f64,
    /// Latin-1 where the message says so, otherwise read as UTF-8, which ASCII is a part of. At most 65535 bytes on the wire.
    pub text: String,
}

/// A message of a type that is not read; its body was checked and passed over.
#[derive(Clone, Debug, PartialEq)]
pub struct Other {
    pub device: String,
    /// Since 1970, s; 0: not stamped.
    pub time: f64,
    /// The type's name, at most 12 bytes on the wire.
    pub kind: String,
    /// Of the body.
    pub bytes: usize,
}

impl ToolKind {
    pub(super) fn read(number: u8) -> Option<ToolKind> {
        [ToolKind::Tracker, ToolKind::SixD, ToolKind::ThreeD, ToolKind::FiveD]
            .into_iter()
            .find(|k| k.number() == number)
    }

    pub(super) fn number(self) -> u8 {
        match self {
            ToolKind::Tracker => 1,
            ToolKind::SixD => 2,
            ToolKind::ThreeD => 3,
            ToolKind::FiveD => 4,
        }
    }
}

impl Message {
    pub fn device(&self) -> &str {
        match self {
            Message::Transform(m) => &m.device,
            Message::TrackingData(m) => &m.device,
            Message::Image(m) => &m.device,
            Message::Status(m) => &m.device,
            Message::Text(m) => &m.device,
            Message::Other(m) => &m.device,
        }
    }

    /// Since 1970, s; 0: not stamped.
    pub fn time(&self) -> f64 {
        match self {
            Message::Transform(m) => m.time,
            Message::TrackingData(m) => m.time,
            Message::Image(m) => m.time,
            Message::Status(m) => m.time,
            Message::Text(m) => m.time,
            Message::Other(m) => m.time,
        }
    }

    /// The type's name on the wire.
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

    /// Bytes of memory, about.
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
