#!/usr/bin/env python3
"""An acquisition program in about ten lines: rings of a moving test pattern, swept both ways, on standard output as src/source/piped.rs reads them.
    tools/pipe_frames.py [FRAMES A SECOND [NUMBER OF FRAMES]]"""
import itertools, json, math, signal, struct, sys, time
rate, count = (float(sys.argv[1]) if len(sys.argv) > 1 else 200.0), (int(sys.argv[2]) if len(sys.argv) > 2 else None)
samples, lines, frames, out = 256, 96, 31, sys.stdout.buffer
signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # whoever reads may go away
probe = {"array": {"kind": "curved", "radius_mm": 40}, "lines": {"sector_angle_deg": 70}, "depth": {"end_mm": 120},
         "motion": {"kind": "fan", "wobble_radius_mm": 25, "fan_angle_deg": 60}}
out.write(json.dumps({"echolume": 1, "samples": samples, "lines": lines, "frames": frames, "type": "u8", "both_ways": True,
                      "stamped": True, "probe": probe}).encode() + b"\n")
line = bytes(round(127.5 + 127.5 * math.sin(i * math.tau / 64)) for i in range(2 * samples))
for n in itertools.count() if count is None else range(count):
    out.write(struct.pack("<d", time.time()) + b"".join(line[s:s + samples] for s in [(n + j // 4) % 64 for j in range(lines)]))
    out.flush()
    time.sleep(1 / rate)
