//! A thread that compiles pipelines in the background, so that drawing goes on meanwhile. It first compiles those that drawing waits for,
//! then those of scenes that may come next.

use super::error::GpuError;
use super::formats::{self, TexelAccess};
use super::host_memory;
use super::pipelines::{Key, Pipeline, Pipelines};
use crate::passes::{DispatchArgs, Pass};
use crate::plan::Plan;
use crate::scene::Scene;
use crate::sync::locked;
use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A function that wakes the event loop of the viewer's window.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// A function that makes a scene which may be shown next. None if its settings cannot be drawn.
pub type SceneMaker = Box<dyn FnOnce() -> Option<Scene> + Send>;

/// Longest pause after a pipeline that nobody waits for.
const MAX_PAUSE: Duration = Duration::from_millis(200);

struct Job {
    key: Key,
    pass: &'static Pass,
    scene: Arc<Scene>,
    args: DispatchArgs,
}

/// What the thread has to do.
#[derive(Default)]
struct Queue {
    /// What drawing waits for.
    asked: VecDeque<Job>,
    /// The keys of `asked`, and of the pipeline in the making. A pipeline that was compiled and forgotten can be asked for again.
    pending: HashSet<Key>,
    /// Scenes that may come next, and the pipelines of the one that was taken last.
    scenes: VecDeque<SceneMaker>,
    in_advance: VecDeque<Job>,
    /// The thread works on a scene or a pipeline of those two.
    is_warming: bool,
    /// Pipelines compiled in advance so far.
    warmed: usize,
    is_over: bool,
}

/// The next piece of work.
enum Work {
    Asked(Job),
    InAdvance(Job),
    Scene(SceneMaker),
}

impl Queue {
    fn next(&mut self) -> Option<Work> {
        let asked = self.asked.pop_front().map(Work::Asked);
        let work = asked.or_else(|| self.in_advance.pop_front().map(Work::InAdvance));
        let work = work.or_else(|| self.scenes.pop_front().map(Work::Scene));
        self.is_warming = matches!(work, Some(Work::InAdvance(_) | Work::Scene(_)));
        work
    }

    fn stop_warming(&mut self) {
        self.scenes.clear();
        self.in_advance.clear();
        self.is_warming = false;
    }
}

/// Shared by the thread and whoever asks it.
#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    faults: Mutex<HashMap<Key, String>>,
}

/// A thread that compiles pipelines in the background, and what was requested of it.
pub(crate) struct AsyncPipelineCompiler {
    shared: Arc<Shared>,
    pipelines: Arc<Pipelines>,
    /// Those of the plan that was asked for last: none is forgotten before all of them are compiled.
    held: Vec<Arc<Pipeline>>,
    thread: Option<JoinHandle<()>>,
}

impl AsyncPipelineCompiler {
    /// `wake` is called after each pipeline that drawing waits for.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn new(
        pipelines: &Arc<Pipelines>,
        texel_access: TexelAccess,
        wake: Option<Wake>,
    ) -> Result<AsyncPipelineCompiler, GpuError> {
        let shared = Arc::new(Shared::default());
        let worker = Worker { shared: shared.clone(), pipelines: pipelines.clone(), texel_access, wake };
        let thread = std::thread::Builder::new().name("pipelines".into()).spawn(move || worker.run());
        let thread =
            thread.map_err(|e| GpuError::Memory { operation: "start a thread".into(), fault: e.to_string() })?;
        Ok(AsyncPipelineCompiler { shared, pipelines: pipelines.clone(), held: Vec::new(), thread: Some(thread) })
    }

    /// True if every pipeline of a plan is compiled; otherwise requests the missing ones. Also true if the thread has died, because missing pipelines
    /// are then compiled at their first use.
    ///
    /// # Errors
    /// A pipeline could not be compiled.
    pub fn prepare(&mut self, plan: &Plan, scene: &Scene) -> Result<bool, GpuError> {
        // If the thread has died, pipelines are compiled at their first use.
        let is_alive = self.thread.as_ref().is_some_and(|thread| !thread.is_finished());
        let mut shared = None;
        let mut is_ready = true;
        let mut held = Vec::new();
        for step in &plan.steps {
            let args = step.args();
            let key = self.pipelines.key(step.pass, scene, &args);
            if let Some(pipeline) = self.pipelines.cached(&key) {
                held.push(pipeline);
                continue;
            }
            if let Some(fault) = locked(&self.shared.faults).get(&key) {
                return Err(GpuError::Shader { shader: key.0.into(), fault: fault.clone() });
            }
            is_ready &= !is_alive;
            let mut queue = locked(&self.shared.queue);
            if queue.pending.insert(key.clone()) {
                let scene = shared.get_or_insert_with(|| Arc::new(scene.clone())).clone();
                queue.asked.push_back(Job { key, pass: step.pass, scene, args });
                self.shared.changed.notify_one();
            }
        }
        self.held = held;
        Ok(is_ready)
    }

    /// Compiles the pipelines of these scenes whenever no requested pipeline is missing. They replace the scenes of an earlier call.
    pub fn warm(&self, scenes: Vec<SceneMaker>) {
        let mut queue = locked(&self.shared.queue);
        queue.stop_warming();
        queue.warmed = 0;
        queue.scenes.extend(scenes);
        self.shared.changed.notify_one();
    }

    /// Drops the scenes of [`AsyncPipelineCompiler::warm`] whose pipelines are not compiled yet.
    pub fn stop_warming(&self) {
        locked(&self.shared.queue).stop_warming();
    }

    /// True while pipelines of [`AsyncPipelineCompiler::warm`] are left to compile.
    pub fn is_warming(&self) -> bool {
        let queue = locked(&self.shared.queue);
        queue.is_warming || !queue.scenes.is_empty() || !queue.in_advance.is_empty()
    }
}

impl Drop for AsyncPipelineCompiler {
    fn drop(&mut self) {
        locked(&self.shared.queue).is_over = true;
        self.shared.changed.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The thread's side.
struct Worker {
    shared: Arc<Shared>,
    pipelines: Arc<Pipelines>,
    texel_access: TexelAccess,
    wake: Option<Wake>,
}

impl Worker {
    fn run(self) {
        let mut has_compiled = false;
        loop {
            let mut queue = locked(&self.shared.queue);
            if queue.is_over {
                return;
            }
            let Some(work) = queue.next() else {
                if has_compiled {
                    // Nothing is left: a program that is killed later has this on disk.
                    has_compiled = false;
                    drop(queue);
                    let context = &self.pipelines.context;
                    context.pipeline_cache.store(&context.device);
                    // Compilers of drivers need much memory for a short time.
                    host_memory::give_back();
                    continue;
                }
                drop(self.shared.changed.wait(queue));
                continue;
            };
            drop(queue);
            match work {
                Work::Asked(job) => {
                    if let Err(fault) = self.compile(&job) {
                        locked(&self.shared.faults).insert(job.key.clone(), fault.to_string());
                    }
                    locked(&self.shared.queue).pending.remove(&job.key);
                    has_compiled = true;
                    if let Some(wake) = &self.wake {
                        wake();
                    }
                }
                Work::InAdvance(job) => {
                    let begun = Instant::now();
                    match self.compile(&job) {
                        Ok(_) => has_compiled = true,
                        // It is reported if it is ever asked for.
                        Err(fault) => tracing::debug!("compiled in advance: {fault}"),
                    }
                    self.pause(begun.elapsed().min(MAX_PAUSE));
                }
                Work::Scene(make) => self.look_at(make),
            }
        }
    }

    /// Compiles a pipeline unless it is compiled.
    fn compile(&self, job: &Job) -> Result<(), GpuError> {
        let is_new = self.pipelines.cached(&job.key).is_none();
        self.pipelines.get(job.pass, &job.scene, &job.args)?;
        self.pipelines.context.counts.async_pipelines.fetch_add(is_new.into(), Ordering::Relaxed);
        Ok(())
    }

    /// Lines up the pipelines of a scene that are missing.
    fn look_at(&self, make: SceneMaker) {
        let context = &self.pipelines.context;
        let Some(scene) = make() else { return };
        let scene = formats::adapt_scene(context, self.texel_access, scene);
        let plan = Plan::new(&scene);
        if formats::check(context, &plan, &scene).is_err() {
            return;
        }
        let scene = Arc::new(scene);
        let mut lined_up = HashSet::new();
        let missing = plan.steps.iter().filter_map(|step| {
            let (args, pass) = (step.args(), step.pass);
            let key = self.pipelines.key(pass, &scene, &args);
            let is_missing = self.pipelines.cached(&key).is_none() && lined_up.insert(key.clone());
            is_missing.then(|| Job { key, pass, scene: scene.clone(), args })
        });
        let missing: Vec<Job> = missing.collect();
        let mut queue = locked(&self.shared.queue);
        // Meanwhile the user may have acted, and warming ended.
        if queue.is_warming {
            // Fewer than are kept, so that none of them is forgotten for another.
            let room = (context.max_unused_pipelines / 2).saturating_sub(queue.warmed);
            queue.warmed += missing.len().min(room);
            queue.in_advance.extend(missing.into_iter().take(room));
        }
    }

    /// Leaves the processor to others for a time, unless there is something to do that drawing waits for.
    fn pause(&self, time: Duration) {
        let waits = |queue: &mut Queue| queue.asked.is_empty() && !queue.is_over;
        drop(self.shared.changed.wait_timeout_while(locked(&self.shared.queue), time, waits));
    }
}
