//! The resources of a scene's slots, as many as its plan names.

use super::context::Context;
use super::resources::{Buffer, Image, Purpose};
use super::{GpuError, formats};
use crate::passes::Slot;
use crate::passes::slots::{Initializer, Shape};
use crate::plan::Plan;
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::sync::Arc;

pub enum Resource {
    Image(Image),
    Buffer(Buffer),
}

/// Slots by name and, for volumes that take turns, number.
pub struct Slots {
    context: Arc<Context>,
    there: BTreeMap<(Slot, u32), Resource>,
    /// How many volume images take turns.
    images: u32,
}

impl Slots {
    pub fn new(context: &Arc<Context>, images: u32) -> Slots {
        Slots { context: context.clone(), there: BTreeMap::new(), images }
    }

    /// Makes what the plan needs and is not there in this shape, and frees what it does not need. New images are in layout
    /// UNDEFINED: they are returned, to be cleared into GENERAL before their first use.
    ///
    /// # Errors
    /// What the device cannot hold; then nothing new is there.
    pub fn fit(&mut self, plan: &Plan, scene: &Scene) -> Result<Vec<(Slot, u32)>, GpuError> {
        formats::check(&self.context, plan, scene)?;
        self.there.retain(|(slot, _), resource| plan.slots.contains(slot) && resource.is(*slot, scene));
        let mut made = BTreeMap::new();
        for &slot in &plan.slots {
            let copies = if slot.is_multibuffered() { self.images } else { 1 };
            for key in (0..copies).map(|copy| (slot, copy)).filter(|key| !self.there.contains_key(key)) {
                made.insert(key, Resource::new(&self.context, slot, scene)?);
            }
        }
        let is_image = |resource: &Resource| matches!(resource, Resource::Image(_));
        let new = made.iter().filter(|(_, resource)| is_image(resource)).map(|(key, _)| *key).collect();
        let tables: Vec<Slot> = made.iter().filter(|(_, resource)| !is_image(resource)).map(|(key, _)| key.0).collect();
        self.there.extend(made);
        tables.into_iter().for_each(|slot| self.fill(slot, scene));
        Ok(new)
    }

    /// Writes a slot made from the scene, if it is a table; images of that kind go through staging.
    pub fn fill(&mut self, slot: Slot, scene: &Scene) {
        if let (Initializer::ByScene(make), Some(Resource::Buffer(buffer))) =
            (slot.filled(), self.there.get_mut(&(slot, 0)))
        {
            let values = self.context.faults.table(slot, scene, make(scene));
            let bytes: &[u8] = bytemuck::cast_slice(&values);
            let there = buffer.bytes_mut();
            let length = bytes.len().min(there.len());
            there[..length].copy_from_slice(&bytes[..length]);
        }
    }

    /// # Panics
    /// When the plan has no such slot: a pass declares what its plan then lists.
    pub fn get(&self, slot: Slot, turn_image: u32) -> &Resource {
        let key = (slot, if slot.is_multibuffered() { turn_image } else { 0 });
        match self.there.get(&key) {
            Some(resource) => resource,
            None => panic!("slot '{}' {} is not in the plan", slot.name(), key.1),
        }
    }

    pub fn image(&self, slot: Slot, turn_image: u32) -> Option<&Image> {
        match self.there.get(&(slot, if slot.is_multibuffered() { turn_image } else { 0 })) {
            Some(Resource::Image(image)) => Some(image),
            _ => None,
        }
    }

    pub fn buffer_mut(&mut self, slot: Slot) -> Option<&mut Buffer> {
        match self.there.get_mut(&(slot, 0)) {
            Some(Resource::Buffer(buffer)) => Some(buffer),
            _ => None,
        }
    }

    /// Frees everything.
    pub fn clear(&mut self) {
        self.there.clear();
    }

    pub fn iter(&self) -> impl Iterator<Item = (Slot, u32)> {
        self.there.keys().copied()
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

    fn is(&self, slot: Slot, scene: &Scene) -> bool {
        match self {
            Resource::Image(image) => image.shape == slot.shape(scene) && image.format == slot.format(scene),
            Resource::Buffer(buffer) => Shape::Buffer(buffer.size as u32) == slot.shape(scene),
        }
    }
}
