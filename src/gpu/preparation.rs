//! Compiles the pipelines of a scene before its renderer is made, on threads of its own, so that a window stays responsive.

use super::context::Context;
use super::error::GpuError;
use super::pipeline_compiler::Wake;
use super::pipelines::{Pipeline, embedded};
use super::renderer::RendererOptions;
use super::scene_compiler::SceneCompiler;
use crate::scene::Scene;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;

/// The compiled pipelines of a scene. As long as this lives, a renderer that is made for the scene compiles none of them.
pub struct Prepared {
    _compiler: SceneCompiler,
    _made: Vec<Arc<Pipeline>>,
}

/// The compilation in the background of the pipelines of a scene.
pub struct Preparation {
    progress: Arc<Progress>,
    thread: Option<JoinHandle<Result<Prepared, GpuError>>>,
}

/// Tells at the end of a thread that it ended, also if it panicked.
struct End {
    progress: Arc<Progress>,
    wake: Wake,
}

impl Drop for End {
    fn drop(&mut self) {
        self.progress.is_finished.store(true, Ordering::Release);
        (self.wake)();
    }
}

#[derive(Default)]
struct Progress {
    done: AtomicUsize,
    count: AtomicUsize,
    is_cancelled: AtomicBool,
    is_finished: AtomicBool,
}

impl Preparation {
    /// Begins to compile the pipelines that a renderer of this scene with these options will need. `wake` is called whenever
    /// [`Preparation::progress`] changes, and at the end. None if the options have shaders from a folder, because renderers do not share the
    /// pipelines of those.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn begin(
        context: &Arc<Context>,
        scene: Scene,
        options: &RendererOptions,
        wake: Wake,
    ) -> Result<Option<Preparation>, GpuError> {
        if !Arc::ptr_eq(&options.shaders, &embedded()) {
            return Ok(None);
        }
        let (context, options) = (context.clone(), RendererOptions { wake: None, ..options.clone() });
        let progress = Arc::new(Progress::default());
        let own = progress.clone();
        let work = move || {
            let _end = End { progress: own.clone(), wake: wake.clone() };
            let compiler = options.compiler(&context)?;
            let (scene, plan) = compiler.plan(scene);
            let goes_on = |done: usize, count: usize| {
                own.count.store(count, Ordering::Relaxed);
                // Two may end at the same time.
                own.done.fetch_max(done, Ordering::Relaxed);
                wake();
                !own.is_cancelled.load(Ordering::Relaxed)
            };
            let made = compiler.compile_while(&plan, &scene, &goes_on)?;
            let count = own.done.load(Ordering::Relaxed) as u64;
            context.counts.async_pipelines.fetch_add(count, Ordering::Relaxed);
            Ok(Prepared { _compiler: compiler, _made: made })
        };
        let thread = std::thread::Builder::new().name("preparing".into()).spawn(work);
        let thread =
            thread.map_err(|e| GpuError::Memory { operation: "start a thread".into(), fault: e.to_string() })?;
        Ok(Some(Preparation { progress, thread: Some(thread) }))
    }

    /// Number of pipelines that this preparation has compiled so far, and the number that it has to compile. Both are 0 until the second is known.
    pub fn progress(&self) -> [usize; 2] {
        [&self.progress.done, &self.progress.count].map(|count| count.load(Ordering::Relaxed))
    }

    pub fn is_finished(&self) -> bool {
        self.progress.is_finished.load(Ordering::Acquire)
            || self.thread.as_ref().is_none_or(|thread| thread.is_finished())
    }

    /// Starts the compilation of no further pipeline, and does not wait for those that are being compiled.
    pub fn cancel(&self) {
        self.progress.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Waits until the thread has ended: after [`Preparation::cancel`] the result holds only the pipelines so far. None if the thread panicked: the
    /// renderer then compiles the pipelines itself and reports the fault.
    ///
    /// # Errors
    /// The error with which a renderer of the scene would fail.
    pub fn finish(mut self) -> Result<Option<Prepared>, GpuError> {
        self.thread.take().and_then(|thread| thread.join().ok()).transpose()
    }
}

impl Drop for Preparation {
    /// Waits for the pipelines in the making: a program that ends while its driver compiles on another thread may crash in that driver.
    fn drop(&mut self) {
        self.cancel();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
