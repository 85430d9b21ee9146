//! OpenIGTLink: stored messages, messages of every kind there and back, bytes that are none, a client and a live source against
//! servers on the loopback interface. Needs no GPU.

mod broken;
mod client;
mod messages;
mod network;
mod pairing;
mod round_trip;
mod stored;
