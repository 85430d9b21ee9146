//! Buffers that the host fills and the device reads, and buffers that return results. The memory that is fastest to write is slow to read,
//! because it is not cached. So the first kind has no method that reads its memory, and the second kind lies in cached memory.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::memory::{Reserve, free, reserve};
use crate::passes::fault_injection::Command;
use crate::passes::slots::{Format, Shape};
use crate::passes::{Slot, Texels};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use std::borrow::Cow;
use std::mem::MaybeUninit;
use std::ops::Range;
use std::sync::Arc;

/// A buffer and its memory, which stays mapped as long as the buffer lives, except with [`Purpose::Groups`]. The host reads only
/// [`Purpose::Readback`] buffers.
pub struct Buffer {
    context: Arc<Context>,
    pub handle: vk::Buffer,
    pub size: u64,
    /// For a lookup table: views with texels of one, two and four floats.
    texels: [vk::BufferView; 3],
    allocation: Option<Allocation>,
}

/// The purpose of a buffer, which decides its kind of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A lookup table that shaders read.
    Table,
    /// Parameters of passes (a uniform buffer), written by the CPU.
    Params,
    /// Data to upload, written by the CPU.
    Staging,
    /// Results that the CPU reads.
    Readback,
    /// Numbers of workgroups for indirect dispatches, written by the device.
    Groups,
}

const TEXELS: [vk::Format; 3] = [vk::Format::R32_SFLOAT, vk::Format::R32G32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT];

/// True if a lookup table of this size can be a texel buffer, whatever the size of its entries.
pub(crate) fn has_texels(context: &Context, bytes: u64) -> bool {
    bytes >= 16 && bytes / 4 <= u64::from(context.candidate.limits.max_texel_buffer_elements)
}

/// The index of the memory type for results that the host reads, and whether the type is coherent. Reading uncached memory takes up to 87
/// times as long as reading cached memory. So cached memory that must be invalidated is preferred to coherent memory that is not cached:
/// several GPUs of Intel (GLK, MTL, ARL, LNL) have no type that is both.
fn readback_type(types: &[vk::MemoryType], allowed: u32) -> Option<(u32, bool)> {
    use vk::MemoryPropertyFlags as M;
    // Memory of this kind must not be allocated without its feature.
    let excluded = M::DEVICE_COHERENT_AMD | M::DEVICE_UNCACHED_AMD | M::PROTECTED;
    [M::HOST_CACHED | M::HOST_COHERENT, M::HOST_CACHED, M::HOST_COHERENT].into_iter().find_map(|wanted| {
        let fits = |flags: M| flags.contains(M::HOST_VISIBLE | wanted) && !flags.intersects(excluded);
        let found = types.iter().enumerate().find(|(n, kind)| allowed >> n & 1 == 1 && fits(kind.property_flags));
        found.map(|(n, kind)| (n as u32, kind.property_flags.contains(M::HOST_COHERENT)))
    })
}

impl Buffer {
    /// Makes a buffer of `size` bytes. `name` is for captures and messages.
    ///
    /// # Errors
    /// The device does not allow the size, is out of memory, or fails.
    pub fn new(context: &Arc<Context>, name: &str, size: u64, purpose: Purpose) -> Result<Buffer, GpuError> {
        let operation = || format!("create buffer '{name}' ({} KiB)", size.div_ceil(1024));
        let usage = match purpose {
            Purpose::Table => vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER,
            Purpose::Params => vk::BufferUsageFlags::UNIFORM_BUFFER,
            Purpose::Staging => vk::BufferUsageFlags::TRANSFER_SRC,
            Purpose::Readback => vk::BufferUsageFlags::TRANSFER_DST,
            Purpose::Groups => vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::INDIRECT_BUFFER,
        };
        let allowed = context.candidate.max_buffer;
        if size > allowed {
            return Err(GpuError::Limit { what: operation(), needed: size, allowed });
        }
        let create = vk::BufferCreateInfo::default().size(size.max(4)).usage(usage);
        let device = &context.device;
        // SAFETY: the create structure is complete.
        let handle = unsafe { device.create_buffer(&create, None) }.context(operation)?;
        let mut buffer =
            Buffer { context: context.clone(), handle, size, texels: Default::default(), allocation: None };
        // SAFETY: the buffer was just made by this device.
        let mut requirements = unsafe { device.get_buffer_memory_requirements(handle) };
        let location = match purpose {
            Purpose::Readback => {
                // SAFETY: the handle belongs to this instance; the call only reads.
                let there = unsafe { context.instance.get_physical_device_memory_properties(context.candidate.handle) };
                if let Some((kind, is_coherent)) =
                    readback_type(there.memory_types_as_slice(), requirements.memory_type_bits)
                {
                    requirements.memory_type_bits = 1 << kind;
                    if !is_coherent {
                        // What is invalidated belongs to this buffer alone.
                        let atom = context.candidate.limits.non_coherent_atom_size.max(1);
                        requirements.alignment = requirements.alignment.max(atom);
                        requirements.size = requirements.size.next_multiple_of(atom);
                    }
                }
                MemoryLocation::Unknown
            }
            Purpose::Groups => MemoryLocation::GpuOnly,
            _ => MemoryLocation::CpuToGpu,
        };
        let wanted = Reserve { name, requirements, location, linear: true };
        let allocation = reserve(context, wanted, &operation)?;
        // SAFETY: the allocation fits the requirements and lives as long as the buffer.
        let bound = unsafe { device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) };
        buffer.allocation = Some(allocation);
        bound.context(operation)?;
        context.name(handle, name);
        if let Some(poison) = context.faults.poisoned() {
            buffer.space().fill(MaybeUninit::new(poison.byte));
            if let Some(range) = buffer.range_to_invalidate() {
                // SAFETY: the range is aligned and inside mapped memory.
                unsafe { device.flush_mapped_memory_ranges(&[range]) }.context(operation)?;
            }
        }
        if purpose == Purpose::Table && has_texels(context, size) {
            for (n, format) in TEXELS.into_iter().enumerate() {
                let create = vk::BufferViewCreateInfo::default().buffer(handle).format(format).range(vk::WHOLE_SIZE);
                // SAFETY: the buffer is bound to memory and alive; every device has these formats as texel buffers.
                buffer.texels[n] = unsafe { device.create_buffer_view(&create, None) }.context(operation)?;
                context.name(buffer.texels[n], name);
            }
        }
        Ok(buffer)
    }

    /// The view of a lookup table with texels of 1, 2 or 4 floats; null if the buffer is no lookup table or its size does not suit texel buffers.
    pub fn texels(&self, components: u32) -> vk::BufferView {
        self.texels[components.ilog2().min(2) as usize]
    }

    /// The mapped bytes, for writing only; empty if the memory is not mapped ([`Purpose::Groups`]).
    pub fn space(&mut self) -> &mut [MaybeUninit<u8>] {
        let size = self.size as usize;
        let bytes = self.allocation.as_mut().and_then(|a| a.mapped_slice_mut()).unwrap_or(&mut []);
        let length = bytes.len().min(size);
        // SAFETY: bytes may be seen as such that may be uninitialized, and the memory is mapped as long as the buffer lives.
        unsafe { std::slice::from_raw_parts_mut(bytes.as_mut_ptr().cast(), length) }
    }

    /// Writes bytes at byte offset `at`. Bytes beyond the end of the buffer are left out.
    pub fn write(&mut self, at: usize, bytes: &[u8]) {
        let space = self.space().get_mut(at..).unwrap_or(&mut []);
        let length = space.len().min(bytes.len());
        space[..length].write_copy_of_slice(&bytes[..length]);
    }

    /// The range to invalidate before the host reads, if the memory is not coherent.
    fn range_to_invalidate(&self) -> Option<vk::MappedMemoryRange<'static>> {
        let allocation = self.allocation.as_ref()?;
        let is_coherent = allocation.memory_properties().contains(vk::MemoryPropertyFlags::HOST_COHERENT);
        // SAFETY: the memory is only named here; the range lives as long as the allocation.
        let memory = unsafe { allocation.memory() };
        let range = vk::MappedMemoryRange::default().memory(memory).offset(allocation.offset()).size(allocation.size());
        (!is_coherent).then_some(range)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.context.destroy(|device| {
            // SAFETY: whoever drops a buffer has waited for the device to be done with it; null handles are allowed.
            unsafe {
                self.texels.iter().for_each(|view| device.destroy_buffer_view(*view, None));
                device.destroy_buffer(self.handle, None);
            }
            free(&self.context, self.allocation.take());
        });
    }
}

/// A region of an image that is copied at once: slices or layers (`parts`), and rows of each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    pub parts: Range<u32>,
    pub rows: Range<u32>,
    /// Their range among the bytes of all parts, which follow each other without gaps.
    bytes: Range<u64>,
}

/// Parts of an image in pieces of at most `most` bytes: one if they fit, else whole parts, else rows of one part.
fn pieces(shape: Shape, texel_bytes: usize, parts: Range<u32>, most: u64) -> Vec<Piece> {
    let [width, height, _] = shape.size().map(|n| n as u64);
    let row = width * texel_bytes as u64;
    let part = row * height;
    let piece = |first: u32, count: u32, rows: Range<u32>| {
        let begin = u64::from(first - parts.start) * part + u64::from(rows.start) * row;
        let bytes = u64::from(count - 1) * part + u64::from(rows.end - rows.start) * row;
        Piece { parts: first..first + count, rows, bytes: begin..begin + bytes }
    };
    let (at_once, height) = ((most / part.max(1)) as u32, height as u32);
    if at_once > 0 {
        let firsts = parts.clone().step_by(at_once as usize);
        return firsts.map(|first| piece(first, at_once.min(parts.end - first), 0..height)).collect();
    }
    let rows = (most / row.max(1)).clamp(1, height.into()) as u32;
    let cuts = parts.clone().flat_map(|part| (0..height).step_by(rows as usize).map(move |row| (part, row)));
    cuts.map(|(part, row)| piece(part, 1, row..(row + rows).min(height))).collect()
}

/// Parts of a slot's image: layers of an array or slices of a 3D image. `copy` is the index of the volume image.
#[derive(Clone, Debug)]
pub(crate) struct SlotParts {
    pub slot: Slot,
    pub copy: u32,
    pub parts: Range<u32>,
}

/// Staging buffers that hold the texels of some parts (slices or layers) of an image. There are several if one would be larger than the device
/// allows.
pub struct Upload {
    /// Each region of the image, with the buffer that holds its texels.
    pub pieces: Vec<(Piece, Buffer)>,
    /// The parts of the image that the texels are for.
    pub(crate) to: SlotParts,
}

impl Upload {
    /// Fills staging buffers for parts of an image of this shape and format. `bytes`: the texels of these parts, part by part. If bytes are missing
    /// at the end, the texels there are undefined.
    ///
    /// # Errors
    /// Memory is exhausted, or the device fails.
    pub(crate) fn new(
        context: &Arc<Context>,
        name: &str,
        (shape, format): (Shape, Format),
        to: SlotParts,
        bytes: &[u8],
    ) -> Result<Upload, GpuError> {
        let cut = pieces(shape, format.texel_bytes(), to.parts.clone(), context.candidate.max_buffer);
        let filled = |piece: Piece| {
            let Range { start, end } = piece.bytes;
            let mut buffer = Buffer::new(context, name, end - start, Purpose::Staging)?;
            let there = (start as usize).min(bytes.len())..(end as usize).min(bytes.len());
            buffer.write(0, &bytes[there]);
            Ok((piece, buffer))
        };
        cut.into_iter().map(filled).collect::<Result<_, _>>().map(|pieces| Upload { pieces, to })
    }
}

/// Buffers that receive the texels of an image, in memory that is fast to read. There are several if one would be larger than the device
/// allows.
pub struct Readback {
    context: Arc<Context>,
    /// Each region of the image, with the buffer for its texels.
    pub pieces: Vec<(Piece, Buffer)>,
    /// Shape and format of the image that they are for.
    pub image: (Shape, Format),
}

impl Readback {
    /// Buffers for a complete image of this shape and format.
    ///
    /// # Errors
    /// Memory is exhausted, or the device fails.
    pub fn new(context: &Arc<Context>, name: &str, image: (Shape, Format)) -> Result<Readback, GpuError> {
        let cut = pieces(image.0, image.1.texel_bytes(), 0..image.0.parts(), context.candidate.max_buffer);
        let made = |piece: Piece| {
            let bytes = piece.bytes.end - piece.bytes.start;
            Buffer::new(context, name, bytes, Purpose::Readback).map(|buffer| (piece, buffer))
        };
        let pieces = cut.into_iter().map(made).collect::<Result<_, _>>()?;
        Ok(Readback { context: context.clone(), pieces, image })
    }

    /// The texels of the image, on the conditions of [`Readback::bytes`].
    ///
    /// # Errors
    /// The device fails.
    pub fn texels(&self) -> Result<Texels, GpuError> {
        Ok(Texels::decode(self.image.0.size(), self.image.1, &self.bytes()?))
    }

    /// The texels of the image that the device wrote: row by row, and one slice or layer after the other, without gaps. The device must have finished
    /// the copy.
    ///
    /// # Errors
    /// The device fails.
    pub fn bytes(&self) -> Result<Cow<'_, [u8]>, GpuError> {
        let stale: Vec<_> = self.pieces.iter().filter_map(|(_, buffer)| buffer.range_to_invalidate()).collect();
        if !stale.is_empty() && !self.context.faults.breaks(Command::Invalidate) {
            // SAFETY: the ranges are aligned, inside mapped memory, and belong to these buffers alone.
            unsafe { self.context.device.invalidate_mapped_memory_ranges(&stale) }
                .context(|| "read results back".into())?;
        }
        Ok(match &self.pieces[..] {
            [(_, only)] => Cow::Borrowed(Readback::mapped(only)),
            several => Cow::Owned(several.iter().flat_map(|(_, buffer)| Readback::mapped(buffer)).copied().collect()),
        })
    }

    /// The memory of a buffer that takes results back: the only kind that is read.
    fn mapped(buffer: &Buffer) -> &[u8] {
        let bytes = buffer.allocation.as_ref().and_then(|allocation| allocation.mapped_slice()).unwrap_or(&[]);
        &bytes[..bytes.len().min(buffer.size as usize)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_read_from_cached_memory_even_where_it_is_not_coherent() {
        use vk::MemoryPropertyFlags as M;
        let (near, seen, coherent, cached) = (M::DEVICE_LOCAL, M::HOST_VISIBLE, M::HOST_COHERENT, M::HOST_CACHED);
        let chosen = |flags: &[M], allowed| {
            let types: Vec<_> =
                flags.iter().map(|flags| vk::MemoryType { property_flags: *flags, heap_index: 0 }).collect();
            readback_type(&types, allowed)
        };
        let meteor_lake = [near, near | seen | coherent, near | seen | cached];
        assert_eq!(chosen(&meteor_lake, 0b111), Some((2, false)));
        assert_eq!(chosen(&meteor_lake, 0b011), Some((1, true)), "better slow than not at all");
        let discrete = [near, seen | coherent, near | seen | coherent, seen | coherent | cached];
        assert_eq!(chosen(&discrete, 0b1111), Some((3, true)));
        let not_asked_for = [seen | coherent | cached | M::DEVICE_COHERENT_AMD, seen | coherent | cached];
        assert_eq!(chosen(&not_asked_for, 0b11), Some((1, true)));
        assert_eq!(chosen(&[near], 1), None);
    }

    #[test]
    fn pieces_cover_an_image_once_and_none_is_larger_than_allowed() {
        for (shape, texel_bytes, parts) in
            [(Shape::Three([5, 4, 7]), 2, 0..7), (Shape::Layers([3, 9, 4]), 4, 1..3), (Shape::Two([6, 11]), 8, 0..1)]
        {
            let [width, height, _] = shape.size();
            let row = (width * texel_bytes) as u64;
            let all = row * height as u64 * u64::from(parts.end - parts.start);
            for most in row..=all + 1 {
                let cut = pieces(shape, texel_bytes, parts.clone(), most);
                let mut at = 0;
                for piece in &cut {
                    assert_eq!(piece.bytes.start, at, "{shape:?} by {most}: {piece:?}");
                    assert!(piece.bytes.end - at <= most, "{shape:?} by {most}: {piece:?}");
                    let texels = (piece.parts.end - piece.parts.start) as usize
                        * (piece.rows.end - piece.rows.start) as usize
                        * width;
                    assert_eq!(piece.bytes.end - at, (texels * texel_bytes) as u64, "{shape:?} by {most}: {piece:?}");
                    at = piece.bytes.end;
                }
                assert_eq!(at, all, "{shape:?} by {most}");
                assert_eq!(cut.len() == 1, most >= all, "{shape:?} by {most}");
            }
        }
    }
}
