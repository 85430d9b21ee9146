"""Faults: what is done to the program, how it shows that it noticed, and when it has recovered.

Each injects the fault, waits until the program has noticed, ends it, and returns what is special about its recovery: a function that is true
once it is complete. That pictures come again is asked of every fault. A fault without an effect raises NoEffect.
"""
import signal
import struct
import time
from pathlib import Path

from kiosk import Stopwatch


class NoEffect(Exception):
    """What should have failed did not: the fault proves nothing."""


def at_once():
    """Nothing special."""
    return True


class Faults:
    """All kinds. `limits` holds what this machine lacks, by kind."""

    def __init__(self, sender, kiosk, log, screen, random, disk, log_disk, clock, trigger):
        self.sender, self.kiosk, self.log, self.screen, self.random = sender, kiosk, log, screen, random
        self.disk, self.log_disk, self.clock, self.trigger = disk, log_disk, clock, trigger
        self.offset = 0
        self.limits = {}
        for kind, there in [("disk_full", disk), ("log_disk_full", log_disk)]:
            if not there:
                self.limits[kind] = "a small file system cannot be mounted here"

    def kinds(self):
        return [name for name in KINDS if name not in self.limits]

    def run(self, kind):
        return getattr(self, kind)()

    def wait(self, until, seconds, what):
        """Waits for it, and says what did not come."""
        watch = Stopwatch(self.kiosk)
        while not until():
            if watch.seconds() > seconds:
                raise NoEffect(f"{what}: not within {seconds:g} s")
            time.sleep(0.1)

    def rest(self, seconds):
        """Leaves the program that much time."""
        watch = Stopwatch(self.kiosk)
        while watch.seconds() < seconds:
            time.sleep(0.1)

    # The source.

    def source_gone(self):
        """The scanner is switched off for some seconds: connections are refused."""
        begun = time.monotonic()
        self.sender.leave()
        try:
            self.wait(lambda: self.log.said("connection lost", begun), 10, "'connection lost' in the log")
            time.sleep(self.random.uniform(1, 7))
        finally:
            self.sender.listen()
        return at_once

    def source_cut(self):
        """The connection breaks within a message."""
        begun = time.monotonic()
        self.sender.do_next("cut")
        self.wait(lambda: self.log.said("connection lost", begun), 10, "'connection lost' in the log")
        return at_once

    def source_damaged(self):
        """A bit of a message changes."""
        before = self.log.counts["damaged"]
        self.sender.do_next("damage")
        self.wait(lambda: self.log.counts["damaged"] > before, 10, "a wrong checksum in the log")
        return at_once

    def source_silent(self):
        """The scanner stays connected and sends nothing: for some seconds, or so long that the program connects again."""
        connections = self.sender.connections
        is_long = self.random.random() < 0.2
        self.sender.silent = True
        try:
            # An idle program says its last counts when it has noticed the silence.
            self.rest(5)
            frames = self.log.totals["frames"]
            time.sleep(30 if is_long else self.random.uniform(1, 6))
            if self.log.totals["frames"] != frames:
                raise NoEffect("frames came while the source was silent")
        finally:
            self.sender.silent = False
        return lambda: not is_long or self.sender.connections > connections

    # The device.

    def device_lost(self):
        """The next submission loses the device."""
        return self.device("l")

    def device_hung(self):
        """The next submission never ends. The program gives the device up and leaks what was made from it, as it must."""
        return self.device("h")

    def device(self, letter):
        begun = time.monotonic()
        written = Path(str(self.trigger) + ".new")
        written.write_text(letter, encoding="utf-8")
        written.rename(self.trigger)
        self.wait(lambda: not self.trigger.exists(), 15, "a submission")
        self.wait(lambda: self.log.said("; trying again", begun), 30, "the loss in the log")
        return at_once

    # The disk.

    def fill(self, folder):
        """Fills the file system. Returns the file that does it."""
        filler = Path(folder) / "filler"
        with open(filler, "wb", buffering=0) as file:
            for size in (1 << 16, 1 << 12, 1):
                try:
                    while True:
                        file.write(bytes(size))
                except OSError:
                    pass
        return filler

    def disk_full(self):
        """The disk of saved pictures and loops is full; then it is not, and both are saved."""
        filler = self.fill(self.disk)
        try:
            begun = time.monotonic()
            self.screen.press(self.random.choice(["p", "r"]))
            self.wait(lambda: self.log.said("Not saved", begun), 15, "'Not saved' in the log")
        finally:
            filler.unlink()
        left = [file.name for file in Path(self.disk).iterdir()]
        if left:
            raise NoEffect(f"the full disk keeps {left}")
        wanted = [("p", ".png"), ("r", ".frames")]
        self.screen.press("p")

        def are_saved():
            key, end = wanted[0]
            found = next((file for file in Path(self.disk).iterdir() if file.suffix == end and not file.name.startswith(".")), None)
            if found is None:
                return False
            if end == ".png" and not found.read_bytes().endswith(b"IEND\xaeB`\x82"):
                raise NoEffect(f"{found.name} is not a whole picture")
            found.unlink()
            wanted.pop(0)
            for key, _ in wanted[:1]:
                self.screen.press(key)
            return not wanted

        return are_saved

    def log_disk_full(self):
        """The disk of the log is full: lines are lost and counted, and nothing else happens."""
        begun = time.monotonic()
        filler = self.fill(self.log_disk)
        try:
            size = grown = None
            watch = Stopwatch(self.kiosk)
            # What is left of the last page takes some lines.
            while grown is None or watch.seconds() - grown < 5:
                if self.log.path.stat().st_size != size:
                    size, grown = self.log.path.stat().st_size, watch.seconds()
                if watch.seconds() > 60:
                    raise NoEffect("the log grows on a full disk")
                time.sleep(0.2)
        finally:
            filler.unlink()
        return lambda: self.log.said("lines of the log could not be written", begun)

    # The system.

    def clock_jumps(self):
        """The clock of the day jumps by up to a day, back or forth."""
        self.offset = self.random.choice([-1, 1]) * self.random.randint(600, 86400)
        with open(self.clock, "r+b") as file:
            file.write(struct.pack("=q", self.offset))

        def jumped():
            at, stamp = self.log.stamp or (0, None)
            if not stamp:
                return False
            # The offset between the clock of the log and this one, which did not jump.
            logged = time.mktime(time.strptime(stamp + " UTC", "%Y-%m-%dT%H:%M:%S %Z")) - time.timezone
            return abs(logged - (time.time() - (time.monotonic() - at)) - self.offset) < 5

        self.wait(jumped, 15, "the new time in the log")
        return at_once

    def window_resized(self):
        """The window changes its size several times, down to a few pixels."""
        for _ in range(self.random.randint(2, 5)):
            size = (self.random.randint(40, 640), self.random.randint(40, 480))
            self.screen.do("windowsize", self.screen.window() or 0, *size)
            self.wait(lambda: self.screen.size() == size, 10, f"a window of {size[0]} x {size[1]}")
            time.sleep(self.random.uniform(0.05, 1))
        self.screen.do("windowsize", self.screen.window() or 0, 320, 240)
        return lambda: self.screen.size() == (320, 240)

    def window_destroyed(self):
        """The window is destroyed by the desktop: the program opens another."""
        window = self.screen.window()
        if not window:
            raise NoEffect("there is no window to destroy")
        self.screen.destroy(window)
        self.wait(lambda: self.screen.window() != window, 10, "the end of the window")
        return self.screen.window

    def stopped(self):
        """SIGSTOP for some seconds, as a debugger or a suspended session does; also for longer than the deadline of a device."""
        self.kiosk.signal(signal.SIGSTOP)
        try:
            time.sleep(self.random.uniform(2, 20))
            state = (Path("/proc") / str(self.kiosk.process.pid) / "stat").read_text().rsplit(")", 1)[1].split()[0]
        finally:
            self.kiosk.signal(signal.SIGCONT)
        if state != "T":
            raise NoEffect(f"the program was not stopped: state {state}")
        return at_once

    # A user, which is no fault: other modes, drags, the times, the help.

    def hands(self):
        """A user: modes, a drag, the wheel, times and help on and off."""
        window = self.screen.window()
        if not window:
            raise NoEffect("there is no window")
        begun = self.log.totals["pictures"]
        self.screen.press(self.random.choice("1234567890"))
        self.screen.do("mousemove", "--window", window, 160, 120, "mousedown", 1)
        for _ in range(8):
            self.screen.do("mousemove_relative", "--", self.random.randint(-12, 12), self.random.randint(-8, 8))
            time.sleep(0.1)
        self.screen.do("mouseup", 1)
        for key in ["F2", "F2", "h", "h", "BackSpace"]:
            self.screen.press(key)
            time.sleep(0.2)
        self.wait(lambda: self.log.totals["pictures"] > begun, 20, "a picture")
        return at_once


KINDS = ["source_gone", "source_cut", "source_damaged", "source_silent", "device_lost", "device_hung", "disk_full", "log_disk_full",
         "clock_jumps", "window_resized", "window_destroyed", "stopped", "hands"]
# Kinds of the first third of a run alone: a device that hangs leaves its memory behind, by design.
EARLY = {"device_hung"}
