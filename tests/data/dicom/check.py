"""Checks DICOM files that echolume writes with other programs: pydicom reads every voxel with the value and at the place that pydicom,
nibabel, pynrrd and SimpleITK read in the original (expected.json), and dciodvfy (dicom3tools) finds no error but those of KNOWN.

Needs pydicom, numpy and dicom3tools. Run in this folder: python3 check.py ../../../target/debug/echolume
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pydicom

# What the standard demands of an Enhanced US Volume, and nobody knows who converts a volume: when it was acquired and made, from which
# images, and how the transducer insonified. None of it is invented.
KNOWN = {
    "ContentDate", "ContentTime", "AcquisitionDateTime", "AcquisitionDuration", "SourceImageSequence", "MechanicalIndex",
    "BoneThermalIndex", "CranialThermalIndex", "SoftTissueThermalIndex", "DepthsOfFocus",
}  # fmt: skip

echolume = Path(sys.argv[1]).resolve()


def errors(path):
    said = subprocess.run(["dciodvfy", path], capture_output=True, text=True).stderr
    found = [line for line in said.splitlines() if line.startswith("Error")]
    return [line for line in found if not any(f"Element=<{name}>" in line for name in KNOWN)]


def convert(source, out, *more):
    subprocess.run([echolume, "convert", source, out, *more], check=True, capture_output=True)


def check(source, expected, folder):
    out = folder / "out.dcm"
    convert(source, out)
    ds = pydicom.dcmread(out)
    array = ds.pixel_array.reshape(-1, ds.Rows, ds.Columns)
    shared, groups = ds.SharedFunctionalGroupsSequence[0], ds.PerFrameFunctionalGroupsSequence
    row_mm, column_mm = map(float, shared.PixelMeasuresSequence[0].PixelSpacing)
    orientation = np.array(shared.PlaneOrientationSequence[0].ImageOrientationPatient, float)
    matrix = np.eye(4)
    matrix[:3] = expected["affine"]
    back = np.linalg.inv(matrix)
    columns, rows, slices = expected["size"]
    values = np.array(expected["values"]).reshape(-1, slices, rows, columns)[0]
    worst = 0.0
    for k, group in enumerate(groups):
        origin = np.array(group.PlanePositionSequence[0].ImagePositionPatient, float)
        for j in range(ds.Rows):
            for i in range(ds.Columns):
                place = origin + orientation[:3] * column_mm * i + orientation[3:] * row_mm * j
                index = (back @ [*place, 1])[:3]
                x, y, z = np.round(index).astype(int)
                worst = max(worst, np.linalg.norm(matrix[:3, :3] @ (index - [x, y, z])))
                assert array[k, j, i] == values[z, y, x], (source, i, j, k)
    assert worst < 1e-3, (source, worst)
    uids = {str(e.value) for e in ds.iterall() if e.VR == "UI" and str(e.value).startswith("2.25.")}
    assert all(len(uid) <= 64 for uid in uids) and len(uids) == 7, uids
    left = errors(out)
    assert not left, left
    print(f"{source.name}: {array.size} voxels are equal, places to {worst:.1e} mm, dciodvfy finds nothing new")


here = Path(__file__).parent
with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    known = json.loads((here / "expected.json").read_text())
    for name in ["enhanced.dcm", "enhanced-big.dcm", "enhanced-depth-z.dcm", "series", "image.dcm", "philips.dcm"]:
        check(here / name, known[name], folder)
    formats = json.loads((here / "../formats/expected.json").read_text())
    for name in ["colours.mha", "detached.nhdr", "gzip-lps.nrrd", "rgb.nii"]:
        check(here / "../formats" / name, formats[name], folder)
    for name in ["double.mha", "short.mha"]:
        out = folder / "capture.dcm"
        convert(here / "../formats" / name, out, "--secondary-capture")
        ds = pydicom.dcmread(out)
        columns, rows, slices = formats[name]["size"]
        assert ds.pixel_array.shape == (slices, rows, columns) and ds.pixel_array.max() == 255
        left = errors(out)
        assert not left, left
        print(f"{name} as a secondary capture: dciodvfy finds nothing")
