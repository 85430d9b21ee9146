//! The limit of the memory of a volume: half of the memory that this process may have, unless the user sets another limit. A header of a
//! few bytes can state any size, so the limit is checked before anything is allocated.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Largest volume, bytes.
static LIMIT: OnceLock<u64> = OnceLock::new();

/// Sets the largest memory of a volume, bytes. Ignored once a limit was set or checked.
pub fn set_limit(bytes: u64) {
    LIMIT.get_or_init(|| bytes);
}

/// Checks that a volume of `bytes` bytes is within the limit: that of [`set_limit`], else half of the memory that this process may have.
///
/// # Errors
/// One line: the size and the limit.
pub fn check(bytes: u64) -> Result<(), String> {
    let limit = *LIMIT.get_or_init(|| available().unwrap_or(u64::MAX) / 2);
    match bytes <= limit {
        true => Ok(()),
        false => Err(format!(
            "takes {} of memory, at most {} may be taken; --max-memory allows more",
            described(bytes),
            described(limit)
        )),
    }
}

/// Parses a number of bytes above 0 as users type it: a number alone or with K, M, G or T, which are powers of 1024 (`8G`, `8GB` and `8GiB` are the
/// same), or `none` for no limit, which gives `u64::MAX`.
///
/// # Errors
/// One line: what is allowed.
pub fn parse(text: &str) -> Result<u64, String> {
    if text == "none" {
        return Ok(u64::MAX);
    }
    let unit = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let power = match text[unit..].to_ascii_uppercase().trim_end_matches('B').trim_end_matches('I') {
        "" => Some(0),
        unit => ["K", "M", "G", "T"].iter().position(|name| *name == unit).map(|n| n as u32 + 1),
    };
    let number = text[..unit].trim_end().parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0);
    let bytes = number.zip(power).map(|(number, power)| (number * 1024f64.powi(power as i32)) as u64);
    bytes
        .filter(|bytes| *bytes > 0)
        .ok_or_else(|| "must be a size such as 8G, 500M or a number of bytes, or none".into())
}

fn described(bytes: u64) -> String {
    match bytes {
        0..0x10_0000 => format!("{bytes} bytes"),
        0x10_0000..0x4000_0000 => format!("{} MiB", bytes >> 20),
        _ => format!("{:.1} GiB", bytes as f64 / 1024f64.powi(3)),
    }
}

/// The least of the machine's memory, the limit of the address space and that of the control group, bytes. None if the system tells none of them.
fn available() -> Option<u64> {
    let machine = read_to_string("/proc/meminfo").ok().and_then(|text| number(&text, "MemTotal:"));
    let space = read_to_string("/proc/self/limits").ok().and_then(|text| number(&text, "Max address space"));
    machine.map(|kib| kib << 10).into_iter().chain(space).chain(of_group()).min()
}

/// The number behind a name at the begin of a line; None for `unlimited`.
fn number(text: &str, name: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}

/// The least limit of the control group of this process and of those above it.
fn of_group() -> Option<u64> {
    let groups = read_to_string("/proc/self/cgroup").ok()?;
    let limit = |file: PathBuf| read_to_string(file).ok()?.trim().parse::<u64>().ok();
    // ID:controllers:path; version 2 has no controllers.
    let of = |line: &str| {
        let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
        let (top, name) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            "memory" => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes"),
            _ => return None,
        };
        Path::new(path)
            .ancestors()
            .filter_map(|group| limit(Path::new(&format!("{top}{}", group.display())).join(name)))
            .min()
    };
    groups.lines().filter_map(of).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units_of_1024() {
        for (text, bytes) in [
            ("123", 123),
            ("1k", 1 << 10),
            ("500M", 500 << 20),
            ("1.5 GiB", 3 << 29),
            ("2TB", 2 << 40),
            ("none", u64::MAX),
        ] {
            assert_eq!(parse(text), Ok(bytes), "{text}");
        }
        for wrong in ["", "G", "-1G", "0", "0.5", "8X", "8 G 8", "inf", "nan", "1e400"] {
            assert!(parse(wrong).is_err_and(|why| why.contains("8G")), "{wrong}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_says_what_there_is() {
        assert!(available().is_some_and(|bytes| bytes > 1 << 20));
        let limits = "Limit  Soft Limit  Hard Limit  Units\nMax address space  3072000000  unlimited  bytes\nMax data size  unlimited  unlimited  bytes\n";
        assert_eq!(number(limits, "Max address space"), Some(3_072_000_000));
        assert_eq!(number(limits, "Max data size"), None);
    }
}
