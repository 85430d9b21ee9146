//! The motor: the protocol, units, positions to angles; and home, sweep, stop and every fault over a simulated module on a
//! pseudo-terminal, through the library and through the program; frames that the motor places. No assertion is on how long anything takes.

mod library;
mod program;
mod table;
mod tmcl;
mod tracking;
