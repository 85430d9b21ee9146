//! Pipelines made on a thread of their own, so that a view goes on with what it has meanwhile.

use super::{Key, Pipelines};
use crate::gpu::GpuError;
use crate::passes::{DispatchArgs, Pass};
use crate::plan::Plan;
use crate::scene::Scene;
use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

/// Tells whoever sleeps that there is something to look at.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

struct Job {
    key: Key,
    pass: &'static Pass,
    scene: Arc<Scene>,
    args: DispatchArgs,
}

/// The thread, and what it was asked for.
pub struct AsyncPipelineCompiler {
    jobs: Option<Sender<Job>>,
    thread: Option<JoinHandle<()>>,
    asked: HashSet<Key>,
    stop: Arc<AtomicBool>,
    faults: Arc<Mutex<HashMap<Key, String>>>,
}

impl AsyncPipelineCompiler {
    /// `wake` is called when something was made.
    ///
    /// # Errors
    /// A thread that cannot be started.
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
                let is_new = pipelines.there(&key).is_none();
                match pipelines.get(pass, &scene, &args) {
                    Ok(_) => drop(pipelines.context.counts.beside.fetch_add(is_new.into(), Ordering::Relaxed)),
                    Err(fault) => drop(theirs.lock().unwrap_or_else(|e| e.into_inner()).insert(key, fault.to_string())),
                }
                if let Some(wake) = &wake {
                    wake();
                }
            }
        };
        let thread = std::thread::Builder::new().name("pipelines".into()).spawn(work);
        let thread = thread.map_err(|e| GpuError::Memory { doing: "start a thread".into(), fault: e.to_string() })?;
        Ok(AsyncPipelineCompiler { jobs: Some(jobs), thread: Some(thread), asked: HashSet::new(), stop, faults })
    }

    /// Whether everything that a scene's plan needs is made; what is not is made from now on.
    ///
    /// # Errors
    /// Something of it cannot be made.
    pub fn prepare(&mut self, pipelines: &Pipelines, plan: &Plan, scene: &Scene) -> Result<bool, GpuError> {
        let mut shared = None;
        let mut is_ready = true;
        for step in &plan.steps {
            let args = step.args();
            let key = Pipelines::key(step.pass, scene, &args);
            if pipelines.there(&key).is_some() {
                continue;
            }
            if let Some(fault) = self.faults.lock().unwrap_or_else(|e| e.into_inner()).get(&key) {
                return Err(GpuError::Shader { shader: key.0.into(), fault: fault.clone() });
            }
            is_ready = false;
            if self.asked.insert(key.clone()) {
                let scene = shared.get_or_insert_with(|| Arc::new(scene.clone())).clone();
                // A thread that broke down makes nothing more: what it lacks is then made at its use.
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
