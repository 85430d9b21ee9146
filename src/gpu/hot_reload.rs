//! Shaders compiled from glsl/ at start, for whoever writes them: an edit and a run, no step between.

use super::pipelines::Shaders;
use crate::shader_source;
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
        let mut options = shaderc::CompileOptions::new().map_err(|e| e.to_string())?;
        options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
        options.set_target_spirv(shaderc::SpirvVersion::V1_5);
        options.set_optimization_level(shaderc::OptimizationLevel::Performance);
        options.set_generate_debug_info();
        options.set_auto_bind_uniforms(true);
        for define in &source.defines {
            options.add_macro_definition(define, Some("1"));
        }
        let binary = compiler
            .compile_into_spirv(&source.text, shaderc::ShaderKind::Compute, &source.name, "main", Some(&options))
            .map_err(|e| format!("{}: {e}", source.name))?;
        compiled.insert(source.name, binary.as_binary().to_vec());
    }
    Ok(Arc::new(move |name| compiled.get(name).cloned().ok_or_else(|| "is not among the sources".to_string())))
}
