"""What is rendered: a fetal-head-like body in dark fluid as a Cartesian volume, and polar frames and sweeps, all u8.

The body is the same at every size, in mm, speckle included; a box of 100 mm about the origin holds it. Axes as Echolume has
them: x lateral, y depth (the camera looks along +y at azimuth 0), z elevation. Arrays are [z, y, x].
"""

import numpy as np

BOX = 100.0  # mm, edge of the volume

# Semi-axes of the head's outside (mm), and the layers from there inwards: thickness (mm), grey value 0..1.
HEAD = (38.0, 42.0, 40.0)
LAYERS = ((3.0, 0.36), (2.5, 0.5), (2.0, 0.08), (1e9, 0.22))
FLUID = 0.02
# Cells of the speckle lattice along the box.
CELLS = 128
SOFT = 0.8  # mm over which one layer goes over into the next


def pitch(n):
    """Distance between voxels, mm."""
    return BOX / n


def places(n):
    """Centres of the voxels along an axis, mm."""
    return ((np.arange(n) + 0.5) * pitch(n) - BOX / 2).astype(np.float32)


def blurred(values, deviation):
    """A Gaussian along each axis of a periodic lattice, out to four standard deviations."""
    reach = int(4 * deviation + 0.5)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2).astype(np.float32)
    weights /= weights.sum()
    for axis in range(values.ndim):
        values = sum(w * np.roll(values, n - reach, axis) for n, w in enumerate(weights))
    return values


def speckle(seed):
    """Rayleigh envelope of mean 1 on a periodic lattice of CELLS^3."""
    random = np.random.default_rng(seed)
    parts = [blurred(random.standard_normal((CELLS,) * 3, dtype=np.float32), 0.8) for _ in range(2)]
    envelope = np.hypot(*parts)
    return envelope / envelope.mean()


def _step(distance):
    """0 outside, 1 inside, over SOFT mm."""
    return np.clip(distance / SOFT + 0.5, 0.0, 1.0)


def _ellipsoid(x, y, z, centre, axes):
    """Signed distance into an ellipsoid, nearly in mm near its surface."""
    q = [(c - o) / a for c, o, a in zip((x, y, z), centre, axes)]
    s = [(c - o) / (a * a) for c, o, a in zip((x, y, z), centre, axes)]
    k0 = np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2)
    k1 = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2) + 1e-9
    return k0 * (1.0 - k0) / k1


def anatomy(x, y, z):
    """Echogenicity 0..1 without speckle; x, y, z broadcast against each other, mm."""
    d = _ellipsoid(x, y, z, (0, 0, 0), HEAD)
    # A face on the near side (-y): nose, lips, chin, and hollows for the eyes.
    nose = _ellipsoid(x, y, z, (0, -41, -2), (4.0, 6.0, 6.5))
    lips = _ellipsoid(x, y, z, (0, -37.5, -15), (9.0, 4.5, 3.5))
    chin = _ellipsoid(x, y, z, (0, -33.5, -25), (9.0, 6.0, 5.5))
    eyes = np.maximum(*[_ellipsoid(x, y, z, (s * 12, -40, 6), (6.5, 5.5, 4.0)) for s in (-1, 1)])
    d = np.minimum(np.maximum.reduce([d, nose, lips, chin]), -eyes)
    value = np.full(np.broadcast(x, y, z).shape, FLUID, np.float32)
    depth = 0.0
    for thickness, level in LAYERS:
        value += (level - value) * _step(d - depth)
        depth += thickness
    # The falx, and two ventricles.
    inside = _step(d - depth + LAYERS[-1][0])
    falx = np.clip(1.0 - np.abs(x) / 0.9, 0, 1) * _step(z + 4.0)
    value += (0.42 - value) * falx * inside * _step(_ellipsoid(x, y, z, (0, 0, 0), (28, 31, 29)))
    for side in (-1, 1):
        value += (0.03 - value) * _step(_ellipsoid(x, y, z, (side * 9, 3, 4), (4.5, 14, 6)))
    return value


def volume(n, seed=1):
    """u8 [z, y, x] of n^3 voxels."""
    cells = speckle(seed)
    at = places(n)
    # Trilinear between the cells, an axis at a time.
    where = (np.arange(n) + 0.5) * CELLS / n - 0.5
    low = np.floor(where).astype(int)
    share = (where - low).astype(np.float32)
    low, high = low % CELLS, (low + 1) % CELLS
    out = np.empty((n, n, n), np.uint8)
    for k in range(n):
        plane = cells[low[k]] * (1 - share[k]) + cells[high[k]] * share[k]
        plane = plane[low] * (1 - share[:, None]) + plane[high] * share[:, None]
        plane = plane[:, low] * (1 - share) + plane[:, high] * share
        value = anatomy(at[None, :], at[:, None], at[k : k + 1, None])
        out[k] = np.clip(255 * value * (0.55 + 0.45 * plane) + 0.5, 0, 255)
    return out


def write_mha(path, voxels, spacing, origin):
    """MetaImage; spacing and origin along x, y, z in mm."""
    depth, height, width = voxels.shape
    header = (
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        f"Offset = {origin[0]} {origin[1]} {origin[2]}\nElementSpacing = {spacing[0]} {spacing[1]} {spacing[2]}\n"
        f"DimSize = {width} {height} {depth}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
    )
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(np.ascontiguousarray(voxels).tobytes())


def slices(count, edge, seed=3):
    """Noisy pictures of the head, u8 [count, edge, edge]: what filters run on."""
    random = np.random.default_rng(seed)
    at = places(edge)
    out = np.empty((count, edge, edge), np.uint8)
    for k in range(count):
        z = np.float32(-20 + 40 * k / max(count - 1, 1))
        value = anatomy(at[None, :], at[:, None], z)
        out[k] = np.clip(255 * (0.1 + 0.8 * value + 0.08 * random.standard_normal((edge, edge))), 0, 255)
    return out


# Polar frames of a curved array that wobbles, mm and deg. SWEEP: an abdominal probe. SCAN: small radius, so that a slice is square.
SWEEP = {"array": 40.0, "wobble": 25.0, "depth": 120.0, "sector": 68.0, "fan": 61.0, "samples": 512, "lines": 256, "frames": 37}
SCAN = {"array": 10.0, "wobble": 8.0, "depth": 120.0, "sector": 55.6, "fan": 30.0, "samples": 512, "lines": 256, "frames": 17}


def polar_places(probe):
    """Angles of the lines and of the frames (rad), and ranges from the array's apex (mm)."""
    half = lambda deg, count: np.radians(np.linspace(-deg / 2, deg / 2, count))
    ranges = probe["array"] + np.linspace(0, probe["depth"], probe["samples"])
    return half(probe["sector"], probe["lines"]), half(probe["fan"], probe["frames"]), ranges


def sweep(probe, seed=5):
    """The head behind 24 mm of fluid, u8 [frame, line, sample]."""
    random = np.random.default_rng(seed)
    lines, fans, ranges = polar_places(probe)
    axis = probe["array"] - probe["wobble"]
    out = np.empty((len(fans), len(lines), len(ranges)), np.uint8)
    for k, fan in enumerate(fans):
        x = (ranges[None, :] * np.sin(lines)[:, None]).astype(np.float32)
        rho = ranges[None, :] * np.cos(lines)[:, None] - axis
        y = axis + rho * np.cos(fan) - (probe["array"] + 68)
        value = anatomy(x, y.astype(np.float32), (rho * np.sin(fan)).astype(np.float32))
        noise = np.hypot(*random.standard_normal((2, len(lines), len(ranges)))) / 1.2533
        out[k] = np.clip(255 * value * (0.5 + 0.5 * noise) + 0.5, 0, 255)
    return out


def write_sweep(path, frames, probe):
    """The frames as a MetaImage of a sweep before scan conversion; metres and radians."""
    count, lines, samples = frames.shape
    pitch = probe["depth"] / (samples - 1) * 1e-3
    turn = lambda deg, n: np.radians(deg) / max(n - 1, 1)
    header = (
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        f"Offset = 0 0 0\nElementSpacing = {pitch * 1e3} 1 1\nDimSize = {samples} {lines} {count}\n"
        "UltrasoundImageType = PRESCAN_3D\nIsTransducerConvex = 1\n"
        f"TransducerRadius = {probe['array'] * 1e-3}\nScanLinePitch = {turn(probe['sector'], lines)}\n"
        f"MotorType = TiltingMotor\nMotorRadius = {probe['wobble'] * 1e-3}\nFramePitch = {turn(probe['fan'], count)}\n"
        f"AxialResolution = {pitch}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
    )
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(np.ascontiguousarray(frames).tobytes())


def distance_map(edge, seed=7):
    """A ball's distance map in mm with noise, f32 [edge, edge]; what the ray misses is far away."""
    random = np.random.default_rng(seed)
    x = np.linspace(-1, 1, edge)
    r2 = (x[None, :] ** 2 + x[:, None] ** 2) / 0.9
    ball = 140 - 40 * np.sqrt(np.maximum(1 - r2, 0)) + random.normal(0, 0.6, (edge, edge))
    return np.where(r2 < 1, ball, 200.0).astype(np.float32)
