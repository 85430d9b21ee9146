//! Compiles pipelines on a background thread, so that drawing goes on meanwhile.

use super::error::GpuError;
use super::pipelines::{Key, Pipelines};
use crate::passes::{DispatchArgs, Pass};
use crate::plan::Plan;
use crate::scene::Scene;
use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

/// Wakes the event loop of a view.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

struct Job {
    key: Key,
    pass: &'static Pass,
    scene: Arc<Scene>,
    args: DispatchArgs,
}

/// A thread that compiles pipelines, and its requests.
pub struct AsyncPipelineCompiler {
    jobs: Option<Sender<Job>>,
    thread: Option<JoinHandle<()>>,
    asked: HashSet<Key>,
    stop: Arc<AtomicBool>,
    faults: Arc<Mutex<HashMap<Key, String>>>,
}

impl AsyncPipelineCompiler {
    /// `wake` is called after each pipeline.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn new(pipelines: &Arc<Pipelines>, wake: Option<Wake>) -> Result<AsyncPipelineCompiler, GpuError> {
        let (jobs, asked_for) = channel::<Job>();
        let faults = Arc::new(Mutex::new(HashMap::new()));
        let stop = Arc::new(AtomicBool::new(false));
        let (theirs, pipelines, over) = (faults.clone(), pipelines.clone(), stop.clone());
        let work = move || {
            for Job { key, pass, scene, args } in asked_for {
                if over.load(Ordering::Relaxed) {
                    break;
                }
                let is_new = pipelines.cached(&key).is_none();
                match pipelines.get(pass, &scene, &args) {
                    Ok(_) => drop(pipelines.context.counts.async_pipelines.fetch_add(is_new.into(), Ordering::Relaxed)),
                    Err(fault) => drop(theirs.lock().unwrap_or_else(|e| e.into_inner()).insert(key, fault.to_string())),
                }
                if let Some(wake) = &wake {
                    wake();
                }
            }
        };
        let thread = std::thread::Builder::new().name("pipelines".into()).spawn(work);
        let thread =
            thread.map_err(|e| GpuError::Memory { operation: "start a thread".into(), fault: e.to_string() })?;
        Ok(AsyncPipelineCompiler { jobs: Some(jobs), thread: Some(thread), asked: HashSet::new(), stop, faults })
    }

    /// True if every pipeline of a plan is compiled; requests those that are not.
    ///
    /// # Errors
    /// A pipeline that could not be compiled.
    pub fn prepare(&mut self, pipelines: &Pipelines, plan: &Plan, scene: &Scene) -> Result<bool, GpuError> {
        let mut shared = None;
        let mut is_ready = true;
        for step in &plan.steps {
            let args = step.args();
            let key = Pipelines::key(step.pass, scene, &args);
            if pipelines.cached(&key).is_some() {
                continue;
            }
            if let Some(fault) = self.faults.lock().unwrap_or_else(|e| e.into_inner()).get(&key) {
                return Err(GpuError::Shader { shader: key.0.into(), fault: fault.clone() });
            }
            is_ready = false;
            if self.asked.insert(key.clone()) {
                let scene = shared.get_or_insert_with(|| Arc::new(scene.clone())).clone();
                // If the thread has died, pipelines are compiled at their first use.
                let sent =
                    self.jobs.as_ref().is_some_and(|j| j.send(Job { key, pass: step.pass, scene, args }).is_ok());
                is_ready |= !sent;
            }
        }
        Ok(is_ready)
    }
}

impl Drop for AsyncPipelineCompiler {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
