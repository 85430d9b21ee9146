"""Writes valid files of random descriptions, for tools/fuzz/formats: each writer returns a Case that another program's reader has confirmed."""
import dataclasses, gzip, io, os, struct, zlib

import h5py, nibabel, nrrd, numpy as np, pydicom, SimpleITK as sitk
from PIL import Image

METAIMAGE = {"uint8": "UCHAR", "int8": "CHAR", "int16": "SHORT", "uint16": "USHORT", "float32": "FLOAT", "float64": "DOUBLE", "int32": "INT",
             "uint32": "UINT", "int64": "LONG_LONG"}
TYPES = list(METAIMAGE)
RANGES = {"uint8": (0, 200), "int8": (-100, 100), "uint16": (0, 60000), "uint32": (0, 1 << 31)}
LUMINANCE = np.array([0.299, 0.587, 0.114])
# Name and mm; name and s.
UNITS = [("mm", 1), ("um", 1e-3), ("cm", 10), ("m", 1e3), ("microns", 1e-3), ("millimeters", 1), ("in", 25.4)]
SECONDS = [("s", 1), ("ms", 1e-3), ("us", 1e-6), ("seconds", 1), ("msec", 1e-3), ("microseconds", 1e-6), ("min", 60)]


@dataclasses.dataclass
class Case:
    """A file and what it holds."""
    path: str
    # "volumes": at step (columns, mm, LPS) and origin; "pictures": of a spacing (x, y, mm); "polar": of a scan.
    check: str
    # By volume, slice, row and column; of scans by volume, slice, line and sample, in geometric order.
    values: np.ndarray
    # The other program's reader finds what was written.
    is_agreed: bool
    step: np.ndarray = None
    origin: np.ndarray = None
    spacing: list = None
    scan: object = None
    # By volume, s.
    times: list = None
    args: list = dataclasses.field(default_factory=list)
    # The frames of a sweep are stored from the last slice to the first.
    backward: bool = False
    # Largest difference of a value; None: rounding to f32.
    tolerance: float = None
    # One file without compression, which may be packed as a whole.
    is_plain: bool = False
    # What else the file is: its pictures placed by a calibration.
    also: object = None


@dataclasses.dataclass
class Scan:
    """Axes in geometric order: ranges from the apex or the face (mm), lines and slices (rad or mm). x lateral, y depth, z elevation."""
    kind: str
    ranges: np.ndarray
    lines: np.ndarray
    slices: np.ndarray
    # Of the array, and of the axis that it turns about, mm from the apex along y.
    radius: float = 0.0
    axis: float = 0.0

    def place(self, i, j, k):
        """Where samples are, mm."""
        r, a, e = self.ranges[i], self.lines[j], self.slices[k]
        if self.kind == "linear":
            return np.stack([a, r, e], -1)
        beyond = r * np.cos(a) - self.axis
        return np.stack([r * np.sin(a), self.axis + beyond * np.cos(e), beyond * np.sin(e)], -1)

    def position(self, place):
        """Range, line and slice of places: the inverse."""
        x, y, z = np.moveaxis(place, -1, 0)
        if self.kind == "linear":
            return y, x, z
        depth = np.hypot(y - self.axis, z) + self.axis
        return np.hypot(x, depth), np.arctan2(x, depth), np.arctan2(z, y - self.axis)


def voxels(rng, size, kind, volumes, colours=()):
    """Random samples (t, z, y, x) of a type, few of them alike."""
    shape = (volumes, *size[::-1], *colours)
    generator = np.random.default_rng(rng.randrange(1 << 32))
    if kind.startswith("float"):
        return generator.normal(0, 100, shape).astype(kind)
    return generator.integers(*RANGES.get(kind, (-30000, 30000)), shape).astype(kind)


def turn(axis, angle):
    axis = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def rotation(rng):
    """An orthonormal matrix: along the axes, permuted, mirrored, or turned."""
    matrix = np.eye(3)[:, rng.sample(range(3), 3)] * np.array([rng.choice([-1, 1]) for _ in range(3)])
    return turn([rng.gauss(0, 1) for _ in range(3)], rng.uniform(0, np.pi)) @ matrix if rng.random() < 0.5 else matrix


def description(rng):
    """Size, type, step (columns, mm, LPS), origin, and the number of volumes."""
    size = [rng.choice([1, *range(2, 10)]) for _ in range(3)]
    spacing = np.array([rng.choice([0.2, 0.35, 0.5, 1, 1.25, 3]) for _ in range(3)])
    origin = np.array([rng.choice([0, 10, -25.5, 100.25]) for _ in range(3)], float)
    return size, rng.choice(TYPES), rotation(rng) * spacing, origin, rng.choice([1, 1, 1, 2, 3, 4])


def stamps(rng, count):
    """Rising times, uneven, from anywhere."""
    steps = [rng.choice([0.0125, 0.04, 0.5, 1 / 3]) for _ in range(count)]
    return list(rng.choice([0.0, 0.25, 1234.5]) + np.cumsum([0, *steps[1:]]))


def coloured(rng, size, kind, volumes):
    """Samples, sometimes of colours, their luminance, and how far that may be rounded."""
    if rng.random() > 0.2 or kind[0] == "i":
        data = voxels(rng, size, kind, volumes)
        return data, data.astype(float), None
    data = voxels(rng, size, kind, volumes, [rng.choice([3, 4])])
    return data, data[..., :3].astype(float) @ LUMINANCE, 0.501 if kind in ("uint8", "uint16") else None


def write_nrrd(rng, folder):
    size, kind, step, origin, volumes = description(rng)
    data, values, tolerance = coloured(rng, size, kind, volumes)
    space, sign = rng.choice([("left-posterior-superior", [1, 1, 1]), ("right-anterior-superior", [-1, -1, 1]),
                              ("left-anterior-superior", [1, -1, 1]), ("RAS", [-1, -1, 1]), ("LPS", [1, 1, 1])])
    unit, mm = rng.choice(UNITS)
    header = {"encoding": rng.choice(["raw", "gzip", "bzip2"]), "endian": rng.choice(["little", "big"])}
    samples, times = (data, None) if volumes > 1 else (data[0], None)
    # Names, the slowest axis first, then in the order of the file: those in space keep theirs.
    names = [*["time"] * (volumes > 1), *"zyx", *["colours"] * (data.ndim > 4)]
    others = [name for name in names if len(name) > 1]
    axes = [name for name in names if len(name) == 1]
    for name in others:
        is_usual = rng.random() < 0.6
        axes.insert((0 if name == "time" else len(axes)) if is_usual else rng.choice([0, len(axes)]), name)
    samples = np.ascontiguousarray(samples.transpose([names.index(name) for name in axes]))
    axes.reverse()
    each = lambda of, other: [of.get(name, other) for name in axes]
    channels = data.shape[-1]
    domain = "domain" if rng.random() < 0.5 else "space"
    colours = rng.choice([{3: "RGB-color", 4: "RGBA-color"}.get(channels), f"{channels}-color", "vector"])
    header["kinds"] = each({"colours": colours, "time": rng.choice(["list", "time"])}, domain)
    spacings, mins, maxs, units = {}, {}, {}, {}
    if volumes > 1 and "colours" not in axes and axes[-1] == "time" and rng.random() < 0.2:
        # As ITK writes four dimensions.
        (name, seconds), times, by = rng.choice(SECONDS), stamps(rng, 1), rng.choice([0.04, 1 / 3])
        whole = np.zeros((4, 4))
        whole[:3, :3], whole[3, 3] = (step * np.array(sign)[:, None] / mm).T, by / seconds
        header |= {"space": space.lower() + ("t" if len(space) == 3 else "-time"), "space units": [unit] * 3 + [name], "space directions": whole,
                   "space origin": [*(origin * sign / mm), times[0] / seconds], "kinds": ["domain"] * 4}
        times = [times[0] + by * n for n in range(volumes)]
    elif rng.random() < 0.7:
        directions = dict(zip("xyz", (step * np.array(sign)[:, None] / mm).T))
        header |= {"space": space, "space units": [unit] * 3, "space origin": origin * sign / mm,
                   "space directions": np.array(each(directions, np.full(3, np.nan)))}
    else:
        # Spacings: along the world.
        lengths = np.linalg.norm(step, axis=0)
        names, mm = zip(*[rng.choice(UNITS) for _ in range(3)])
        step, spacings, units = np.diag(lengths), dict(zip("xyz", lengths / mm)), dict(zip("xyz", names))
        origin, is_node = np.zeros(3), rng.random() < 0.5
        if rng.random() < 0.7:
            least = np.array([rng.choice([-12.5, 0.25, 40]) for _ in range(3)])
            mins = dict(zip("xyz", least))
            origin = least * mm + (0 if is_node else lengths / 2)
            header["centerings"] = each(dict.fromkeys("xyz", "node" if is_node else "cell"), "???")
            if min(size) > 1 and rng.random() < 0.4:
                maxs, spacings = dict(zip("xyz", least + lengths / mm * (np.array(size) - is_node))), {}
    if volumes > 1 and not times and (form := rng.choice(["none", "values", "steps", "seq"])) != "none":
        name, seconds = rng.choice(SECONDS)
        times = stamps(rng, volumes)
        if form == "seq":
            header |= {f"Seq_Frame{n:04}_Timestamp": repr(float(time)) for n, time in enumerate(times)}
        else:
            units |= {"time": name}
        if form == "values":
            n = axes.index("time")
            header |= {f"axis {n} index type": "numeric", f"axis {n} index values": " ".join(repr(float(time / seconds)) for time in times)}
        if form == "steps":
            first, by = times[0], rng.choice([0.04, 1 / 3])
            times = [first + by * n for n in range(volumes)]
            spacings |= {"time": by / seconds}
            mins |= {"time": first / seconds} if first else {}
    for field, of, other in [("spacings", spacings, np.nan), ("axis mins", mins, np.nan), ("axis maxs", maxs, np.nan), ("units", units, "")]:
        header |= {field: each(of, other)} if of else {}
    path = os.path.join(folder, "a.nrrd" if rng.random() < 0.7 else "a.nhdr")
    order = "<" if header["endian"] == "little" else ">"
    nrrd.write(path, samples.astype(samples.dtype.newbyteorder(order)), header, index_order="C")
    if path.endswith(".nhdr") and header["encoding"] == "raw" and rng.random() < 0.7:
        skipped(rng, path)
    back, said = nrrd.read(path, index_order="C")
    return Case(path, "volumes", values, np.array_equal(back, samples) and said["kinds"] == header["kinds"], step, origin, times=times, tolerance=tolerance,
                is_plain=path.endswith(".nrrd") and header["encoding"] == "raw")


def skipped(rng, path):
    """Puts bytes before the samples of a detached header."""
    more = rng.choice(["line skip: 1", "byte skip: 5", "byte skip: -1"])
    change_header = lambda text: text.replace(b"data file:", f"{more}\ndata file:".encode())
    for name, change in [(path.replace(".nhdr", ".raw"), lambda samples: b"junk\n" + samples), (path, change_header)]:
        with open(name, "rb") as file:
            content = change(file.read())
        with open(name, "wb") as file:
            file.write(content)


def numbers(values):
    return " ".join(repr(float(n)) for n in values)


def write_metaimage(rng, folder):
    size, kind, step, origin, volumes = description(rng)
    data, values, tolerance = coloured(rng, size, kind, volumes)
    spacing, times, is_plain = np.linalg.norm(step, axis=0), None, False
    if volumes > 1 or data.ndim > 4 or rng.random() < 0.5:
        # By hand: SimpleITK writes neither big-endian samples nor four dimensions of a chosen form.
        dims = 4 if volumes > 1 else 3
        matrix = np.eye(dims)
        matrix[:3, :3] = (step / spacing).T
        word = rng.choice(["TransformMatrix", "Orientation", "Rotation"])
        place = rng.choice(["Offset", "Position", "Origin"])
        big, form = rng.random() < 0.5, rng.choice(["LOCAL", "a.raw", "LIST", "a%d.raw", "packed"])
        samples, is_plain = data.astype(data.dtype.newbyteorder(">" if big else "<")), form == "LOCAL"
        lines = ["ObjectType = Image", f"NDims = {dims}", "BinaryData = True",
                 f"{rng.choice(['BinaryDataByteOrderMSB', 'ElementByteOrderMSB'])} = {big}", f"{word} = {numbers(matrix.ravel())}",
                 f"{place} = {numbers([*origin, 0][:dims])}", f"{rng.choice(['ElementSpacing', 'ElementSpacing', 'ElementSize'])} = {numbers([*spacing, 1][:dims])}",
                 f"DimSize = {' '.join(map(str, [*size, volumes][:dims]))}", f"ElementType = MET_{METAIMAGE[kind]}"]
        if data.ndim > 4:
            lines.append(f"ElementNumberOfChannels = {data.shape[-1]}")
        if volumes > 1 and rng.random() < 0.5:
            times = stamps(rng, volumes)
            lines += [f"Seq_Frame{n:04}_Timestamp = {float(time)!r}" for n, time in enumerate(times)]
        inside = samples.tobytes() if form == "LOCAL" else b""
        if form == "packed":
            inside = zlib.compress(samples.tobytes())
            lines += ["CompressedData = True"] + [f"CompressedDataSize = {len(inside)}"]
        skipped = rng.choice([0, 0, 7]) if form == "a.raw" else 0
        lines += [f"HeaderSize = {rng.choice([-1, skipped])}"] * (skipped > 0)
        slabs = samples if dims == 4 else samples[0]
        lines.append(f"ElementDataFile = {'LOCAL' if form == 'packed' else f'{form} 0 {len(slabs) - 1} 1' if '%' in form else form}")
        if form == "LIST":
            lines += [f"a{n}.raw" for n in range(len(slabs))]
        path = os.path.join(folder, "a.mha" if inside else "a.mhd")
        parts = {"a.raw": samples} if form == "a.raw" else {f"a{n}.raw": part for n, part in enumerate(slabs) if form in ("LIST", "a%d.raw")}
        parts = {name: b"x" * skipped + part.tobytes() for name, part in parts.items()}
        for name, content in {**parts, os.path.basename(path): "\n".join([*lines, ""]).encode() + inside}.items():
            with open(os.path.join(folder, name), "wb") as f:
                f.write(content)
    else:
        image = sitk.GetImageFromArray(data[0])
        image.SetSpacing(spacing.tolist())
        image.SetOrigin(origin.tolist())
        image.SetDirection((step / spacing).ravel().tolist())
        path = os.path.join(folder, rng.choice(["a.mha", "a.mhd"]))
        sitk.WriteImage(image, path, useCompression=rng.random() < 0.5)
    image = sitk.ReadImage(path)
    said = [image.GetMetaData(key) for key in sorted(image.GetMetaDataKeys()) if key.endswith("_Timestamp")]
    own = np.reshape(image.GetDirection(), [image.GetDimension()] * 2) @ np.diag(image.GetSpacing())
    is_placed = np.allclose(own[:3, :3], step, atol=1e-6) and np.allclose(image.GetOrigin()[:3], origin)
    is_agreed = is_placed and np.array_equal(sitk.GetArrayFromImage(image).reshape(data.shape), data) and [float(time) for time in said] == (times or [])
    return Case(path, "volumes", values, is_agreed, step, origin, times=times, tolerance=tolerance, is_plain=is_plain)


def write_nifti(rng, folder):
    size, kind, step, origin, volumes = description(rng)
    data = voxels(rng, size, kind, volumes)
    form = rng.choice(["plain", "plain", "scaled", "colours"])
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = step, origin
    affine = np.diag([-1, -1, 1, 1]) @ affine
    unit, mm = rng.choice([("mm", 1), ("micron", 1e-3), ("meter", 1e3)])
    affine[:3] /= mm
    if form == "colours":
        data = voxels(rng, size, "uint8", volumes, [3]).view([(name, "u1") for name in "RGB"])[..., 0]
    samples = np.moveaxis(data, 0, -1).transpose(2, 1, 0, 3)
    samples = samples[..., 0] if len(data) == 1 else samples
    header = nibabel.Nifti1Header(endianness=rng.choice("<>"))
    # Of a scaled one nibabel chooses slope and intercept.
    stored = np.dtype(rng.choice(["uint8", "int16"])) if form == "scaled" else samples.dtype
    header.set_data_dtype(stored)
    which = rng.choice([nibabel.Nifti1Image, nibabel.Nifti2Image])
    image = which(samples.astype(float) if form == "scaled" else samples, affine, header if which is nibabel.Nifti1Image else None, dtype=stored)
    image.set_data_dtype(stored)
    if rng.random() < 0.5:
        image.set_sform(None, 0)
        image.set_qform(affine, 1)
    elif rng.random() < 0.3:
        # The sform counts.
        image.set_qform(np.diag([2, 3, 4, 1]), 1)
    if rng.random() < 0.3:
        image.header.extensions.append(nibabel.nifti1.Nifti1Extension("comment", b"x" * rng.randint(1, 40)))
    seconds = rng.choice([("sec", 1), ("msec", 1e-3), ("usec", 1e-6)])
    image.header.set_xyzt_units(unit, seconds[0])
    times = None
    if volumes > 1:
        by, first = rng.choice([0.04, 0.5, 1 / 3]), rng.choice([0, 0, 12.25])
        image.header["pixdim"][4], image.header["toffset"] = by / seconds[1], first / seconds[1]
        times = [first + by * n for n in range(volumes)]
    path = os.path.join(folder, rng.choice(["a.nii", "a.nii.gz", "a.hdr"]))
    nibabel.save(image, path)
    back = nibabel.load(path)
    found = np.asarray(back.dataobj)
    quantum = np.ptp(samples.astype(float)) / 200 if form == "scaled" else 0
    is_agreed = found.shape == samples.shape and (np.array_equal(found, samples) if not quantum else np.abs(found - samples).max() <= quantum)
    if times:
        found_times = (float(back.header["pixdim"][4]) * seconds[1], float(back.header["toffset"]) * seconds[1])
        is_agreed &= np.allclose(found_times, (by, first), rtol=1e-6) and back.header.get_xyzt_units() == (unit, seconds[0])
    is_agreed &= np.allclose(back.affine, affine, atol=1e-5 * np.abs(affine).max())
    found = found.reshape(*found.shape[:3], -1).transpose(3, 2, 1, 0)
    values = np.stack([found[name].astype(float) for name in "RGB"], -1) @ LUMINANCE if form == "colours" else found.astype(float)
    return Case(path, "volumes", values, is_agreed, step, origin, times=times, tolerance=0.501 if form == "colours" else None)


def write_dicom(rng, folder):
    """A picture or a cine; its values are its luminance by pydicom."""
    packed = [pydicom.uid.RLELossless, pydicom.uid.JPEGBaseline8Bit, pydicom.uid.JPEG2000Lossless]
    syntax = rng.choice([pydicom.uid.ExplicitVRLittleEndian, pydicom.uid.ImplicitVRLittleEndian, pydicom.uid.ExplicitVRBigEndian, *packed])
    is_picture = syntax in packed[1:]
    rows, columns, frames = rng.randint(2, 20), rng.randint(2, 20), rng.choice([1, 1, 2, 5])
    colours = {packed[1]: ["YBR_FULL"], packed[2]: ["YBR_RCT", "RGB"]}.get(syntax, ["RGB", "YBR_FULL", "PALETTE COLOR"])
    look = rng.choice(["MONOCHROME2", "MONOCHROME1", *colours])
    bits = rng.choice([8, 16]) if look[0] in "MP" and syntax != packed[1] else 8
    generator = np.random.default_rng(rng.randrange(1 << 32))
    ds = pydicom.Dataset()
    ds.SOPClassUID = pydicom.uid.UltrasoundMultiFrameImageStorage if frames > 1 else pydicom.uid.UltrasoundImageStorage
    ds.SOPInstanceUID, ds.Modality = pydicom.uid.generate_uid(entropy_srcs=[str(rng.random())]), "US"
    ds.Rows, ds.Columns, ds.PhotometricInterpretation = rows, columns, look
    times = None
    if frames > 1:
        ds.NumberOfFrames = frames
        if rng.random() < 0.5:
            ds.FrameTime, ds.FrameIncrementPointer = rng.choice([40, "33.333333", "0.5"]), 0x00181063
            times = [float(ds.FrameTime) * n / 1e3 for n in range(frames)]
        else:
            ds.FrameTimeVector, ds.FrameIncrementPointer = [0] + [rng.choice([40, "33.333333", "12.5"]) for _ in range(frames - 1)], 0x00181065
            times = list(np.cumsum([float(ms) for ms in ds.FrameTimeVector]) / 1e3)
    ds.BitsAllocated, ds.PixelRepresentation, ds.SamplesPerPixel = bits, 0, 3 if look[0] in "RY" else 1
    ds.BitsStored = bits if bits == 8 else rng.choice([10, 12, 16])
    ds.HighBit = ds.BitsStored - 1
    spacing = [rng.choice([0.1, 0.25, 0.5]), rng.choice([0.1, 0.2, 0.5])]
    if rng.random() < 0.5:
        ds.PixelSpacing = spacing
    else:
        region = pydicom.Dataset()
        region.RegionSpatialFormat, region.RegionDataType, region.RegionFlags = 1, 1, 0
        region.RegionLocationMinX0, region.RegionLocationMinY0, region.RegionLocationMaxX1, region.RegionLocationMaxY1 = 0, 0, columns - 1, rows - 1
        region.PhysicalUnitsXDirection, region.PhysicalUnitsYDirection = 3, 3
        region.PhysicalDeltaX, region.PhysicalDeltaY = spacing[1] / 10, spacing[0] / 10
        ds.SequenceOfUltrasoundRegions = [region]
    if look == "MONOCHROME2" and rng.random() < 0.2:
        ds.RescaleSlope, ds.RescaleIntercept = rng.choice([2, "0.5"]), rng.choice([0, -100])
    shape = (frames, rows, columns) + ((3,) if ds.SamplesPerPixel == 3 else ())
    entries = rng.choice([16, 200, 256]) if look.startswith("PAL") else 1 << ds.BitsStored
    pixels = generator.integers(0, min(entries, 1 << ds.BitsStored), shape).astype(np.uint8 if bits == 8 else np.uint16)
    if look.startswith("PAL"):
        first = 0 if bits == 8 else rng.choice([0, 30])
        pixels = pixels + np.array(first, pixels.dtype)
        tables = [np.sort(generator.integers(0, 256, entries)).astype(np.uint16) * 257 for _ in range(3)]
        for name, table in zip(("Red", "Green", "Blue"), tables):
            setattr(ds, f"{name}PaletteColorLookupTableDescriptor", [entries, first, 16])
            setattr(ds, f"{name}PaletteColorLookupTableData", table.astype(">u2" if syntax == pydicom.uid.ExplicitVRBigEndian else "<u2").tobytes())
    stored = pixels
    if ds.SamplesPerPixel == 3:
        ds.PlanarConfiguration = rng.choice([0, 1]) if syntax not in packed else 0
        stored = np.moveaxis(pixels, -1, 1) if ds.PlanarConfiguration else pixels
    is_big = syntax == pydicom.uid.ExplicitVRBigEndian
    data = stored.astype(stored.dtype.newbyteorder(">" if is_big else "<")).tobytes()
    data += b"\0" * (len(data) % 2)
    is_words = bits == 16 or rng.random() < 0.5 or syntax == pydicom.uid.ImplicitVRLittleEndian
    if is_big and bits == 8 and is_words:
        data = np.frombuffer(data, "<u2").astype(">u2").tobytes()
    ds.PixelData = data
    ds["PixelData"].VR = "OW" if is_words else "OB"
    ds.file_meta = pydicom.dataset.FileMetaDataset()
    if is_picture:
        frames_of = [io.BytesIO() for _ in range(frames)]
        form = {"format": "JPEG", "quality": 95, "subsampling": 0} if syntax == packed[1] else {"format": "JPEG2000", "no_jp2": True, "mct": int(look == "YBR_RCT")}
        for picture, out in zip(pixels, frames_of):
            Image.fromarray(picture).save(out, **form)
        made = [out.getvalue() for out in frames_of]
        ds.PixelData = pydicom.encaps.encapsulate(made, fragments_per_frame=rng.choice([1, 2]), has_bot=rng.random() < 0.5)
        ds["PixelData"].VR, ds["PixelData"].is_undefined_length = "OB", True
        ds.file_meta.TransferSyntaxUID = syntax
    elif syntax == pydicom.uid.RLELossless:
        ds.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        ds.compress(syntax, generate_instance_uid=False)
    else:
        ds.file_meta.TransferSyntaxUID = syntax
    path = os.path.join(folder, "a.dcm")
    pydicom.dcmwrite(path, ds, enforce_file_format=True, little_endian=not is_big,
                     implicit_vr=syntax == pydicom.uid.ImplicitVRLittleEndian)
    back = pydicom.dcmread(path)
    found = pydicom.pixels.pixel_array(back, raw=syntax != packed[1]).reshape(shape)
    # JPEG loses something.
    is_agreed = np.array_equal(found, pixels) or syntax == packed[1]
    if is_picture:
        pixels = found
    values = pydicom.pixels.apply_rescale(pixels, back).astype(float)
    if look.startswith("PAL"):
        values = np.stack([table[pixels.astype(int) - first] / 257.0 for table in tables], -1)
    if look == "MONOCHROME1":
        values = (1 << ds.BitsStored) - 1 - values
    if look == "YBR_FULL" and not is_picture:
        values = values[..., 0]
    elif values.ndim == 4:
        values = values @ LUMINANCE
    return Case(path, "pictures", values[:, None], is_agreed, spacing=spacing[::-1], times=times, tolerance=3.5 if syntax == packed[1] else 1.01,
                # Whose frames stand whole and in order.
                is_plain=syntax not in packed and look[0] == "M" and not (is_big and bits == 8))


def axis(rng, span, count, is_even):
    """Rising positions over a span, more or less in its middle."""
    steps = np.ones(count - 1) if is_even else np.array([rng.uniform(0.5, 1.5) for _ in range(count - 1)])
    return span * (np.concatenate([[0], np.cumsum(steps)]) / steps.sum() - rng.choice([0.5, 0.45]))


def write_uff(rng, folder):
    """Beamformed data of USTB's classes, by h5py."""
    is_sector, is_3d, frames = rng.random() < 0.6, rng.random() < 0.5, rng.choice([1, 1, 2, 3])
    samples, lines, slices = rng.randint(2, 14), rng.randint(2, 8), rng.randint(2, 6) if is_3d else 1
    form, real = rng.choice(["complex", "amplitudes", "decibels", "grey"]), rng.choice(["<f4", "<f8", ">f4"])
    generator = np.random.default_rng(rng.randrange(1 << 32))
    first = rng.choice([0, 2e-3, 10e-3])
    depth = np.linspace(first, first + rng.choice([20e-3, 55e-3]), samples)
    is_even = rng.random() < 0.6
    lateral = axis(rng, rng.uniform(0.4, 1.8) if is_sector else rng.uniform(5e-3, 40e-3), lines, is_even)
    elevation = axis(rng, rng.uniform(0.3, 1.2) if is_sector else rng.uniform(5e-3, 20e-3), slices, is_even) if is_3d else np.zeros(1)
    # In the precision of the file.
    depth, lateral, elevation = [values.astype(real).astype(float) for values in (depth, lateral, elevation)]
    shape = (frames, slices, lines, samples)
    decibels = -generator.uniform(0, 80, shape)
    envelope = 10 ** (decibels / 20) * rng.choice([1e-6, 1, 3.5e4])
    if form != "decibels" and rng.random() < 0.3:
        envelope.flat[generator.integers(0, envelope.size, 3)] = 0
    is_packed = rng.random() < 0.5
    pixels = (frames, 1, 1, slices * lines * samples) if frames > 1 or rng.random() < 0.6 else (1, slices * lines * samples)
    chunk = tuple(rng.randint(1, n) for n in pixels) if rng.random() < 0.5 else pixels
    layout = {"chunks": chunk, **({"compression": "gzip", "shuffle": rng.random() < 0.5, "fletcher32": rng.random() < 0.3} if is_packed else {})}
    layout = layout if is_packed or rng.random() < 0.6 else {}
    path = os.path.join(folder, "a.uff")
    kind = f"uff.{'sector' if is_sector else 'linear'}_scan{'_3D' if is_3d and rng.random() < 0.5 else ''}"
    with h5py.File(path, "w", libver=rng.choice(["earliest", "latest"])) as file:
        def group(parent, name, of):
            made = parent.create_group(name)
            made.attrs.update({"class": np.bytes_(of), "name": np.bytes_(name), "array": np.int32(0)})
            return made
        if rng.random() < 0.3:
            group(file, "a_channel_data", "uff.channel_data")
        beamformed = group(file, rng.choice(["b_data", "beamformed"]), "uff.beamformed_data")
        scan = group(beamformed, "scan", kind)
        names = ["depth_axis", "azimuth_axis", "elevation_axis"] if is_sector else ["z_axis", "x_axis", "y_axis"]
        for name, values in zip(names, [depth, lateral, elevation][:3 if is_3d or rng.random() < 0.5 else 2]):
            scan.create_dataset(name, data=values.reshape(1, -1).astype(real))
        put = lambda where, name, values, of: where.create_dataset(name, data=values.reshape(pixels).astype(of), **layout)
        if form == "complex":
            signal = envelope * np.exp(1j * generator.uniform(0, 6, shape))
            parts = beamformed.create_group("data")
            put(parts, "real", signal.real, real)
            put(parts, "imag", signal.imag, real)
        else:
            stored = {"amplitudes": envelope, "decibels": decibels, "grey": generator.integers(0, 255, shape)}[form]
            put(beamformed, "data", stored, "u1" if form == "grey" else real)
    with h5py.File(path) as file:
        back = file[sorted(file)[-1]]
        data = back["data"]
        found = np.hypot(data["real"][()].astype(float), data["imag"][()].astype(float)) if form == "complex" else data[()].astype(float)
        found = found.reshape(shape)
        axes = [back["scan"][name][0].astype(float) for name in names if name in back["scan"]]
    written = {"complex": envelope, "amplitudes": envelope, "decibels": decibels}.get(form, found)
    is_agreed = np.allclose(found, written, rtol=1e-5, atol=1e-7 * written.max()) and all(map(np.array_equal, axes, [depth, lateral, elevation]))
    if form in ("complex", "amplitudes"):
        with np.errstate(divide="ignore"):
            found = np.maximum(20 * np.log10(found / found.max()), -200)
    unit = 1 if is_sector else 1e3
    scan = Scan("sector" if is_sector else "linear", depth * 1e3, lateral * unit, elevation * unit)
    return Case(path, "polar", found, is_agreed, scan=scan, tolerance=0.501 if form == "grey" else 1e-4)


def write_kretz(rng, folder):
    """A Kretz volume. No other program that is free reads one: the answer is what it was made of."""
    samples, lines, frames = rng.randint(3, 14), rng.randint(2, 8), rng.choice([1, 2, 3, 5])
    volumes = rng.choice([1, 1, 2, 3])
    values = np.random.default_rng(rng.randrange(1 << 32)).integers(0, 255, (volumes, frames, lines, samples)).astype(np.uint8)
    pitch, is_flat = rng.choice([0.25, 0.7, 2]), frames > 1 and rng.random() < 0.15
    radius = rng.choice([0, 20, 80.5])
    minus = -rng.choice([0, radius, radius / 4])
    is_even = rng.random() < 0.6
    across, along = axis(rng, rng.uniform(0.4, 1.8), lines, is_even), axis(rng, rng.uniform(0.3, 1.2), frames, is_even) if frames > 1 else np.zeros(1)
    is_reversed, is_backward = rng.random() < 0.3, frames > 1 and rng.random() < 0.3
    stored = values[:, ::-1] if is_backward and not is_flat else values
    stored = (stored[:, :, ::-1] if is_reversed and not is_flat else stored).tobytes()
    falling = lambda table, falls: table[::-1] if falls else table
    items = [(0x0110, 2, b"NOBODY"), (0xC000, 1, struct.pack("<H", samples)), (0xC000, 2, struct.pack("<H", lines)),
             (0xC000, 3, struct.pack("<H", frames)), (0xC100, 1, struct.pack("<d", pitch / 1e3))]
    if not is_flat:
        items += [(0xC200, 1, struct.pack("<d", radius)), (0xC200, 2, struct.pack("<d", minus)),
                  (0xC300, 2, (falling(across, is_reversed) + np.pi / 2).astype("<f8").tobytes())]
        items += [(0xC300, 1, (falling(along, is_backward) + np.pi / 2).astype("<f8").tobytes())] if frames > 1 or rng.random() < 0.5 else []
    rng.shuffle(items)
    still = stored[: frames * lines * samples]
    if volumes > 1:
        items += [(0xD000, 1, still)] * rng.randrange(2) + [(0xD600, 1, stored)]
    else:
        items += [(0xD000, 1, stored)]
    data = b"KRETZFILE 1.0   " + b"".join(struct.pack("<HHI", group, element, len(content)) + content for group, element, content in items)
    data += struct.pack("<HHI", 0xFFFF, 0xFFFF, 0) if rng.random() < 0.7 else b""
    is_packed = rng.random() < 0.3
    path = os.path.join(folder, "a.vol.gz" if is_packed else "a.vol")
    with open(path, "wb") as f:
        f.write(gzip.compress(data, mtime=0) if is_packed else data)
    if is_flat:
        return Case(path, "volumes", values.astype(float), True, np.eye(3) * pitch, np.zeros(3))
    radius, apex_to_axis = radius * pitch, -minus * pitch
    scan = Scan("sector", radius + pitch * np.arange(samples), across, along, radius, apex_to_axis if frames > 1 else 0.0)
    return Case(path, "polar", values.astype(float), True, scan=scan, backward=is_backward, tolerance=0.501)


def write_tracked(rng, folder):
    """Pictures of PLUS with poses. Half of them make up a lattice, whose voxels are their pixels."""
    kind, frames, is_nrrd, is_lattice = rng.choice(["uint8", "uint8", "int16", "float32"]), rng.randint(2, 6), rng.random() < 0.5, rng.random() < 0.5
    columns, rows = rng.randint(2, 9), rng.randint(2, 9)
    # In the order of PLUS: marked, far.
    data = voxels(rng, [columns, rows, frames], kind, 1)[0]
    # What was not reached is 0: no pixel may be it.
    data = np.where(data == 0, np.array(1, kind), data)
    word = rng.choice(["MF", "UF", "MN", "UN"]) if rng.random() < 0.7 else "MF"
    stored = data[:, ::-1 if word[1] == "N" else 1, ::-1 if word[0] == "U" else 1]
    times = stamps(rng, frames)
    px, py = rng.choice([0.2, 0.5, 1]), rng.choice([0.25, 0.5])
    image_to_probe, pose = np.eye(4), np.eye(4)
    image_to_probe[:3, :3] = turn([rng.gauss(0, 1) for _ in range(3)], rng.uniform(0, 3)) @ np.diag([px, py, py])
    image_to_probe[:3, 3] = [rng.uniform(-20, 20) for _ in range(3)]
    pose[:3, :3] = turn([rng.gauss(0, 1) for _ in range(3)], rng.uniform(0, 3))
    pose[:3, 3] = [rng.uniform(-100, 100) for _ in range(3)]
    across = np.cross(*(pose @ image_to_probe)[:3, :2].T)
    across *= max(px, py) / np.linalg.norm(across)
    poses = []
    for n in range(frames):
        moved = pose.copy()
        moved[:3, 3] += across * n
        if not is_lattice:
            moved[:3, :3] = turn([rng.gauss(0, 1) for _ in range(3)], rng.uniform(0, 0.1)) @ moved[:3, :3]
        poses.append(moved)
    has_reference, is_valid = rng.random() < 0.4, [is_lattice or n == 0 or rng.random() > 0.2 for n in range(frames)]
    reference = np.eye(4)
    reference[:3, :3], reference[:3, 3] = turn([1, 2, 3], rng.uniform(0, 3)), [5, -7, 11]
    fields = {}
    for n, matrix in enumerate(poses):
        fields |= {f"Seq_Frame{n:04}_ProbeToTrackerTransform": numbers((reference @ matrix if has_reference else matrix).ravel()),
                   f"Seq_Frame{n:04}_ProbeToTrackerTransformStatus": "OK" if is_valid[n] else "INVALID",
                   f"Seq_Frame{n:04}_Timestamp": repr(float(times[n])), f"Seq_Frame{n:04}_ImageStatus": "OK"}
        fields |= {f"Seq_Frame{n:04}_ReferenceToTrackerTransform": numbers(reference.ravel())} if has_reference else {}
    spacing = [rng.choice([0.3, 1]), rng.choice([0.4, 1])]
    if is_nrrd:
        path = os.path.join(folder, "a.nrrd")
        flat = rng.random() < 0.5
        header = {"space": "LPS", "kinds": ["domain"] * (2 if flat else 3) + ["list"], "endian": "little", "encoding": rng.choice(["raw", "gzip"]),
                  "space directions": np.array([[spacing[0], 0, 0], [0, spacing[1], 0], *[[0, 0, 1]] * (not flat), [np.nan] * 3]),
                  "ultrasound image orientation": word, "ultrasound image type": "BRIGHTNESS", **fields}
        nrrd.write(path, stored if flat else stored[:, None], header, index_order="C")
        back, said = nrrd.read(path, index_order="C")
    else:
        path = os.path.join(folder, "a.mha")
        lines = ["ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False", f"DimSize = {columns} {rows} {frames}",
                 "Kinds = domain domain list", f"ElementSpacing = {numbers([*spacing, 1])}", f"ElementType = MET_{METAIMAGE[kind]}",
                 f"UltrasoundImageOrientation = {word}", "UltrasoundImageType = BRIGHTNESS", *[f"{key} = {value}" for key, value in fields.items()],
                 "ElementDataFile = LOCAL", ""]
        with open(path, "wb") as f:
            f.write("\n".join(lines).encode() + stored.tobytes())
        image = sitk.ReadImage(path)
        back, said = sitk.GetArrayFromImage(image), {key: image.GetMetaData(key) for key in image.GetMetaDataKeys()}
    is_agreed = np.array_equal(back.reshape(stored.shape), stored) and all(said.get(key) == value for key, value in fields.items())
    case = Case(path, "pictures", data[:, None].astype(float), is_agreed, spacing=spacing, times=times, is_plain=not is_nrrd or header["encoding"] == "raw")
    args = ["--calibration", "ImageToProbe=" + numbers(image_to_probe.ravel())]
    placed = [matrix @ image_to_probe for matrix in poses]
    if is_lattice:
        step, origin = np.column_stack([placed[0][:3, :2], across]), placed[0][:3, 3]
        case.also = Case(path, "volumes", data[None].astype(float), is_agreed, step, origin, args=args, tolerance=0.51 if kind != "float32" else 0.01)
    else:
        case.also = Case(path, "compounded", data.astype(float), is_agreed, args=args, tolerance=0.51 if kind != "float32" else 0.01)
        case.also.step = [matrix if valid else None for matrix, valid in zip(placed, is_valid)]
    return case


def packed(rng, case):
    """Packs some files as a whole by gzip."""
    if case.is_plain and rng.random() < 0.2:
        with open(case.path, "rb") as plain, open(case.path + ".gz", "wb") as file:
            file.write(gzip.compress(plain.read(), mtime=0))
        os.remove(case.path)
        for each in [case, case.also] if case.also else [case]:
            each.path += ".gz"
    return case


WRITERS = {"nrrd": write_nrrd, "metaimage": write_metaimage, "nifti": write_nifti, "dicom": write_dicom, "uff": write_uff, "kretz": write_kretz,
           "plus": write_tracked}
