//! A place that one process writes to is no other's.
#![cfg(unix)]

use crate::common::program::*;
use crate::common::wait::until;
use std::fs;
use std::process::Command;

/// Prevents two programs that replace each other's metrics, or write into one log.
#[test]
fn a_second_program_with_the_same_metrics_or_log_is_refused_until_the_first_is_gone() {
    let folder = Folder::new("locks");
    let [metrics, log] = ["a.prom", "a.log"].map(|name| folder.path(name));
    let both = ["stream", "--null", "--size", "16x16", "--mode", "mip", "--prometheus", &metrics, "--log-file", &log];
    let mut first = Command::new(PROGRAM);
    let mut first = crate::common::program::start(first.args(both).args(["--source", "phantom"]));
    until("metrics", || fs::exists(&metrics).expect("look").then_some(()));
    let named = format!("is in use by process {}", first.id());
    let one = ["stream", "--null", "--source", BONE, "--size", "16x16", "--mode", "mip"];
    let info = ["info", BONE, "--log-file", &log];
    refuses(&info, &run(&info), 1, &["log ", "a.log: ", &named]);
    let other = [&one[..], &["--prometheus", &metrics]].concat();
    refuses(&other, &run(&other), 1, &["a.prom: ", &named]);
    // Killed, it removes nothing.
    first.kill().expect("killed");
    first.wait().expect("it ends");
    assert!(folder.names().contains(".a.prom.lock"), "{:?}", folder.names());
    done(&info);
    done(&other);
    assert_eq!(folder.names().into_iter().collect::<Vec<_>>(), ["a.log", "a.prom"], "nothing is left");
}

/// A kiosk says so before it opens a window.
#[cfg(feature = "view")]
#[test]
fn a_second_kiosk_with_the_same_folder_or_metrics_is_refused() {
    use echolume::low_level::files::Lock;
    let folder = Folder::new("kiosks");
    let saved = folder.join("saved");
    fs::create_dir(&saved).expect("a folder");
    for (keys, place) in [
        ("[files]\npictures = 'saved'", saved.clone()),
        ("[live]\nrecord = 'saved'", saved),
        ("[files]\nprometheus = 'a.prom'", folder.join("a.prom")),
    ] {
        let file = folder.write("cart.toml", format!("source = 'phantom'\n{keys}\n"));
        let _held = Lock::take(&place).expect("free");
        let mut command = Command::new(PROGRAM);
        command.args(["view", "--kiosk", "--config", &file]).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        let name = place.file_name().expect("a name").to_string_lossy().into_owned();
        let named = format!("{name}: is in use by process {}", std::process::id());
        refuses(&[keys], &finish(&mut command), 1, &[&named]);
    }
}
