//! The text of a shader as it is compiled: includes expanded, one per variant. Pure, and the same file in the shader tool
//! (which compiles) and in the tests (which check that `spirv/` is what `glsl/` says).

use std::path::Path;

/// Options that go into every compilation; a change of them is a change of every shader.
pub const OPTIONS: &str = "vulkan1.3 spirv1.5 -O -g auto-bind";

/// One shader to compile.
pub struct Source {
    /// Path below glsl/ without extension, and the variant: `filter/sigma.slice`. This is the name passes use.
    pub name: String,
    /// Macros defined for this variant.
    pub defines: Vec<String>,
    /// The text with every include in place.
    pub text: String,
}

/// Every variant of every `.comp` below `root`, in order of name.
///
/// # Errors
/// Files that cannot be read, includes that do not exist or include themselves.
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
    let text = expand(root, file, 0)?;
    let below = file.strip_prefix(root).unwrap_or(file).with_extension("");
    let stem = below.to_string_lossy().replace('\\', "/");
    let Some(line) = text.lines().find_map(|l| l.strip_prefix("// variants:")) else {
        return Ok(vec![Source { name: stem, defines: Vec::new(), text }]);
    };
    line.split(';')
        .map(|variant| {
            let mut words = variant.split_whitespace().map(str::to_string);
            let name = words.next().ok_or_else(|| format!("{}: an empty variant", file.display()))?;
            Ok(Source { name: format!("{stem}.{name}"), defines: words.collect(), text: text.clone() })
        })
        .collect()
}

fn expand(root: &Path, file: &Path, depth: u32) -> Result<String, String> {
    if depth > 8 {
        return Err(format!("{}: includes itself", file.display()));
    }
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut expanded = String::with_capacity(text.len());
    for line in text.lines() {
        match line.trim().strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"')) {
            Some(name) => expanded.push_str(&expand(root, &root.join("include").join(name), depth + 1)?),
            None => {
                expanded.push_str(line);
                expanded.push('\n');
            }
        }
    }
    // GLSL wants its version first; everything above it is comment.
    match depth {
        0 => Ok(version_first(&expanded)),
        _ => Ok(expanded),
    }
}

fn version_first(text: &str) -> String {
    let (version, rest): (Vec<&str>, Vec<&str>) = text.lines().partition(|l| l.starts_with("#version"));
    format!("{}\n{}\n", version.join("\n"), rest.join("\n"))
}

impl Source {
    /// What the SOURCES file holds a hash of.
    pub fn fingerprint(&self) -> String {
        format!("{OPTIONS}\n{}\n{}", self.defines.join(" "), self.text)
    }
}
