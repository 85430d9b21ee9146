"""One peer in a process of its own: what crashes takes no other with it, and CPU time is that of the peer alone.

Reads one JSON request a line from standard input and answers each with one line; what libraries print goes to standard error.

    {"do": "prepare", "peer": "VTK fixed-point", "row": "vr", "size": 128, "new": false, "folder": "..."}
    {"do": "measure", "first": 0, "count": 5}     wall and CPU time of each picture, ns
    {"do": "picture", "file": "..."}              the last picture as a PNG
"""

import importlib
import json
import os
import sys
import time

import numpy as np

# Name of a peer: module and maker. A maker takes the row and the volumes and gives something with
# picture(number, volume or None), shown() and driver().
PEERS = {
    "VTK fixed-point": ("peer_vtk", "fixed_point"),
    "VTK GPU": ("peer_vtk", "gpu"),
    "VTK flying edges": ("peer_vtk", "FlyingEdges"),
    "VTK reslice": ("peer_vtk", "Reslice"),
    "pygfx": ("peer_pygfx", "rendered"),
    "vispy": ("peer_vispy", "rendered"),
    "OpenCV": ("peer_arrays", "opencv"),
    "FAST": ("peer_fast", "scan"),
    "SimpleITK": ("peer_arrays", "simpleitk"),
    "scipy": ("peer_arrays", "scipy"),
}


class Worker:
    def prepare(self, peer, row, size, new, folder, inputs):
        module, maker = PEERS[peer]
        module = importlib.import_module(module)
        arrays = [np.load(os.path.join(folder, name)) for name in inputs]
        self.made = getattr(module, maker)(row, arrays)
        self.new = new
        self.count = len(arrays)
        return {"version": module.version()}

    def measure(self, first, count):
        wall, cpu = [], []
        for n in range(first, first + count):
            # Counted from the process's beginning, so that a turn ends on the other volume than the next begins with.
            volume = n % self.count if self.new else None
            begun, used = time.perf_counter_ns(), time.process_time_ns()
            self.made.picture(n, volume)
            wall.append(time.perf_counter_ns() - begun)
            cpu.append(time.process_time_ns() - used)
        return {"wall": wall, "cpu": cpu, "driver": self.made.driver()}

    def picture(self, file):
        from PIL import Image

        Image.fromarray(self.made.shown()).save(file)
        return {}


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    worker = Worker()
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            answer = getattr(worker, asked.pop("do"))(**asked)
        except Exception as fault:  # told to who asked, who goes on with the next peer
            import traceback

            traceback.print_exc()
            answer = {"error": f"{type(fault).__name__}: {fault}".splitlines()[0][:300]}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


main()
