#!/usr/bin/env python3
"""The server of `echolume stream --serve` read by pyigtl, and its volume compared with what `echolume convert` writes of the same sweep.

    pip install pyigtl numpy
    tests/io/igtl/pyigtl_check.py target/debug/echolume

Fails with the first difference; prints what was compared."""
import pathlib, re, signal, subprocess, sys, tempfile
import numpy as np
import pyigtl

program, top = sys.argv[1], pathlib.Path(__file__).resolve().parents[3]
sweep, spacing = top / "tests/data/wobbler-4dc7/sweep.mha", 1.5


def written(folder):
    """Voxels (k, j, i) and the voxel-to-world matrix (LPS) of a conversion."""
    path = pathlib.Path(folder) / "volume.mha"
    subprocess.run([program, "convert", sweep, path, "--spacing", str(spacing)], check=True, stdout=subprocess.DEVNULL)
    head, data = path.read_bytes().split(b"ElementDataFile = LOCAL\n", 1)
    field = dict(line.split(" = ", 1) for line in head.decode().splitlines())
    numbers = lambda key: np.array([float(word) for word in field[key].split()])
    size = [int(word) for word in field["DimSize"].split()]
    assert field["ElementType"] == "MET_UCHAR", field
    matrix = np.eye(4)
    matrix[:3, :3] = numbers("TransformMatrix").reshape(3, 3).T * numbers("ElementSpacing")
    matrix[:3, 3] = numbers("Offset")
    return np.frombuffer(data, np.uint8).reshape(size[::-1]), matrix


with tempfile.TemporaryDirectory() as folder:
    voxels, to_world = written(folder)
arguments = [program, "stream", "--source", sweep, "--rounds", "1000", "--rate", "2", "--null", "--mode", "mip", "--size", "96x80",
             "--serve", "igtl://127.0.0.1:0", "--serve-spacing", str(spacing)]
running = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
address = next(found for line in running.stdout if (found := re.match(r"serving: igtl://(.*):(\d+)", line)))
clients = [pyigtl.OpenIGTLinkClient(address[1], int(address[2])) for _ in range(2)]
for client in clients:
    picture = client.wait_for_message("EcholumePicture", timeout=60)
    volume = client.wait_for_message("EcholumeVolume", timeout=60)
    assert picture is not None and volume is not None, "no message came"
    assert picture.image.shape == (1, 80, 96, 3) and picture.image.dtype == np.uint8, picture.image.shape
    assert picture.image.max() > 40, "the picture is black"
    assert volume.image.shape == voxels.shape, (volume.image.shape, voxels.shape)
    assert volume.world_coordinate_system == "ras"
    worst = np.abs(volume.image.astype(int) - voxels.astype(int)).max()
    assert worst <= 1, f"voxels differ by {worst}"
    lps = np.diag([-1, -1, 1, 1]) @ volume.ijk_to_world_matrix
    off = np.abs(lps - to_world).max()
    assert off < 1e-4, f"places differ by {off} mm"
    assert abs(volume.timestamp - picture.timestamp) < 60
running.send_signal(signal.SIGINT)
rest = running.stdout.read()
assert running.wait(30) == 0 and "served" in rest, rest
for client in clients:
    client.stop()
print(f"two clients: picture {picture.image.shape}, volume {volume.image.shape}, voxels differ by at most {worst}, places by {off:.1e} mm")
print(next(line for line in rest.splitlines() if line.startswith("served")))
