//! What machine this is, in words: never whose.

use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Longest file of the system that is read, bytes: of a processor with many cores, the first ones.
const LONGEST: u64 = 64 << 10;
/// How the variables begin that decide what Vulkan does.
const VARIABLES: &[&str] = &["VK_", "LP_", "MESA_", "GALLIVM_"];

/// Program, system, processor, memory, and what is set for Vulkan, one to a line.
pub fn system() -> String {
    let mut said = String::new();
    let mut say = |what: &str, value: Option<String>| {
        // Writing to a text does not fail.
        let _ = writeln!(said, "{what}: {}", value.unwrap_or_else(|| "not told by this system".into()));
    };
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    say("program", Some(format!("{} {} ({build})", env!("CARGO_PKG_NAME"), env!("CARGO_PKG_VERSION"))));
    say("time", Some(humantime::format_rfc3339_seconds(std::time::SystemTime::now()).to_string()));
    say("built for", Some(format!("{} on {}", std::env::consts::OS, std::env::consts::ARCH)));
    let kernel = ["ostype", "osrelease", "version"].map(|name| text(&format!("/proc/sys/kernel/{name}")));
    let kernel = kernel.map(|part| part.unwrap_or_default().trim().to_string()).join(" ");
    say("kernel", Some(kernel.trim().to_string()).filter(|kernel| !kernel.is_empty()));
    say("system", text("/etc/os-release").and_then(|text| value(&text, "PRETTY_NAME", '=')));
    say("processor", text("/proc/cpuinfo").and_then(|text| value(&text, "model name", ':')));
    say("cores", std::thread::available_parallelism().ok().map(|cores| cores.to_string()));
    let memory = text("/proc/meminfo").unwrap_or_default();
    say("memory", value(&memory, "MemTotal", ':'));
    say("of it free", value(&memory, "MemAvailable", ':'));
    say("up for", text("/proc/uptime").and_then(|up| Some(format!("{} s", up.split(' ').next()?))));
    let mut set: Vec<_> = std::env::vars_os()
        .map(|(name, value)| (name.to_string_lossy().into_owned(), value.to_string_lossy().into_owned()))
        .filter(|(name, _)| VARIABLES.iter().any(|start| name.starts_with(start)))
        .collect();
    set.sort();
    let _ = writeln!(said, "variables that begin with {}:", VARIABLES.join(", "));
    for (name, value) in &set {
        let _ = writeln!(said, "    {name}={}", value.escape_debug());
    }
    if set.is_empty() {
        said += "    none\n";
    }
    said
}

fn text(path: &str) -> Option<String> {
    let mut bytes = Vec::new();
    File::open(Path::new(path)).ok()?.take(LONGEST).read_to_end(&mut bytes).ok()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
}

/// What a line says that begins with a name.
fn value(text: &str, name: &str, sign: char) -> Option<String> {
    let lines = text.lines().filter_map(|line| line.split_once(sign));
    let mut values = lines.filter(|(left, _)| left.trim() == name).map(|(_, value)| value.trim().trim_matches('"'));
    values.next().map(str::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_and_the_system_are_named_and_the_machine_is_not() {
        let said = system();
        assert!(said.starts_with(&format!("program: echolume {}", env!("CARGO_PKG_VERSION"))), "{said}");
        assert!(
            ["kernel: ", "processor: ", "memory: ", "begin with VK_"].iter().all(|name| said.contains(name)),
            "{said}"
        );
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        assert!(host.trim().len() < 4 || !said.contains(host.trim()), "{said}");
        assert!(!said.contains("PATH="));
    }

    #[test]
    fn values_are_those_of_their_name() {
        let text = "NAME=\"a\"\nPRETTY_NAME=\"Some System 12\"\nodd line\n";
        assert_eq!(value(text, "PRETTY_NAME", '=').as_deref(), Some("Some System 12"));
        assert_eq!(value(text, "none", '='), None);
    }
}
