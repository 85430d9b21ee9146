#!/usr/bin/env bash
# Compiles Mesa's drm-shim for Intel's kernel drivers, and nothing else of Mesa.   intel_shim.sh MESA_SOURCE LIBRARIES OUTPUT
# LIBRARIES holds Debian's development packages of libdrm, expat and zlib, unpacked.
set -euo pipefail
source=$1 libraries=$2 output=$3
for tool in gcc g++ flex bison pkg-config python3; do
    command -v "$tool" >/dev/null || { echo "$tool is missing (Debian: apt-get install gcc g++ flex bison pkg-config python3-venv)" >&2; exit 1; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet meson ninja mako pyyaml packaging setuptools
export PATH=$work/venv/bin:$PATH
# Static libraries would ask for the newer C library of their suite while they are linked.
find "$libraries" -name '*.a' -delete
find "$libraries" -name '*.pc' -exec sed -i "s#^prefix=.*#prefix=$libraries/usr#" {} +
export PKG_CONFIG_PATH=$libraries/usr/lib/x86_64-linux-gnu/pkgconfig:$libraries/usr/share/pkgconfig
off=()
for part in glx egl gbm llvm glvnd gles1 gles2 shader-cache zstd valgrind libunwind lmsensors xmlconfig; do off+=("-D$part=disabled"); done
meson setup "$work/build" "$source" --buildtype release -Dtools=drm-shim,intel -Dplatforms= -Dgallium-drivers= -Dvulkan-drivers= -Dvideo-codecs= \
    -Dopengl=false -Dintel-elk=false -Dintel-clc=system "${off[@]}" >"$work/log" 2>&1 || { tail -5 "$work/log" >&2; exit 1; }
ninja -C "$work/build" src/intel/tools/libintel_noop_drm_shim.so >"$work/log" 2>&1 || { tail -5 "$work/log" >&2; exit 1; }
cp "$work/build/src/intel/tools/libintel_noop_drm_shim.so" "$output"
