#!/usr/bin/env python3
"""Writes the UFF files of the tests with h5py, as USTB's MATLAB class `uff` lays them out, and where their pixels are to expected.json.

    pip install h5py numpy
    tests/data/uff/make.py

The positions are those of USTB's scans: ndgrid of depth, azimuth (x) and elevation (y), and sph2cart for sectors. The envelope of a pixel is
10^(-d/20) with d = (7 i + 11 j + 5 k + 3 v) mod 41 dB of sample i, line j, slice k and volume v; the phase of complex data turns with i."""
import json, pathlib, shutil
import h5py
import numpy as np

here = pathlib.Path(__file__).parent
expected = {}


def put(group, name, values, kind="single", **layout):
    # MATLAB's axes are the other way round in the file, a vector is a column, and a dataset is one chunk.
    values = np.asarray(values)
    stored = values.T if values.ndim > 1 else values.reshape(1, -1)
    made = group.create_dataset(name, data=stored.astype(np.float32 if kind == "single" else kind), **{"chunks": stored.shape, **layout})
    for key, value in {"class": "single", "name": name}.items():
        made.attrs[key] = np.bytes_(value)
    made.attrs["complex"] = np.int32(0)
    made.attrs["imaginary"] = np.int32(0)


def structure(parent, name, kind):
    group = parent.create_group(name)
    for key, value in {"class": kind, "name": name}.items():
        group.attrs[key] = np.bytes_(value)
    group.attrs["array"] = np.int32(0)
    return group


def scan(group, kind, **axes):
    made = structure(group, "scan", kind)
    for name, values in axes.items():
        put(made, name, values)
    point = structure(made, "origin" if "sector" in kind else "transform", "uff.point")
    for name in ["distance", "azimuth", "elevation"] if "sector" in kind else ["translation"]:
        put(point, name, [0.0])


def decibels(shape, volumes):
    """d of (sample, line, slice, volume)."""
    i, j, k, v = np.meshgrid(*map(np.arange, [*shape, volumes]), indexing="ij")
    return (7 * i + 11 * j + 5 * k + 3 * v) % 41


def columns(values):
    """(pixel, channel, wave, frame), the first of which has samples fastest."""
    samples, lines, slices, volumes = values.shape
    return np.reshape(values, [samples * lines * slices, 1, 1, volumes], order="F")


def file(name, kind, axes, volumes, form):
    path = here / f"{name}.uff"
    with h5py.File(path, "w", libver="earliest") as made:
        made.attrs["version"] = np.bytes_("v1.0.0")
        group = structure(made, "b_data", "uff.beamformed_data")
        names = ["depth_axis", "azimuth_axis", "elevation_axis"] if "sector" in kind else ["z_axis", "x_axis", "y_axis"]
        given = [np.asarray(axis, np.float32) for axis in axes]
        scan(group, kind, **dict(zip(names, given)))
        put(group, "frame_rate", [1.0])
        shape = [len(axis) for axis in given] + [1] * (3 - len(given))
        db = decibels(shape, volumes)
        envelope = 10.0 ** (-db / 20.0) * 3.5e4
        if form == "complex":
            turned = envelope * np.exp(1j * 0.7 * np.arange(shape[0])[:, None, None, None])
            parts = group.create_group("data")
            parts.attrs["class"], parts.attrs["name"], parts.attrs["complex"] = np.bytes_("single"), np.bytes_("data"), np.int32(1)
            put(parts, "real", columns(turned.real))
            put(parts, "imag", columns(turned.imag))
        elif form == "envelope":
            put(group, "data", columns(envelope))
        elif form == "decibels":
            put(group, "data", columns(-db.astype(float)))
        elif form == "grey":
            put(group, "data", columns(db), "u1")
        elif form == "rf":
            put(group, "data", columns(envelope * np.cos(0.7 * np.arange(shape[0]))[:, None, None, None]))
        elif form == "chunked":
            put(group, "data", columns(envelope), chunks=(2, 1, 1, 50), compression="gzip", shuffle=True)
        elif form == "hollow":
            # Chunks that are stated and not there.
            group.create_dataset("data", (65536, 1, 1, int(np.prod(shape))), np.float32, chunks=(1, 1, 1, int(np.prod(shape))))
        elif form == "channels":
            put(group, "data", np.ones([int(np.prod(shape)), 4, 1, 1]))
        elif form == "wrong":
            put(group, "data", np.ones([int(np.prod(shape)) - 1, 1, 1, volumes]))
    depth, lateral, elevation = [*map(lambda axis: axis.astype(float), given), np.zeros(1)][:3]
    r, a, e = np.meshgrid(depth, lateral, elevation, indexing="ij")
    if "sector" in kind:
        # MATLAB's sph2cart(azimuth = elevation of the scan, elevation = azimuth of the scan, r) gives z, y, x.
        x, y, z = r * np.sin(a), r * np.cos(a) * np.sin(e), r * np.cos(a) * np.cos(e)
    else:
        x, y, z = a, e, r
    places = []
    for at in [(0, 0, 0), (1, 0, 0), (0, 1, 0), tuple(n - 1 for n in r.shape), (2, 1, r.shape[2] // 2)]:
        places.append([list(at), [1e3 * x[at], 1e3 * y[at], 1e3 * z[at]]])
    expected[name] = {"size": [*r.shape, volumes], "places": places}


line = lambda first, last, count: np.linspace(first, last, count)
file("linear", "uff.linear_scan", [line(5e-3, 41e-3, 37), line(-19e-3, 19e-3, 9)], 2, "envelope")
file("linear-3d", "uff.linear_scan_3D", [line(0, 30e-3, 16), line(-10e-3, 11e-3, 8), line(-4e-3, 5e-3, 4)], 1, "grey")
file("sector", "uff.sector_scan", [line(2e-3, 80e-3, 40), line(-0.6, 0.55, 12)], 1, "complex")
file("sector-3d", "uff.sector_scan", [line(10e-3, 90e-3, 21), line(-0.5, 0.5, 6), line(-0.3, 0.35, 5)], 2, "complex")
file("decibels", "uff.sector_scan_3D", [line(10e-3, 90e-3, 9), line(-0.5, 0.5, 4), line(-0.3, 0.3, 3)], 1, "decibels")
file("chunked", "uff.sector_scan", [line(10e-3, 90e-3, 21), line(-0.5, 0.5, 6), line(-0.3, 0.35, 2)], 5, "chunked")
file("hollow", "uff.linear_scan", [line(5e-3, 41e-3, 64), line(-19e-3, 19e-3, 64)], 1, "hollow")
file("rf", "uff.linear_scan", [line(5e-3, 41e-3, 9), line(-19e-3, 19e-3, 4)], 1, "rf")
file("channels", "uff.linear_scan", [line(5e-3, 41e-3, 9), line(-19e-3, 19e-3, 4)], 1, "channels")
file("wrong", "uff.linear_scan", [line(5e-3, 41e-3, 9), line(-19e-3, 19e-3, 4)], 1, "wrong")
file("uneven", "uff.linear_scan", [[5e-3, 6e-3, 8e-3], line(-19e-3, 19e-3, 4)], 1, "envelope")
for name in ["hollow", "rf", "channels", "wrong", "uneven"]:
    del expected[name]
with h5py.File(here / "channel-data.uff", "w", libver="earliest") as made:
    structure(made, "channel_data", "uff.channel_data")
with h5py.File(here / "other.h5", "w") as made:
    made["table"] = np.arange(4)
(here / "expected.json").write_text(json.dumps(expected, indent=1) + "\n")

# The sector about an origin that is 10 mm away, which no scan of USTB has.
shutil.copy(here / "sector.uff", here / "moved.uff")
with h5py.File(here / "moved.uff", "r+") as moved:
    moved["b_data/scan/origin/distance"][...] = 0.01
