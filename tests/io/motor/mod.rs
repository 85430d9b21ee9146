//! The motor: the protocol, units, positions to angles; home, sweep, stop and every fault over a simulated module on a
//! pseudo-terminal, through the library and through the program; frames placed by the motor. No test asserts how long anything takes.

mod client;
mod library;
mod program;
mod table;
mod tmcl;
mod tracking;
