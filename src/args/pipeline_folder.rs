//! The folder in which compiled pipelines are kept between runs.

use std::ffi::OsString;
use std::path::PathBuf;

/// Names another folder, or `none`.
const VARIABLE: &str = "ECHOLUME_PIPELINE_CACHE";

/// `pipelines` in the user's cache folder, or what ECHOLUME_PIPELINE_CACHE names instead; none if that is `none` or empty, or if the
/// system names no such folder.
pub fn pipeline_folder() -> Option<PathBuf> {
    chosen(|name| std::env::var_os(name))
}

fn chosen(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    if let Some(asked) = variable(VARIABLE) {
        return (!asked.is_empty() && asked != "none").then(|| asked.into());
    }
    // A relative path is to be ignored (XDG Base Directory Specification).
    let absolute = |name: &str| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = match cfg!(windows) {
        true => absolute("LOCALAPPDATA"),
        false => absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache"))),
    };
    cache.map(|folder| folder.join("echolume").join("pipelines"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn of(set: &[(&str, &str)]) -> Option<PathBuf> {
        chosen(|name| set.iter().find(|(n, _)| *n == name).map(|(_, value)| value.into()))
    }

    #[cfg(unix)]
    #[test]
    fn the_folder_is_the_users_cache_unless_another_is_named_or_none() {
        let home = ("HOME", "/home/a");
        assert_eq!(of(&[home]).as_deref(), Some(Path::new("/home/a/.cache/echolume/pipelines")));
        assert_eq!(of(&[home, ("XDG_CACHE_HOME", "/c")]).as_deref(), Some(Path::new("/c/echolume/pipelines")));
        let relative = of(&[home, ("XDG_CACHE_HOME", "c")]);
        assert_eq!(relative.as_deref(), Some(Path::new("/home/a/.cache/echolume/pipelines")));
        assert_eq!(of(&[home, (VARIABLE, "/else")]).as_deref(), Some(Path::new("/else")));
        for none in ["none", ""] {
            assert_eq!(of(&[home, (VARIABLE, none)]), None);
        }
        assert_eq!(of(&[]), None);
    }
}
