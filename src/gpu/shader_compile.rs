//! Compiles GLSL to SPIR-V with shaderc, for the shader tool and for the feature `hot-reload`. Nothing else calls shaderc.

use crate::shader_source::Source;

/// Compiles one variant of a shader with shaderc. A warning is an error.
///
/// # Errors
/// The shader's name and the compiler's message.
pub fn compile(compiler: &shaderc::Compiler, source: &Source) -> Result<Vec<u32>, String> {
    let mut options = shaderc::CompileOptions::new().map_err(|e| e.to_string())?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
    options.set_target_spirv(shaderc::SpirvVersion::V1_5);
    options.set_optimization_level(shaderc::OptimizationLevel::Performance);
    // Optimising strips the names that bindings go by, unless debug names are asked for.
    options.set_generate_debug_info();
    options.set_auto_bind_uniforms(true);
    for define in &source.defines {
        options.add_macro_definition(define, Some("1"));
    }
    let binary = compiler
        .compile_into_spirv(&source.text, shaderc::ShaderKind::Compute, &source.name, "main", Some(&options))
        .map_err(|e| format!("{}: {}", source.name, source.with_origins(&e.to_string(), &source.name)))?;
    match binary.get_num_warnings() {
        0 => Ok(binary.as_binary().to_vec()),
        _ => {
            let warnings = source.with_origins(&binary.get_warning_messages(), &source.name);
            Err(format!("{}: {warnings}", source.name))
        }
    }
}
