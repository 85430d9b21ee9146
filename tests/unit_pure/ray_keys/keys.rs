//! Every key of the settings as a ray sees it: read by rays, read only for their accuracy, or read by none. The list of keys is that of the
//! declaration (src/core/scene/settings), so that a new one must be put here.

use crate::common::files::repository;
use std::collections::BTreeMap;
use syn::{Fields, GenericArgument, Item, PathArguments, Type};

/// What a ray makes of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// It changes what rays show: exact rays and bounds honour it or refuse the scene.
    Rays,
    /// It changes how accurate samples are, and not what they approximate.
    Accuracy,
    /// No ray reads it.
    Nothing,
}

/// A key, what it is to rays, the settings that it is changed from, and what it is changed to: assignments as of `--set`, between ` & `.
pub struct Key {
    pub name: &'static str,
    pub of: Of,
    pub from: &'static str,
    pub to: &'static [&'static str],
}

/// Keys of [`ROWS`] that belong together, one a line.
type Row = (&'static str, Of, &'static str, &'static [&'static str]);

pub fn keys() -> impl Iterator<Item = Key> {
    ROWS.iter().map(|(name, of, from, to)| Key { name, of: *of, from, to })
}

use Of::{Accuracy, Nothing, Rays};

const SURFACE: &str = "mode=surface";
const CLIPPED: &str = "clip=[{at=[0,22,2],normal=[0,0,1]}] & cap.level=0.3 & volume.extinction=3.0";
const LEARNS: &str = "mode=surface & surface.detector=adaptive";
const LIT: &str = "light.volume={}";
const STILL: &str = "still={}";
const SKIN: &str = "mode=surface & light.skin={translucency=0.4,depth=4.0}";
const FOUR: &str = "layout=four";

const ROWS: &[Row] = &[
    (
        "mode",
        Rays,
        "",
        &[
            "mode=surface",
            "mode=mixed",
            "mode=mip",
            "mode=minip",
            "mode=mean",
            "mode=plane",
            "mode=orthogonal",
            "mode=tomography",
            "mode=cube",
        ],
    ),
    ("layout", Rays, SURFACE, &["layout=pair", "layout=four"]),
    ("floating", Rays, "volume.threshold=0.4 & picture.size=[20,16]", &["floating=900.0"]),
    ("picture.size", Rays, "", &["picture.size=[5,7]"]),
    ("samples.range", Rays, "", &["samples.range=[0.1,0.8]"]),
    // Stage 1: what it makes of the samples are the texels that rays go through.
    ("conditioning.tgc.depth", Rays, "", &["conditioning.tgc=[{depth=10,gain=-6},{depth=40,gain=6}]"]),
    ("conditioning.tgc.gain", Rays, "", &["conditioning.tgc=[{depth=10,gain=3}]"]),
    ("conditioning.dynamic_range", Rays, "", &["conditioning.dynamic_range=40.0"]),
    (
        "conditioning.compressed_range",
        Rays,
        "conditioning.tgc=[{depth=10,gain=6}]",
        &["conditioning.compressed_range=30.0"],
    ),
    ("conditioning.low_pass", Rays, "", &["conditioning.low_pass=2.0"]),
    ("conditioning.low_pass_mm", Rays, "", &["conditioning.low_pass_mm=2.5"]),
    ("conditioning.samples", Rays, "", &["conditioning.samples=30"]),
    ("slices.pixels", Rays, "", &["slices.pixels=30"]),
    ("slices.median", Rays, "", &["slices.median=true"]),
    (
        "slices.estimator",
        Rays,
        "",
        &["slices.estimator=gradient-inverse", "slices.estimator=nagao-matsuyama", "slices.estimator=median"],
    ),
    ("slices.estimator_edge", Rays, "slices.estimator=perona-malik", &["slices.estimator_edge=0.4"]),
    ("slices.sigma.window", Rays, "", &["slices.sigma={window=5}"]),
    ("slices.sigma.window_mm", Rays, "", &["slices.sigma={window_mm=9.0}"]),
    ("slices.sigma.sigma", Rays, "slices.sigma={}", &["slices.sigma={sigma=0.3}"]),
    ("slices.sigma.noise", Rays, "slices.sigma={}", &["slices.sigma={noise='multiplicative'}"]),
    ("slices.enhanced_sigma.window", Rays, "slices.enhanced_sigma={}", &["slices.enhanced_sigma={window=3}"]),
    (
        "slices.enhanced_sigma.largest",
        Rays,
        "slices.enhanced_sigma={sigma=0.01}",
        &["slices.enhanced_sigma={sigma=0.01,largest=5}"],
    ),
    (
        "slices.enhanced_sigma.window_mm",
        Rays,
        "slices.enhanced_sigma={sigma=0.3}",
        &["slices.enhanced_sigma={sigma=0.3,window_mm=24.0}"],
    ),
    (
        "slices.enhanced_sigma.largest_mm",
        Rays,
        "slices.enhanced_sigma={sigma=0.01}",
        &["slices.enhanced_sigma={sigma=0.01,largest_mm=10.0}"],
    ),
    ("slices.enhanced_sigma.sigma", Rays, "slices.enhanced_sigma={}", &["slices.enhanced_sigma={sigma=0.3}"]),
    (
        "slices.enhanced_sigma.noise",
        Rays,
        "slices.enhanced_sigma={}",
        &["slices.enhanced_sigma={noise='multiplicative'}"],
    ),
    (
        "slices.enhanced_sigma.centre",
        Rays,
        "slices.enhanced_sigma={}",
        &["slices.enhanced_sigma={centre='perona-malik'}"],
    ),
    (
        "slices.enhanced_sigma.edge",
        Rays,
        "slices.enhanced_sigma={centre='perona-malik'}",
        &["slices.enhanced_sigma={centre='perona-malik',edge=0.7}"],
    ),
    ("slices.enhanced_sigma.growth", Nothing, "slices.enhanced_sigma={}", &["slices.enhanced_sigma={growth=true}"]),
    (
        "slices.perona_malik.scheme",
        Rays,
        "slices.perona_malik={}",
        &[
            "slices.perona_malik={scheme='aos',step=1.0}",
            "slices.perona_malik={scheme='aos-richardson',step=1.0}",
            "slices.perona_malik={scheme='rkl1',step=1.0}",
        ],
    ),
    ("slices.perona_malik.edge", Rays, "slices.perona_malik={}", &["slices.perona_malik={edge=inf}"]),
    (
        "slices.perona_malik.conductance",
        Rays,
        "slices.perona_malik={}",
        &["slices.perona_malik={conductance='exponential'}"],
    ),
    ("slices.perona_malik.step", Rays, "slices.perona_malik={}", &["slices.perona_malik={step=0.1}"]),
    ("slices.perona_malik.repeat", Rays, "slices.perona_malik={}", &["slices.perona_malik={repeat=3}"]),
    ("slices.perona_malik.width_mm", Rays, "slices.perona_malik={}", &["slices.perona_malik={width_mm=6.0}"]),
    ("slices.smooth.lateral", Rays, "", &["slices.smooth={lateral=3.0}"]),
    ("slices.smooth.depth", Rays, "", &["slices.smooth={depth=3.0}"]),
    ("slices.smooth.elevation", Rays, "", &["slices.smooth={elevation=1.0}"]),
    ("slices.smooth.elevation_mm", Rays, "", &["slices.smooth={elevation_mm=4.0}"]),
    ("slices.smooth.kernel", Rays, "", &["slices.smooth={kernel=3}", "slices.smooth={kernel=5}"]),
    ("slices.blur", Rays, "", &["slices.blur=true"]),
    ("slices.format", Accuracy, "", &["slices.format=r8", "slices.format=r16", "slices.format=r32f"]),
    ("slices.everything", Accuracy, "", &["slices.everything=true"]),
    ("slices.still", Accuracy, "", &["slices.still=true"]),
    // Which part of the volume is rendered.
    ("region.lateral", Rays, "", &["region.lateral=[-8,11]"]),
    ("region.depth", Rays, "", &["region.depth=[9,37]"]),
    ("region.elevation", Rays, "", &["region.elevation=[-5,8]"]),
    ("region.start_curve", Rays, "", &["region.start_curve=[[-15,26],[0,16],[14,30]]"]),
    ("region.fade", Rays, "region.depth=[9,37]", &["region.fade=5.0", "region.fade=1.3", "region.fade=30.0"]),
    (
        "clip.at",
        Rays,
        "cap.enabled=false & clip=[{at=[0,22,2],normal=[0.3,0.1,1]}]",
        &["cap.enabled=false & clip=[{at=[0,22,-3],normal=[0.3,0.1,1]}]"],
    ),
    (
        "clip.normal",
        Rays,
        "cap.enabled=false & clip=[{at=[0,22,2],normal=[0.3,0.1,1]}]",
        &[
            "cap.enabled=false & clip=[{at=[0,22,2],normal=[1,0.1,-0.4]}]",
            "cap.enabled=false & clip=[{at=[0,22,2],normal=[1,0,-0.4]},{at=[0,22,2],normal=[-1,0,-0.4]}]",
        ],
    ),
    ("cap.enabled", Rays, CLIPPED, &["cap.enabled=false"]),
    ("cap.level", Rays, CLIPPED, &["cap.level=0.95"]),
    ("cuts.contour", Rays, "", &["cuts=[{contour=[[-9,-9],[10,-8],[3,9]]}]"]),
    (
        "cuts.view.at",
        Rays,
        "cuts=[{contour=[[-9,-9],[10,-8],[3,9]]}]",
        &["cuts=[{contour=[[-9,-9],[10,-8],[3,9]],view={at=[6,0,3],direction=[0,1,0],up=[0,0,1]}}]"],
    ),
    (
        "cuts.view.direction",
        Rays,
        "cuts=[{contour=[[-9,-9],[10,-8],[3,9]]}]",
        &["cuts=[{contour=[[-9,-9],[10,-8],[3,9]],view={at=[0,0,0],direction=[0.3,1,0],up=[0,0,1]}}]"],
    ),
    (
        "cuts.view.up",
        Rays,
        "cuts=[{contour=[[-9,-9],[10,-8],[3,9]]}]",
        &["cuts=[{contour=[[-9,-9],[10,-8],[3,9]],view={at=[0,0,0],direction=[0,1,0],up=[1,0,1]}}]"],
    ),
    (
        "cuts.view.eye",
        Rays,
        "cuts=[{contour=[[-9,-9],[10,-8],[3,9]]}]",
        &["cuts=[{contour=[[-9,-9],[10,-8],[3,9]],view={at=[0,0,0],direction=[0,1,0],up=[0,0,1],eye=60}}]"],
    ),
    (
        "cuts.keep",
        Rays,
        "cuts=[{contour=[[-9,-9],[10,-8],[3,9]]}]",
        &["cuts=[{contour=[[-9,-9],[10,-8],[3,9]],keep='inside'}]"],
    ),
    (
        "cuts.depth",
        Rays,
        "cuts=[{contour=[[-9,-9],[10,-8],[3,9]]}]",
        &["cuts=[{contour=[[-9,-9],[10,-8],[3,9]],depth=25}]"],
    ),
    (
        "cuts.brush.radius",
        Rays,
        "cuts=[{brush={radius=5,strokes=[[[0,22,0]]]}}]",
        &["cuts=[{brush={radius=9,strokes=[[[0,22,0]]]}}]"],
    ),
    (
        "cuts.brush.strokes",
        Rays,
        "cuts=[{brush={radius=5,strokes=[[[0,22,0]]]}}]",
        &["cuts=[{brush={radius=5,strokes=[[[0,22,0],[9,25,4]]]}}]"],
    ),
    ("unveil.enabled", Rays, "", &["unveil.enabled=true"]),
    ("unveil.offset", Rays, "unveil.enabled=true", &["unveil.offset=9.0"]),
    (
        "unveil.smoothing",
        Rays,
        "unveil.enabled=true & unveil.offset=3.0 & slices.pixels=40",
        &["unveil.smoothing=20.0"],
    ),
    // Where rays are.
    ("camera.azimuth", Rays, "", &["camera.azimuth=80.0", "camera.azimuth=-140.0"]),
    ("camera.elevation", Rays, "", &["camera.elevation=-70.0", "camera.elevation=90.0"]),
    ("camera.roll", Rays, "", &["camera.roll=33.0"]),
    ("camera.zoom", Rays, "", &["camera.zoom=2.5"]),
    ("camera.field_of_view", Rays, "", &["camera.field_of_view=50.0"]),
    ("camera.target", Rays, "", &["camera.target=[4,30,-3]"]),
    ("ray.rays", Rays, "", &["ray.rays=2"]),
    ("ray.adaptive", Rays, "ray.rays=2", &["ray.rays=2 & ray.adaptive=true"]),
    ("ray.subsampling", Rays, "picture.size=[24,32]", &["ray.subsampling=2", "ray.subsampling=4", "ray.subsampling=8"]),
    // How samples are taken along them.
    ("ray.step", Accuracy, "", &["ray.step=0.7"]),
    ("ray.samples_per_voxel", Accuracy, "", &["ray.samples_per_voxel=3"]),
    ("ray.early_end", Accuracy, "", &["ray.early_end=0.2", "ray.early_end=0.0"]),
    ("ray.sampling", Accuracy, "", &["ray.sampling=exact", "ray.sampling=hardware", "ray.sampling=quads"]),
    ("ray.elevation", Rays, "", &["ray.elevation=bspline", "ray.elevation=bspline-sharp"]),
    ("ray.spread", Accuracy, "", &["ray.spread=1.0"]),
    ("ray.sliding", Rays, "", &["ray.sliding=3", "ray.sliding=5"]),
    ("ray.slice_index", Accuracy, "", &["ray.slice_index=table"]),
    ("ray.entries", Accuracy, "ray.slice_index=table", &["ray.entries=9"]),
    ("ray.brick", Accuracy, "", &["ray.brick=0", "ray.brick=4"]),
    // Volume rendering.
    ("volume.window", Rays, "", &["volume.window=[0.1,0.6]", "volume.window=[-0.3,1.4]"]),
    ("volume.start_depth", Rays, "", &["volume.start_depth=21.0"]),
    (
        "volume.transfer",
        Rays,
        "",
        &[
            "volume.transfer=bone",
            "volume.transfer=[{at=0.3,colour=[1,0.4,0.2],opacity=0.0},{at=0.5,colour=[0.3,0.9,0.4],opacity=1.0}]",
            "volume.transfer=[{at=0.2,colour=[1,1,1],opacity=0.2}]",
        ],
    ),
    ("volume.extinction", Rays, "", &["volume.extinction=0.05", "volume.extinction=0.6", "volume.extinction=40.0"]),
    ("volume.entries", Accuracy, "", &["volume.entries=32"]),
    ("volume.threshold", Rays, "", &["volume.threshold=0.35"]),
    (
        "volume.compositing",
        Accuracy,
        "",
        &["volume.compositing=riemann", "volume.compositing=pre-integrated", "volume.compositing=exponential"],
    ),
    ("volume.shading", Rays, "", &["volume.shading=depth-coded", "volume.shading=first-hit"]),
    ("volume.near_tint", Rays, "volume.shading=depth-coded", &["volume.near_tint=[0.2,1.4,0.6]"]),
    ("volume.far_tint", Rays, "volume.shading=depth-coded", &["volume.far_tint=[1.3,0.0,0.6]"]),
    ("volume.hit", Rays, "volume.shading=first-hit", &["volume.hit=0.6", "volume.hit=0.02"]),
    ("volume.veil", Nothing, "mode=mixed", &["volume.veil=0.3"]),
    // Surface rendering.
    ("surface.window", Rays, SURFACE, &["surface.window=[0.1,0.7]"]),
    ("surface.start_depth", Rays, SURFACE, &["surface.start_depth=24.0"]),
    ("surface.detector", Rays, SURFACE, &["surface.detector=adaptive", "surface.detector=lasting"]),
    ("surface.noise", Rays, LEARNS, &["surface.noise=5.0"]),
    ("surface.edge", Rays, SURFACE, &["surface.edge=5.0", "surface.edge=samples"]),
    ("surface.threshold", Rays, SURFACE, &["surface.threshold=0.3"]),
    ("surface.rough_threshold", Rays, "mode=surface & surface.rough=2", &["surface.rough_threshold=0.05"]),
    ("surface.rough", Rays, SURFACE, &["surface.rough=2"]),
    ("surface.sign", Rays, SURFACE, &["surface.sign=dark"]),
    ("surface.place", Rays, SURFACE, &["surface.place=middle", "surface.place=first-crossing"]),
    ("surface.number", Rays, SURFACE, &["surface.number=2"]),
    ("surface.colour", Rays, SURFACE, &["surface.colour=rendered", "surface.colour=behind"]),
    ("surface.colour_depth", Rays, "mode=surface & surface.colour=behind", &["surface.colour_depth=9.0"]),
    ("projection.window", Rays, "mode=mip", &["projection.window=[0.1,0.4]"]),
    ("projection.start_depth", Rays, "mode=mean", &["projection.start_depth=24.0"]),
    // Planes and the block cast no rays; cut faces have the window of planes.
    ("planes.window", Rays, CLIPPED, &["planes.window=[0.0,0.4]"]),
    ("labels.fill", Nothing, "", &["labels.fill=0.5"]),
    ("labels.outline", Nothing, "", &["labels.outline=false"]),
    ("labels.shell", Nothing, "", &["labels.shell=0.2"]),
    ("labels.behind", Nothing, "", &["labels.behind=0.9"]),
    ("planes.position", Nothing, FOUR, &["planes.position=[3,20,2]"]),
    ("planes.azimuth", Nothing, FOUR, &["planes.azimuth=20.0"]),
    ("planes.tilt", Nothing, FOUR, &["planes.tilt=20.0"]),
    ("planes.roll", Nothing, FOUR, &["planes.roll=20.0"]),
    ("planes.thickness", Nothing, FOUR, &["planes.thickness=5.0"]),
    ("planes.slab", Nothing, "layout=four & planes.thickness=5.0", &["planes.slab=max"]),
    ("planes.zoom", Nothing, FOUR, &["planes.zoom=2.0"]),
    ("planes.plane", Nothing, FOUR, &["planes.plane=c"]),
    ("planes.columns", Nothing, FOUR, &["planes.columns=2"]),
    ("planes.rows", Nothing, FOUR, &["planes.rows=2"]),
    ("planes.spacing", Nothing, FOUR, &["planes.spacing=2.0"]),
    ("planes.reference", Nothing, FOUR, &["planes.reference=true"]),
    ("planes.lines", Nothing, FOUR, &["planes.lines=false"]),
    ("planes.smooth.lateral", Nothing, FOUR, &["planes.smooth={lateral=2.0}"]),
    ("planes.smooth.depth", Nothing, FOUR, &["planes.smooth={depth=2.0}"]),
    ("planes.smooth.elevation", Nothing, FOUR, &["planes.smooth={elevation=1.0}"]),
    ("planes.smooth.elevation_mm", Nothing, FOUR, &["planes.smooth={elevation_mm=3.0}"]),
    ("planes.smooth.kernel", Nothing, FOUR, &["planes.smooth={kernel=3}"]),
    ("planes.curve.plane", Nothing, FOUR, &["planes.curve={plane='b',points=[[-5,20],[5,25]]}"]),
    ("planes.curve.points", Nothing, FOUR, &["planes.curve={points=[[-5,20],[5,25]]}"]),
    ("cube.window", Nothing, "", &["cube.window=[0.1,0.4]"]),
    ("cube.inset.left", Nothing, "", &["cube.inset.left=2.0"]),
    ("cube.inset.right", Nothing, "", &["cube.inset.right=2.0"]),
    ("cube.inset.near", Nothing, "", &["cube.inset.near=2.0"]),
    ("cube.inset.far", Nothing, "", &["cube.inset.far=2.0"]),
    ("cube.inset.bottom", Nothing, "", &["cube.inset.bottom=2.0"]),
    ("cube.inset.top", Nothing, "", &["cube.inset.top=2.0"]),
    ("cube.tilt.left", Nothing, "", &["cube.tilt.left=[5,9]"]),
    ("cube.tilt.right", Nothing, "", &["cube.tilt.right=[5,9]"]),
    ("cube.tilt.near", Nothing, "", &["cube.tilt.near=[5,9]"]),
    ("cube.tilt.far", Nothing, "", &["cube.tilt.far=[5,9]"]),
    ("cube.tilt.bottom", Nothing, "", &["cube.tilt.bottom=[5,9]"]),
    ("cube.tilt.top", Nothing, "", &["cube.tilt.top=[5,9]"]),
    ("cube.shading", Nothing, "", &["cube.shading=0.8"]),
    ("cube.edges", Nothing, "", &["cube.edges=false"]),
    // Stage 3.
    ("distance.median", Nothing, "", &["distance.median=5"]),
    ("distance.median_mm", Nothing, "", &["distance.median_mm=20.0"]),
    ("distance.bilateral.pixels", Nothing, "", &["distance.bilateral={pixels=1.5,distance=3.0}"]),
    ("distance.bilateral.mm", Nothing, "", &["distance.bilateral={mm=20.0,distance=3.0}"]),
    ("distance.bilateral.distance", Nothing, "", &["distance.bilateral={pixels=1.5,distance=9.0}"]),
    ("distance.bilateral.repeat", Nothing, "", &["distance.bilateral={pixels=1.5,distance=9.0,repeat=2}"]),
    ("distance.sigma.window", Nothing, "", &["distance.sigma={window=5}"]),
    ("distance.sigma.window_mm", Nothing, "", &["distance.sigma={window_mm=30.0}"]),
    ("distance.sigma.sigma", Nothing, "", &["distance.sigma={sigma=2.0}"]),
    ("distance.sigma.noise", Nothing, "", &["distance.sigma={noise='additive'}"]),
    ("distance.sigma.repeat", Nothing, "", &["distance.sigma={repeat=2}"]),
    ("distance.enhanced_sigma.window", Nothing, "", &["distance.enhanced_sigma={window=3}"]),
    ("distance.enhanced_sigma.largest", Nothing, "", &["distance.enhanced_sigma={largest=7}"]),
    ("distance.enhanced_sigma.window_mm", Nothing, "", &["distance.enhanced_sigma={window_mm=30.0}"]),
    ("distance.enhanced_sigma.largest_mm", Nothing, "", &["distance.enhanced_sigma={largest_mm=60.0}"]),
    ("distance.enhanced_sigma.sigma", Nothing, "", &["distance.enhanced_sigma={sigma=2.0}"]),
    ("distance.enhanced_sigma.noise", Nothing, "", &["distance.enhanced_sigma={noise='additive'}"]),
    ("distance.enhanced_sigma.centre", Nothing, "", &["distance.enhanced_sigma={centre='median'}"]),
    ("distance.enhanced_sigma.edge", Nothing, "", &["distance.enhanced_sigma={centre='perona-malik',edge=2.0}"]),
    ("distance.enhanced_sigma.growth", Nothing, "", &["distance.enhanced_sigma={growth=false}"]),
    ("distance.perona_malik.scheme", Nothing, "", &["distance.perona_malik={scheme='explicit'}"]),
    ("distance.perona_malik.edge", Nothing, "", &["distance.perona_malik={edge=2.0}"]),
    ("distance.perona_malik.conductance", Nothing, "", &["distance.perona_malik={conductance='exponential'}"]),
    ("distance.perona_malik.step", Nothing, "", &["distance.perona_malik={step=0.1}"]),
    ("distance.perona_malik.repeat", Nothing, "", &["distance.perona_malik={repeat=2}"]),
    ("distance.perona_malik.width_mm", Nothing, "", &["distance.perona_malik={width_mm=20.0}"]),
    ("light.direction", Nothing, "", &["light.direction=[1,0,1]"]),
    ("light.follows", Nothing, "", &["light.follows=region"]),
    ("light.position", Nothing, "", &["light.position=[5,5,60]"]),
    ("light.ambient", Nothing, "", &["light.ambient=0.5"]),
    ("light.diffuse", Nothing, "", &["light.diffuse=0.2"]),
    ("light.specular", Nothing, "", &["light.specular=0.7"]),
    ("light.shininess", Nothing, "", &["light.shininess=3.0"]),
    ("light.colour", Nothing, "", &["light.colour=[1,0,0.5]"]),
    ("light.surface_colour", Nothing, "", &["light.surface_colour=[0,1,0.5]"]),
    // Light by the echo at the surface, or behind it: rays take it along.
    ("light.texture", Rays, SURFACE, &["light.texture=0.5"]),
    ("light.cliff", Nothing, "", &["light.cliff=0.5"]),
    ("light.shadow.strength", Nothing, "", &["light.shadow={strength=0.9}"]),
    ("light.shadow.softness", Nothing, "", &["light.shadow={softness=0.0}"]),
    ("light.shadow.reach", Nothing, "", &["light.shadow={reach=9.0}"]),
    ("light.shadow.thickness", Nothing, "", &["light.shadow={thickness=3.0}"]),
    ("light.shadow.bias", Nothing, "", &["light.shadow={bias=2.0}"]),
    ("light.shadow.dims", Nothing, "", &["light.shadow={dims='pixel'}"]),
    ("light.occlusion.radius", Nothing, "", &["light.occlusion={radius=9.0}"]),
    ("light.occlusion.strength", Nothing, "", &["light.occlusion={strength=0.5}"]),
    ("light.skin.wrap", Nothing, "light.skin={translucency=0.4}", &["light.skin={translucency=0.4,wrap=0.9}"]),
    ("light.skin.translucency", Rays, SURFACE, &["light.skin={translucency=0.6,depth=4.0}"]),
    ("light.skin.depth", Rays, SKIN, &["light.skin={translucency=0.4,depth=11.0}"]),
    (
        "light.skin.colour",
        Nothing,
        "light.skin={translucency=0.4}",
        &["light.skin={translucency=0.4,colour=[0.1,0.5,0.9]}"],
    ),
    ("light.volume.cell", Rays, LIT, &["light.volume={cell=3.0}"]),
    ("light.volume.cells", Rays, LIT, &["light.volume={cells=1000}"]),
    ("light.volume.reach", Rays, LIT, &["light.volume={reach=3.0}"]),
    ("light.volume.slope", Rays, LIT, &["light.volume={slope=0.5}"]),
    ("light.volume.taps", Rays, LIT, &["light.volume={taps=2}"]),
    ("light.volume.depth", Rays, LIT, &["light.volume={depth=5.0}"]),
    ("light.volume.warmth", Rays, LIT, &["light.volume={warmth=0.0}"]),
    ("light.volume.widening", Rays, LIT, &["light.volume={widening=1.0}"]),
    ("light.volume.scatter", Rays, LIT, &["light.volume={scatter=2.0}"]),
    ("light.volume.relief", Rays, LIT, &["light.volume={relief=0.1}"]),
    ("light.volume.wrap", Rays, LIT, &["light.volume={wrap=1.0}"]),
    ("light.volume.back", Rays, LIT, &["light.volume={back=2.0}"]),
    ("light.volume.back_direction", Rays, LIT, &["light.volume={back_direction=[0,1,-1]}"]),
    ("light.volume.back_colour", Rays, LIT, &["light.volume={back_colour=[0,1,0]}"]),
    ("light.volume.exposure", Rays, LIT, &["light.volume={exposure=2.0}"]),
    ("light.volume.ground.middle", Rays, LIT, &["light.volume={ground={middle=[1,1,1]}}"]),
    ("light.volume.ground.edge", Rays, LIT, &["light.volume={ground={edge=[1,1,1]}}"]),
    ("still.samples", Rays, STILL, &["still={samples=2}"]),
    ("still.seed", Rays, STILL, &["still={seed=7}"]),
    ("still.extinction", Rays, STILL, &["still={extinction=2.0}"]),
    ("still.albedo", Rays, STILL, &["still={albedo=0.5}"]),
    ("still.anisotropy", Rays, STILL, &["still={anisotropy=0.5}"]),
    ("still.events", Rays, STILL, &["still={events=2}"]),
    ("still.batch", Rays, STILL, &["still={batch=2}"]),
    // Stage 4.
    ("post.sigma.window", Nothing, "", &["post.sigma={window=5}"]),
    ("post.sigma.window_mm", Nothing, "", &["post.sigma={window_mm=2.0}"]),
    ("post.sigma.sigma", Nothing, "", &["post.sigma={sigma=0.3}"]),
    ("post.sigma.noise", Nothing, "", &["post.sigma={noise='multiplicative'}"]),
    ("post.sigma.repeat", Nothing, "", &["post.sigma={repeat=2}"]),
    ("post.enhanced_sigma.window", Nothing, "", &["post.enhanced_sigma={window=3}"]),
    ("post.enhanced_sigma.largest", Nothing, "", &["post.enhanced_sigma={largest=7}"]),
    ("post.enhanced_sigma.window_mm", Nothing, "", &["post.enhanced_sigma={window_mm=2.0}"]),
    ("post.enhanced_sigma.largest_mm", Nothing, "", &["post.enhanced_sigma={largest_mm=9.0}"]),
    ("post.enhanced_sigma.sigma", Nothing, "", &["post.enhanced_sigma={sigma=0.3}"]),
    ("post.enhanced_sigma.noise", Nothing, "", &["post.enhanced_sigma={noise='multiplicative'}"]),
    ("post.enhanced_sigma.centre", Nothing, "", &["post.enhanced_sigma={centre='gradient-inverse'}"]),
    ("post.enhanced_sigma.edge", Nothing, "", &["post.enhanced_sigma={centre='perona-malik',edge=0.4}"]),
    ("post.enhanced_sigma.growth", Nothing, "", &["post.enhanced_sigma={growth=true}"]),
    ("post.perona_malik.scheme", Nothing, "", &["post.perona_malik={scheme='aos'}"]),
    ("post.perona_malik.edge", Nothing, "", &["post.perona_malik={edge=0.4}"]),
    ("post.perona_malik.conductance", Nothing, "", &["post.perona_malik={conductance='exponential'}"]),
    ("post.perona_malik.step", Nothing, "", &["post.perona_malik={step=0.1}"]),
    ("post.perona_malik.repeat", Nothing, "", &["post.perona_malik={repeat=2}"]),
    ("post.perona_malik.width_mm", Nothing, "", &["post.perona_malik={width_mm=3.0}"]),
    ("post.antialias", Nothing, "", &["post.antialias=false"]),
    ("post.brightness", Nothing, "", &["post.brightness=0.3"]),
    ("post.contrast", Nothing, "", &["post.contrast=2.0"]),
    ("post.gamma", Nothing, "", &["post.gamma=2.0"]),
    ("post.colour_map", Nothing, "", &["post.colour_map=ice"]),
    ("post.floats", Nothing, "", &["post.floats=true"]),
    // What is drawn over pictures, and how a recording is played.
    ("marks.probe", Nothing, "", &["marks.probe=last"]),
    ("marks.lateral", Nothing, "", &["marks.lateral=left-right"]),
    ("marks.depth", Nothing, "", &["marks.depth=front-back"]),
    ("marks.elevation", Nothing, "", &["marks.elevation=head-feet"]),
    ("marks.bar", Nothing, "", &["marks.bar=true"]),
    ("measure.kind", Nothing, "", &["measure=[{kind='arrow',points=[[0,20,0],[5,22,1]]}]"]),
    ("measure.points", Nothing, "", &["measure=[{kind='distance',points=[[0,20,0],[5,22,1]]}]"]),
    (
        "measure.contours",
        Nothing,
        "",
        &["measure=[{kind='volume',contours=[[[0,20,0],[5,22,0],[3,19,0]],[[0,20,3],[5,22,3],[3,19,3]]]}]"],
    ),
    ("measure.text", Nothing, "", &["measure=[{kind='text',points=[[0,20,0]],text='here'}]"]),
    ("measure.threshold", Nothing, "", &["measure=[{kind='threshold',points=[[0,20,0],[5,22,1]],threshold=0.4}]"]),
    ("measure.counted", Nothing, "", &["measure=[{kind='threshold',points=[[0,20,0],[5,22,1]],counted=4.0}]"]),
    (
        "measure.interval",
        Nothing,
        "",
        &["measure=[{kind='threshold',points=[[0,20,0],[5,22,1]],counted=4.0,interval=[3.5,4.5]}]"],
    ),
    ("measure.made.volume", Nothing, "", &["measure=[{kind='distance',points=[[0,20,0],[5,22,1]],made={volume=3}}]"]),
    (
        "measure.made.time",
        Nothing,
        "",
        &["measure=[{kind='distance',points=[[0,20,0],[5,22,1]],made={volume=3,time=2.0}}]"],
    ),
    (
        "measure.made.plane",
        Nothing,
        "",
        &["measure=[{kind='distance',points=[[0,20,0],[5,22,1]],made={volume=3,plane='A'}}]"],
    ),
    (
        "measure.made.settings",
        Nothing,
        "",
        &["measure=[{kind='distance',points=[[0,20,0],[5,22,1]],made={volume=3,settings='Plane'}}]"],
    ),
    ("measure.on_surface", Nothing, "", &["measure=[{kind='distance',points=[[0,20,0],[5,22,1]],on_surface=true}]"]),
    ("body_marks.body", Nothing, "", &["body_marks=[{body='uterus'}]"]),
    ("body_marks.mirrored", Nothing, "", &["body_marks=[{mirrored=true}]"]),
    ("body_marks.at", Nothing, "", &["body_marks=[{at=[0.5,0.5]}]"]),
    ("body_marks.size", Nothing, "", &["body_marks=[{size=0.4}]"]),
    ("body_marks.probe", Nothing, "", &["body_marks=[{probe=[0.5,0.5]}]"]),
    ("body_marks.angle", Nothing, "", &["body_marks=[{angle=30.0}]"]),
    ("cine.first", Nothing, "", &["cine.first=1"]),
    ("cine.last", Nothing, "", &["cine.last=3"]),
    ("cine.speed", Nothing, "", &["cine.speed=2.0"]),
    ("cine.back_and_forth", Nothing, "", &["cine.back_and_forth=true"]),
    ("ray.tolerance", Rays, "", &["ray.tolerance=2.0"]),
    // A key's place decides which body it is tried on.
    ("slices.sigma.repeat", Rays, "slices.sigma={}", &["slices.sigma={repeat=2}"]),
    ("volume.colour", Rays, "", &["volume.colour=warm", "volume.colour=skin"]),
    ("volume.opacity", Rays, "", &["volume.opacity=bone", "volume.opacity=skin"]),
];

/// The keys of all settings, from the declaration of their types: those of tables within tables and lists after a dot.
pub fn declared() -> Vec<String> {
    let mut types = BTreeMap::new();
    let folder = repository("src/core/scene/settings");
    for entry in std::fs::read_dir(&folder).expect("the settings") {
        let path = entry.expect("a file").path();
        let text = std::fs::read_to_string(&path).expect("source");
        for item in syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display())).items {
            let Item::Struct(item) = item else { continue };
            let Fields::Named(fields) = item.fields else { continue };
            types.insert(item.ident.to_string(), fields.named.into_iter().collect::<Vec<_>>());
        }
    }
    let mut keys = Vec::new();
    collect("Settings", "", &types, &mut keys);
    keys
}

fn collect(name: &str, before: &str, types: &BTreeMap<String, Vec<syn::Field>>, keys: &mut Vec<String>) {
    let says = |field: &syn::Field, word: &str| {
        field.attrs.iter().any(|a| a.meta.require_list().is_ok_and(|list| list.tokens.to_string() == word))
    };
    for field in types[name].iter().filter(|field| !says(field, "skip")) {
        let key = format!("{before}{}", field.ident.as_ref().expect("a name"));
        match innermost(&field.ty) {
            Some(part) if says(field, "flatten") => collect(&part, before, types, keys),
            Some(inner) if types.contains_key(&inner) => collect(&inner, &format!("{key}."), types, keys),
            _ => keys.push(key),
        }
    }
}

/// The name of a type, of what it is a list or an option of.
fn innermost(of: &Type) -> Option<String> {
    let Type::Path(path) = of else { return None };
    let last = path.path.segments.last()?;
    match &last.arguments {
        PathArguments::AngleBracketed(arguments) => match arguments.args.first()? {
            GenericArgument::Type(inner) => innermost(inner),
            _ => None,
        },
        _ => Some(last.ident.to_string()),
    }
}
