//! The list of files to open: the recent ones and the entries of a folder, and the file that stores the recent ones.

use crate::files;
use crate::source::{self, formats};
use crate::workspace;
use std::path::{Path, PathBuf};

/// Most recent files that are kept and listed.
const MAX_RECENT: usize = 8;
/// Most entries of a folder that are read and listed.
const MAX_READ: usize = 10_000;
const MAX_LISTED: usize = 200;
/// Most files of a folder whose beginning is read, to tell whether they are DICOM.
const MAX_LOOKED_AT: usize = 2000;
/// Longest list of recent files, bytes.
const MAX_BYTES: u64 = 1 << 16;

/// What an entry of the list of files stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A recording or a workspace.
    File,
    /// The DICOM files of the listed folder, which are one recording; the number of files.
    Series(usize),
    Folder,
    FolderAbove,
}

/// The recent files, and folders that are one recording, the newest first. Those that no longer exist are left out; empty if the list cannot be
/// read.
pub(super) fn recent(list: &Path) -> Vec<PathBuf> {
    let text = files::read_text(list, MAX_BYTES, "list").unwrap_or_default();
    let there = text.lines().map(PathBuf::from).filter(|file| file.is_absolute() && file.exists());
    there.take(MAX_RECENT).collect()
}

/// Puts a file at the top of the stored list of recent files. An error of writing is ignored.
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

/// What can be opened in a folder, at most 200 entries: the parent folder, its DICOM files as one recording, folders, then recordings and
/// workspaces by name.
pub(super) fn entries(folder: &Path) -> Vec<(Kind, PathBuf)> {
    let is_hidden = |path: &Path| path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
    let read = std::fs::read_dir(folder).into_iter().flatten().take(MAX_READ);
    let there = read.flatten().map(|entry| entry.path()).filter(|path| !is_hidden(path));
    let (mut folders, mut others): (Vec<_>, Vec<_>) = there.partition(|path| path.is_dir());
    folders.sort();
    others.sort();
    let (mut looked_at, mut of_series) = (0, 0);
    others.retain(|path| {
        // Scanners and discs name DICOM files in any way, also without an ending.
        let is_dicom = may_be_dicom(path) && looked_at < MAX_LOOKED_AT && {
            looked_at += 1;
            source::is_dicom(path)
        };
        of_series += usize::from(is_dicom);
        is_dicom || can_be_opened(path)
    });
    let series = (of_series > 1).then(|| (Kind::Series(of_series), folder.to_path_buf()));
    let above = folder.parent().map(|above| (Kind::FolderAbove, above.to_path_buf()));
    let folders = folders.into_iter().map(|path| (Kind::Folder, path));
    let files = others.into_iter().map(|path| (Kind::File, path));
    above.into_iter().chain(series).chain(folders).chain(files).take(MAX_LISTED).collect()
}

/// The path that a typed text stands for; `~` is the user's home folder.
pub(super) fn expanded(typed: &str) -> PathBuf {
    let home = std::env::var_os("HOME").map(PathBuf::from).filter(|home| home.is_absolute());
    match (typed.strip_prefix('~'), home) {
        (Some(""), Some(home)) => home,
        (Some(rest), Some(home)) if rest.starts_with('/') => home.join(rest.trim_start_matches('/')),
        _ => PathBuf::from(typed),
    }
}

/// The longest common beginning of all existing paths that begin with the typed one, with `/` if it is a folder and the only one. Hidden files
/// are included if the dot is typed.
pub(super) fn completion(typed: &str) -> String {
    let Some((folder, begun)) = typed.rsplit_once('/') else {
        return if typed == "~" { "/".into() } else { String::new() };
    };
    let folder = expanded(&format!("{folder}/"));
    let read = std::fs::read_dir(folder.as_path()).into_iter().flatten().take(MAX_READ).flatten();
    let names = read.filter_map(|entry| entry.file_name().into_string().ok());
    let rests = names.filter(|name| begun.starts_with('.') || !name.starts_with('.'));
    let rests: Vec<String> = rests.filter_map(|name| name.strip_prefix(begun).map(str::to_string)).collect();
    let Some((first, others)) = rests.split_first() else { return String::new() };
    let agree = |other: &String| first.chars().zip(other.chars()).take_while(|(a, b)| a == b).count();
    let count = others.iter().map(agree).min().unwrap_or(first.chars().count());
    let is_folder = others.is_empty() && folder.join(format!("{begun}{first}")).is_dir();
    first.chars().take(count).chain(is_folder.then_some('/')).collect()
}

fn ending(path: &Path) -> Option<String> {
    path.extension().map(|end| end.to_string_lossy().to_lowercase())
}

/// True if a file is named like a recording, or begins like a workspace.
fn can_be_opened(path: &Path) -> bool {
    ending(path).is_some_and(|end| formats::is_ending(&end)) || workspace::is_workspace(path)
}

/// False if a file is named as something else. The numbers of a UID in a name end with one that looks like an ending.
fn may_be_dicom(path: &Path) -> bool {
    let is_number = |end: &str| end.chars().all(|letter| letter.is_ascii_digit());
    ending(path).is_none_or(|end| is_number(&end) || formats::DICOM.contains(&end.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_every_format_are_offered() {
        for ending in formats::FORMATS.iter().flat_map(|format| format.endings) {
            for name in
                [format!("/a/b.{ending}"), format!("/a/B.{}", ending.to_uppercase()), format!("/a/b.{ending}.gz")]
            {
                assert!(can_be_opened(Path::new(&name)), "{name}");
            }
        }
        assert!(!can_be_opened(Path::new("/a/b.txt")) && !can_be_opened(Path::new("/a/b")));
    }

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
        let listed =
            || entries(&folder).into_iter().map(|(kind, path)| (kind, path.file_name().expect("a name").to_owned()));
        let names: Vec<_> = listed().skip(1).map(|(_, name)| name).collect();
        assert_eq!(names, ["inside", "a.nii.gz", "b.mha", "work.toml"]);
        assert_eq!(entries(&folder)[0], (Kind::FolderAbove, std::env::temp_dir()));
        // DICOM files are told by their beginning, and several may be one recording.
        let dicom = [&[0; 128][..], b"DICM"].concat();
        std::fs::write(folder.join("IM_0001"), &dicom).expect("file");
        assert!(listed().all(|(kind, _)| !matches!(kind, Kind::Series(_))));
        for name in ["1.2.840.113", "I2.dcm", "picture.png", "IM_0002"] {
            let text = if name == "IM_0002" { &[7; 200][..] } else { &dicom };
            std::fs::write(folder.join(name), text).expect("file");
        }
        assert_eq!(entries(&folder)[1], (Kind::Series(3), folder.clone()));
        let files: Vec<_> = listed().filter(|(kind, _)| *kind == Kind::File).map(|(_, name)| name).collect();
        assert_eq!(files, ["1.2.840.113", "I2.dcm", "IM_0001", "a.nii.gz", "b.mha", "work.toml"]);
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
        remember(&list, &folder.join("inside"));
        assert_eq!(recent(&list)[0], folder.join("inside"), "a folder of one series");
        std::fs::remove_dir_all(&folder).expect("remove");
    }
}
