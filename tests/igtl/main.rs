//! OpenIGTLink: stored messages, messages of every kind there and back, and bytes that are
//! none. Needs no GPU.

mod broken;
mod common;
mod round_trip;
mod stored;
