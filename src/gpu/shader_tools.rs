//! GLSL to SPIR-V by a compiler that is found at run time: shaderc if the feature `hot-reload` built it in, else `glslc` or
//! `glslangValidator` of the system. All of them compile with the options of tools/shaders: see `shader_source::OPTIONS`.

use crate::shader_source::Source;
use crate::spirv;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

const NONE: &str = "there is no shader compiler: install glslc (Debian: apt-get install glslc) or glslangValidator \
                    (Debian: apt-get install glslang-tools), or build with `--features hot-reload`";

/// A compiler from GLSL to SPIR-V.
pub enum Compiler {
    #[cfg(feature = "hot-reload")]
    Shaderc,
    Glslc(PathBuf),
    /// `glslangValidator`, which does not optimise for speed; `spirv-opt` does that afterwards, if it is installed.
    Glslang {
        validator: PathBuf,
        optimizer: Option<PathBuf>,
    },
}

impl Compiler {
    /// The first available compiler of shaderc, `glslc` and `glslangValidator`.
    ///
    /// # Errors
    /// No compiler was found.
    pub fn find() -> Result<Compiler, String> {
        #[cfg(feature = "hot-reload")]
        return Ok(Compiler::Shaderc);
        #[cfg(not(feature = "hot-reload"))]
        Compiler::glslc().or_else(Compiler::glslang).ok_or_else(|| NONE.to_string())
    }

    /// `glslc`, if it is in PATH.
    pub fn glslc() -> Option<Compiler> {
        in_path("glslc").map(Compiler::Glslc)
    }

    /// `glslangValidator`, if it is in PATH and the system is a Unix.
    pub fn glslang() -> Option<Compiler> {
        // It writes to files only, and is given the pipe by its name.
        let validator = in_path("glslangValidator").filter(|_| cfg!(unix))?;
        Some(Compiler::Glslang { validator, optimizer: in_path("spirv-opt") })
    }

    pub fn name(&self) -> &'static str {
        match self {
            #[cfg(feature = "hot-reload")]
            Compiler::Shaderc => "shaderc",
            Compiler::Glslc(_) => "glslc",
            Compiler::Glslang { optimizer: Some(_), .. } => "glslangValidator and spirv-opt",
            Compiler::Glslang { optimizer: None, .. } => "glslangValidator (without spirv-opt: slower shaders)",
        }
    }

    /// Compiles one variant. A warning is an error.
    ///
    /// # Errors
    /// The shader's name and the compiler's message, with files and lines below glsl/.
    pub fn compile(&self, source: &Source) -> Result<Vec<u32>, String> {
        let defines = source.defines.iter().map(|define| format!("-D{define}=1"));
        let made = match self {
            #[cfg(feature = "hot-reload")]
            Compiler::Shaderc => {
                let compiler = shaderc::Compiler::new().map_err(|e| e.to_string())?;
                return crate::shader_compile::compile(&compiler, source);
            }
            Compiler::Glslc(program) => {
                let mut command = Command::new(program);
                command.args(["--target-env=vulkan1.3", "--target-spv=spv1.5", "-O", "-g", "-fauto-bind-uniforms"]);
                command.args(["-Werror", "-fshader-stage=comp"]).args(defines).args(["-o", "-", "-"]);
                pipe(&mut command, source.text.as_bytes())
            }
            Compiler::Glslang { validator, optimizer } => {
                let mut command = Command::new(validator);
                command.args(["--stdin", "--quiet", "--target-env", "vulkan1.3", "--target-env", "spirv1.5", "-g"]);
                command.args(["--auto-map-bindings", "-S", "comp"]).args(defines).args(["-o", "/dev/stdout"]);
                let made = pipe(&mut command, source.text.as_bytes());
                match optimizer {
                    None => made,
                    Some(program) => made.and_then(|module| {
                        let mut command = Command::new(program);
                        pipe(
                            command.args(["--target-env=vulkan1.3", "--scalar-block-layout", "-O", "-", "-o", "-"]),
                            &module,
                        )
                    }),
                }
            }
        };
        match made {
            Ok(module) => Ok(spirv::words(&module)),
            // The text came from standard input, which each of them calls another name.
            Err(fault) => {
                let file = if matches!(self, Compiler::Glslc(_)) { "<stdin>" } else { "stdin" };
                Err(format!("{}: {}", source.name, source.with_origins(&fault, file)))
            }
        }
    }
}

/// Runs a program that reads `input` and writes a SPIR-V module.
fn pipe(command: &mut Command, input: &[u8]) -> Result<Vec<u8>, String> {
    let program = PathBuf::from(command.get_program());
    let fault = |e: std::io::Error| format!("{}: {e}", program.display());
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().map_err(fault)?;
    // Where it ended before it read everything, it says why itself. It writes nothing before.
    if let Some(mut pipe) = child.stdin.take() {
        let _ = pipe.write_all(input);
    }
    let output = child.wait_with_output().map_err(fault)?;
    const MAGIC: [u8; 4] = 0x0723_0203u32.to_le_bytes();
    let is_module = output.stdout.starts_with(&MAGIC) && output.stdout.len().is_multiple_of(4);
    if output.status.success() && is_module {
        return Ok(output.stdout);
    }
    let said = if is_module { output.stderr } else { [output.stdout, output.stderr].concat() };
    let said = String::from_utf8_lossy(&said);
    let lines: Vec<&str> = said.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    match lines.is_empty() {
        true => Err(format!("{}: {}", program.display(), output.status)),
        false => Err(lines.join("\n")),
    }
}

/// A program in one of the folders of PATH.
fn in_path(name: &str) -> Option<PathBuf> {
    let name = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    std::env::split_paths(&std::env::var_os("PATH")?).map(|folder| folder.join(&name)).find(|file| file.is_file())
}
