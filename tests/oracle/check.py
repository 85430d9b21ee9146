#!/usr/bin/env python3
"""A second implementation of stage 2 in numpy, written from docs/numerics.md and not from the program.

    echolume render RECORDING --dump DIR --raw ... && tests/oracle/check.py DIR

It reads the volume, the rays and the settings of a dump, casts the rays again in double precision, and compares with what the program
wrote: the distance map (mode surface, detector threshold without a rough search), the rendered picture (modes mip and volume without shading), or
the light that arrives in the cells of a light volume (light.volume without widening and scatter, light.follows = region, a fan).
Prints the differences; the exit code is 1 where they are larger than the limits below.
"""
import json
import sys
from pathlib import Path

import numpy as np


class Volume:
    """The 3D texture, and the map from space to its indices (docs/numerics.md, Geometry)."""

    def __init__(self, folder, scene):
        self.texels = np.load(folder / "volume.npy").astype(float)  # slice, row, column
        self.geometry, self.grid = scene["geometry"], scene["slice_pixels"]

    def indices(self, p):
        """Column, row and slice of places p (n, 3) in mm, and whether they are in the insonified region."""
        origin, pitch = self.grid["origin_mm"], self.grid["pitch_mm"]
        x, y, z = p.T
        if "cartesian" in self.geometry:
            grid = self.geometry["cartesian"]
            k = (z - grid["origin"][2]) / grid["spacing"][2]
            return np.stack([(x - origin[0]) / pitch[0], (y - origin[1]) / pitch[1], k]), np.ones(len(p), bool)
        probe = self.geometry["sweep"]
        array, lines, slices = probe["array"]["Curved"]["radius"], probe["lines"]["Even"], probe["slices"]["Even"]
        if probe["advance"] != "None":
            raise SystemExit("oracle: a motor that moves during a frame is not in it")
        axis = array - probe["motion"]["Fan"]["wobble_radius"]
        rho, angle = np.hypot(y - axis, z), np.arctan2(z, y - axis)
        y = rho + axis
        sample = (np.hypot(x, y) - array - probe["start_depth"]) / probe["sample_pitch"]
        line = (np.arctan2(x, y) - lines["first"]) / lines["pitch"]
        k = (angle - slices["first"]) / slices["pitch"]
        inside = (sample >= 0) & (sample <= probe["samples"] - 1) & (line >= 0) & (line <= lines["count"] - 1)
        inside &= (k >= 0) & (k <= slices["count"] - 1)
        return np.stack([(x - origin[0]) / pitch[0], (y - origin[1]) / pitch[1], k]), inside

    def at(self, p):
        """Trilinear samples; beyond the border the nearest texel is repeated."""
        index, inside = self.indices(p)
        last = np.array(self.texels.shape[::-1])[:, None] - 1
        index = np.clip(index, 0, last)
        low = np.minimum(index.astype(int), np.maximum(last - 1, 0))
        share = index - low
        total = np.zeros(len(p))
        for corner in range(8):
            bit = np.array([corner & 1, corner >> 1 & 1, corner >> 2])[:, None]
            weight = np.where(bit == 1, share, 1 - share).prod(axis=0)
            i, j, k = np.minimum(low + bit, last)
            total += weight * self.texels[k, j, i]
        return total, inside


def cast(scene):
    """Origins and unit directions of the rays (rows * columns, 3), and where they enter and leave the box, mm."""
    rays = scene["rays"]
    columns, rows = rays["size"]
    y, x = np.mgrid[0:rows, 0:columns] + 0.5
    place = lambda name: (np.array(rays[name]) + x[..., None] * np.array(rays[name + "_dx"]) + y[..., None] * np.array(rays[name + "_dy"])).reshape(-1, 3)
    origin, direction = place("origin"), place("direction")
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = ((np.array(scene["box"][side]) - origin) / direction for side in ("low_mm", "high_mm"))
    enter = np.maximum(np.nanmax(np.minimum(a, b), axis=1), 0)
    leave = np.nanmin(np.maximum(a, b), axis=1)
    return origin, direction, enter, leave


def windowed(values, window):
    return np.clip((values - window[0]) / (window[1] - window[0]), 0, 1)


def surface(scene, volume):
    """Distances in mm, NaN where there is no surface: the first crossing of D, followed to its largest value."""
    s = scene["settings"]["surface"]
    assert (s["detector"], s["rough"], s["number"], s["place"]) == ("threshold", 1, 1, "peak"), "other detectors are not in the oracle"
    m, ds = scene["detector"]["samples_of_an_edge"], scene["detector"]["step_mm"]
    sign = 1 if s["sign"] == "bright" else -1
    origin, direction, enter, leave = cast(scene)
    found = np.full(len(origin), np.nan)
    for ray in np.flatnonzero(leave > enter):
        count = int((leave[ray] - enter[ray]) / ds)
        # The ring is filled half an edge in front of the region, and an edge may peak behind it.
        first = max(-m, int(np.ceil(-enter[ray] / ds - 0.5)))
        n = np.arange(first, count + 3 * m)
        values, inside = volume.at(origin[ray] + direction[ray] * (enter[ray] + (n[:, None] + 0.5) * ds))
        values = windowed(values, s["window"])
        sums = np.concatenate([[0], np.cumsum(values)])
        gaps = np.concatenate([[0], np.cumsum(~inside)])
        d = np.full(len(n), np.nan)
        i = np.arange(2 * m - 1, len(n))
        means = (sums[i + 1] - 2 * sums[i + 1 - m] + sums[i + 1 - 2 * m]) / m
        d[i] = np.where(gaps[i + 1] == gaps[i + 1 - 2 * m], sign * means, np.nan)
        before = np.concatenate([[np.nan], d[:-1]])
        fires = np.flatnonzero((d > s["threshold"]) & ~(before > s["threshold"]) & (n >= m))
        if not len(fires):
            continue
        peak = fires[0]
        limit = peak + int(np.ceil(m * np.clip(0.25 / s["threshold"], 1, 16)))
        for at in range(fires[0] + 1, len(n)):
            if not d[at] >= 0.7 * d[peak] or at > limit:
                break
            peak = at if d[at] > d[peak] else peak
        if peak + 1 >= len(n) or np.isnan(d[peak + 1]):
            continue
        left = d[peak - 1] if not np.isnan(d[peak - 1]) else d[peak]
        bend = left - 2 * d[peak] + d[peak + 1]
        shift = np.clip(0.5 * (left - d[peak + 1]) / bend, -0.5, 0.5) if bend < 0 else 0
        place = (n[peak] + 1 - m + shift) * ds
        if 0 <= place <= leave[ray] - enter[ray]:
            found[ray] = enter[ray] + place
    return found


def mip(scene, volume):
    origin, direction, enter, leave = cast(scene)
    best = np.zeros(len(origin))
    for i in range(int(np.nanmax((leave - enter) / scene["step_mm"]))):
        at = (i + 0.5) * scene["step_mm"]
        values, inside = volume.at(origin + direction * (enter + at)[:, None])
        values = windowed(values, scene["settings"]["projection"]["window"])
        best = np.where(inside & (at <= leave - enter), np.maximum(best, values), best)
    return np.repeat(best[:, None], 3, axis=1)


def composited(scene, volume):
    """Emission and absorption, front to back; a step of length h is exp(-kappa h) transparent."""
    v, step = scene["settings"]["volume"], scene["step_mm"]
    assert (v["compositing"], v["shading"]) == ("corrected", "none"), "other compositing is not in the oracle"
    points = v["transfer"]
    at = [p["at"] for p in points]
    one_voxel = min(scene["slice_pixels"]["pitch_mm"])
    origin, direction, enter, leave = cast(scene)
    colour, light = np.zeros((len(origin), 3)), np.ones(len(origin))
    for i in range(int(np.ceil(np.nanmax((leave - enter) / step)))):
        # The last step is as long as what is left.
        length = np.clip(leave - enter - i * step, 0, step)
        values, inside = volume.at(origin + direction * (enter + i * step + length / 2)[:, None])
        values = windowed(values, v["window"])
        opacity = np.where(values >= v["threshold"], np.interp(values, at, [p["opacity"] for p in points]), 0)
        share = np.where(inside, 1 - (1 - opacity) ** (length / one_voxel), 0)
        tint = np.stack([np.interp(values, at, [p["colour"][c] for p in points]) for c in range(3)], axis=1)
        colour += (light * share)[:, None] * tint
        light *= 1 - share
    return colour


def light(scene, folder):
    """Light along single rays through the density of a light volume: Lambert and Beer's law, not from layer to layer. (n, 3) twice: theirs, ours."""
    density = np.load(folder / "light_matter.npy").astype(float)[..., 0]  # elevation, depth, lateral
    arriving = np.load(folder / "light_arriving.npy").astype(float)
    settings = scene["settings"]["light"]
    right, up, viewer = np.array(settings["direction"]) / np.linalg.norm(settings["direction"])
    towards = np.array([up, -viewer, right])  # of the axes of the arrays
    volume = settings["volume"]
    extinction = np.array([0.557, 1.0, 1.286]) ** volume["warmth"] / volume["depth"]
    size = np.array(density.shape)
    # Cells near matter: elsewhere there is little to compare.
    cells = np.argwhere(density > 0.02)
    cells = cells[np.random.default_rng(1).permutation(len(cells))[:6000]]
    step, optical = 0.5, np.zeros(len(cells))
    # Beyond the sides of the lattice its outermost cells repeat; light begins where it enters the layers, at the face of the box.
    across = int(np.abs(towards).argmax())
    for n in range(int(2 * np.linalg.norm(size))):
        at = cells + towards * step * (n + 0.5)
        inside = (at[:, across] >= -0.5) & (at[:, across] <= size[across] - 0.5)
        if not inside.any():
            break
        at = np.clip(at, 0, size - 1)
        low = np.minimum(at.astype(int), size - 2)
        share, value = at - low, 0.0
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, share, 1 - share), axis=1)
            value = value + weight * density[tuple((low + corner).T)]
        optical += inside * value * step * volume["cell"]
    return arriving[tuple(cells.T)][:, :3], np.exp(-optical[:, None] * extinction)


def main():
    folder = Path(sys.argv[1])
    scene = json.loads((folder / "scene.json").read_text())
    volume = Volume(folder, scene)
    mode = scene["settings"]["mode"]
    if scene["settings"]["light"].get("volume"):
        theirs, ours = light(scene, folder)
        off, bias = np.abs(theirs - ours).mean(), np.abs((theirs - ours).mean(axis=0)).max()
        alike = np.corrcoef(theirs[:, 1], ours[:, 1])[0, 1]
        # The lattice spreads light over half a cell a layer, so that single cells differ; their mean does not.
        print(f"light: mean {ours.mean():.3f}; {off:.3f} apart on average, {bias:.4f} in the mean of a colour, correlation {alike:.4f}")
        sys.exit(not (0.05 < ours.mean() < 0.95 and off < 0.05 and bias < 0.01 and alike > 0.97))
    if mode == "surface":
        theirs, ours = np.load(folder / "distance_map.npy").astype(float).ravel(), surface(scene, volume)
        hit = theirs < json.loads((folder / "distance_map.json").read_text())["no_surface"]
        both = hit & ~np.isnan(ours)
        lost = np.mean(hit != ~np.isnan(ours))
        off = np.abs(theirs - ours)[both]
        far = np.mean(off > 0.01)
        print(f"surface: {both.sum()} rays hit; {lost:.2%} of all by one only; median {np.median(off):.1e} mm, {far:.2%} more than 0.01 mm apart")
        sys.exit(not (both.sum() > 100 and lost < 0.005 and far < 0.005))
    theirs = np.load(folder / "picture.npy").astype(float)[..., :3].reshape(-1, 3)
    ours = mip(scene, volume) if mode == "mip" else composited(scene, volume)
    off = np.abs(theirs - ours).max(axis=1)
    print(f"{mode}: mean {ours.mean():.3f}; RMSE {np.sqrt(np.mean((theirs - ours) ** 2)):.1e}; {np.mean(off > 4e-3):.2%} of the pixels more than 0.004 apart, {off.max():.1e} at most")
    sys.exit(not (ours.mean() > 0.01 and np.mean(off > 4e-3) < 0.005))


if __name__ == "__main__":
    main()
