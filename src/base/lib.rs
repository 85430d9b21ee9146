//! What every other member stands on: files that are read with limits and written atomically ([`files`]), how much [`memory`] a volume may take, pictures and films
//! ([`picture`]), drawings and plots ([`canvas`]), lines of text ([`text`]), values of TOML that types are read from ([`tree`]), what is said on a terminal ([`terminal`]), pages of HTML
//! ([`html_page`]), tables for Prometheus ([`metrics`]), and results of earlier runs that new ones are compared with ([`baselines`]).

#![forbid(unsafe_code)]

pub mod baselines;
pub mod canvas;
pub mod files;
pub mod html_page;
pub mod memory;
pub mod metrics;
pub mod picture;
pub mod progress_lines;
pub mod statistics;
pub mod terminal;
pub mod text;
pub mod tree;
