"""FAST, a framework for streams of ultrasound: its scan conversion, in OpenCL."""

import os

import numpy as np

import phantom
from peer_arrays import Each


def version():
    from importlib import metadata

    return f"FAST {metadata.version('pyfast')}"


def scan(row, arrays):
    # Its windows, which nobody opens here, want a folder.
    os.environ.setdefault("XDG_RUNTIME_DIR", "/tmp")
    import fast

    fast.Reporter.setGlobalReportMethod(fast.Reporter.NONE)
    lines, _, ranges = phantom.polar_places(phantom.SCAN)
    # Samples down, lines across; gain and dynamic range are for frames in decibels.
    frames = [np.ascontiguousarray(one.T)[:, :, None] for one in arrays[0]]
    places = map(float, (ranges[0], ranges[-1], lines[0], lines[-1]))
    converter = fast.ScanConverter.create(512, 512, 10.0, 60.0, *places)

    def work(frame):
        converter.connect(fast.Image.createFromArray(frame))
        return np.asarray(converter.runAndGetOutputData())[:, :, 0]

    return Each(frames, work, "OpenCL on the processor (pocl)")
