"""Makes a folder that measures on a GPU without a network: wheels, the program, and what this folder holds. Started by tools/peers --pack.

VTK's wheel has 570 MB unpacked, of which the peers use a tenth: libraries that they do not need are left out.
"""

import argparse
import os
import re
import shutil
import stat
import subprocess
import sys
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
# What computes on the CPU alone.
LEFT_OUT = ("opencv-python-headless", "pyfast", "scipy", "simpleitk")
RUN = """#!/usr/bin/env bash
# tools/peers --gpu without a network: installs the wheels beside it into a folder, and measures. Options are those of tools/peers.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
site=${PEERS_SITE:-$here/site}
if [ ! -d "$site" ]; then
    rm -rf "$site.part"
    python3 -m pip install --quiet --no-index --no-deps --no-compile --target "$site.part" "$here"/wheels/*.whl
    mv "$site.part" "$site"
fi
export PYTHONPATH=$site PYTHONDONTWRITEBYTECODE=1
out=${PEERS_OUT:-$here/out}
mkdir -p "$out"
exec python3 "$here/peers.d/run.py" --gpu --out "$out" --work "$out/work" --binary "$here/echolume" "$@"
"""


def needs(file):
    """The names of the libraries that an ELF file is linked to."""
    said = subprocess.run(["readelf", "-d", file], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"\(NEEDED\).*\[(.*)\]", said))


def smaller(wheel, work):
    """VTK's wheel with what peer_vtk.py imports and what that is linked to."""
    with zipfile.ZipFile(wheel) as whole:
        whole.extractall(work)
        names = whole.namelist()
    with open(os.path.join(HERE, "peer_vtk.py")) as file:
        modules = set(re.findall(r"\bvtk[A-Z]\w+(?=,)", file.read().split("MODULES = (")[1].split(")")[0]))
    libraries = {os.path.basename(name): os.path.join(work, name) for name in names if ".so" in name}
    found, ask = set(), [name for name in libraries if name.split(".")[0] in modules]
    while ask:
        name = ask.pop()
        if name in found or name not in libraries:
            continue
        found.add(name)
        ask += needs(libraries[name])
        # The module of a library imports those of the libraries that this one is linked to.
        ask += [n for n in libraries if "lib" + n.split(".")[0] == name.split(".")[0].split("-")[0]]
    os.remove(wheel)
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_LZMA) as small:
        for name in names:
            if name.endswith("/") or (".so" in name and os.path.basename(name) not in found):
                continue
            if name.endswith(".pyi") or "/web/" in name or "/test/" in name:
                continue
            small.write(os.path.join(work, name), name)
    shutil.rmtree(work)


def main():
    parser = argparse.ArgumentParser(prog="tools/peers --pack", description=__doc__.splitlines()[0])
    parser.add_argument("folder")
    parser.add_argument("--python", default=f"{sys.version_info[0]}.{sys.version_info[1]}", help="version there (default: the one here)")
    parser.add_argument("--binary", required=True)
    options = parser.parse_args()
    wheels = os.path.join(options.folder, "wheels")
    if os.path.exists(options.folder) and os.listdir(options.folder):
        parser.error(f"{options.folder} is not empty")
    os.makedirs(wheels)
    with open(os.path.join(HERE, "requirements.txt")) as file:
        lines = [line.strip() for line in file if "==" in line]
    pinned = [line for line in lines if line.split("==")[0] not in LEFT_OUT]
    platforms = [f"--platform=manylinux_2_{n}_x86_64" for n in range(39, 4, -1)]
    platforms += [f"--platform=manylinux{n}_x86_64" for n in (2014, 2010, 1)]
    download = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps", "--only-binary=:all:"]
    download += [f"--python-version={options.python}", "--implementation=cp", *platforms, "--dest", wheels]
    subprocess.run([*download, *pinned], check=True)
    for name in os.listdir(wheels):
        if name.startswith("vtk-"):
            smaller(os.path.join(wheels, name), os.path.join(options.folder, "vtk"))
    shutil.copytree(HERE, os.path.join(options.folder, "peers.d"), ignore=shutil.ignore_patterns("__pycache__", "pack.py"))
    shutil.copy(options.binary, os.path.join(options.folder, "echolume"))
    run = os.path.join(options.folder, "run")
    with open(run, "w") as file:
        file.write(RUN)
    os.chmod(run, os.stat(run).st_mode | stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)
    size = sum(os.path.getsize(os.path.join(path, name)) for path, _, files in os.walk(options.folder) for name in files)
    print(f"written: {options.folder}, {size / 1e6:.0f} MB; there: {os.path.join(options.folder, 'run')}")


main()
