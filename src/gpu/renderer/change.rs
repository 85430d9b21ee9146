//! Another scene: what differs is made anew, the rest stays.

use super::*;

impl Renderer {
    /// Whether a scene is another than the one that is shown, what the device decides of it aside.
    pub fn is_other(&self, scene: &Scene) -> bool {
        (&scene.geometry, &scene.settings, scene.input, scene.seen)
            != (&self.scene.geometry, &self.scene.settings, self.scene.input, self.scene.seen)
    }

    /// Whether nothing can be drawn until a change succeeds.
    pub fn is_broken(&self) -> bool {
        self.broken.is_some()
    }

    /// Whether a change to this scene would find every pipeline made; those that are not are made from now on, beside the drawing, and
    /// [`Options::wake`] is called.
    ///
    /// # Errors
    /// A shader that does not compile, a slot that the device cannot hold.
    pub fn prepare(&mut self, scene: &Scene) -> Result<bool, GpuError> {
        let scene = super::super::formats::suited(&self.context, self.fetch, scene.clone());
        let plan = Plan::new(&scene);
        super::super::formats::check(&self.context, &plan, &scene)?;
        let beside = match &mut self.beside {
            Some(beside) => beside,
            None => self.beside.insert(AsyncPipelineCompiler::new(&self.pipelines, self.wake.clone())?),
        };
        beside.prepare(&self.pipelines, &plan, &scene)
    }

    /// Takes a new scene. What it changes is run with the next picture; when it says `Everything` or `Frames`, frames have to
    /// be sent again first.
    ///
    /// # Errors
    /// A shader that does not compile or a slot that the device cannot hold at all leaves the old scene as it was. When memory
    /// runs out half-way nothing can be drawn until another change succeeds; that one builds everything anew.
    pub fn change(&mut self, scene: Scene) -> Result<Rerun, GpuError> {
        let scene = super::super::formats::suited(&self.context, self.fetch, scene);
        let plan = Plan::new(&scene);
        // What was seen before a region shrank is still there.
        let before = Scene { seen: self.filtered, ..self.scene.clone() };
        let rerun = if self.broken.is_some() { Rerun::Everything } else { plan.rerun(&before, &scene) };
        super::super::formats::check(&self.context, &plan, &scene)?;
        let steps = pipelines_of(&self.pipelines, &plan, &scene)?;
        // Frames that are on their way use nothing that a change of pictures alone touches: only the picture is waited for.
        let touched = |slots: &[Slot]| {
            plan.steps_of(Frequency::Frame).any(|(_, s)| s.reads(&scene).iter().any(|r| slots.contains(r)))
        };
        self.wait_presented()?;
        match &rerun {
            Rerun::Steps { slots, .. } if !touched(slots) => self.wait_drawn()?,
            _ => self.collect()?,
        }
        let kept: Vec<_> = self.plan.steps.iter().zip(&self.stale).filter(|s| *s.1).map(|s| s.0.id()).collect();
        self.stale = plan.steps.iter().map(|s| kept.contains(&s.id())).collect();
        (self.plan, self.steps, self.scene) = (plan, steps, scene);
        self.broken = None;
        if !matches!(rerun, Rerun::Steps { .. }) {
            self.filtered = self.scene.seen;
        }
        self.rebuild(&rerun).inspect_err(|error| self.broken = Some(error.to_string()))?;
        Ok(rerun)
    }

    /// Waits until what was shown last has been taken from the picture's image.
    fn wait_presented(&self) -> Result<(), GpuError> {
        self.timelines.of(0).wait(self.presented)
    }

    /// Makes pipelines anew of shaders that are other ones now, by name. Says what has to run again, as [`Renderer::change`].
    ///
    /// # Errors
    /// A shader that is not there, or that disagrees with its pass's declaration: the pipelines before stay.
    pub fn renew_shaders(&mut self, shaders: &HashSet<String>) -> Result<Rerun, GpuError> {
        if let Some(fault) = &self.broken {
            return Err(GpuError::Broken(fault.clone()));
        }
        // It may be making some of the old ones.
        self.beside = None;
        self.wait_presented()?;
        self.collect()?;
        self.steps = self.pipelines.renew(shaders, &self.plan, &self.scene)?;
        let rerun = self.plan.rerun_shaders(&self.scene, |shader| shaders.contains(shader));
        self.rebuild(&rerun).inspect_err(|error| self.broken = Some(error.to_string()))?;
        Ok(rerun)
    }

    fn rebuild(&mut self, rerun: &Rerun) -> Result<(), GpuError> {
        let refilled = match rerun {
            Rerun::Steps { steps, slots } => {
                steps.iter().for_each(|i| self.stale[*i] = true);
                if steps.iter().any(|i| self.plan.steps[*i].pass.frequency == Frequency::Volume) {
                    self.forget_volumes();
                }
                slots.clone()
            }
            Rerun::Frames | Rerun::Everything => {
                self.stale.iter_mut().for_each(|stale| *stale = true);
                self.forget_volumes();
                if *rerun == Rerun::Everything {
                    // Their bytes lie in lanes that go.
                    self.torn += u64::from(self.arriving.take().is_some());
                    self.slab = None;
                    self.slots.clear();
                    self.lanes = self.new_lanes()?;
                    self.next_lane = 0;
                }
                self.plan.slots.clone()
            }
        };
        self.fit()?;
        for slot in refilled {
            self.fill(slot)?;
        }
        if self.readback.as_ref().is_some_and(|r| r.size != Slot::Screen.bytes(&self.scene)) {
            self.readback = Some(readback(&self.context, &self.scene)?);
        }
        Ok(())
    }
}
