//! Units of length and time as files spell them: symbols, and names in the singular and the plural (UDUNITS, Teem, ITK).

/// Symbols of lengths, and mm that they are. Case counts: `Mm` is no millimetre.
const LENGTHS: [(&[&str], f64); 9] = [
    (&["km"], 1e6),
    (&["m"], 1e3),
    (&["dm"], 100.0),
    (&["cm", "CM", "Cm"], 10.0),
    (&["mm", "MM"], 1.0),
    // Both characters for micro: the sign and the Greek letter.
    (&["um", "UM", "\u{b5}m", "\u{3bc}m", "\u{b5}", "\u{3bc}"], 1e-3),
    (&["nm"], 1e-6),
    (&["in", "IN", "In"], INCH),
    (&["ft"], 12.0 * INCH),
];
/// Names of lengths that have no prefix, and mm that they are.
const NAMED_LENGTHS: [(&[&str], f64); 4] = [
    (&["micron", "microns"], 1e-3),
    (&["inch", "inches"], INCH),
    (&["foot", "feet"], 12.0 * INCH),
    (&["meter", "meters", "metre", "metres"], 1e3),
];
const INCH: f64 = 25.4;

/// Symbols of times, and seconds that they are.
const TIMES: [(&[&str], f64); 6] = [
    (&["s", "sec", "secs"], 1.0),
    (&["ms", "msec", "msecs"], 1e-3),
    (&["us", "usec", "usecs", "\u{b5}s", "\u{3bc}s"], 1e-6),
    (&["ns", "nsec", "nsecs"], 1e-9),
    (&["min", "mins"], 60.0),
    (&["h", "hr", "hrs"], 3600.0),
];
const NAMED_TIMES: [(&[&str], f64); 3] =
    [(&["second", "seconds"], 1.0), (&["minute", "minutes"], 60.0), (&["hour", "hours"], 3600.0)];

/// Prefixes of names.
const PREFIXES: [(&str, f64); 7] =
    [("", 1.0), ("kilo", 1e3), ("deci", 0.1), ("centi", 1e-2), ("milli", 1e-3), ("micro", 1e-6), ("nano", 1e-9)];

/// Number of mm in a unit; None if it is no known unit of length.
pub(super) fn millimetres(unit: &str) -> Option<f64> {
    find(unit, &LENGTHS, &NAMED_LENGTHS)
}

/// Number of seconds in a unit; None if it is no known unit of time.
pub(super) fn seconds(unit: &str) -> Option<f64> {
    find(unit, &TIMES, &NAMED_TIMES)
}

/// A symbol as it is written, or a name in any case with its prefix.
fn find(unit: &str, symbols: &[(&[&str], f64)], names: &[(&[&str], f64)]) -> Option<f64> {
    let unit = unit.trim().trim_end_matches('.');
    let of = |table: &[(&[&str], f64)], word: &str| {
        table.iter().find(|(words, _)| words.contains(&word)).map(|(_, value)| *value)
    };
    let name: String = unit.to_lowercase().chars().filter(|c| !matches!(c, ' ' | '-')).collect();
    let prefixed = |(prefix, factor): &(&str, f64)| Some(of(names, name.strip_prefix(prefix)?)? * factor);
    of(symbols, unit).or_else(|| PREFIXES.iter().find_map(prefixed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_known_by_symbol_and_name() {
        for (words, expected) in [
            ("mm MM millimeter Millimetres MILLIMETERS", 1.0),
            ("um \u{b5}m \u{3bc}m micron microns Micrometers micrometre MICRONS", 1e-3),
            ("nm nanometers", 1e-6),
            ("cm centimeters centimetre", 10.0),
            ("m meter Meters metre metres", 1e3),
            ("in inch Inches", 25.4),
        ] {
            for word in words.split(' ') {
                let found = millimetres(word).unwrap_or(f64::NAN);
                assert!((found / expected - 1.0).abs() < 1e-12, "{word}: {found}");
            }
        }
        for other in ["", "pixel", "Mm", "M", "NM", "s", "metric", "voxel", "milli"] {
            assert_eq!(millimetres(other), None, "{other}");
        }
    }

    #[test]
    fn times_are_known_by_symbol_and_name() {
        for (words, expected) in [
            ("s sec second Seconds", 1.0),
            ("ms msec milliseconds Millisecond", 1e-3),
            ("us \u{b5}s \u{3bc}s microseconds", 1e-6),
            ("min minutes", 60.0),
        ] {
            for word in words.split(' ') {
                let found = seconds(word).unwrap_or(f64::NAN);
                assert!((found / expected - 1.0).abs() < 1e-12, "{word}: {found}");
            }
        }
        for other in ["", "frame", "mm", "Hz", "m"] {
            assert_eq!(seconds(other), None, "{other}");
        }
    }
}
