"""What is measured: one entry a row of the table."""

from dataclasses import dataclass, field

import peer_arrays
import phantom
import view

# Aims of the ratio of CPU time, Echolume over the fastest peer.
VOLUME, FIXED_PLANE, NEW_PLANE = 0.5, 0.8, 1.0


@dataclass(frozen=True)
class Row:
    name: str  # as asked for by --rows, with `:new` for a new volume every picture
    title: str
    kind: str  # "volume", or what else is read: "scan", "sweep", "slices", "distance"
    peers: tuple
    echolume: tuple = ()  # arguments; empty where Echolume has no such command
    without: tuple = ()  # subtracted: the same run without what the row is about
    new: bool = False
    inverted: bool = False
    sizes: tuple = (128, 256, 512)
    aim: float | None = None
    judged_by: str = "cpu"  # the time of which the aim is: "cpu" or "wall"
    per: int = 1  # frames or slices that one repeat works on
    notes: dict = field(default_factory=dict)  # by peer: another method

    @property
    def key(self):
        return self.name + (":new" if self.new else "")


# Without a preset Echolume smooths a recording and its surface, and takes four slices for a sample. The choice of one filter, here of
# none, replaces that of all.
UNFILTERED = ("slices.median=false", "distance.bilateral=none", "ray.elevation=linear")


def transfer(n):
    points = ",".join(f"{{at={at},colour=[{g},{g},{g}],opacity={a:.9f}}}" for at, g, a in view.transfer(n))
    return f"volume.transfer=[{points}]"


def arguments(row, n):
    """Of Echolume, for a row at a size: the camera, one sample a voxel, u8 stored as u8, the transfer function."""
    if row.kind != "volume":
        return list(row.echolume)
    # VTK's fixed-point caster ends a ray at 1/128 of the light left, and that is no setting there.
    sets = ["slices.format=r8", *UNFILTERED, f"ray.step={phantom.pitch(n)}", "ray.early_end=0.0078125", *view.PLANE]
    # Grey values as they are, and all of the volume, as the peers take them. By default the windows follow from the recording, and a
    # minimum projection takes a slab; surfaces keep their window, since no peer finds edges.
    sets += [f"{mode}.window=[0,1]" for mode in ("volume", "projection", "planes")]
    sets.append(f"region.depth=[{-phantom.BOX / 2},{phantom.BOX / 2}]")
    sets += [f"light.ambient={view.AMBIENT}", f"light.diffuse={view.DIFFUSE}", f"light.specular={view.SPECULAR}"]
    if "vr" in row.echolume:
        sets.append(transfer(n))
    # A plane needs few slices at first, and more as it turns: the pictures on which the volume grows are not those of a fixed or of a whole new one.
    if "mpr" in row.echolume:
        sets.append("slices.everything=true")
    return view.arguments() + list(row.echolume) + [word for s in sets for word in ("--set", s)]


GRADIENTS = "lit by volume gradients; Echolume lights the distance map"
FIRST_HIT = ("--mode", "vr", "--set", "volume.shading=first-hit")
SHADOW = ("--set", "light.shadow={}")
VOLUME_PEERS = ("VTK fixed-point", "VTK GPU")


def volume_rows(new):
    def row(name, title, echolume, peers, **more):
        more.setdefault("aim", VOLUME)
        title += ", a new volume every picture" if new else ", fixed volume"
        return Row(name, title, "volume", peers, echolume, new=new, **more)

    shaded = {peer: GRADIENTS for peer in VOLUME_PEERS}
    polygons = {
        "VTK flying edges": "triangles, made anew only with a new volume",
        "VTK GPU": "first crossing of a grey value; Echolume finds the edge with a ring of 8 samples",
        "pygfx": "first crossing of a grey value; Echolume finds the edge with a ring of 8 samples",
    }
    shadowed = {"VTK GPU": "shadow rays through the volume; Echolume traces the distance map"}
    return [
        row("shaded", "volume, shaded", FIRST_HIT, VOLUME_PEERS, notes=shaded),
        row("unshaded", "volume, unshaded", ("--mode", "vr"), VOLUME_PEERS),
        row("surface", "surface", ("--mode", "sr"), ("VTK GPU", "VTK flying edges", "pygfx"), notes=polygons),
        row("mip", "MIP", ("--mode", "mip"), ("VTK fixed-point", "pygfx", "vispy")),
        row("minip", "MinIP (volume inverted)", ("--mode", "minip"), ("VTK fixed-point", "pygfx", "vispy"), inverted=True),
        row("mean", "mean", ("--mode", "xray"), ("VTK GPU", "vispy")),
        row("mpr", "oblique plane (MPR)", ("--mode", "mpr"), ("VTK reslice",), aim=NEW_PLANE if new else FIXED_PLANE),
        row("shadows", "volume with shadows", FIRST_HIT + SHADOW, ("VTK GPU",), notes=shadowed, sizes=(128, 256)),
    ]


# The slice that the peers show is cut, though a picture that small is hardly one. All slices are made, as by the peers, not only
# those that the plane is cut from.
SETS = ("slices.format=r8", "slices.everything=true", "planes.window=[0,1]", *UNFILTERED)
TINY = ("--size", "16x16", "--mode", "mpr", *(word for s in SETS for word in ("--set", s)))


def slice_row(name, title, peers, setting, **more):
    plain = (*TINY, "--set", "planes.position=[0,0,0]")
    return Row(name, title, "slices", peers, (*plain, "--set", setting), plain, sizes=(512,), per=16, **more)


def distance_row(name, title, peers, setting, **more):
    plain = ("--size", "512x512", "--mode", "sr", "--still", *(word for s in UNFILTERED for word in ("--set", s)))
    return Row(name, title, "distance", peers, (*plain, "--set", setting), plain, sizes=(512,), **more)


def other_rows():
    pixel = phantom.pitch(512)
    edge = peer_arrays.EDGE
    near = {"SimpleITK": "exponential conductance, edge by the rms of gradients; Echolume 1/(1 + (g/k)^2)"}
    blur = f"slices.smooth={{lateral={peer_arrays.GAUSSIAN * pixel},depth={peer_arrays.GAUSSIAN * pixel}}}"
    diffuse = f"slices.perona_malik={{edge={edge},step=0.125,repeat={peer_arrays.STEPS}}}"
    bilateral = f"distance.bilateral={{pixels={peer_arrays.BILATERAL_PIXELS},distance={peer_arrays.BILATERAL_MM}}}"
    none = {"Echolume": "has no command that writes a Cartesian volume"}
    scan = (*TINY, "--set", "slices.pixels=512")
    return [
        Row("scan", "scan conversion 256 x 512 -> 512 x 512", "scan", ("OpenCV", "FAST"), scan, sizes=(512,), per=phantom.SCAN["frames"]),
        Row("sweep", "sweep to Cartesian, 512 x 256 x 37", "sweep", ("scipy",), sizes=(128, 256), notes=none),
        slice_row("median3", "median 3x3, slice of 512 x 512, u8", ("OpenCV", "SimpleITK"), "slices.median=true"),
        slice_row("gaussian", "Gaussian of 1.5 pixels, slice of 512 x 512, u8", ("OpenCV", "SimpleITK"), blur),
        slice_row("perona_malik", "Perona-Malik, 10 steps, slice of 512 x 512", ("SimpleITK",), diffuse, notes=near),
        distance_row("bilateral", "bilateral 3 px / 2 mm, map of 512 x 512, f32", ("OpenCV", "SimpleITK"), bilateral),
        distance_row(
            "median_wide", "median 11x11, map of 512 x 512, f32", ("SimpleITK", "scipy"), f"distance.median={peer_arrays.MEDIAN}"
        ),
    ]


ROWS = volume_rows(False) + volume_rows(True) + other_rows()
# What a worker is asked for: its own name of the row.
PEER_ROW = {"shaded": "vr_shaded", "unshaded": "vr", "shadows": "vr_shadows"}
