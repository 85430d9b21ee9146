//! Tests that run in a process of their own, because they send it signals or measure its memory.

use std::process::{Command, Output};

/// Set in such a process.
const CHILD: &str = "ECHOLUME_TEST_CHILD";

/// True in the process that [`command`] describes.
pub fn is_child() -> bool {
    std::env::var_os(CHILD).is_some()
}

/// The command that runs one test of this binary, given by its full path such as `signals::child`, in a process of its own. The
/// default action of each signal is restored: whoever runs the tests may ignore one, as `nohup` does.
pub fn command(test: &str) -> Command {
    let this = std::env::current_exe().expect("this program");
    let mut command = Command::new("env");
    command.arg("--default-signal=INT,TERM,HUP").arg(this).args([test, "--exact", "--nocapture"]).env(CHILD, test);
    command
}

/// Runs a command of [`command`]. Returns what it printed; panics with that unless its test passed.
pub fn passes(command: &mut Command) -> String {
    let Output { status, stdout, stderr } = command.output().expect("start the test");
    let printed = String::from_utf8_lossy(&stdout) + String::from_utf8_lossy(&stderr);
    assert!(status.success() && printed.contains("1 passed"), "{status}: {printed}");
    printed.into_owned()
}
