//! Names the Vulkan calls in which a driver may crash or hang, just before each: a process that ends in one cannot name it afterwards.

use std::sync::OnceLock;

/// Is told the name of a call, and of what it is made for.
pub type Told = fn(call: &'static str, of: &str);

static TOLD: OnceLock<Told> = OnceLock::new();

/// From now on `told` is called before such calls, on whatever thread makes them. The first of several stays.
pub fn tell(told: Told) {
    let _ = TOLD.set(told);
}

pub(crate) fn begins(call: &'static str, of: &str) {
    if let Some(told) = TOLD.get() {
        told(call, of);
    }
}
