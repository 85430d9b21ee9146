//! Shaders from a folder: those of the system's compilers draw what the embedded ones draw, and a running view draws what was edited.

use super::*;
use crate::common::wait;
use echolume::low_level::gpu::shader_reload::ShaderFolder;
use echolume::low_level::shader_tools::Compiler;
use std::path::Path;

const TONE: &str = "postprocess/assemble.comp";
const TONE_INCLUDE: &str = "include/tone.glsl";
const SLICES: &str = "include/slice_target.glsl";

/// A copy of glsl/ that may be edited.
struct Glsl(Folder);

impl Glsl {
    fn new() -> Glsl {
        let folder = Folder::new("glsl");
        for below in std::fs::read_dir(repository("glsl")).expect("glsl").map(|e| e.expect("entry").path()) {
            let to = folder.join(below.file_name().expect("a name"));
            std::fs::create_dir(&to).expect("create");
            for file in std::fs::read_dir(&below).expect("list").map(|e| e.expect("entry").path()) {
                std::fs::copy(&file, to.join(file.file_name().expect("a name"))).expect("copy");
            }
        }
        Glsl(folder)
    }

    /// The file as it is in the repository, with the text `from` replaced.
    fn edit(&self, name: &str, from: &str, to: &str) {
        let text = std::fs::read_to_string(repository("glsl").join(name)).expect(name);
        assert!(text.contains(from), "{name} has no {from:?}");
        std::fs::write(self.0.join(name), text.replace(from, to)).expect(name);
    }

    fn restore(&self, name: &str) {
        std::fs::copy(repository("glsl").join(name), self.0.join(name)).expect(name);
    }

    fn folder(&self) -> Arc<ShaderFolder> {
        // Without a compiler this is a failure, never a skip: tools/test installs glslc.
        ShaderFolder::open(&self.0).expect("a shader compiler")
    }
}

/// Ticks as a window would, until this is so.
fn until(desk: &mut Desk, what: &str, mut is: impl FnMut(&mut Desk) -> bool) {
    let begun = Instant::now();
    while !is(desk) {
        assert!(begun.elapsed() < BOUND, "{what}: {:?}", desk.console.shader_fault());
        desk.tick(Instant::now() + LATER);
        wait::poll();
    }
}

/// The picture, once it is this one.
fn draws(desk: &mut Desk, what: &str, is: impl Fn(&Picture) -> bool) -> Picture {
    until(desk, what, |desk| {
        desk.rest();
        is(&desk.picture())
    });
    desk.picture()
}

fn negative(picture: &Picture) -> Picture {
    let rgba = picture.rgba.chunks_exact(4).flat_map(|p| [255 - p[0], 255 - p[1], 255 - p[2], p[3]]).collect();
    Picture { rgba, ..*picture }
}

#[test]
fn an_edited_shader_is_drawn_with_and_a_broken_one_leaves_the_last_good_picture() {
    let (device, glsl) = (Device::alone(), Glsl::new());
    let stream = StreamOptions { shaders: Some(glsl.folder()), ..options().stream };
    let mut desk = Desk::new(&device, ConsoleOptions { stream, ..options() });
    desk.begin();
    let first = desk.live(0);
    assert!(difference(&first, &headless(&device, &desk.drawn(), &body(0))).1 <= 1.0, "compiled with other options");

    // A shader of the picture.
    glsl.edit(TONE, "vec4(c, 1.0)", "vec4(1.0 - c, 1.0)");
    let negated = draws(&mut desk, "the edit is not drawn", |now| difference(now, &negative(&first)).1 <= 1.0);

    // One that does not compile, in an include.
    glsl.edit(TONE_INCLUDE, "vec3 toned", "vec3 nonsense;\nvec3 toned() { return unknown; }\nvec3 toned");
    until(&mut desk, "the fault is not reported", |desk| desk.console.shader_fault().is_some());
    let fault = desk.console.shader_fault().expect("a fault").to_string();
    assert!(fault.contains("postprocess/assemble") && fault.contains("include/tone.glsl:"), "{fault}");
    assert!(fault.contains("unknown"), "{fault}");
    desk.rest();
    assert!(desk.picture() == negated, "the last good picture is gone");
    // The view goes on: another volume, and settings that move.
    desk.live(1);
    desk.drag([40.0, 36.0], [50.0, 30.0]);
    desk.rest();
    desk.press(Key::Backspace);
    desk.rest();

    // One that compiles, and does not fit its pass.
    glsl.restore(TONE_INCLUDE);
    glsl.edit(TONE, "screen", "elsewhere");
    until(&mut desk, "the misfit is not reported", |desk| {
        desk.console.shader_fault().is_some_and(|fault| fault.contains("assemble_toned: the pass writes 'screen'"))
    });

    // A shader of the frames: they are sent again.
    glsl.restore(TONE);
    until(&mut desk, "the fault stays", |desk| desk.console.shader_fault().is_none());
    desk.rest();
    let restored = desk.picture();
    let expected = headless(&device, &desk.drawn(), &body(1));
    assert!(difference(&restored, &expected).1 <= 1.0, "what was restored is not drawn");
    glsl.edit(
        SLICES,
        "void write_slice(ivec3 at, float value) {",
        "void write_slice(ivec3 at, float value) {\n    value *= 0.5;",
    );
    draws(&mut desk, "stage 1 is as before", |now| difference(now, &restored).0 > 1.0);
    glsl.restore(SLICES);
    draws(&mut desk, "stage 1 is not restored", |now| difference(now, &restored).1 <= 1.0);
}

#[test]
fn every_compiler_of_the_system_draws_what_the_embedded_shaders_draw() {
    let device = Device::alone();
    let glslang = Compiler::glslang().expect("glslangValidator: tools/test installs it");
    let Compiler::Glslang { validator, .. } = &glslang else { panic!("{}", glslang.name()) };
    let slower = Compiler::Glslang { validator: validator.clone(), optimizer: None };
    let glslc = Compiler::glslc().expect("glslc: tools/test installs it");
    let views = Views::new(&header(0.3), &plain(), Update::Whole).expect("views");
    let scene = views.of(&vec![false; body(0).len()]).into_owned();
    let draw = |shaders| {
        let options = gpu::RendererOptions { shaders, ..gpu::RendererOptions::default() };
        let mut renderer = Renderer::new(&device, scene.clone(), &options).expect("renderer");
        body(0).iter().for_each(|f| renderer.frame(f.slice as u32, &f.bytes, 0).expect("frame"));
        renderer.show(0).expect("show");
        renderer.picture().expect("picture")
    };
    let embedded = draw(gpu::RendererOptions::default().shaders);
    for compiler in [glslc, glslang, slower] {
        let name = compiler.name();
        let folder = ShaderFolder::open_with(Path::new(&repository("glsl")), compiler).expect("shaders");
        assert!(difference(&draw(folder.shaders()), &embedded).1 <= 1.0, "{name}");
    }
}
