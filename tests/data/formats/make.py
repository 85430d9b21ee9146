"""Small volumes as other programs write them, with what those programs read back: expected.json.

pip install numpy nibabel pynrrd SimpleITK; python make.py

Each entry: `affine`, the upper three rows of the map from stored voxel indices to LPS mm; `size`, fastest first, and volumes;
`values`, fastest first. The numbers are made up: free to ship.
"""

import gzip
import json
import os

import nibabel as nib
import nrrd
import numpy as np
import SimpleITK as sitk

HERE = os.path.dirname(os.path.abspath(__file__))
RAS_TO_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])
EXPECTED = {}


def expect(name, affine, array):
    """`array` is indexed x, y, z[, t]; `affine` maps to LPS."""
    size = list(array.shape) + [1] * (4 - array.ndim)
    values = array.astype(float).flatten(order="F")
    EXPECTED[name] = {
        "affine": np.asarray(affine, float)[:3].tolist(),
        "size": size[:3],
        "volumes": size[3],
        "values": [round(v, 6) for v in values.tolist()],
    }


def at(name):
    return os.path.join(HERE, name)


def numbers(*size):
    return (np.arange(np.prod(size)) * 7 % 113).reshape(size, order="F")


def turned(angles, spacing, origin):
    x, y, z = angles
    rx = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    ry = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    rz = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    affine = np.eye(4)
    affine[:3, :3] = rz @ ry @ rx @ np.diag(spacing)
    affine[:3, 3] = origin
    return affine


def nifti(name, make, data, affine, how, rgb=False, zooms=None, scale=None):
    image = make(data, affine)
    image.set_sform(affine if how == "sform" else None, 1 if how == "sform" else 0)
    image.set_qform(affine if how == "qform" else None, 1 if how == "qform" else 0)
    image.header.set_xyzt_units("mm", "msec" if zooms else "sec")
    if zooms:
        image.header.set_zooms(zooms)
    if scale:
        image.header.set_slope_inter(*scale)
    nib.save(image, at(name))
    if how and name.endswith(".gz"):
        # Without the time of day, so that the file is always the same.
        packed = gzip.open(at(name)).read()
        with open(at(name), "wb") as out:
            out.write(gzip.compress(packed, mtime=0))
    back = nib.load(at(name))
    values = np.asanyarray(back.dataobj)
    if rgb:
        values = np.round(0.299 * values["R"] + 0.587 * values["G"] + 0.114 * values["B"])
    expect(name, RAS_TO_LPS @ back.affine, values)


oblique = turned((0.3, -0.2, 1.1), (0.5, 0.75, 1.25), (-12.5, 30.25, 7.0))
mirrored = oblique @ np.diag([1, 1, -1, 1])
nifti("oblique.nii", nib.Nifti1Image, numbers(5, 4, 3).astype(np.int16) - 50, oblique, "sform")
nifti("mirrored.nii.gz", nib.Nifti1Image, numbers(5, 4, 3).astype(np.float32) / 4, mirrored, "qform")
big = nib.Nifti2Image(numbers(4, 3, 2, 3).astype(">f8"), oblique, nib.Nifti2Header(endianness=">"))
big.set_sform(oblique, 1)
big.header.set_xyzt_units("mm", "msec")
big.header.set_zooms((0.5, 0.75, 1.25, 40.0))
big.header.set_slope_inter(0.5, 3)
big.header["pixdim"][4] = 40.0
nib.save(big, at("big-endian-4d.nii"))
back = nib.load(at("big-endian-4d.nii"))
assert back.header.endianness == ">"
expect("big-endian-4d.nii", RAS_TO_LPS @ back.affine, np.asanyarray(back.dataobj))
# Both matrices: what a writer of them is compared with.
both = nib.Nifti1Image(numbers(5, 4, 3).astype(np.int16) - 50, oblique)
both.set_sform(oblique, 1)
both.set_qform(oblique, 1)
both.header.set_xyzt_units("mm")
nib.save(both, at("both.nii"))
expect("both.nii", RAS_TO_LPS @ oblique.astype(np.float32), np.asanyarray(nib.load(at("both.nii")).dataobj))
colour = np.zeros((4, 3, 2), dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
for n, channel in enumerate("RGB"):
    colour[channel] = numbers(4, 3, 2) * (n + 1) % 200
nifti("rgb.nii", nib.Nifti1Image, colour, np.diag([-1.0, -2.0, 3.0, 1.0]), "sform", rgb=True)


def write_nrrd(name, data, header, affine_to_lps, **how):
    nrrd.write(at(name), data, header, **how)
    values, read = nrrd.read(at(name))
    affine = np.eye(4)
    affine[:3, :3] = np.array(read["space directions"], float)[-3:].T
    affine[:3, 3] = read["space origin"]
    expect(name, affine_to_lps @ affine, values)


def placed(space, affine, encoding):
    return {
        "space": space,
        "space directions": affine[:3, :3].T,
        "space origin": affine[:3, 3],
        "kinds": ["domain"] * 3,
        "space units": ["mm"] * 3,
        "encoding": encoding,
    }


LPS = np.eye(4)
write_nrrd("raw-ras.nrrd", numbers(5, 4, 3).astype(np.int16) - 50, placed("right-anterior-superior", oblique, "raw"), RAS_TO_LPS)
write_nrrd("gzip-lps.nrrd", numbers(5, 4, 3).astype(np.uint8), placed("left-posterior-superior", mirrored, "gzip"), LPS)
write_nrrd("bzip2-las.nrrd", numbers(5, 4, 3) / 8.0, placed("left-anterior-superior", oblique, "bzip2"), np.diag([1.0, -1, 1, 1]))
write_nrrd(
    "detached.nhdr", numbers(5, 4, 3).astype(np.uint16) * 300, placed("left-posterior-superior", oblique, "gzip"), LPS,
    detached_header=True,
)


def metaimage(name, array, affine, packed=False):
    """`array` is indexed x, y, z, or x, y, z, colour."""
    is_colour = array.ndim == 4
    image = sitk.GetImageFromArray(np.moveaxis(array, (0, 1, 2), (2, 1, 0)), isVector=is_colour)
    axes = affine[:3, :3]
    lengths = np.linalg.norm(axes, axis=0)
    image.SetSpacing(lengths.tolist())
    image.SetDirection((axes / lengths).flatten().tolist())
    image.SetOrigin(affine[:3, 3].tolist())
    sitk.WriteImage(image, at(name), packed)
    back = sitk.ReadImage(at(name))
    there = np.eye(4)
    there[:3, :3] = np.reshape(back.GetDirection(), (3, 3)) @ np.diag(back.GetSpacing())
    there[:3, 3] = back.GetOrigin()
    values = np.moveaxis(sitk.GetArrayFromImage(back), (0, 1, 2), (2, 1, 0)).astype(float)
    if is_colour:
        values = np.round(values @ [0.299, 0.587, 0.114])
    expect(name, there, values)


metaimage("double.mha", numbers(5, 4, 3) / 16.0 - 2, oblique)
metaimage("char.mha", (numbers(5, 4, 3) - 60).astype(np.int8), mirrored)
metaimage("int.mha", (numbers(5, 4, 3) * 1000 - 9).astype(np.int32), oblique, packed=True)
metaimage("short.mha", (numbers(5, 4, 3) - 60).astype(np.int16), oblique)
metaimage("colours.mha", np.stack([numbers(5, 4, 3) * n % 251 for n in (1, 2, 3)], axis=-1).astype(np.uint8), oblique)
with open(at("packed.mha.gz"), "wb") as out:
    out.write(gzip.compress(open(at("double.mha"), "rb").read(), mtime=0))
EXPECTED["packed.mha.gz"] = EXPECTED["double.mha"]

with open(at("expected.json"), "w") as out:
    out.write("{\n" + ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in sorted(EXPECTED.items())) + "\n}\n")
