//! Shaders compiled from glsl/ at start, for whoever writes them: an edit and a run, no step between.

use super::pipelines::Shaders;
use crate::{shader_compile, shader_source};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Compiles every variant of every shader below `glsl`.
///
/// # Errors
/// The first shader that does not compile, with the compiler's words.
pub fn compile(glsl: &Path) -> Result<Arc<Shaders>, String> {
    let compiler = shaderc::Compiler::new().map_err(|e| e.to_string())?;
    let mut compiled: HashMap<String, Vec<u32>> = HashMap::new();
    for source in shader_source::sources(glsl)? {
        let words = shader_compile::compile(&compiler, &source)?;
        compiled.insert(source.name, words);
    }
    Ok(Arc::new(move |name| compiled.get(name).cloned().ok_or_else(|| "is not among the sources".to_string())))
}
