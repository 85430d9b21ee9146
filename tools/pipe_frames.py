#!/usr/bin/env python3
"""An acquisition program in about ten lines: rings of a moving test pattern, swept both ways, on standard output as src/source/piped.rs reads them.
    tools/pipe_frames.py [FRAMES A SECOND [NUMBER OF FRAMES]]
With --freehand: a tracked probe, tilted and moved over a ball; each picture comes with its pose.
    tools/pipe_frames.py --freehand [PICTURES A SECOND [NUMBER OF PICTURES]]"""
import itertools, json, math, signal, struct, sys, time, zlib
words = [word for word in sys.argv[1:] if word != "--freehand"]
rate, count = (float(words[0]) if words else 200.0), (int(words[1]) if len(words) > 1 else None)
samples, lines, frames, out = 256, 96, 31, sys.stdout.buffer
signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # whoever reads may go away


def checked(number, content):
    """A frame of version 3: a byte that the pipe loses costs this frame and no other."""
    body = struct.pack("<Q", number) + content
    return b"\x89ECHOFR\n" + body + struct.pack("<I", zlib.crc32(body))


def freehand():
    """Pictures of 80 x 80 pixels, 0.5 mm apart: the shell of a ball of 12 mm around (110, -40, 65) mm in the tracker's space."""
    size, pitch, (x, y, z), radius = 80, 0.5, (110.0, -40.0, 65.0), 12.0
    lattice = {"size": [size, size, 1], "spacing": [pitch, pitch, 1], "origin": [-20, 0, 0]}
    out.write(json.dumps({"echolume": 3, "type": "u8", "stamped": True, "posed": True, "cartesian": lattice}).encode() + b"\n")
    for n in itertools.count() if count is None else range(count):
        # Forth and back in steps of half a millimetre, tilted by 20 degrees about the tracker's x axis.
        step, c, s = (30 - abs(n % 120 - 60)) * pitch, math.cos(math.radians(20)), math.sin(math.radians(20))
        if count is not None:
            step = (n - (count - 1) / 2) * pitch
        corner = (x, y - 20 * c - step * s, z - 20 * s + step * c)
        pose = (1, 0, 0, corner[0], 0, c, -s, corner[1], 0, s, c, corner[2])
        # The centre of the ball as the picture sees it: 20 mm deep, and `step` behind its plane.
        pixel = lambda i, j: 255 if abs(math.hypot(pitch * i - 20, pitch * j - 20, step) - radius) < 0.6 else 20
        out.write(checked(n, struct.pack("<d12d", time.time(), *pose) + bytes(pixel(i, j) for j in range(size) for i in range(size))))
        out.flush()
        time.sleep(1 / rate)


if len(words) < len(sys.argv) - 1:
    sys.exit(freehand())
probe = {"array": {"kind": "curved", "radius_mm": 40}, "lines": {"sector_angle_deg": 70}, "depth": {"end_mm": 120},
         "motion": {"kind": "fan", "wobble_radius_mm": 25, "fan_angle_deg": 60}}
out.write(json.dumps({"echolume": 3, "samples": samples, "lines": lines, "frames": frames, "type": "u8", "both_ways": True,
                      "stamped": True, "probe": probe}).encode() + b"\n")
line = bytes(round(127.5 + 127.5 * math.sin(i * math.tau / 64)) for i in range(2 * samples))
for n in itertools.count() if count is None else range(count):
    out.write(checked(n, struct.pack("<d", time.time()) + b"".join(line[s:s + samples] for s in [(n + j // 4) % 64 for j in range(lines)])))
    out.flush()
    time.sleep(1 / rate)
