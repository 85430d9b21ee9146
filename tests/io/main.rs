//! What comes in and goes out: files of recordings, pipes, the network, the motor, signals. Needs no GPU.

mod convert;
mod igtl;
mod interrupted;
mod motor;
mod piped;
mod recorder;
mod signals;
mod sources;
