//! What is wrong with a message, on one line.

use crate::source::error::{escaped, quoted};

/// Longest part of an error, in characters.
const PART: usize = 300;

/// A fault of a message: one line naming the message, the field, its value and what is allowed.
///
/// Whatever came over the wire is escaped and shortened on the way in, so that no peer can write to a terminal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}: {field}: {fault}")]
pub struct MessageError {
    message: String,
    field: &'static str,
    fault: String,
}

impl MessageError {
    pub(super) fn new(kind: &str, device: &str, fault: Fault) -> MessageError {
        let message = format!("{} from {}", escaped(kind, PART), quoted(device));
        MessageError { message, field: fault.field, fault: escaped(&fault.fault, PART) }
    }

    pub fn field(&self) -> &str {
        self.field
    }

    pub fn fault(&self) -> &str {
        &self.fault
    }
}

/// Why bytes gave no message, and what is left to be done with them.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// The body is not the one that was sent. The next message begins `length` bytes on.
    #[error("{error}")]
    Checksum { length: usize, error: MessageError },
    /// The body came as it was sent, and is none that its type allows. The next message begins `length` bytes on.
    #[error("{error}")]
    Content { length: usize, error: MessageError },
    /// This is no header. Nothing in the format marks where a message begins: the stream cannot be found again, and the
    /// connection has to be made anew.
    #[error("{error}; the stream cannot be re-synchronised")]
    Framing { error: MessageError },
}

impl DecodeError {
    pub fn error(&self) -> &MessageError {
        match self {
            DecodeError::Checksum { error, .. }
            | DecodeError::Content { error, .. }
            | DecodeError::Framing { error } => error,
        }
    }
}

/// A fault of a field, before it is known whose.
pub(super) struct Fault {
    pub field: &'static str,
    pub fault: String,
}

impl Fault {
    pub fn new(field: &'static str, fault: impl Into<String>) -> Fault {
        Fault { field, fault: fault.into() }
    }
}
