//! What a command writes, looked at before it does any work.

use super::{Failure, failed, input};
use crate::files::check_target;
use std::path::Path;

/// A file to write, and the flag that says so.
pub type Target<'a> = (&'a str, Option<&'a Path>);

/// Refuses to write where nothing can be written, over what is read, or twice to one place.
pub fn check<'a>(targets: &[Target], read: impl IntoIterator<Item = &'a Path>) -> Result<(), Failure> {
    let read: Vec<&Path> = read.into_iter().collect();
    let targets: Vec<(&str, &Path)> = targets.iter().filter_map(|(flag, file)| Some((*flag, (*file)?))).collect();
    for (n, (flag, file)) in targets.iter().enumerate() {
        let refuse = |why: String| Err(input(format!("{flag} {}: {why}; give another name", file.display())));
        if read.iter().any(|input| is_one(input, file)) {
            return refuse("would replace an input".into());
        }
        if let Some((other, _)) = targets[..n].iter().find(|(_, before)| is_one(before, file)) {
            return refuse(format!("is written by {other} already"));
        }
        check_target(file).map_err(failed)?;
    }
    Ok(())
}

/// Whether two names are one file. A device takes whatever comes.
fn is_one(a: &Path, b: &Path) -> bool {
    let real = |file: &Path| file.canonicalize().ok();
    let is_special = std::fs::metadata(b).is_ok_and(|there| !there.is_file());
    !is_special && (a == b || real(a).is_some_and(|a| real(b) == Some(a)))
}
