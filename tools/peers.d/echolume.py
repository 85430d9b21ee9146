"""Echolume's own cells: `echolume profile` for times, `echolume render` for the picture."""

import json
import os
import subprocess

import rows
import view

LIMIT = 600  # s, of one run
# How the names of its passes begin that a peer has nothing of.
FILTERS = ("gaussian", "median", "sigma", "enhanced_sigma", "perona_malik", "aos", "rkl1", "estimator", "bilateral")


class Failed(Exception):
    pass


class Echolume:
    def __init__(self, binary, row, size, inputs, folder):
        self.binary, self.row = binary, row
        self.file = inputs[row.kind if row.kind != "volume" else ("inverted" if row.inverted else "volume")]
        self.arguments = rows.arguments(row, size)
        self.json = os.path.join(folder, "profile.json")
        self.driver = None

    def run(self, *arguments):
        try:
            done = subprocess.run(
                [self.binary, *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LIMIT
            )
        except subprocess.TimeoutExpired:
            raise Failed(f"took over {LIMIT} s") from None
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if line.strip()]
            raise Failed(lines[-1][:300] if lines else f"exit code {done.returncode}")

    def picture(self, file):
        if self.row.kind == "distance":
            return
        # What is made of a slice is shown large, though it is measured with the smallest of pictures.
        larger = {"16x16": f"{view.SIZE}x{view.SIZE}"}
        self.run("render", self.file, *[larger.get(word, word) for word in self.arguments], "-o", file)

    def profile(self, arguments, count):
        words = ["profile", self.file, *arguments, "--no-ceilings", "--json", self.json, "--warm-up", 1, "--repeat", count]
        if self.row.kind == "volume":
            words += ["--turn", view.TURN]
            if not self.row.new:
                words.append("--still")
        self.run(*words)
        with open(self.json) as file:
            measured = json.load(file)
        self.driver = f"{measured['device']['name']}, {measured['device']['driver']}"
        self.program = measured["program"]
        filters = [p["name"] for p in measured["passes"] if p["name"].startswith(FILTERS)]
        if self.row.kind == "volume" and filters:
            raise Failed(f"changed the volume: {', '.join(filters)}")
        made = max((p["runs_per_picture"] for p in measured["passes"] if p["stage"] == "preprocess"), default=self.row.per)
        if made < self.row.per:
            raise Failed(f"made {made} of {self.row.per} slices")
        return {"wall": measured["wall_ns"], "cpu": measured.get("cpu_ns") or None}

    def measure(self, count):
        """Wall and CPU time of each repeat, ns. Of a filter: less the median of the same without it, in the same turn."""
        measured = self.profile(self.arguments, count)
        if not self.row.without:
            return measured
        without = self.profile(list(self.row.without), count)
        less = lambda kind: [v - sorted(without[kind])[len(without[kind]) // 2] for v in measured[kind]]
        return {kind: less(kind) if measured[kind] else None for kind in measured}

    def estimate(self):
        """Seconds that a repeat takes when nothing else runs; the driver's caches are warm afterwards."""
        measured = self.profile(self.arguments, 2)
        return min(measured["cpu"] or measured["wall"]) * 1e-9 / os.cpu_count()
