//! Files that may hold frames of a patient are their owner's alone.
#![cfg(unix)]

use crate::common::program::*;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

/// Runs the program where the umask allows everything.
fn open_to_all(arguments: &[&str], private: Option<&str>) -> Ran {
    let mut command = Command::new("bash");
    command.args(["-c", "umask 0; exec \"$@\"", "bash", PROGRAM]).args(arguments).env_remove("ECHOLUME_PRIVATE");
    finish(command.envs(private.map(|value| ("ECHOLUME_PRIVATE", value))))
}

#[test]
fn files_of_patients_are_for_their_owner_alone_unless_the_umask_decides() {
    for (private, mode) in [(None, 0o600), (Some("1"), 0o600), (Some("0"), 0o666)] {
        let folder = Folder::new("private");
        let [picture, log, mha, frames, tape, mesh] =
            ["a.png", "a.log", "a.mha", "a.frames", "b.frames", "a.stl"].map(|name| folder.path(name));
        for arguments in [
            &["render", SWEEP, "-o", &picture, "--size", "16x16", "--mode", "mip", "--log-file", &log][..],
            &["convert", BONE, &mha, "--spacing", "4"],
            &["convert", SWEEP, &frames],
            &["stream", "--source", BONE, "--null", "--size", "16x16", "--mode", "mip", "--record", &tape],
            &["mesh", BONE, &mesh, "--spacing", "4"],
        ] {
            let (code, _, err) = open_to_all(arguments, private);
            assert_eq!(code, Some(0), "{arguments:?}: {err}");
        }
        assert_eq!(folder.names().len(), 6, "a lock is left: {:?}", folder.names());
        for name in folder.names() {
            let about = fs::metadata(folder.join(&name)).expect("there");
            assert_eq!(about.permissions().mode() & 0o777, mode, "{name} with {private:?}");
        }
    }
    refuses(&["info"], &open_to_all(&["info", SWEEP], Some("yes")), 2, &["ECHOLUME_PRIVATE=yes: must be 0 or 1"]);
    let folder = Folder::new("shared");
    assert_eq!(open_to_all(&["man", "-o", &folder.path("man")], None).0, Some(0));
    let page = fs::metadata(folder.join("man/echolume.1")).expect("a page").permissions().mode();
    assert_eq!(page & 0o777, 0o666, "a manual is everyone's");
}
