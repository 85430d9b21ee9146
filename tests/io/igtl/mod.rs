//! OpenIGTLink: stored messages, round trips of every kind of message, invalid bytes, a client and a live source against
//! servers on the loopback interface. Needs no GPU.

mod broken;
mod client;
mod messages;
mod network;
mod pairing;
mod round_trip;
mod server;
mod stored;
