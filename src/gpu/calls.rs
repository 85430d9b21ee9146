//! Reports the name of each Vulkan call in which a driver may crash or hang, just before the call: a process that ends in the call cannot
//! name it afterwards.

use std::sync::OnceLock;

/// A function that gets the name of a Vulkan call, and the name of the object that the call is for.
pub type Told = fn(call: &'static str, of: &str);

static TOLD: OnceLock<Told> = OnceLock::new();

/// From now on `told` is called before each Vulkan call in which a driver may crash or hang, on the thread that makes it. Only the first call of this
/// function has an effect.
pub fn tell(told: Told) {
    let _ = TOLD.set(told);
}

pub(crate) fn begins(call: &'static str, of: &str) {
    if let Some(told) = TOLD.get() {
        told(call, of);
    }
}
