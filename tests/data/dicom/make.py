"""Makes the DICOM files of this folder and expected.json: what is where in them, as pydicom 3 and numpy say.

Needs pydicom, numpy and pillow, dcmcrle and dcmcjpeg of dcmtk, and opj_compress and opj_decompress of OpenJPEG. No patient, no scanner: the pictures are formulas.
Run in this folder: python3 make.py
"""

import json
import subprocess
from pathlib import Path

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian, JPEG2000, JPEG2000Lossless, JPEGLSLossless

STORAGE = "1.2.840.10008.5.1.4.1.1."
expected = {}


def uid(n):
    return f"2.25.{2**127 + n}"


def one(**fields):
    item = Dataset()
    for name, value in fields.items():
        setattr(item, name, value)
    return item


def seq(**fields):
    return Sequence([one(**fields)])


def new(name, cls, syntax=ExplicitVRLittleEndian, number=1):
    ds, meta = Dataset(), FileMetaDataset()
    meta.MediaStorageSOPClassUID = cls
    meta.MediaStorageSOPInstanceUID = uid(1000 + number)
    meta.TransferSyntaxUID = syntax
    meta.ImplementationClassUID = uid(0)
    ds.file_meta = meta
    ds.SOPClassUID, ds.SOPInstanceUID = cls, meta.MediaStorageSOPInstanceUID
    # Names that must not be shown or copied.
    ds.PatientName, ds.PatientID, ds.PatientBirthDate, ds.PatientSex = "Secret^Name", "SECRET-ID", "19010203", "F"
    ds.InstitutionName, ds.ReferringPhysicianName = "Secret Hospital", "Secret^Doctor"
    ds.StudyDate, ds.StudyTime, ds.AccessionNumber, ds.StudyID = "20010203", "040506", "SECRET-NO", "SECRET"
    ds.Modality, ds.Manufacturer, ds.ManufacturerModelName = "US", "Nobody", "Formula 1"
    ds.StudyInstanceUID, ds.SeriesInstanceUID = uid(1), uid(2)
    ds.SeriesNumber, ds.InstanceNumber = 1, number
    return ds


def pixels(ds, array, photometric="MONOCHROME2"):
    """array: frames, rows, columns and channels."""
    frames, rows, columns = array.shape[:3]
    bits = array.dtype.itemsize * 8
    ds.SamplesPerPixel = array.shape[3] if array.ndim == 4 else 1
    if ds.SamplesPerPixel > 1:
        ds.PlanarConfiguration = 0
    ds.PhotometricInterpretation, ds.NumberOfFrames, ds.Rows, ds.Columns = photometric, frames, rows, columns
    ds.BitsAllocated = ds.BitsStored = bits
    ds.HighBit, ds.PixelRepresentation = bits - 1, 0
    data = array.tobytes()
    ds.PixelData = data + b"\0" * (len(data) % 2)
    ds["PixelData"].VR = "OB" if bits == 8 else "OW"


def write(name, ds):
    Path(name).parent.mkdir(exist_ok=True)
    pydicom.dcmwrite(name, ds, enforce_file_format=True)


def expect(name, affine, array, times=None, tolerance=0):
    """affine: column, row and slice to LPS, mm. array: volumes, slices, rows, columns."""
    volumes, slices, rows, columns = array.shape
    expected[name] = {
        "affine": [[float(v) for v in row] for row in np.asarray(affine)[:3]],
        "size": [columns, rows, slices],
        "volumes": volumes,
        "values": [int(v) for v in array.ravel()],
        "times": times or [],
        "tolerance": tolerance,
    }


def affine(columns, rows, slices, origin):
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = columns, rows, slices, origin
    return matrix


def formula(*shape, dtype=np.uint8):
    """Smooth, so that JPEG keeps it, and different everywhere."""
    grid = np.meshgrid(*[np.arange(n) for n in shape], indexing="ij")
    wave = sum(np.sin(0.21 * (k + 2) * axis + k) for k, axis in enumerate(grid))
    most = np.iinfo(dtype).max
    return np.round((wave / len(shape) + 1) / 2 * most).astype(dtype)


def region(x0, y0, x1, y1, dx, dy, kind=1, form=1, units=3, reference=(0, 0), value=(0.0, 0.0)):
    return one(
        RegionSpatialFormat=form, RegionDataType=kind, RegionFlags=0,
        RegionLocationMinX0=x0, RegionLocationMinY0=y0, RegionLocationMaxX1=x1, RegionLocationMaxY1=y1,
        ReferencePixelX0=reference[0], ReferencePixelY0=reference[1],
        PhysicalUnitsXDirection=units, PhysicalUnitsYDirection=units,
        ReferencePixelPhysicalValueX=value[0], ReferencePixelPhysicalValueY=value[1],
        PhysicalDeltaX=dx, PhysicalDeltaY=dy,
    )  # fmt: skip


def multiframe(name, array, photometric="MONOCHROME2"):
    """Pictures in time with two regions: the larger one is of tissue and is read."""
    ds = new(name, STORAGE + "3.1")
    ds.FrameTime, ds.FrameIncrementPointer = "40", 0x00181063
    ds.SequenceOfUltrasoundRegions = Sequence([
        region(0, 0, 3, 3, 0.02, 0.02),
        region(4, 2, 19, 17, 0.0123, 0.0217, reference=(8, -3), value=(0.0, 0.5)),
        region(0, 18, 23, 19, 0.001, 0.02, form=3, units=4),
    ])
    pixels(ds, array, photometric)
    write(name, ds)
    return ds


def expect_region(name, grey, tolerance=0):
    part = grey[:, None, 2:18, 4:20]
    place = affine([0.123, 0, 0], [0, 0.217, 0], [0, 0, 1], [-8 * 0.123, 5 + 3 * 0.217, 0])
    expect(name, place, part, [0.04 * k for k in range(len(grey))], tolerance)


def luminance(rgb):
    return np.floor(rgb.astype(float) @ [0.299, 0.587, 0.114] + 0.5)


grey = formula(5, 20, 24)
multiframe("multiframe.dcm", grey)
expect_region("multiframe.dcm", grey)
subprocess.run(["dcmcrle", "multiframe.dcm", "multiframe-rle.dcm"], check=True)
expect_region("multiframe-rle.dcm", grey)
subprocess.run(["dcmcjpeg", "+eb", "+q", "95", "multiframe.dcm", "multiframe-jpeg.dcm"], check=True)
expect_region("multiframe-jpeg.dcm", pydicom.dcmread("multiframe-jpeg.dcm").pixel_array, 2)
# The frames in several fragments, which the table of offsets divides.
jpeg = pydicom.dcmread("multiframe-jpeg.dcm")
frames = list(pydicom.encaps.generate_frames(jpeg.PixelData, number_of_frames=5))
jpeg.PixelData = encapsulate(frames, fragments_per_frame=3, has_bot=True)
write("multiframe-fragments.dcm", jpeg)
expect_region("multiframe-fragments.dcm", jpeg.pixel_array, 2)

rgb = np.stack([formula(2, 20, 24), formula(2, 20, 24)[:, ::-1], 255 - formula(2, 20, 24)], axis=-1)
colours = multiframe("colours.dcm", rgb, "RGB")
expect_region("colours.dcm", luminance(rgb))
subprocess.run(["dcmcrle", "colours.dcm", "colours-rle.dcm"], check=True)
expect_region("colours-rle.dcm", luminance(rgb))
subprocess.run(["dcmcjpeg", "+eb", "+q", "95", "colours.dcm", "colours-jpeg.dcm"], check=True)
expect_region("colours-jpeg.dcm", luminance(pydicom.dcmread("colours-jpeg.dcm").pixel_array), 4)
colours.PlanarConfiguration = 1
colours.PixelData = rgb.transpose(0, 3, 1, 2).tobytes()
write("planes.dcm", colours)
expect_region("planes.dcm", luminance(rgb))
colours.PlanarConfiguration = 0
colours.PhotometricInterpretation, colours.PixelData = "YBR_FULL", rgb.tobytes()
write("ybr.dcm", colours)
expect_region("ybr.dcm", rgb[..., 0])
pairs = np.concatenate([rgb[:, :, 0::2, 0:1], rgb[:, :, 1::2, 0:1], rgb[:, :, 0::2, 1:]], axis=-1)
colours.PhotometricInterpretation, colours.PixelData = "YBR_FULL_422", pairs.tobytes()
write("ybr-422.dcm", colours)
expect_region("ybr-422.dcm", rgb[..., 0])

palette = multiframe("palette.dcm", grey[:2], "PALETTE COLOR")
table = np.array([[n, 255 - n, n * n // 255] for n in range(256)])
for colour, name in enumerate(["Red", "Green", "Blue"]):
    setattr(palette, f"{name}PaletteColorLookupTableDescriptor", [256, 0, 16])
    setattr(palette, f"{name}PaletteColorLookupTableData", (table[:, colour].astype("<u2") * 257).tobytes())
write("palette.dcm", palette)
expect_region("palette.dcm", luminance(table)[grey[:2]])



def jpeg_2000(name, source, array, *more, photometric=None, syntax=JPEG2000Lossless):
    """Packs frames with OpenJPEG. array: frames, rows, columns and channels. Returns the frames as OpenJPEG reads them again."""
    ds, frames, read = pydicom.dcmread(source), [], []
    rows, columns = array.shape[1:3]
    channels = array.shape[3] if array.ndim == 4 else 1
    bits = array.dtype.itemsize * 8
    for frame in array:
        # Raw pixels, channel after channel, in big-endian order.
        planes = frame.reshape(rows, columns, channels).transpose(2, 0, 1)
        Path("frame.raw").write_bytes(planes.astype(planes.dtype.newbyteorder(">")).tobytes())
        form = f"{columns},{rows},{channels},{bits},u"
        subprocess.run(["opj_compress", "-i", "frame.raw", "-o", "frame.j2c", "-F", form, "-n", "2", *more], check=True, capture_output=True)
        frames.append(Path("frame.j2c").read_bytes())
        subprocess.run(["opj_decompress", "-i", "frame.j2c", "-o", "back.rawl"], check=True, capture_output=True)
        back = np.frombuffer(Path("back.rawl").read_bytes(), array.dtype.newbyteorder("<"))
        read.append(back.reshape(channels, rows, columns).transpose(1, 2, 0).reshape(frame.shape))
    for path in ["frame.raw", "frame.j2c", "back.rawl"]:
        Path(path).unlink()
    ds.file_meta.TransferSyntaxUID = syntax
    ds.PixelData = encapsulate(frames)
    ds["PixelData"].VR = "OB"
    ds["PixelData"].is_undefined_length = True
    if photometric:
        ds.PhotometricInterpretation = photometric
    write(name, ds)
    return np.stack(read).astype(array.dtype)


# Without loss: any predictor, and the first; of 8 bits, of colours, and of 16 bits below.
subprocess.run(["dcmcjpeg", "+el", "+sv", "5", "multiframe.dcm", "multiframe-lossless.dcm"], check=True)
expect_region("multiframe-lossless.dcm", grey)
colours = multiframe("colours.dcm", rgb, "RGB")
subprocess.run(["dcmcjpeg", "+e1", "colours.dcm", "colours-lossless.dcm"], check=True)
expect_region("colours-lossless.dcm", luminance(rgb))
assert (jpeg_2000("multiframe-j2k.dcm", "multiframe.dcm", grey) == grey).all()
expect_region("multiframe-j2k.dcm", grey)
assert (jpeg_2000("colours-j2k.dcm", "colours.dcm", rgb, photometric="YBR_RCT") == rgb).all()
expect_region("colours-j2k.dcm", luminance(rgb))
lossy = jpeg_2000("multiframe-j2k-lossy.dcm", "multiframe.dcm", grey, "-I", "-r", "3", syntax=JPEG2000)
assert 0 < np.abs(lossy.astype(int) - grey).max() < 40
expect_region("multiframe-j2k-lossy.dcm", lossy, 1)

# One picture of 16 bits without regions, in implicit order, placed in the patient.
single = new("image.dcm", STORAGE + "6.1", ImplicitVRLittleEndian)
words = formula(1, 6, 7, dtype=np.uint16)
pixels(single, words)
single.PixelSpacing, single.SliceThickness = ["0.31", "0.29"], "1.5"
single.ImageOrientationPatient, single.ImagePositionPatient = ["0", "1", "0", "0", "0", "-1"], ["10", "-20.5", "30.25"]
write("image.dcm", single)
placed = affine([0, 0.29, 0], [0, 0, -0.31], [-1.5, 0, 0], [10, -20.5, 30.25])
expect("image.dcm", placed, words[None])
subprocess.run(["dcmcjpeg", "+e1", "image.dcm", "image-lossless.dcm"], check=True)
expect("image-lossless.dcm", placed, words[None])
assert (jpeg_2000("image-j2k.dcm", "image.dcm", words) == words).all()
expect("image-j2k.dcm", placed, words[None])
plain = new("plain.dcm", STORAGE + "6.1")
pixels(plain, formula(1, 6, 7))
write("plain.dcm", plain)


def turned(a, b, c):
    """A rotation by three angles."""
    (x, y, z), (u, v, w) = np.cos([a, b, c]), np.sin([a, b, c])
    return (
        np.array([[1, 0, 0], [0, x, -u], [0, u, x]])
        @ np.array([[y, 0, v], [0, 1, 0], [-v, 0, y]])
        @ np.array([[z, -w, 0], [w, z, 0], [0, 0, 1]])
    )


def enhanced(name, volume, order, syntax=ExplicitVRLittleEndian, patient=True, matrix=None, extra=0):
    """volume: volumes in time, slices, rows, columns. order: in which the frames are stored."""
    times, slices = volume.shape[:2]
    axes, spacing, origin = turned(0.3, -0.5, 0.2), [0.4, 0.6, 0.9], np.array([-12.5, 30.0, 7.25])
    ds = new(name, STORAGE + "6.2", syntax)
    ds.VolumeFrameOfReferenceUID, ds.UltrasoundAcquisitionGeometry = uid(5), "APEX"
    ds.ApexPosition = [1.0, -4.0, 2.5]
    ds.VolumeToTransducerMappingMatrix = list((np.eye(4) if matrix is None else matrix).ravel())
    shared = one(
        PixelMeasuresSequence=seq(PixelSpacing=[str(spacing[1]), str(spacing[0])], SliceThickness=str(spacing[2])),
        PlaneOrientationVolumeSequence=seq(ImageOrientationVolume=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    )
    if patient:
        text = [f"{v:.12f}" for v in axes[:, :2].T.ravel()]
        shared.PlaneOrientationSequence = seq(ImageOrientationPatient=text)
    ds.SharedFunctionalGroupsSequence = Sequence([shared])
    frames, groups = [], Sequence()
    for t, k in order:
        group = one(
            FrameContentSequence=seq(TemporalPositionIndex=t + 1, DimensionIndexValues=[t + 1, k + 1]),
            TemporalPositionSequence=seq(TemporalPositionTimeOffset=0.05 * t),
            PlanePositionVolumeSequence=seq(ImagePositionVolume=[1.0, 2.0, 3.0 + spacing[2] * k]),
            ImageDataTypeSequence=seq(DataType="TISSUE_INTENSITY", AliasedDataType="NO"),
        )
        if patient:
            text = [f"{v:.9f}" for v in origin + axes[:, 2] * spacing[2] * k]
            group.PlanePositionSequence = seq(ImagePositionPatient=text)
        groups.append(group)
        frames.append(volume[t, k])
    # Frames of another type of data, which are not tissue.
    for k in range(extra):
        group = one(
            FrameContentSequence=seq(TemporalPositionIndex=1, DimensionIndexValues=[1, k + 1]),
            PlanePositionVolumeSequence=seq(ImagePositionVolume=[1.0, 2.0, 3.0 + spacing[2] * k]),
            ImageDataTypeSequence=seq(DataType="FLOW_VELOCITY", AliasedDataType="NO"),
        )
        groups.append(group)
        frames.append(255 - volume[0, k])
    ds.PerFrameFunctionalGroupsSequence = groups
    array = np.stack(frames)
    if syntax == ExplicitVRBigEndian:
        pixels(ds, array.byteswap())
    else:
        pixels(ds, array)
    write(name, ds)
    if patient:
        columns, rows, steps = [axes[:, n] * spacing[n] for n in range(3)]
    else:
        columns, rows, steps, origin = [0.4, 0, 0], [0, 0.6, 0], [0, 0, 0.9], [1, 2, 3]
    stamps = [0.05 * t for t in range(times) for _ in range(slices)]
    expect(name, affine(columns, rows, steps, origin), volume, stamps)


mixed = [(1, 2), (0, 0), (0, 3), (1, 0), (0, 1), (1, 3), (1, 1), (0, 2)]
enhanced("enhanced.dcm", formula(2, 4, 6, 5), mixed)
straight = [(t, k) for t in range(2) for k in range(4)]
enhanced("enhanced-straight.dcm", formula(2, 4, 6, 5), straight, patient=False)
enhanced("enhanced-big.dcm", formula(2, 4, 6, 5, dtype=np.uint16), straight, ExplicitVRBigEndian)
enhanced("enhanced-flow.dcm", formula(1, 3, 6, 5), [(0, 2), (0, 0), (0, 1)], patient=False, extra=3)
# The transducer looks along z of the volume.
depth_z = np.array([[1, 0, 0, 4.0], [0, 0, 1, 5.0], [0, -1, 0, 6.0], [0, 0, 0, 1]])
enhanced("enhanced-depth-z.dcm", formula(1, 4, 6, 5), [(0, k) for k in range(4)], matrix=depth_z)
subprocess.run(["dcmcrle", "enhanced-big.dcm", "enhanced-rle.dcm"], check=True)
expected["enhanced-rle.dcm"] = expected["enhanced-big.dcm"]

# A folder of slices, whose names and numbers are not in the order of their places.
slices = formula(5, 6, 7)
axes = turned(-0.4, 0.1, 0.7)
for k, place in enumerate([3, 0, 4, 1, 2]):
    ds = new(f"series/{k}.dcm", STORAGE + "6.1", number=k + 1)
    pixels(ds, slices[place : place + 1])
    ds.PixelSpacing = ["0.5", "0.25"]
    ds.ImageOrientationPatient = [f"{v:.12f}" for v in axes[:, :2].T.ravel()]
    ds.ImagePositionPatient = [f"{v:.9f}" for v in axes[:, 2] * 0.8 * place + [5, 6, 7]]
    write(f"series/{k}.dcm", ds)
expect("series", affine(axes[:, 0] * 0.25, axes[:, 1] * 0.5, axes[:, 2] * 0.8, [5, 6, 7]), slices[None])

# A Kretz file in a block of private elements, beside a picture.
kretz = new("kretz.dcm", STORAGE + "6.1")
pixels(kretz, formula(1, 4, 4))
block = kretz.private_block(0x7FE1, "KRETZ_US", create=True)
volume = Path("../../fuzz/seeds/kretz/small.vol").read_bytes()
block.add_new(0x01, "OB", volume + b"\0" * (len(volume) % 2))
write("kretz.dcm", kretz)

# Volumes as Philips' QLAB exports them.
volume = formula(2, 3, 6, 5)
philips = new("philips.dcm", "1.2.840.113543.6.6.1.3.10002")
pixels(philips, volume.reshape(6, 6, 5))
philips.NumberOfFrames = 2  # of volumes
philips.PhysicalUnitsXDirection = philips.PhysicalUnitsYDirection = 3
philips.PhysicalDeltaX, philips.PhysicalDeltaY, philips.FrameTime = 0.05, 0.06, "50"
block = philips.private_block(0x3001, "Philips3D", create=True)
block.add_new(0x01, "UL", 3)
block.add_new(0x02, "US", 3)
block.add_new(0x03, "FD", 0.07)
write("philips.dcm", philips)
expect("philips.dcm", affine([0.5, 0, 0], [0, 0.6, 0], [0, 0, 0.7], [0, 0, 0]), volume, [0.0] * 3 + [0.05] * 3)

# What is not read.
ct = new("ct.dcm", STORAGE + "2")
ct.Modality = "CT"
pixels(ct, formula(1, 4, 4))
write("ct.dcm", ct)
ls = new("jpeg-ls.dcm", STORAGE + "6.1", JPEGLSLossless)
pixels(ls, formula(1, 4, 4))
ls.PixelData = encapsulate([b"\xff\xd8\xff\xd9"])
write("jpeg-ls.dcm", ls)

# One file a line.
lines = [f"{json.dumps(name)}: {json.dumps(value, separators=(',', ':'))}" for name, value in sorted(expected.items())]
Path("expected.json").write_text("{\n" + ",\n".join(lines) + "\n}\n")
