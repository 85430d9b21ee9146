//! The configuration of a cart, and the redaction of logs.

use super::told;
use echolume::low_level::kiosk::config::Config;
use echolume::low_level::kiosk::redaction::Redactor;
use std::path::Path;

/// An accepted configuration round-trips, and gives arguments and layers.
pub fn configuration(bytes: &[u8]) -> String {
    let path = Path::new("echolume.toml");
    let config = match Config::parse(&String::from_utf8_lossy(bytes), path) {
        Ok(config) => config,
        Err(error) => return told(error),
    };
    let written = config.to_toml().expect("TOML");
    let again = Config::parse(&written, path).expect("what was written out is right");
    assert_eq!(again.to_toml().expect("TOML"), written);
    let arguments = config.source_arguments();
    assert!(arguments.iter().all(|argument| argument.starts_with("--")), "{arguments:?}");
    config.layers().and_then(|layers| layers.finish()).expect("checked before");
    told(config.flag_error(&arguments.join(" ")))
}

/// Text after an unknown name is kept, and so are lines.
pub fn redacted(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let mut redactor = Redactor::new();
    redactor.add_recording(Path::new(text.lines().next().unwrap_or_default()));
    let said = redactor.redact(&text);
    assert_eq!(said.matches('\n').count(), text.matches('\n').count());
    let mut planted = Redactor::new().redact(&text.replace('\n', "/data/ZQX.mha\n"));
    planted.retain(|c| c.is_ascii_uppercase() || c == '\n');
    assert!(text.contains("ZQX") || !planted.contains("ZQX"), "{planted}");
    said.split_whitespace().filter(|word| word.contains('<')).take(8).collect()
}
