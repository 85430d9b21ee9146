"""Peers that work on arrays: OpenCV, SimpleITK and scipy; scan conversion, sweeps to Cartesian, filters."""

import numpy as np

import phantom

# What the filters are given, in pixels and 0..1; rows.py gives Echolume the same.
GAUSSIAN = 1.5
EDGE, STEPS = 0.1, 10
BILATERAL_PIXELS, BILATERAL_MM = 3.0, 2.0
MEDIAN = 11


def version():
    import cv2
    import scipy as package
    import SimpleITK

    return f"OpenCV {cv2.__version__}, SimpleITK {SimpleITK.Version.VersionString()}, scipy {package.__version__}"


class Each:
    """Every array of a stack, one after another, through `work`."""

    def __init__(self, stack, work, driver="CPU", array=np.asarray):
        self.stack, self.work, self.said, self.array = stack, work, driver, array
        self.out = None

    def picture(self, n, volume):
        self.out = [self.work(one) for one in self.stack]

    def shown(self):
        one = np.asarray(self.array(self.out[len(self.out) // 2]), np.float32)
        low, high = (0, 255) if one.max() <= 255 and one.min() >= 0 and one.max() > 100 else (one.min(), one.max())
        grey = np.clip((one - low) * 255 / max(high - low, 1e-9), 0, 255).astype(np.uint8)
        return np.repeat(grey[:, :, None], 3, 2)

    def driver(self):
        return self.said


def scan_map(edge):
    """Where each pixel of a slice lies among the lines (y) and samples (x), as Echolume's look-up table has it."""
    probe = phantom.SCAN
    lines, _, ranges = phantom.polar_places(probe)
    width, low = 2 * ranges[-1] * np.sin(lines[-1]), ranges[0] * np.cos(lines[-1])
    pitch = max(width, ranges[-1] - low) / (edge - 1)
    x = -width / 2 + np.arange(int(np.ceil(width / pitch - 1e-9)) + 1) * pitch
    y = low + np.arange(int(np.ceil((ranges[-1] - low) / pitch - 1e-9)) + 1) * pitch
    r, t = np.hypot(x[None, :], y[:, None]), np.arctan2(x[None, :], y[:, None])
    sample = (r - ranges[0]) / (ranges[1] - ranges[0])
    line = (t - lines[0]) / (lines[1] - lines[0])
    outside = (sample < 0) | (sample > len(ranges) - 1) | (line < 0) | (line > len(lines) - 1)
    return np.where(outside, -2, sample).astype(np.float32), np.where(outside, -2, line).astype(np.float32)


def opencv(row, arrays):
    import cv2

    stack = arrays[0]
    if row == "scan":
        # Fixed-point maps: its quickest way.
        maps = cv2.convertMaps(*scan_map(512), cv2.CV_16SC2)
        work = lambda one: cv2.remap(one, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    elif row == "median3":
        work = lambda one: cv2.medianBlur(one, 3)
    elif row == "gaussian":
        taps = 2 * int(np.ceil(3 * GAUSSIAN)) + 1
        work = lambda one: cv2.GaussianBlur(one, (taps, taps), GAUSSIAN)
    elif row == "bilateral":
        window = 2 * int(np.ceil(3 * BILATERAL_PIXELS)) + 1
        work = lambda one: cv2.bilateralFilter(one, window, BILATERAL_MM, BILATERAL_PIXELS)
    else:
        raise ValueError(f"OpenCV has no {row}")
    return Each(stack, work, f"CPU, {cv2.getNumThreads()} threads")


def simpleitk(row, arrays):
    import SimpleITK as sitk

    threads = sitk.ProcessObject.GetGlobalDefaultNumberOfThreads()
    pictures = [sitk.GetImageFromArray(one) for one in arrays[0]]
    if row == "median3":
        made = lambda one: sitk.Median(one, (1, 1))
    elif row == "median_wide":
        made = lambda one: sitk.Median(one, (MEDIAN // 2,) * 2)
    elif row == "gaussian":
        made = lambda one: sitk.DiscreteGaussian(one, GAUSSIAN**2)
    elif row == "perona_malik":
        # Its conductance is exp(-(g / (K rms))^2): the rms of the gradients is not a setting, so K is near, not equal.
        pictures = [sitk.Cast(one, sitk.sitkFloat32) for one in pictures]
        made = lambda one: sitk.GradientAnisotropicDiffusion(one, 0.125, 1.0, 1, STEPS)
    elif row == "bilateral":
        made = lambda one: sitk.Bilateral(one, BILATERAL_PIXELS, BILATERAL_MM)
    else:
        raise ValueError(f"SimpleITK has no {row}")
    return Each(pictures, made, f"CPU, {threads} threads", sitk.GetArrayFromImage)


def scipy(row, arrays):
    from scipy import ndimage

    if row == "median_wide":
        return Each(arrays[0], lambda one: ndimage.median_filter(one, MEDIAN))
    if row.startswith("sweep_"):
        frames, edge = arrays[0][0], int(row.split("_")[1])
        where = sweep_map(edge)
        return Each([frames], lambda one: ndimage.map_coordinates(one, where, order=1, output=np.uint8)[edge // 2])
    raise ValueError(f"scipy has no {row}")


def sweep_map(edge):
    """Indices (frame, line, sample) of each voxel of a cube about the sweep: made once, as coordinates are cached."""
    probe = phantom.SWEEP
    lines, fans, ranges = phantom.polar_places(probe)
    axis = probe["array"] - probe["wobble"]
    at = (np.arange(edge) + 0.5) / edge - 0.5
    deep = ranges[-1] - ranges[0] * np.cos(lines[-1])
    x, z = at[None, None, :] * deep, at[:, None, None] * deep
    y = ranges[-1] + (at[None, :, None] - 0.5) * deep - axis
    rho = np.hypot(z, y)
    fan, deep = np.arctan2(z, y), rho + axis
    index = lambda value, places: (value - places[0]) / (places[1] - places[0])
    shape = (edge,) * 3
    parts = [index(fan, fans), index(np.arctan2(x, deep), lines), index(np.hypot(x, deep), ranges)]
    return np.stack([np.broadcast_to(p, shape).astype(np.float32) for p in parts])
