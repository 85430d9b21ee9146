"""Measures rows and writes the table. Started by tools/peers, which says how."""

import argparse
import dataclasses
import datetime
import json
import os
import platform
import select
import subprocess
import sys

import numpy as np

import echolume
import phantom
import rows
import table

HERE = os.path.dirname(os.path.abspath(__file__))
# The same for Echolume and for what runs on the same driver: what .cargo/config.toml sets.
DRIVER = {"LP_NATIVE_VECTOR_WIDTH": "256", "GALLIVM_PERF": "no_aos_sampling"}

# The file of the frames: not to be taken for one of another number.
SCAN = f"scan-{phantom.SCAN['frames']}"


class Peer:
    """A worker process; what goes wrong in it becomes `fault`."""

    LIMIT = 300  # s, of one request

    def __init__(self, name, log):
        self.name, self.fault, self.version, self.driver = name, None, None, None
        self.process = subprocess.Popen(
            [sys.executable, os.path.join(HERE, "worker.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True
        )

    def ask(self, do, **more):
        if self.fault:
            return None
        try:
            self.process.stdin.write(json.dumps({"do": do, **more}) + "\n")
            self.process.stdin.flush()
            ready, _, _ = select.select([self.process.stdout], [], [], self.LIMIT)
            line = self.process.stdout.readline() if ready else None
        except OSError:
            line = ""
        if line is None:
            self.fault = f"took over {self.LIMIT} s"
        elif not line:
            self.fault = f"its process ended ({self.process.wait()}), see peers.log"
        else:
            answer = json.loads(line)
            self.fault = answer.get("error")
            return answer if not self.fault else None
        return None

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


def inputs(folder, size):
    """Files that Echolume and the peers read, made once: by kind, and the arrays' names."""
    made = {}

    def array(name, make):
        path = os.path.join(folder, name + ".npy")
        if not os.path.exists(path):
            np.save(path + ".part.npy", make())
            os.replace(path + ".part.npy", path)
        made.setdefault("arrays", {})[name] = name + ".npy"
        return np.load(path, mmap_mode="r")

    def mha(kind, name, write):
        made[kind] = os.path.join(folder, name + ".mha")
        if not os.path.exists(made[kind]):
            write(made[kind] + ".part")
            os.replace(made[kind] + ".part", made[kind])

    lattice = lambda n: ([phantom.pitch(n)] * 3, [float(phantom.places(n)[0])] * 3)
    if size in (128, 256, 512):
        one = array(f"volume-{size}-1", lambda: phantom.volume(size, 1))
        array(f"volume-{size}-2", lambda: phantom.volume(size, 2))
        mha("volume", f"volume-{size}", lambda path: phantom.write_mha(path, one, *lattice(size)))
        for k in (1, 2):
            array(f"inverted-{size}-{k}", lambda: 255 - np.load(os.path.join(folder, f"volume-{size}-{k}.npy")))
        mha("inverted", f"inverted-{size}", lambda path: phantom.write_mha(path, 255 - np.asarray(one), *lattice(size)))
    slices = array("slices", lambda: phantom.slices(16, 512))
    mha("slices", "slices", lambda path: phantom.write_mha(path, slices, [phantom.pitch(512)] * 2 + [2.0], [-50, -50, -16]))
    array("distance", lambda: phantom.distance_map(512)[None])
    scan = array(SCAN, lambda: phantom.sweep(phantom.SCAN))
    mha("scan", SCAN, lambda path: phantom.write_sweep(path, scan, phantom.SCAN))
    array("sweep", lambda: phantom.sweep(phantom.SWEEP)[None])
    made["distance"] = made.get("volume") if size == 128 else None
    return made


def arrays_of(row, size):
    if row.kind == "volume":
        kind = "inverted" if row.inverted else "volume"
        return [f"{kind}-{size}-{k}.npy" for k in (1, 2)]
    return [f"{SCAN if row.kind == 'scan' else row.kind}.npy"]


def count_for(seconds, budget):
    """Repeats of one turn."""
    return int(min(7, max(1, budget / max(seconds, 1e-6))))


def measure(row, size, options, log):
    """All contestants of a row in turns; a row of the results."""
    made = inputs(options.work, size if row.kind == "volume" else 128)
    shown = lambda name: os.path.join(options.out, f"{row.name}{'-new' if row.new else ''}-{size}-{name.replace(' ', '-')}.png")
    cells, contestants = {}, []
    if row.echolume:
        own = echolume.Echolume(options.binary, row, size, made, options.work)
        try:
            own.picture(shown("Echolume"))
            contestants.append(("Echolume", own, count_for(own.estimate(), options.budget)))
            cells["Echolume"] = {"wall": [], "cpu": []}
        except echolume.Failed as fault:
            cells["Echolume"] = {"fault": str(fault)}
    else:
        cells["Echolume"] = {"fault": row.notes.get("Echolume", "has no such command")}
    for name in row.peers:
        if options.peers and name not in options.peers:
            continue
        peer = Peer(name, log)
        task = rows.PEER_ROW.get(row.name, row.name) + (f"_{size}" if row.kind == "sweep" else "")
        ready = peer.ask("prepare", peer=name, row=task, size=size, new=row.new, folder=options.work, inputs=arrays_of(row, size))
        peer.version = ready["version"] if ready else None
        # The first picture compiles shaders and builds what a fixed volume needs once; it is the one that is kept to look at.
        peer.ask("measure", first=0, count=1)
        peer.ask("picture", file=shown(name))
        warm = peer.ask("measure", first=1, count=1)
        if peer.fault:
            cells[name] = {"fault": peer.fault}
            peer.close()
            continue
        cells[name] = {"wall": [], "cpu": [], "version": peer.version, "driver": warm["driver"]}
        # By CPU time: a busy machine makes a run longer, not poorer.
        contestants.append((name, peer, count_for(warm["cpu"][0] * 1e-9 / os.cpu_count(), options.budget)))
    for turn in range(options.turns):
        # Every other turn the other way round, so that none always runs behind the same one.
        for name, who, count in contestants if turn % 2 == 0 else contestants[::-1]:
            if "fault" in cells[name]:
                continue
            try:
                if name == "Echolume":
                    got = who.measure(count)
                else:
                    # What takes seconds needs no picture to be warm again, only another angle than the last.
                    if count > 1:
                        who.ask("measure", first=0, count=1)
                    got = who.ask("measure", first=1 if count > 1 else 2 + turn, count=count) or {}
                    if who.fault:
                        raise echolume.Failed(who.fault)
            except echolume.Failed as fault:
                cells[name] = {"fault": str(fault)}
                continue
            for kind in ("wall", "cpu"):
                cells[name][kind] += [ns / row.per for ns in got[kind] or []]
    for name, who, _ in contestants:
        if name == "Echolume":
            cells[name].update(driver=who.driver, version=getattr(who, "program", None))
        else:
            who.close()
    for name, note in row.notes.items():
        if name in cells and name != "Echolume":
            cells[name]["note"] = note
    pictures = [(name, shown(name)) for name in cells if os.path.exists(shown(name))]
    for name, mean in table.side_by_side(pictures, options.out, row, size).items():
        cells[name]["differs"] = mean
    return {
        "row": row.key, "title": row.title, "size": size, "aim": row.aim, "judged_by": row.judged_by, "kind": row.kind,
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "load": os.getloadavg()[0], "cells": cells,
    }


# What draws on a GPU; a plane has the CPU's peer alone.
ON_GPU = ("VTK GPU", "pygfx", "vispy", "VTK reslice")


def on_gpu(row):
    """The row as it is measured on a GPU, at every size and judged by time by the wall; None if no peer of it draws there."""
    also = ("VTK GPU",) if row.name in ("mip", "minip") else ()
    peers = tuple(name for name in (*also, *row.peers) if name in ON_GPU)
    if row.kind != "volume" or not peers:
        return None
    return dataclasses.replace(row, peers=peers, sizes=(128, 256, 512), aim=rows.VOLUME, judged_by="wall")


def machine():
    cpu = next((l.split(":", 1)[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), platform.processor())
    return {"cpu": cpu, "cores": os.cpu_count(), "system": platform.platform(), "python": platform.python_version()}


def asked():
    parser = argparse.ArgumentParser(prog="tools/peers", description="Echolume beside what a user would pick instead, in one run on one machine.")
    parser.add_argument("--rows", default="", help="such as mip,mpr,shaded:new; default all: " + ", ".join(r.key for r in rows.ROWS))
    parser.add_argument("--sizes", help="edges of the volumes, of 128, 256, 512 (default 128,256; with --gpu all three)")
    parser.add_argument("--peers", default="", help="only these, such as 'pygfx,VTK GPU'")
    parser.add_argument("--turns", type=int, default=3, help="turns that all contestants of a row take (default 3)")
    parser.add_argument("--budget", type=float, default=0.8, help="seconds of one contestant's turn, at most 7 pictures (default 0.8)")
    parser.add_argument("--gpu", action="store_true", help="volumes on a GPU, by VTK, pygfx and vispy; ratios of time by the wall")
    parser.add_argument("--missing", action="store_true", help="only what the output folder does not hold yet")
    parser.add_argument("--out", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--binary", required=True)
    options = parser.parse_args()
    options.sizes = options.sizes or ("128,256,512" if options.gpu else "128,256")
    split = lambda text: [word.strip() for word in text.split(",") if word.strip()]
    options.rows, options.peers, options.sizes = split(options.rows), split(options.peers), [int(s) for s in split(options.sizes)]
    known = {r.key for r in rows.ROWS}
    unknown = [name for name in options.rows if name not in known]
    if unknown or any(s not in (128, 256, 512) for s in options.sizes):
        parser.error(f"unknown rows or sizes: {', '.join(unknown) or options.sizes}; rows are {', '.join(sorted(known))}")
    return options


def main():
    options = asked()
    if options.gpu:
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"
    else:
        os.environ.update(DRIVER)
    os.makedirs(os.path.join(options.out, "rows"), exist_ok=True)
    os.makedirs(options.work, exist_ok=True)
    with open(os.path.join(options.work, "peers.log"), "a") as log:
        for row in (on_gpu(row) for row in rows.ROWS) if options.gpu else rows.ROWS:
            if row is None:
                continue
            if options.rows and row.key not in options.rows:
                continue
            # What has no size of its own is measured whatever sizes are asked for.
            for size in row.sizes if len(row.sizes) == 1 else [s for s in row.sizes if s in options.sizes]:
                file = os.path.join(options.out, "rows", f"{row.key.replace(':', '-')}-{size}.json")
                if options.missing and os.path.exists(file):
                    continue
                measured = measure(row, size, options, log)
                with open(file + ".part", "w") as out:
                    json.dump(measured, out, indent=1)
                os.replace(file + ".part", file)
                print(table.line(measured), flush=True)
    table.write(options.out, [r.key for r in rows.ROWS], machine())
    print(f"written: {options.out}/table.md, {options.out}/table.json, and the pictures side by side")


main()
