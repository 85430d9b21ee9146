//! Shaders from a folder of GLSL instead of the embedded ones, for shader development. They are compiled when a pipeline needs them, and
//! again when a file changes ([`Watch`]), so that a running view shows every edit.

use super::pipeline_compiler::Wake;
use super::pipelines::{Shaders, embedded};
use crate::shader_source::{self, Source};
use crate::shader_tools::Compiler;
use crate::sync::locked;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

/// Time between two readings of the modification times of the files. There are some fifty files: a reading takes less than a millisecond,
/// needs no crate, and works where the kernel reports nothing, such as on network drives, and with editors that replace files.
const LOOK: Duration = Duration::from_millis(250);

/// A folder of GLSL sources, and the SPIR-V that was compiled from it so far.
pub struct ShaderFolder {
    glsl: PathBuf,
    compiler: Compiler,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    sources: HashMap<String, Arc<Source>>,
    /// The last good SPIR-V of each shader that was compiled.
    compiled: HashMap<String, Arc<Vec<u32>>>,
    /// Those of `compiled` that no pipeline was made of yet, although there may be one of the version before.
    changed: HashSet<String>,
    /// Why a shader does not compile, by name.
    faults: BTreeMap<String, String>,
    /// Why the folder cannot be read.
    unreadable: Option<String>,
    /// Shaders that compile and of which no pipelines can be made, and why.
    refused: Option<(HashSet<String>, String)>,
}

impl ShaderFolder {
    /// Reads the folder, but compiles nothing yet.
    ///
    /// # Errors
    /// There is no compiler, the folder cannot be read or holds no shader, or an include does not exist or includes itself.
    pub fn open(glsl: &Path) -> Result<Arc<ShaderFolder>, String> {
        ShaderFolder::open_with(glsl, Compiler::find()?)
    }

    /// Reads the folder, whose shaders `compiler` will compile, but compiles nothing yet.
    ///
    /// # Errors
    /// The folder cannot be read or holds no shader, or an include does not exist or includes itself.
    pub fn open_with(glsl: &Path, compiler: Compiler) -> Result<Arc<ShaderFolder>, String> {
        let sources = read(glsl)?;
        tracing::info!("shaders: {} from {}, compiled by {}", sources.len(), glsl.display(), compiler.name());
        let state = Mutex::new(State { sources, ..State::default() });
        Ok(Arc::new(ShaderFolder { glsl: glsl.into(), compiler, state }))
    }

    /// A function that returns the shaders of this folder. A shader that does not compile is an error.
    pub fn shaders(self: &Arc<ShaderFolder>) -> Arc<Shaders> {
        let folder = self.clone();
        // Whoever asks names the shader itself.
        Arc::new(move |name| {
            folder.words(name).map_err(|fault| match fault.strip_prefix(&format!("{name}: ")) {
                Some(rest) => rest.to_string(),
                None => fault,
            })
        })
    }

    /// A function that returns the shaders of this folder. For one that does not compile it returns the embedded shader, and [`ShaderFolder::fault`]
    /// reports the fault.
    pub fn shaders_or_embedded(self: &Arc<ShaderFolder>) -> Arc<Shaders> {
        let (folder, embedded) = (self.clone(), embedded());
        Arc::new(move |name| folder.words(name).or_else(|fault| embedded(name).map_err(|_| fault)))
    }

    fn words(&self, name: &str) -> Result<Vec<u32>, String> {
        let source = {
            let state = locked(&self.state);
            if let Some(words) = state.compiled.get(name) {
                return Ok(words.to_vec());
            }
            state.sources.get(name).cloned().ok_or_else(|| format!("is not in {}", self.glsl.display()))?
        };
        let made = self.compiler.compile(&source);
        let mut state = locked(&self.state);
        match &made {
            // Meanwhile the file may have changed.
            Ok(words) if state.sources.get(name).is_some_and(|now| Arc::ptr_eq(now, &source)) => {
                state.faults.remove(name);
                state.compiled.insert(name.into(), Arc::new(words.clone()));
            }
            Ok(_) => {}
            Err(fault) => drop(state.faults.insert(name.into(), fault.clone())),
        }
        made
    }

    /// Why the present sources are not all in use: the first fault, which may have several lines. None if there is no fault.
    pub fn fault(&self) -> Option<String> {
        let state = locked(&self.state);
        let refused = state.refused.iter().map(|(_, fault)| fault);
        state.unreadable.iter().chain(state.faults.values()).chain(refused).next().cloned()
    }

    /// The shaders whose source changed and was compiled since the last call, so that pipelines of them are out of date. None if there are none.
    /// Otherwise refused shaders ([`ShaderFolder::refuse`]) are included until [`ShaderFolder::accept`].
    pub fn take_changed(&self) -> Option<HashSet<String>> {
        let mut state = locked(&self.state);
        let mut changed = std::mem::take(&mut state.changed);
        if !changed.is_empty() {
            changed.extend(state.refused.iter().flat_map(|(shaders, _)| shaders.iter().cloned()));
        }
        Some(changed).filter(|changed| !changed.is_empty())
    }

    /// Notes that no pipelines can be made of these shaders although they compile. `fault`: the reason.
    pub fn refuse(&self, shaders: HashSet<String>, fault: String) {
        tracing::warn!("{fault}");
        locked(&self.state).refused = Some((shaders, fault));
    }

    /// Notes that pipelines were made of all shaders of [`ShaderFolder::take_changed`].
    pub fn accept(&self) {
        locked(&self.state).refused = None;
    }

    /// Reads the folder again and compiles what is different: first what is in use, then the rest, so that its faults are known.
    /// `done` is called after each.
    fn refresh(&self, done: &dyn Fn()) {
        let read = match read(&self.glsl) {
            Ok(read) => read,
            Err(fault) => {
                tracing::warn!("shaders: {fault}");
                locked(&self.state).unreadable = Some(fault);
                return done();
            }
        };
        let (mut used, mut rest) = (Vec::new(), Vec::new());
        {
            let mut state = locked(&self.state);
            state.unreadable = None;
            state.faults.retain(|name, _| read.contains_key(name));
            for (name, source) in read {
                if state.sources.get(&name).is_some_and(|before| before.fingerprint() == source.fingerprint()) {
                    continue;
                }
                if state.compiled.contains_key(&name) { &mut used } else { &mut rest }.push(source.clone());
                state.sources.insert(name, source);
            }
        }
        for group in [used, rest] {
            let made: Vec<_> = group.par_iter().map(|source| self.compiler.compile(source)).collect();
            let mut state = locked(&self.state);
            for (source, made) in group.into_iter().zip(made) {
                let name = source.name.clone();
                match made {
                    Ok(words) => {
                        state.faults.remove(&name);
                        state.compiled.insert(name.clone(), Arc::new(words));
                        state.changed.insert(name);
                    }
                    Err(fault) => {
                        tracing::warn!("{fault}");
                        state.faults.insert(name, fault);
                    }
                }
            }
            drop(state);
            done();
        }
    }
}

fn read(glsl: &Path) -> Result<HashMap<String, Arc<Source>>, String> {
    let sources = shader_source::sources(glsl)?;
    if sources.is_empty() {
        return Err(format!("{}: there are no shaders (*/*.comp)", glsl.display()));
    }
    Ok(sources.into_iter().map(|source| (source.name.clone(), Arc::new(source))).collect())
}

/// A thread that keeps a [`ShaderFolder`] up to date with its files.
pub struct Watch {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Starts the thread. `wake` is called when shaders or the fault changed.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn new(folder: &Arc<ShaderFolder>, wake: Wake) -> Result<Watch, String> {
        let stop = Arc::new(AtomicBool::new(false));
        let (over, folder) = (stop.clone(), folder.clone());
        // Before the thread starts: nothing that is written from now on is missed.
        let mut known = stamps(&folder.glsl);
        let work = move || {
            let mut last = known.clone();
            while !over.load(Ordering::Relaxed) {
                std::thread::park_timeout(LOOK);
                let now = stamps(&folder.glsl);
                // An editor may be half-way: files are read when two looks agree.
                if now != known && now == last {
                    known = now.clone();
                    folder.refresh(&*wake);
                }
                last = now;
            }
        };
        let thread = std::thread::Builder::new().name("shaders".into()).spawn(work);
        Ok(Watch { stop, thread: Some(thread.map_err(|e| format!("watch shaders: {e}"))?) })
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

/// When each file of the folder and of those in it was written last, and its length.
fn stamps(glsl: &Path) -> Vec<(PathBuf, Option<SystemTime>, u64)> {
    let within = |folder: &Path| {
        std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())).collect::<Vec<_>>()
    };
    let files = within(glsl).into_iter().flat_map(|path| if path.is_dir() { within(&path) } else { vec![path] });
    let mut stamps: Vec<_> = files
        .filter_map(|path| std::fs::metadata(&path).ok().map(|about| (path, about.modified().ok(), about.len())))
        .collect();
    stamps.sort();
    stamps
}
