"""Tests the rules by which a soak passes: each kind of fault must be found, and a clean run must not be one."""
import copy

import figures
from faults import KINDS
from kiosk import LATENCY, NAMES, Stopwatch, TOTALS
from sender import crc64

LIMITS = {"memory": 32, "handles": 4, "threads": 2}
# What the program logs.
LINE = ("frames 32.0/s  volumes 2.00/s  pictures 2.0/s  dropped 0  latency ms p50 30.5 p95 41.0 p99 41.0 max 41.1  load_slice 0.10 ms x 32; "
        "in all: 160 frames, 0 lost, 0 refused, 3 left out; volumes: 9 shown, 1 dropped, 0 incomplete; 12 pictures")


class Waiting:
    """A program whose threads say how long they waited for a processor."""

    def __init__(self):
        self.now, self.times = 100.0, {"1": 5.0}

    def passes(self, seconds, waits):
        self.now += seconds
        for thread, wait in waits.items():
            if thread.startswith("-"):
                del self.times[thread[1:]]
                continue
            self.times[thread] = self.times.get(thread, 0.0) + wait

    def waits(self):
        return dict(self.times)


def series(growth=0.0):
    """An hour of samples that grow by so much from the middle third to the last."""
    return [(at, 100.0 + 3 * growth * max(0, at / 3600 - 1 / 3)) for at in range(0, 3600, 10)]


def clean():
    found = {name: figures.of_series(series(), 3600) for name in ("memory", "handles", "threads", "latency p50", "latency p95")}
    faults = [{"kind": kind, "at": 5.0, "seconds": 2.0, "error": None} for kind in KINDS]
    totals = dict(zip(NAMES, [160, 0, 0, 0, 9, 1, 0, 12]))
    return {**found, "faults": faults, "sent": {"whole": 12, "damaged": 1, "cut": 1, "refused": 0, "connections": 3}, "totals": totals,
            "counts": {"damaged": 1, "overtaken": 2}, "accounts": [], "ends": [], "left_out": {}, "seconds": 3600, "seed": 1,
            "program": "echolume", "processor": 0.2, "waited": 3.0}


def accounted(result):
    result["accounts"] = figures.accounts(result["sent"], 16, result["totals"], result["counts"])
    return figures.verdict(result, LIMITS)


def run(line):
    """0 if all holds. Raises AssertionError otherwise. `line`: what the program logs now, so that a change is noticed here and not after an hour."""
    assert not line or TOTALS.search(line) and LATENCY.search(line), f"no counts or no latency is found in: {line}"
    assert crc64(b"123456789") == 0x6C40DF5F0B497347, "the catalogue's check value of CRC-64/ECMA-182"
    assert [int(n) for n in TOTALS.search(LINE).groups()] == [160, 0, 0, 3, 9, 1, 0, 12]
    assert LATENCY.search(LINE).groups() == ("30.5", "41.0", "41.0", "41.1")
    assert abs(figures.slope([(0, 1.0), (1, 3.0), (2, 5.0)]) - 2) < 1e-9
    assert accounted(clean()) == []
    table = figures.table(clean())
    assert all(f"| {kind} | 1 | 0 | 2.0 | 2.0 |" in table for kind in KINDS), table
    # One wrong thing each, and a word of the sentence that says it.
    cases = [("memory grew", lambda r: r.update(memory=figures.of_series(series(33), 3600))),
             ("handles grew", lambda r: r.update(handles=figures.of_series(series(5), 3600))),
             ("threads grew", lambda r: r.update(threads=figures.of_series(series(3), 3600))),
             ("not within", lambda r: r["faults"][3].update(error="no pictures: not within 30 s")),
             ("16 are missing", lambda r: r["totals"].update(frames=144)),
             ("make 9", lambda r: r["totals"].update(shown=8)),
             ("2 damaged volumes", lambda r: r["sent"].update(damaged=2)),
             ("refused", lambda r: r["totals"].update(refused=1)),
             ("did not end", lambda r: r.update(ends=["SIGTERM did not end it"]))]
    for words, spoil in cases:
        result = copy.deepcopy(clean())
        spoil(result)
        wrong = accounted(result)
        assert any(words in line for line in wrong), f"{words}: {wrong}"
    # Metrics: none are no fault, and every one must be what the log says.
    lost = sum(kind in ("device_lost", "device_hung") for kind in KINDS)
    metrics = {**{name: clean()["totals"][name] for name in ("frames", "pictures", "shown", "dropped", "incomplete")}, "device_losses": lost}
    assert figures.exported(None, clean()["totals"], clean()["faults"]) == figures.exported(metrics, clean()["totals"], clean()["faults"]) == []
    for name in metrics:
        wrong = figures.exported({**metrics, name: 7}, clean()["totals"], clean()["faults"])
        assert wrong == [f"the metrics have 7 {name}, not {metrics[name]}"], wrong
    # What the thread waits that waits longest does not count, up to half of the time and 15 s; all other time does.
    for steps, counts in (([(10, {"1": 0})], 10), ([(10, {"1": 4})], 6), ([(10, {"1": 4, "2": 3})], 6), ([(10, {"1": 9})], 5),
                          # Fifteen threads, one after the other: each waited 2 s of 30.
                          ([(2, {str(thread): 2}) for thread in range(15)], 28),
                          # A thread that was there before its wait, and one that began later and has ended.
                          ([(10, {"1": 1}), (10, {"new": 6}), (10, {"-new": 0})], 24),
                          ([(30, {"1": 30})], 15), ([(300, {"1": 300})], 285)):
        program = Waiting()
        watch = Stopwatch(program, lambda: program.now)
        for seconds, waits in steps:
            program.passes(seconds, waits)
            found = watch.seconds()
        assert abs(found - counts) < 1e-9, (steps, found)
    # A limit of 30 s is over after 45 s of the wall clock, whatever waits, as often as it is asked.
    program = Waiting()
    watch = Stopwatch(program, lambda: program.now)
    while watch.seconds() <= 30:
        program.passes(0.5, {str(thread): 0.5 for thread in range(15)})
    assert program.now - 100 == 45.5, program.now
    # What is within the bound passes, and what grew in the first third only.
    result = clean()
    result["memory"] = figures.of_series(series(31), 3600)
    assert 30 < result["memory"]["growth"] < 32 and 80 < result["memory"]["slope"] < 110
    assert accounted(result) == []
    result["memory"] = figures.of_series([(at, min(at, 1000)) for at in range(0, 3600, 10)], 3600)
    assert accounted(result) == []
    print("self-test passed")
    return 0
