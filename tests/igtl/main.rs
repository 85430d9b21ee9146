//! OpenIGTLink: stored messages, messages of every kind there and back, bytes that are none, and a client against servers
//! on the loopback interface. Needs no GPU.

mod broken;
mod client;
mod common;
mod pairing;
mod round_trip;
mod stored;
