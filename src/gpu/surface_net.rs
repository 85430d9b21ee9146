//! Surface nets on the device: stored samples go up, crossed cells and vertices come back. The lattice itself stays there, a slab of its
//! slices at a time, so that its size is bounded by the file and not by the device's memory.
//!
//! Each slab takes three submissions or more, since the host decides between them: how many cells there are, which vertices they have, and
//! where these are.

use super::bands::{BandLimit, Bands};
use super::buffers::{Readback, Upload};
use super::context::Context;
use super::error::GpuError;
use super::formats::TexelAccess;
use super::pipelines::{Pipelines, embedded};
use super::recorder::{BarrierRecorder, Dispatch, Recorder, SlotParts};
use super::resources::SlotResources;
use super::timeline::Timelines;
use super::timing::{TimeStamps, Timings};
use crate::mesh::Mesh;
use crate::mesh::polygons::{Builder, Cell, Vertex, cells_of};
use crate::passes::net::{self, LIST_WIDTH};
use crate::passes::slots::Shape;
use crate::passes::{DispatchArgs, Pass, PassTime, Slot};
use crate::plan::Plan;
use crate::scene::{Lattice, Scene, SceneError};
use glam::DVec3;
use std::sync::Arc;

/// Why there is no mesh.
#[derive(Debug, thiserror::Error)]
pub enum NetError {
    /// The device cannot do it; another one, or the CPU, may.
    #[error(transparent)]
    Device(#[from] GpuError),
    /// The lattice or the mesh is too large.
    #[error("{0}")]
    Mesh(String),
}

impl From<String> for NetError {
    fn from(fault: String) -> NetError {
        NetError::Mesh(fault)
    }
}

impl From<SceneError> for NetError {
    fn from(error: SceneError) -> NetError {
        NetError::Mesh(error.to_string())
    }
}

/// Makes meshes of one volume.
pub struct SurfaceNet {
    lattice: Lattice,
    limit: Option<BandLimit>,
    timings: Timings,
    /// Bytes that came back so far.
    pub read_back: u64,
    // Fields are dropped in this order, after `drop` has waited for the device.
    recorder: Recorder,
    pipelines: Arc<Pipelines>,
    slots: SlotResources,
    timelines: Timelines,
    barriers: BarrierRecorder,
    context: Arc<Context>,
}

impl SurfaceNet {
    /// Uploads the stored samples of a volume. `frames`: the bytes of each slice; one without any is zeros. `lattice`: all of its slices.
    ///
    /// # Errors
    /// A volume that the device cannot hold, a device that fails.
    pub fn new(context: &Arc<Context>, lattice: Lattice, frames: &[Vec<u8>]) -> Result<SurfaceNet, NetError> {
        SurfaceNet::in_bands(context, lattice, frames, Bands::default())
    }

    /// As [`SurfaceNet::new`], with dispatches divided in a given way.
    ///
    /// # Errors
    /// As [`SurfaceNet::new`].
    pub fn in_bands(
        context: &Arc<Context>,
        lattice: Lattice,
        frames: &[Vec<u8>],
        bands: Bands,
    ) -> Result<SurfaceNet, NetError> {
        let mut net = SurfaceNet {
            limit: BandLimit::new(bands, context.candidate.is_software()),
            timings: Timings::new(context, false),
            read_back: 0,
            recorder: Recorder::new(context, 0, "surface net", TimeStamps::EachPass, false)?,
            pipelines: Pipelines::shared(context, embedded(), TexelAccess::for_device(&context.candidate))?,
            slots: SlotResources::new(context, 1),
            timelines: Timelines::new(context, 1)?,
            barriers: BarrierRecorder::default(),
            context: context.clone(),
            lattice,
        };
        let scene = net.lattice.clone().scene()?;
        net.fit(&scene, &[Slot::NetSamples])?;
        let zeros = vec![0; frames.iter().map(Vec::len).max().unwrap_or(0)];
        // Few frames at a time: what is staged takes memory too.
        let frame = Slot::NetSamples.bytes(&scene) / frames.len().max(1) as u64;
        let at_once = (STAGED / frame.max(1)).max(1) as usize;
        for (n, some) in frames.chunks(at_once).enumerate() {
            let bytes: Vec<u8> =
                some.iter().flat_map(|frame| if frame.is_empty() { &zeros } else { frame }).copied().collect();
            let first = (n * at_once) as u32;
            net.upload(Slot::NetSamples, first..first + some.len() as u32, None, &bytes)?;
        }
        Ok(net)
    }

    /// The deepest row at which a column is inside for the first time; none if nothing is inside. `each` is called after every slice.
    ///
    /// # Errors
    /// A slab that the device cannot hold, a device that fails.
    pub fn deepest(&mut self, each: impl Fn()) -> Result<Option<usize>, NetError> {
        let mut deepest = -1.0f32;
        let slabs = self.lattice.slabs();
        for (n, slab) in slabs.iter().enumerate() {
            let scene = self.lattice.slab(*slab).scene()?;
            self.fit(&scene, &slots_of(&scene, &[&net::SAMPLE, &net::SMOOTH, &net::SURVEY]))?;
            self.begin()?;
            self.values(&scene)?;
            self.dispatch(&scene, &net::SURVEY, DispatchArgs::default())?;
            let bytes = self.read(Slot::NetDepths, None)?;
            deepest = bytemuck::pod_collect_to_vec::<u8, f32>(&bytes).into_iter().fold(deepest, f32::max);
            (0..own_slices(&slabs, n)).for_each(|_| each());
        }
        Ok((deepest >= 0.0).then_some(deepest as usize))
    }

    /// The mesh of the surface. `filled_rows`: of a lattice that is filled behind it. `place`: fractional voxel indices to mm. `each` is
    /// called after every slice.
    ///
    /// # Errors
    /// A slab that the device cannot hold, a device that fails, more triangles than are made.
    pub fn mesh(
        &mut self,
        filled_rows: Option<usize>,
        place: impl Fn(DVec3) -> DVec3,
        each: impl Fn(),
    ) -> Result<Mesh, NetError> {
        self.lattice.filled_rows = filled_rows;
        let lattice = self.lattice.clone();
        let size = [lattice.grid.size[0], lattice.rows(), lattice.grid.size[2]];
        if cells_of(size, lattice.closed).contains(&0) {
            return Ok(Mesh::default());
        }
        let mut builder = Builder::new(lattice.closed, place);
        let (slabs, mut begun) = (lattice.slabs(), 0);
        let mut passes = vec![&net::SAMPLE, &net::SMOOTH, &net::COUNT, &net::CELLS, &net::VERTICES];
        passes.extend(filled_rows.map(|_| &net::FILL));
        for (n, slab) in slabs.iter().enumerate() {
            let scene = lattice.slab(*slab).scene()?;
            self.fit(&scene, &slots_of(&scene, &passes))?;
            self.begin()?;
            self.values(&scene)?;
            if filled_rows.is_some() {
                self.dispatch(&scene, &net::FILL, DispatchArgs::default())?;
            }
            self.dispatch(&scene, &net::COUNT, DispatchArgs::default())?;
            let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&self.read(Slot::NetCounts, None)?);
            let [rows, layers, _] = Slot::NetCounts.shape(&scene).size();
            let mut layer = 0;
            while layer < layers {
                let (firsts, count) = net::firsts(&scene, &counts, layer);
                let counts = &counts[layer * rows..(layer + count) * rows];
                let total = counts.iter().map(|n| *n as usize).sum();
                let cells = self.cells(&scene, &firsts, layer..layer + count, total)?;
                builder.take(cells, |vertices| self.offsets(&scene, vertices, begun))?;
                layer += count;
            }
            begun += layers as u32;
            (0..own_slices(&slabs, n)).for_each(|_| each());
        }
        Ok(builder.finish())
    }

    /// Times of the passes since the last call, ns; empty if the device has no time stamps.
    pub fn take_times(&mut self) -> Vec<PassTime> {
        self.timings.take_times()
    }

    /// Records the passes that make the values of a slab.
    fn values(&mut self, scene: &Scene) -> Result<(), GpuError> {
        self.dispatch(scene, &net::SAMPLE, DispatchArgs::default())?;
        for iteration in 0..(net::SMOOTH.repeat)(scene) {
            self.dispatch(scene, &net::SMOOTH, DispatchArgs { iteration, ..DispatchArgs::default() })?;
        }
        Ok(())
    }

    /// The crossed cells of some layers of a slab, by layer. `firsts`: where those of each row begin; `total`: how many there are.
    fn cells(
        &mut self,
        scene: &Scene,
        firsts: &[u32],
        layers: std::ops::Range<usize>,
        total: usize,
    ) -> Result<Vec<Vec<Cell>>, GpuError> {
        let mut found = vec![Vec::new(); layers.len()];
        if total == 0 {
            return Ok(found);
        }
        self.upload(Slot::NetFirsts, 0..1, None, bytemuck::cast_slice(firsts))?;
        self.begin()?;
        let (slice, slices) = (layers.start as u32, layers.len() as u32);
        self.dispatch(scene, &net::CELLS, DispatchArgs { slice, slices, ..DispatchArgs::default() })?;
        let list: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&self.read(Slot::NetCrossed, Some(total))?);
        for [cell, row] in list.into_iter().take(total) {
            let (x, inside, is_known) = (cell & 0xffff, (cell >> 16) as u8, cell >> 24 & 1 == 1);
            let layer = ((row >> 16) as usize).checked_sub(layers.start).and_then(|n| found.get_mut(n));
            // A device that computes nonsense must not end the program.
            layer.into_iter().for_each(|layer| layer.push(Cell { x, y: row & 0xffff, inside, is_known }));
        }
        Ok(found)
    }

    /// Where vertices are in their cells. `begun`: layers of cells before the slab.
    fn offsets(&mut self, scene: &Scene, vertices: &[Vertex], begun: u32) -> Result<Vec<DVec3>, NetError> {
        let mut offsets = Vec::with_capacity(vertices.len());
        for some in vertices.chunks(Slot::NetAsked.shape(scene).texels() as usize) {
            let asked = some
                .iter()
                .map(|Vertex { cell: [x, y, layer], edges }| [x | u32::from(*edges) << 16, y | (layer - begun) << 16]);
            let mut asked: Vec<[u32; 2]> = asked.collect();
            let rows = asked.len().div_ceil(LIST_WIDTH as usize);
            asked.resize(rows * LIST_WIDTH as usize, [0; 2]);
            self.upload(Slot::NetAsked, 0..1, Some(rows as u32), bytemuck::cast_slice(&asked))?;
            self.begin()?;
            self.dispatch(scene, &net::VERTICES, DispatchArgs { slices: rows as u32, ..DispatchArgs::default() })?;
            let places: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&self.read(Slot::NetOffsets, Some(some.len()))?);
            offsets
                .extend(places.into_iter().take(some.len()).map(|[x, y, z, _]| DVec3::from([x, y, z].map(f64::from))));
        }
        Ok(offsets)
    }

    /// Makes the slots that are missing, and frees those that are not named.
    fn fit(&mut self, scene: &Scene, slots: &[Slot]) -> Result<(), GpuError> {
        let new = self.slots.fit(&Plan { steps: Vec::new(), slots: slots.to_vec() }, scene)?;
        if new.is_empty() {
            return Ok(());
        }
        self.begin()?;
        self.recorder.clear_new(&mut self.barriers, &self.slots, &new);
        self.submit()
    }

    fn begin(&mut self) -> Result<(), GpuError> {
        self.recorder.begin(&mut self.barriers, &self.timelines)
    }

    fn dispatch(&mut self, scene: &Scene, pass: &'static Pass, args: DispatchArgs) -> Result<(), GpuError> {
        let pipeline = self.pipelines.get(pass, scene, &args)?;
        let dispatch = Dispatch { slots: &self.slots, pipeline: &pipeline, scene, pass, args: &args };
        match &self.limit {
            None => self.recorder.dispatch(&mut self.barriers, &dispatch),
            Some(limit) => self.recorder.dispatch_in_bands(&mut self.barriers, &mut self.timelines, &dispatch, limit),
        }
    }

    /// Copies texels into parts of an image, or into its first `rows`.
    fn upload(
        &mut self,
        slot: Slot,
        parts: std::ops::Range<u32>,
        rows: Option<u32>,
        bytes: &[u8],
    ) -> Result<(), GpuError> {
        let Some(image) = self.slots.image(slot, 0) else { return Ok(()) };
        let (shape, texel_bytes) = image.layout();
        let upload =
            Upload::new(&self.context, slot.name(), (first_rows(shape, rows), texel_bytes), parts.clone(), bytes)?;
        self.recorder.begin(&mut self.barriers, &self.timelines)?;
        self.recorder.upload(&mut self.barriers, &upload, image, SlotParts { slot, copy: 0, parts });
        self.submit()
    }

    /// Ends the recording with a copy of an image to the host, of a list as many rows as its `count` entries take. Waits for it.
    fn read(&mut self, slot: Slot, count: Option<usize>) -> Result<Vec<u8>, GpuError> {
        let Some(image) = self.slots.image(slot, 0) else { return Ok(Vec::new()) };
        let rows = count.map(|count| count.div_ceil(LIST_WIDTH as usize) as u32);
        let shape = first_rows(image.shape, rows);
        let buffer = Readback::new(&self.context, slot.name(), shape, image.format.texel_bytes())?;
        self.recorder.copy_out(&mut self.barriers, image, slot, 0, &buffer);
        self.submit()?;
        self.read_back += buffer.size;
        Ok(buffer.bytes()?.into_owned())
    }

    fn submit(&mut self) -> Result<(), GpuError> {
        self.recorder.submit(&mut self.barriers, &mut self.timelines)?;
        let done = self.timelines.wait_all();
        // What was staged is freed after this, also when waiting failed.
        self.timelines.drain();
        done?;
        self.recorder.collect(&self.timelines, &mut self.timings)
    }
}

/// Bytes of samples that are staged at once.
const STAGED: u64 = 64 << 20;

/// A list that is as long as its first rows.
fn first_rows(shape: Shape, rows: Option<u32>) -> Shape {
    match (shape, rows) {
        (Shape::Two([width, height]), Some(rows)) => Shape::Two([width, rows.min(height)]),
        _ => shape,
    }
}

/// Slices of a slab that the one before does not have.
fn own_slices(slabs: &[(usize, usize)], n: usize) -> usize {
    slabs[n].1 - usize::from(n > 0)
}

/// The slots that some passes use in a scene, and the samples.
fn slots_of(scene: &Scene, passes: &[&Pass]) -> Vec<Slot> {
    let mut slots = vec![Slot::NetSamples];
    for pass in passes {
        for iteration in 0..(pass.repeat)(scene) {
            let args = DispatchArgs { iteration, ..DispatchArgs::default() };
            slots.extend(pass.reads(scene, &args).iter().chain(&pass.writes(scene, &args)).map(|bind| bind.slot));
        }
    }
    slots.sort();
    slots.dedup();
    slots
}

impl Drop for SurfaceNet {
    fn drop(&mut self) {
        self.timelines.drain();
    }
}
