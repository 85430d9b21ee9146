//! The code that every other member uses: bounded reading and atomic writing of files ([`files`]), the limit of the [`memory`] of a volume,
//! pictures and films ([`picture`]), drawings and plots ([`canvas`]), digests ([`digest`]), lines of text ([`text`]), values of TOML and JSON that types are
//! read from and written as ([`tree`]), output of commands ([`terminal`]), pages of HTML ([`html_page`]), metrics for Prometheus ([`metrics`]),
//! results of earlier runs that new ones are compared with ([`baselines`]), quantiles and pseudo-random numbers ([`statistics`]), and locks that survive a
//! panic ([`sync`]).

#![forbid(unsafe_code)]

// The derives of [`tree`] name this crate.
extern crate self as echolume_base;

pub mod baselines;
pub mod canvas;
pub mod digest;
pub mod files;
pub mod html_page;
pub mod memory;
pub mod metrics;
pub mod picture;
pub mod progress_lines;
pub mod statistics;
pub mod sync;
pub mod terminal;
pub mod text;
pub mod tree;
