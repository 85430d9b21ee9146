//! The images and buffers of the slots in a scene's plan.

use super::context::Context;
use super::error::GpuError;
use super::formats;
use super::resources::{Buffer, Image, Purpose};
use crate::passes::Slot;
use crate::passes::slots::{Initializer, Shape};
use crate::plan::Plan;
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The memory of a slot.
pub enum Resource {
    Image(Image),
    Buffer(Buffer),
}

/// The allocated slots, by slot and number of the volume image.
pub struct Slots {
    context: Arc<Context>,
    resources: BTreeMap<(Slot, u32), Resource>,
    /// Number of volume images.
    images: u32,
}

impl Slots {
    pub fn new(context: &Arc<Context>, images: u32) -> Slots {
        Slots { context: context.clone(), resources: BTreeMap::new(), images }
    }

    /// Allocates the slots of the plan that are missing or have another shape, and frees those that it does not need. New images are
    /// in layout UNDEFINED. They are returned and must be cleared, which moves them to GENERAL, before their first use.
    ///
    /// # Errors
    /// A slot that the device cannot hold; then nothing new is kept.
    pub fn fit(&mut self, plan: &Plan, scene: &Scene) -> Result<Vec<(Slot, u32)>, GpuError> {
        formats::check(&self.context, plan, scene)?;
        self.resources.retain(|(slot, _), resource| plan.slots.contains(slot) && resource.matches(*slot, scene));
        let mut made = BTreeMap::new();
        for &slot in &plan.slots {
            let copies = if slot.is_multibuffered() { self.images } else { 1 };
            for key in (0..copies).map(|copy| (slot, copy)).filter(|key| !self.resources.contains_key(key)) {
                made.insert(key, Resource::new(&self.context, slot, scene)?);
            }
        }
        let is_image = |resource: &Resource| matches!(resource, Resource::Image(_));
        let new = made.iter().filter(|(_, resource)| is_image(resource)).map(|(key, _)| *key).collect();
        let tables: Vec<Slot> = made.iter().filter(|(_, resource)| !is_image(resource)).map(|(key, _)| key.0).collect();
        self.resources.extend(made);
        tables.into_iter().for_each(|slot| self.fill(slot, scene));
        Ok(new)
    }

    /// Writes a slot that the CPU computes from the scene, if it is a buffer. Images are uploaded through staging instead.
    pub fn fill(&mut self, slot: Slot, scene: &Scene) {
        if let (Initializer::ByScene(make), Some(Resource::Buffer(buffer))) =
            (slot.initializer(), self.resources.get_mut(&(slot, 0)))
        {
            let values = self.context.faults.table(slot, scene, make(scene));
            let bytes: &[u8] = bytemuck::cast_slice(&values);
            let target = buffer.bytes_mut();
            let length = bytes.len().min(target.len());
            target[..length].copy_from_slice(&bytes[..length]);
        }
    }

    /// The memory of a slot.
    ///
    /// # Panics
    /// If the plan has no such slot. A plan lists every slot that its passes declare.
    pub fn get(&self, slot: Slot, image: u32) -> &Resource {
        let key = (slot, if slot.is_multibuffered() { image } else { 0 });
        match self.resources.get(&key) {
            Some(resource) => resource,
            None => panic!("slot '{}' {} is not in the plan", slot.name(), key.1),
        }
    }

    pub fn image(&self, slot: Slot, image: u32) -> Option<&Image> {
        match self.resources.get(&(slot, if slot.is_multibuffered() { image } else { 0 })) {
            Some(Resource::Image(image)) => Some(image),
            _ => None,
        }
    }

    pub fn buffer_mut(&mut self, slot: Slot) -> Option<&mut Buffer> {
        match self.resources.get_mut(&(slot, 0)) {
            Some(Resource::Buffer(buffer)) => Some(buffer),
            _ => None,
        }
    }

    /// Frees everything.
    pub fn clear(&mut self) {
        self.resources.clear();
    }
}

impl Resource {
    fn new(context: &Arc<Context>, slot: Slot, scene: &Scene) -> Result<Resource, GpuError> {
        match slot.shape(scene) {
            Shape::Buffer(bytes) => {
                Buffer::new(context, slot.name(), bytes.into(), Purpose::Table).map(Resource::Buffer)
            }
            shape => Image::new(context, slot, shape, slot.format(scene)).map(Resource::Image),
        }
    }

    /// True if it has the shape and format that the slot has in a scene.
    fn matches(&self, slot: Slot, scene: &Scene) -> bool {
        match self {
            Resource::Image(image) => image.shape == slot.shape(scene) && image.format == slot.format(scene),
            Resource::Buffer(buffer) => Shape::Buffer(buffer.size as u32) == slot.shape(scene),
        }
    }
}
