//! The text of a shader as it is compiled, with includes expanded, once for each variant. The shader tool, which compiles, and the tests,
//! which compare `spirv/` with `glsl/`, use this same file. It has no side effects.

use std::path::Path;
use std::sync::Arc;

/// The compiler's options as the hash of every shader contains them, so that a change of them changes every hash.
pub(crate) const OPTIONS: &str = "vulkan1.3 spirv1.5 -O -g auto-bind";

/// A variant of a shader with its source text.
pub struct Source {
    /// Path below glsl/ without extension, and the variant, such as `filter/sigma.slice`. Passes name shaders so.
    pub name: String,
    /// Macros that are defined for this variant.
    pub defines: Vec<String>,
    /// The text with all includes expanded.
    pub text: String,
    /// Where each line of the text comes from.
    origins: Arc<[Origin]>,
}

#[derive(Clone)]
struct Origin {
    /// Path below glsl/.
    file: Arc<str>,
    /// From 1.
    line: usize,
}

/// Every variant of every `.comp` file in the folders directly below `root`, in order of path.
///
/// # Errors
/// A file cannot be read or lists a variant without a name, or an include does not exist or includes itself.
pub fn sources(root: &Path) -> Result<Vec<Source>, String> {
    let mut all = Vec::new();
    for stage in sorted(root)? {
        if !stage.is_dir() {
            continue;
        }
        for file in sorted(&stage)? {
            if file.extension().is_some_and(|e| e == "comp") {
                all.extend(variants(root, &file)?);
            }
        }
    }
    Ok(all)
}

fn sorted(folder: &Path) -> Result<Vec<std::path::PathBuf>, String> {
    let listed = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<_> = listed.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    files.sort();
    Ok(files)
}

/// A line `// variants: name MACRO MACRO; name ...` names them; without it there is one, unnamed.
fn variants(root: &Path, file: &Path) -> Result<Vec<Source>, String> {
    let (text, origins) = version_first(expand(root, file, 0)?);
    let origins: Arc<[Origin]> = origins.into();
    let stem = below(root, &file.with_extension(""));
    let source = |name: String, defines| Source { name, defines, text: text.clone(), origins: origins.clone() };
    let Some(line) = text.lines().find_map(|l| l.strip_prefix("// variants:")) else {
        return Ok(vec![source(stem, Vec::new())]);
    };
    line.split(';')
        .map(|variant| {
            let mut words = variant.split_whitespace().map(str::to_string);
            let name = words.next().ok_or_else(|| format!("{}: an empty variant", file.display()))?;
            Ok(source(format!("{stem}.{name}"), words.collect()))
        })
        .collect()
}

fn below(root: &Path, file: &Path) -> String {
    file.strip_prefix(root).unwrap_or(file).to_string_lossy().replace('\\', "/")
}

/// Every line with its includes in place, and where it comes from.
fn expand(root: &Path, file: &Path, depth: u32) -> Result<Vec<(String, Origin)>, String> {
    if depth > 8 {
        return Err(format!("{}: includes itself", file.display()));
    }
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let name: Arc<str> = below(root, file).into();
    let mut expanded = Vec::new();
    for (i, line) in text.lines().enumerate() {
        match line.trim().strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"')) {
            Some(included) => expanded.extend(expand(root, &root.join("include").join(included), depth + 1)?),
            None => expanded.push((line.to_string(), Origin { file: name.clone(), line: i + 1 })),
        }
    }
    Ok(expanded)
}

/// GLSL wants its version first; everything above it is comment.
fn version_first(lines: Vec<(String, Origin)>) -> (String, Vec<Origin>) {
    let (version, rest): (Vec<_>, Vec<_>) = lines.into_iter().partition(|(line, _)| line.starts_with("#version"));
    let (mut text, mut origins) = (String::new(), Vec::new());
    for (line, origin) in version.into_iter().chain(rest) {
        text.push_str(&line);
        text.push('\n');
        origins.push(origin);
    }
    (text, origins)
}

impl Source {
    /// The text whose hash is in the file spirv/SOURCES: the compiler's options, the macros and the source text.
    pub fn fingerprint(&self) -> String {
        format!("{OPTIONS}\n{}\n{}", self.defines.join(" "), self.text)
    }

    /// A compiler's message with lines of the edited files: `file:LINE:` of the expanded text becomes, for example, `include/ray.glsl:12:`. `file` is
    /// the name that the compiler was given.
    pub(crate) fn with_origins(&self, message: &str, file: &str) -> String {
        let place = format!("{file}:");
        let mut parts = message.split(place.as_str());
        let mut located = parts.next().unwrap_or_default().to_string();
        for part in parts {
            let digits = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
            let line = part[..digits].parse::<usize>().ok().and_then(|n| self.origins.get(n.checked_sub(1)?));
            match line {
                Some(Origin { file, line }) => located.push_str(&format!("{file}:{line}{}", &part[digits..])),
                None => located.push_str(&format!("{}:{part}", self.name)),
            }
        }
        located
    }
}
