//! The list of files to open: the recent ones and what a folder has, and the file that keeps the recent ones.

use crate::files;
use crate::workspace;
use std::path::{Path, PathBuf};

/// Most recent files that are kept and listed.
const MAX_RECENT: usize = 8;
/// Most entries of a folder that are read and listed.
const MAX_READ: usize = 10_000;
const MAX_LISTED: usize = 200;
/// Longest list of recent files, bytes.
const MAX_BYTES: u64 = 1 << 16;
/// Endings of recordings.
const ENDINGS: [&str; 11] = ["mha", "mhd", "nrrd", "nhdr", "nii", "hdr", "dcm", "vol", "uff", "frames", "gz"];

/// The recent files that still exist, the newest first. A list that cannot be read is empty.
pub(super) fn recent(list: &Path) -> Vec<PathBuf> {
    let text = files::read_text(list, MAX_BYTES, "list").unwrap_or_default();
    let there = text.lines().map(PathBuf::from).filter(|file| file.is_absolute() && file.is_file());
    there.take(MAX_RECENT).collect()
}

/// Puts a file first on the list. That it cannot be written is no fault of the view.
pub(super) fn remember(list: &Path, file: &Path) {
    let Some(file) = std::path::absolute(file).ok().filter(|file| !file.to_string_lossy().contains('\n')) else {
        return;
    };
    let mut all = recent(list);
    all.retain(|known| *known != file);
    all.insert(0, file);
    all.truncate(MAX_RECENT);
    let text: String = all.iter().map(|file| format!("{}\n", file.display())).collect();
    let kept = list.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|e| e.to_string());
    if let Err(why) = kept.and_then(|()| files::replace(list, text.as_bytes())) {
        tracing::debug!("the list of recent files is not kept: {why}");
    }
}

/// What can be opened in a folder: the folder above, folders, then recordings and workspaces, by name. At most 200.
pub(super) fn entries(folder: &Path) -> Vec<PathBuf> {
    let is_hidden = |path: &Path| path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
    let read = std::fs::read_dir(folder).into_iter().flatten().take(MAX_READ);
    let there = read.flatten().map(|entry| entry.path()).filter(|path| !is_hidden(path));
    let (mut folders, others): (Vec<_>, Vec<_>) = there.partition(|path| path.is_dir());
    let mut recordings: Vec<_> = others.into_iter().filter(|path| can_be_opened(path)).collect();
    folders.sort();
    recordings.sort();
    let above = folder.parent().map(Path::to_path_buf);
    above.into_iter().chain(folders).chain(recordings).take(MAX_LISTED).collect()
}

/// True if a file is named like a recording, or begins like a workspace.
fn can_be_opened(path: &Path) -> bool {
    let ending = path.extension().map(|end| end.to_string_lossy().to_lowercase());
    ending.is_some_and(|end| ENDINGS.contains(&end.as_str())) || workspace::is_workspace(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_and_workspaces_are_listed_and_the_recent_ones_are_bounded() {
        let folder = std::env::temp_dir().join(format!("echolume-open-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("inside")).expect("folder");
        for (name, text) in [
            ("b.mha", ""),
            ("a.nii.gz", ""),
            ("scene.toml", "mode = 'plane'"),
            ("work.toml", "[workspace]\nversion = 1\n"),
            ("notes.txt", ""),
            (".hidden.mha", ""),
        ] {
            std::fs::write(folder.join(name), text).expect("file");
        }
        let names: Vec<_> = entries(&folder)[1..].iter().map(|p| p.file_name().expect("a name").to_owned()).collect();
        assert_eq!(names, ["inside", "a.nii.gz", "b.mha", "work.toml"]);
        assert_eq!(entries(&folder)[0], std::env::temp_dir());
        assert!(entries(&folder.join("nowhere")).len() <= 1);
        let list = folder.join("state").join("recent");
        assert!(recent(&list).is_empty());
        for n in 0..12 {
            let file = folder.join(format!("{n}.mha"));
            std::fs::write(&file, "").expect("file");
            remember(&list, &file);
        }
        remember(&list, &folder.join("9.mha"));
        let kept = recent(&list);
        assert_eq!((kept.len(), &kept[0], &kept[1]), (MAX_RECENT, &folder.join("9.mha"), &folder.join("11.mha")));
        std::fs::remove_file(folder.join("9.mha")).expect("remove");
        assert_eq!(recent(&list)[0], folder.join("11.mha"), "what is gone is not listed");
        std::fs::remove_dir_all(&folder).expect("remove");
    }
}
