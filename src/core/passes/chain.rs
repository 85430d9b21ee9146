//! What follows from the place of a pass in [`PASSES`]: the slots that it reads and writes as a link of a filter chain, and the part of a
//! slice that it computes. Between the first and the last slot of a chain its filters alternate between two spare slots. A filter that is
//! not needed leaves no copy behind.

use super::PASSES;
use super::pass::{
    Arrays, Bind, Chain, Dispatch, DispatchArgs, Filter, Frequency, Link, Need, Params, Pass, RUN, Slot, Texels,
};
use crate::scene::{Rectangle, Scene, TILE, VisibleBounds};

impl Chain {
    /// What the first link reads.
    fn first(self) -> Slot {
        match self {
            Chain::Slices | Chain::Sections => Slot::Frames,
            Chain::Distances => Slot::Distance,
            Chain::Pictures => Slot::Picture,
        }
    }

    /// What the links between write, in turn.
    fn spare(self) -> [Slot; 2] {
        match self {
            // The chains of a frame run one after the other.
            Chain::Slices | Chain::Sections => [Slot::SliceA, Slot::SliceB],
            Chain::Distances => [Slot::DistanceA, Slot::DistanceB],
            Chain::Pictures => [Slot::SmoothPicture, Slot::SmoothPictureB],
        }
    }

    /// What the last link writes; none: the next spare slot.
    fn last(self, scene: &Scene) -> Option<Slot> {
        match self {
            Chain::Slices if scene.filters_across_slices() => Some(Slot::SharpVolume),
            Chain::Sections if scene.section_smoothing_radius()[2] > 0 => Some(Slot::SharpSectionVolume),
            _ => self.volume(scene),
        }
    }

    /// True if frames go through it to a volume.
    fn is_of_frames(self) -> bool {
        matches!(self, Chain::Slices | Chain::Sections)
    }

    /// The filters that a scene asks for, in order.
    fn requested(self, scene: &Scene) -> impl Iterator<Item = (&'static Pass, Filter)> {
        let filters = PASSES
            .iter()
            .filter_map(|pass| if let Link::Filter(filter) = pass.link { Some((pass, filter)) } else { None });
        filters.filter(move |(pass, filter)| filter.chain == self && asked_for(pass, *filter, scene).is_ok())
    }

    /// True if the first of several filters is left out: the next reads what it would read.
    fn omits_first(self, scene: &Scene) -> bool {
        let mut requested = self.requested(scene);
        requested.next().is_some_and(|(_, filter)| (filter.is_identity)(scene)) && requested.next().is_some()
    }

    /// The filters that run, each with its number of links.
    fn filters(self, scene: &Scene) -> impl Iterator<Item = (&'static Pass, Filter, u32)> {
        let is_copied = self == Chain::Slices && copied(scene).is_some();
        let omitted = usize::from(self.omits_first(scene));
        let filters = self.requested(scene).skip(omitted).filter(move |_| !is_copied);
        filters.map(|(pass, filter)| (pass, filter, (pass.repeat)(scene) / (filter.dispatches)(scene)))
    }

    /// Links before a pass, and links in all.
    fn position(self, scene: &Scene, pass: &Pass) -> (u32, u32) {
        let place = |name: &str| PASSES.iter().position(|p| p.name == name);
        let own = place(pass.name);
        self.filters(scene).fold((0, 0), |(before, all), (filter, _, links)| {
            (before + if place(filter.name) < own { links } else { 0 }, all + links)
        })
    }

    /// What the chain holds after so many of all its links.
    fn after(self, scene: &Scene, links: u32, all: u32) -> Slot {
        match self.last(scene) {
            _ if links == 0 => self.first(),
            Some(last) if links == all => last,
            _ => self.spare()[(links - 1) as usize % 2],
        }
    }

    /// The slot that holds the result of the chain's last filter.
    fn end(self, scene: &Scene) -> Slot {
        let all = self.filters(scene).map(|(_, _, links)| links).sum();
        self.after(scene, all, all)
    }
}

/// The slot that holds the distance map after all its filters; the unfiltered map ([`Slot::Distance`]) if no filter runs.
pub fn distance_end(scene: &Scene) -> Slot {
    Chain::Distances.end(scene)
}

/// The slot that holds the picture after all its filters; the unfiltered picture ([`Slot::Picture`]) if no filter runs.
pub fn picture_end(scene: &Scene) -> Slot {
    Chain::Pictures.end(scene)
}

/// The slot that frames are copied into as they arrive, without any pass, because the only filter of slices would store its input without loss and no
/// section volume is made from the frames. None if a pass converts or filters the frames.
pub fn copied(scene: &Scene) -> Option<Slot> {
    if scene.has_sections() {
        return None;
    }
    let mut requested = Chain::Slices.requested(scene);
    let (_, filter) = requested.next()?;
    if requested.next().is_none() && (filter.copies)(scene) { Chain::Slices.last(scene) } else { None }
}

// A rectangle begins and ends with complete workgroups of the slices' filters, eight invocations of a run each. The Gaussian has longer
// runs, and is told where the rectangle ends.
const _: () = assert!(Rectangle::ALIGNMENT.is_multiple_of(8 * RUN));

/// The columns and rows of the volume that are stored.
fn stored_rectangle(scene: &Scene) -> Rectangle {
    let VisibleBounds { low, high } = scene.stored_bounds();
    Rectangle { first: [low[0], low[1]], size: [high[0] - low[0], high[1] - low[1]] }
}

/// Whether a scene asks for a filter, whatever else its chain holds.
fn asked_for(pass: &Pass, filter: Filter, scene: &Scene) -> Need {
    if filter.chain == Chain::Distances && !scene.has_distance() {
        return Err("no distance map in this mode");
    }
    (pass.needed)(scene)
}

impl Pass {
    pub fn is_needed(&self, scene: &Scene) -> bool {
        self.needed(scene).is_ok()
    }

    /// Whether a scene needs the pass: `Ok` with the reason, or `Err` with the reason why not.
    pub fn needed(&self, scene: &Scene) -> Need {
        match self.link {
            Link::Filter(filter) => match asked_for(self, filter, scene) {
                Ok(_) if filter.chain == Chain::Slices && copied(scene).is_some() => {
                    Err("the volume stores a frame's values without loss: it is copied there")
                }
                Ok(_) if (filter.is_identity)(scene) && filter.chain.omits_first(scene) => {
                    Err("the first filter reads frames as they are")
                }
                need => need,
            },
            _ => (self.needed)(scene),
        }
    }

    /// The slots (read, written) of a dispatch of a chain's filter. For an observer ([`Link::Observer`]) only the first is meaningful: it writes
    /// slots of its own. None for a pass that is no link of a chain.
    pub fn link_slots(&self, scene: &Scene, args: &DispatchArgs) -> Option<(Slot, Slot)> {
        let chain = self.link.chain()?;
        let step = if let Link::Filter(filter) = self.link { args.iteration / (filter.dispatches)(scene) } else { 0 };
        let (before, all) = chain.position(scene, self);
        let link = before + step;
        // A pass that the scene does not need is a link of no chain: it would write the next spare slot.
        Some((chain.after(scene, link, all), chain.after(scene, link + 1, all)))
    }

    /// Path of the shader below glsl/, with its variant.
    pub fn shader(&self, scene: &Scene, args: &DispatchArgs) -> &'static str {
        (self.shader)(scene, &Dispatch::new(args, self.link_slots(scene, args)))
    }

    /// Specialization constants of a dispatch, by name. For the passes that make slices from frames they include `LAYERED`: whether the target is an
    /// array of layers instead of the 3D texture.
    pub fn constants(&self, scene: &Scene, args: &DispatchArgs) -> Vec<(&'static str, i32)> {
        let mut constants = (self.constants)(scene, &Dispatch::new(args, self.link_slots(scene, args)));
        if self.link.chain().is_some_and(Chain::is_of_frames) {
            let target = self.writes(scene, args).into_iter().find(|bind| bind.name == "target");
            constants.extend(target.map(|bind| ("LAYERED", bind.slot.is_layered(scene) as i32)));
        }
        constants
    }

    /// The slots that a dispatch reads, by their names in the shader.
    pub fn reads(&self, scene: &Scene, args: &DispatchArgs) -> Vec<Bind> {
        (self.reads)(scene, &Dispatch::new(args, self.link_slots(scene, args)))
    }

    /// The slots that a dispatch writes, by their names in the shader.
    pub fn writes(&self, scene: &Scene, args: &DispatchArgs) -> Vec<Bind> {
        (self.writes)(scene, &Dispatch::new(args, self.link_slots(scene, args)))
    }

    /// Computes the outputs of a dispatch by the formulas of the pass in f64, over all of the pass's extent. Texels that stay NaN are not written by
    /// the dispatch. For the frame array, `reads` holds only the layers of the dispatch.
    pub fn reference(&self, scene: &Scene, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
        let slots = self.link_slots(scene, args);
        if self.frequency != Frequency::Frame {
            return (self.reference)(scene, &Dispatch::new(args, slots), reads, writes);
        }
        let is_layered = |bind: &Bind| bind.slot.is_layered(scene);
        let (bound, written) = (self.reads(scene, args), self.writes(scene, args));
        for n in 0..args.slices {
            let (mut own, mut made) = (Arrays::default(), Arrays::default());
            for bind in &bound {
                let all = reads.get(bind.name);
                own.insert(bind.name, if is_layered(bind) { all.layer(n as usize) } else { all.clone() });
            }
            for bind in &written {
                let all = writes.get_mut(bind.name);
                let before = match is_layered(bind) {
                    true => all.layer(n as usize),
                    false => std::mem::replace(all, Texels::untouched([0; 3], 1)),
                };
                made.insert(bind.name, before);
            }
            let args = DispatchArgs { slice: args.slice + n, slices: 1, ..*args };
            (self.reference)(scene, &Dispatch::new(&args, slots), &own, &mut made);
            for bind in &written {
                let (all, made) = (writes.get_mut(bind.name), made.get_mut(bind.name));
                match is_layered(bind) {
                    true => all.set_layer(n as usize, made),
                    false => std::mem::swap(all, made),
                }
            }
        }
    }

    /// Number of slices that one dispatch writes if frames are not batched: all slices of the volume for a pass over volumes, 1 for any other pass.
    pub fn slices(&self, scene: &Scene) -> u32 {
        if self.frequency == Frequency::Volume { scene.slices() } else { 1 }
    }

    /// The rectangle of each slice that a pass over slices has to compute: the visible part and as much around it as later filters read. It is the
    /// whole slice if the pass only observes the slice or a later filter reads all of it. None for passes that compute all of their extent: filters
    /// each of whose texels depends on the complete slice (AOS, RKL1), and passes that are no part of the chains of slices.
    pub fn rectangle(&self, scene: &Scene, args: &DispatchArgs) -> Option<Rectangle> {
        let all = Rectangle { first: [0; 2], size: scene.grid.size };
        let mut around = [0, 0];
        match self.link {
            Link::Observer(Chain::Slices) => return Some(all),
            Link::AfterSlices => {}
            Link::Filter(filter) if filter.chain.is_of_frames() => {
                let chain = filter.chain;
                (filter.reach)(scene)?;
                let done = chain.position(scene, self).0 + args.iteration / (filter.dispatches)(scene) + 1;
                let mut before = 0;
                for (_, filter, links) in chain.filters(scene) {
                    let after = (before + links).saturating_sub(done.max(before));
                    before += links;
                    match (filter.reach)(scene) {
                        _ if after == 0 => {}
                        None => return Some(all),
                        Some(reach) => (0..2).for_each(|axis| around[axis] += after * reach[axis]),
                    }
                }
            }
            _ => return None,
        }
        Some(scene.visible_rectangle(around))
    }

    /// Number of invocations of a dispatch along x, y and z. A pass over slices has invocations only for its rectangle ([`Pass::rectangle`]).
    pub fn invocations(&self, scene: &Scene, args: &DispatchArgs) -> [u32; 3] {
        let extent = (self.extent)(scene, args);
        let Some(visible) = self.rectangle(scene, args) else { return extent };
        // Some make a run of neighbours each.
        let of_pass = if let Link::Filter(filter) = self.link { filter.run } else { RUN };
        let run = |axis: usize| if extent[axis] < scene.grid.size[axis] { of_pass } else { 1 };
        [visible.size[0].div_ceil(run(0)), visible.size[1].div_ceil(run(1)), extent[2]]
    }

    /// Parameters of a dispatch, as the shader gets them. A pass over slices also gets the bounds of its rectangle, and the first texel of the volume
    /// that the device stores.
    pub fn numbers(&self, scene: &Scene, args: &DispatchArgs) -> Params {
        let mut params = (self.params)(scene, args);
        if let Some(r) = self.rectangle(scene, args) {
            let end = [0, 1].map(|axis| r.first[axis] + r.size[axis]);
            params = params.i32("first_column", r.first[0]).i32("first_row", r.first[1]);
            params = params.i32("end_column", end[0]).i32("end_row", end[1]);
        }
        let of_slices = matches!(self.link, Link::AfterSlices) || self.link.chain().is_some_and(Chain::is_of_frames);
        match of_slices && params.0.iter().any(|(name, _)| *name == "slice") {
            true => params.first_stored(scene),
            false => params,
        }
    }

    /// Computes the content of the outputs after a dispatch: the reference within the rectangle that the dispatch writes ([`Pass::rectangle`]), and
    /// around it what `writes` held before the call. A dispatch without a rectangle writes all of its outputs, but of a volume only the columns and
    /// rows that the device stores.
    pub fn expected(&self, scene: &Scene, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
        let before = writes.clone();
        self.reference(scene, args, reads, writes);
        let made = self.rectangle(scene, args);
        for bind in self.writes(scene, args) {
            let (kept, target) = (before.get(bind.name), writes.get_mut(bind.name));
            // What is made beyond the stored part of the volume is dropped.
            let Some(r) = made.or(bind.slot.is_volume().then(|| stored_rectangle(scene))) else { continue };
            let size = [kept.size[0], kept.size[1]];
            if size == r.size.map(|n| n as usize) {
                continue;
            }
            // A slice of tiles has one texel for each tile.
            let texels = if size == scene.grid.size.map(|n| n as usize) { 1 } else { TILE as usize };
            for (x, y) in kept.pixels() {
                let within =
                    |at: usize, a: usize| (r.first[a]..r.first[a] + r.size[a]).contains(&((at * texels) as u32));
                let made = within(x, 0) && within(y, 1);
                (0..kept.size[2]).filter(|_| !made).for_each(|z| target.set([x, y, z], kept.get([x, y, z])));
            }
        }
    }
}
