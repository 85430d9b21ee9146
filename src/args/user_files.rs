//! Files that the program keeps for a user between runs: compiled pipelines, presets, and the list of recent files.

use std::ffi::OsString;
use std::path::PathBuf;

/// A place in one of the user's folders.
struct Place {
    /// The variable of the environment that names another place, or `none`.
    variable: &'static str,
    /// The variable of the XDG Base Directory Specification that names the folder, and the folder below HOME where it is not set.
    xdg: (&'static str, &'static str),
    /// In the program's own folder.
    name: &'static str,
}

const PIPELINES: Place =
    Place { variable: "ECHOLUME_PIPELINE_CACHE", xdg: ("XDG_CACHE_HOME", ".cache"), name: "pipelines" };
const PRESETS: Place =
    Place { variable: "ECHOLUME_PRESETS", xdg: ("XDG_CONFIG_HOME", ".config"), name: "presets.toml" };
#[cfg(feature = "view")]
const RECENT: Place = Place { variable: "ECHOLUME_RECENT", xdg: ("XDG_STATE_HOME", ".local/state"), name: "recent" };

/// Path of the folder of compiled pipelines: `echolume/pipelines` in the user's cache folder, or the value of ECHOLUME_PIPELINE_CACHE. None if that
/// value is `none` or empty, or if the system has no such folder.
pub fn pipeline_folder() -> Option<PathBuf> {
    PIPELINES.path(|name| std::env::var_os(name))
}

/// Path of the file with the user's presets: `echolume/presets.toml` in the user's configuration folder, or the value of ECHOLUME_PRESETS. None if
/// that value is `none` or empty, or if the system has no such folder.
pub fn presets_file() -> Option<PathBuf> {
    PRESETS.path(|name| std::env::var_os(name))
}

/// Path of the list of recent files: `echolume/recent` in the user's state folder, or the value of ECHOLUME_RECENT. None if that value is `none` or
/// empty, or if the system has no such folder.
#[cfg(feature = "view")]
pub fn recent_list() -> Option<PathBuf> {
    RECENT.path(|name| std::env::var_os(name))
}

/// Path of an empty file that is to be created once the hints of the first start were shown. None unless this is the first start: neither this
/// file, nor a list of recent files, nor presets of the user exist. Also None if no list of recent files is kept.
#[cfg(feature = "view")]
pub fn first_steps() -> Option<PathBuf> {
    first_steps_beside(recent_list()?, presets_file())
}

#[cfg(feature = "view")]
fn first_steps_beside(recent: PathBuf, presets: Option<PathBuf>) -> Option<PathBuf> {
    let shown = recent.with_file_name("hints-shown");
    let is_used = recent.exists() || shown.exists() || presets.is_some_and(|presets| presets.exists());
    (!is_used).then_some(shown)
}

impl Place {
    fn path(&self, variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
        if let Some(asked) = variable(self.variable) {
            return (!asked.is_empty() && asked != "none").then(|| asked.into());
        }
        // A relative path is to be ignored (XDG Base Directory Specification).
        let absolute = |name: &str| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let (named, below_home) = self.xdg;
        let folder = match cfg!(windows) {
            true => absolute("LOCALAPPDATA"),
            false => absolute(named).or_else(|| absolute("HOME").map(|home| home.join(below_home))),
        };
        folder.map(|folder| folder.join("echolume").join(self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[cfg(feature = "view")]
    #[test]
    fn only_the_first_start_of_a_user_has_hints() {
        let work = crate::files::WorkFolder::new(&std::env::temp_dir(), "echolume-first-start-").expect("a folder");
        let folder = work.path();
        let [recent, presets] = ["recent", "presets.toml"].map(|name| folder.join(name));
        let shown = folder.join("hints-shown");
        let hints = |presets: Option<&PathBuf>| first_steps_beside(recent.clone(), presets.cloned());
        assert_eq!(hints(Some(&presets)), Some(shown.clone()));
        assert_eq!(hints(None), Some(shown.clone()));
        for file in [&recent, &shown, &presets] {
            std::fs::write(file, "").expect("written");
            assert_eq!(hints(Some(&presets)), None, "{}", file.display());
            std::fs::remove_file(file).expect("removed");
        }
    }

    #[cfg(all(unix, feature = "view"))]
    #[test]
    fn a_place_is_in_the_users_folder_unless_another_is_named_or_none() {
        for (place, standard) in [
            (PIPELINES, "/home/a/.cache/echolume/pipelines"),
            (PRESETS, "/home/a/.config/echolume/presets.toml"),
            (RECENT, "/home/a/.local/state/echolume/recent"),
        ] {
            let of =
                |set: &[(&str, &str)]| place.path(|name| set.iter().find(|(n, _)| *n == name).map(|(_, v)| v.into()));
            let (home, (xdg, _)) = (("HOME", "/home/a"), place.xdg);
            assert_eq!(of(&[home]).as_deref(), Some(Path::new(standard)));
            assert_eq!(of(&[home, (xdg, "/c")]), Some(Path::new("/c/echolume").join(place.name)));
            assert_eq!(of(&[home, (xdg, "c")]).as_deref(), Some(Path::new(standard)), "a relative path");
            assert_eq!(of(&[home, (place.variable, "/else")]).as_deref(), Some(Path::new("/else")));
            for none in [&[home, (place.variable, "none")][..], &[home, (place.variable, "")], &[]] {
                assert_eq!(of(none), None);
            }
        }
    }
}
