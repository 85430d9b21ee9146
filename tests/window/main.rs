//! The program in a window of a server without a monitor (Xvfb), driven by keys and pointer as by a user. Every view
//! runs with validation, and any message fails its test. No server is a failure, never a skip.

#[path = "../common/mod.rs"]
mod common;
mod desktop;
mod kiosk;
mod panels;
mod pictures;
mod recordings;
mod shapes;
mod start;
mod tools;
