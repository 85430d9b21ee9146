#!/usr/bin/env python3
"""Writes the licences of the crates that the program is built from, each text once, with the crates that have it. Run in the root of the
repository, where the sources of the crates are in cargo's registry."""

import collections
import json
import re
import subprocess
import sys
from pathlib import Path

command = ["cargo", "metadata", "--format-version", "1", "--locked", "--offline"]
host = re.search(r"^host: (.*)$", subprocess.check_output(["rustc", "-vV"], text=True), re.M)[1]
metadata = json.loads(subprocess.check_output([*command, "--filter-platform", host]))
packages = {package["id"]: package for package in metadata["packages"]}
nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}

# What tests alone need is in no program.
needed, ahead = set(), [metadata["resolve"]["root"]]
while ahead:
    at = ahead.pop()
    if at not in needed:
        needed.add(at)
        ahead += [d["pkg"] for d in nodes[at]["deps"] if any(kind["kind"] != "dev" for kind in d["dep_kinds"])]

texts, without = collections.defaultdict(list), []
for package in sorted((packages[at] for at in needed if packages[at]["source"]), key=lambda p: (p["name"], p["version"])):
    name = f"{package['name']} {package['version']} ({package['license']})"
    files = sorted(Path(package["manifest_path"]).parent.glob("*"))
    files = [file for file in files if file.is_file() and re.match(r"(?i)(licen[cs]e|copying|notice|unlicense)", file.name)]
    for file in files:
        texts[file.read_text(errors="replace").strip()].append(name)
    if not files:
        without.append(name)
if not texts:
    sys.exit("licences.py: no crate has a licence")
print("Echolume is built from these crates.\n")
if without:
    print("Without a text of their own, under the licence of the SPDX list that they name:\n  " + "\n  ".join(without) + "\n")
for text, names in sorted(texts.items(), key=lambda entry: (-len(entry[1]), entry[1])):
    print("=" * 100 + "\n" + "\n".join(dict.fromkeys(names)) + "\n" + "-" * 100 + "\n" + text + "\n")
