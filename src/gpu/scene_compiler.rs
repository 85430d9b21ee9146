//! Prepares scenes for a device: makes their plans, and compiles the pipelines of these at once or in the background.

use super::context::Context;
use super::error::GpuError;
use super::formats::{self, TexelAccess};
use super::pipeline_compiler::{AsyncPipelineCompiler, SceneMaker, Wake};
use super::pipelines::{GoesOn, Pipelines, PlanPipelines, Shaders};
use crate::plan::Plan;
use crate::scene::{DeviceFacts, Scene};
use std::collections::HashSet;
use std::sync::Arc;

/// Makes plans of scenes and compiles their pipelines, at once or in the background.
pub(super) struct SceneCompiler {
    /// Started at its first use. It ends before the pipelines do.
    background: Option<AsyncPipelineCompiler>,
    pub pipelines: Arc<Pipelines>,
    /// How single texels are read.
    pub texel_access: TexelAccess,
    frames_at_once: Option<u32>,
    wake: Option<Wake>,
}

impl SceneCompiler {
    /// The arguments have the meaning of the fields of the same names of the renderer's options.
    ///
    /// # Errors
    /// The device fails.
    pub fn new(
        context: &Arc<Context>,
        shaders: &Arc<Shaders>,
        texel_access: Option<TexelAccess>,
        frames_at_once: Option<u32>,
        wake: Option<Wake>,
    ) -> Result<SceneCompiler, GpuError> {
        let texel_access = texel_access.unwrap_or(TexelAccess::for_device(&context.candidate));
        let pipelines = Pipelines::shared(context, shaders.clone(), texel_access)?;
        Ok(SceneCompiler { background: None, pipelines, texel_access, frames_at_once, wake })
    }

    /// The scene with the fields that depend on the device set, and its plan.
    pub fn plan(&self, scene: Scene) -> (Scene, Plan) {
        let adapted = formats::adapt_scene(&self.pipelines.context, self.texel_access, scene);
        let frames_at_once = self.frames_at_once.unwrap_or(adapted.device.frames_at_once);
        let scene = Scene { device: DeviceFacts { frames_at_once, ..adapted.device }, ..adapted };
        let plan = Plan::new(&scene);
        (scene, plan)
    }

    /// The pipelines of a plan, one for each step. Before the first and after each that is compiled, `goes_on` is called with the number of compiled
    /// pipelines and the total; if it returns false, the rest is not compiled and missing in the result.
    ///
    /// # Errors
    /// The device cannot hold a slot, or a shader does not compile.
    pub(crate) fn compile_while(&self, plan: &Plan, scene: &Scene, goes_on: &GoesOn) -> PlanPipelines {
        formats::check(&self.pipelines.context, plan, scene)?;
        self.pipelines.of_plan_while(plan, scene, goes_on)
    }

    /// The pipelines of a plan, one for each step.
    ///
    /// # Errors
    /// The device cannot hold a slot, or a shader does not compile.
    pub fn compile(&self, plan: &Plan, scene: &Scene) -> PlanPipelines {
        self.compile_while(plan, scene, &|_, _| true)
    }

    /// The pipelines of a plan after those that use `shaders` were compiled again. This ends compilation in the background, which may use the
    /// previous source of a shader.
    pub(crate) fn recompile(&mut self, shaders: &HashSet<String>, plan: &Plan, scene: &Scene) -> PlanPipelines {
        self.background = None;
        self.pipelines.recompile(shaders, plan, scene)
    }

    /// True if every pipeline of the scene is compiled. Otherwise the missing ones are compiled in the background from now on.
    ///
    /// # Errors
    /// A shader does not compile, the device cannot hold a slot, or the thread cannot be started.
    pub fn prepare(&mut self, scene: &Scene) -> Result<bool, GpuError> {
        let (scene, plan) = self.plan(scene.clone());
        formats::check(&self.pipelines.context, &plan, &scene)?;
        self.background()?.prepare(&plan, &scene)
    }

    fn background(&mut self) -> Result<&mut AsyncPipelineCompiler, GpuError> {
        let background = match self.background.take() {
            Some(background) => background,
            None => AsyncPipelineCompiler::new(&self.pipelines, self.texel_access, self.wake.clone())?,
        };
        Ok(self.background.insert(background))
    }

    /// Compiles the pipelines of these scenes in the background whenever no requested pipeline is missing. They replace the scenes of an earlier
    /// call.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn warm(&mut self, scenes: Vec<SceneMaker>) -> Result<(), GpuError> {
        self.background()?.warm(scenes);
        Ok(())
    }

    /// Drops the scenes of [`SceneCompiler::warm`] whose pipelines are not compiled yet.
    pub fn stop_warming(&self) {
        self.background.iter().for_each(AsyncPipelineCompiler::stop_warming);
    }

    /// True while pipelines of [`SceneCompiler::warm`] are left to compile.
    pub fn is_warming(&self) -> bool {
        self.background.as_ref().is_some_and(AsyncPipelineCompiler::is_warming)
    }
}
