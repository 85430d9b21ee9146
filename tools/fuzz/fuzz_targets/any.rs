//! One parser of `tests/fuzz` under libFuzzer: the one that FUZZ_TARGET names. See `../run`.
#![no_main]

// What only the tests need, such as how often each is run there.
#[allow(dead_code)]
#[path = "../../../tests/fuzz/targets/mod.rs"]
mod targets;

use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;
use targets::{TARGETS, Target};

static TARGET: LazyLock<&Target> = LazyLock::new(|| {
    let name = std::env::var("FUZZ_TARGET").unwrap_or_default();
    let names: Vec<&str> = TARGETS.iter().map(|t| t.name).collect();
    TARGETS.iter().find(|t| t.name == name).unwrap_or_else(|| panic!("FUZZ_TARGET is none of {}", names.join(", ")))
});

fuzz_target!(|bytes: &[u8]| {
    (TARGET.run)(bytes);
});
