"""The program on a screen of its own, what it logs, and what it uses."""
import ctypes
import ctypes.util
import os
import re
import signal
import subprocess
import threading
import time
from pathlib import Path

TOTALS = re.compile(r"in all: (\d+) frames, (\d+) lost, (\d+) refused, (\d+) left out; "
                    r"volumes: (\d+) shown, (\d+) dropped, (\d+) incomplete; (\d+) pictures")
NAMES = ["frames", "lost", "refused", "left_out", "shown", "dropped", "incomplete", "pictures"]
LATENCY = re.compile(r"latency ms p50 ([\d.]+) p95 ([\d.]+) p99 ([\d.]+) max ([\d.]+)")
STAMP = re.compile(r"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d)(?:\.\d+)?Z ")
# Kinds of lines with a count, which is 1 if it is not there.
COUNTED = {"messages with a wrong checksum passed over": "damaged", "messages dropped": "overtaken"}
# Counters that `--prometheus` exports, by what the log calls them.
METRICS = {"frames": "echolume_frames_total", "pictures": "echolume_pictures_total", "shown": 'echolume_volumes_total{result="shown"}',
           "dropped": 'echolume_volumes_total{result="dropped"}', "incomplete": 'echolume_volumes_total{result="incomplete"}',
           "device_losses": "echolume_device_losses_total"}
# When a device that does not finish is given up: a picture takes some 10 ms of a processor, which others use, too.
DEADLINE = "15s"
CONFIGURATION = """source = "igtl://127.0.0.1:{port}"
[display]
full_screen = false
direct = false
size = [{width}, {height}]
[live]
cine_volumes = 5
retry = "500ms"
[files]
pictures = "{pictures}"
log = "{log}"
log_size_mb = 1
log_files = 4
"""


class Screen:
    """An X server without a monitor."""

    def __init__(self, size):
        reads, writes = os.pipe()
        self.server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writes), "-screen", "0", f"{size[0]}x{size[1]}x24", "-nolisten", "tcp", "-noreset"],
            pass_fds=[writes], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(writes)
        with os.fdopen(reads) as said:
            number = said.readline().strip()
        if not number:
            raise RuntimeError("Xvfb did not start")
        self.display = f":{number}"

    def do(self, *words):
        """Runs xdotool and returns what it says; nothing if it fails, as it does while there is no window."""
        done = subprocess.run(["xdotool", *map(str, words)], env={**os.environ, "DISPLAY": self.display}, capture_output=True, text=True, timeout=30)
        return done.stdout.split() if done.returncode == 0 else []

    def window(self):
        """The newest visible window of the program."""
        found = self.do("search", "--onlyvisible", "--name", "^Echolume$")
        return found[-1] if found else None

    def size(self):
        shown = dict(line.split("=", 1) for line in self.do("getwindowgeometry", "--shell", self.window() or 0) if "=" in line)
        return (int(shown.get("WIDTH", 0)), int(shown.get("HEIGHT", 0)))

    def press(self, *keys):
        """Keys to the program. Without a window manager nothing else gives it the focus."""
        window = self.window()
        if window:
            self.do("windowfocus", window, "key", *keys)

    def destroy(self, window):
        """Destroys the window itself, as a desktop that crashes does; xdotool could only close the connection of the program."""
        x = ctypes.CDLL(ctypes.util.find_library("X11") or "libX11.so.6")
        x.XOpenDisplay.restype = ctypes.c_void_p
        display = x.XOpenDisplay(self.display.encode())
        if display:
            x.XDestroyWindow(ctypes.c_void_p(display), ctypes.c_ulong(int(window)))
            x.XCloseDisplay(ctypes.c_void_p(display))

    def close(self):
        self.server.terminate()
        self.server.wait()


class Log(threading.Thread):
    """Follows the log of the program through its rotations, and keeps what faults are recognised by."""

    def __init__(self, path, copy):
        super().__init__(daemon=True)
        self.path, self.copy = Path(path), open(copy, "a", encoding="utf-8", errors="replace")
        self.totals = dict.fromkeys(NAMES, 0)
        # Of every line with totals: time, and pictures and frames so far; and of those with latencies: time, p50, p95.
        self.progress, self.latencies = [], []
        self.counts = dict.fromkeys(COUNTED.values(), 0)
        self.lines, self.over, self.stamp = [], False, None
        self.file, self.part, self.number = None, "", None

    def run(self):
        while not self.over:
            self.read()
            time.sleep(0.1)
        self.read()
        self.copy.close()
        if self.file:
            self.file.close()

    def read(self):
        while True:
            if self.file:
                self.part += self.file.read()
                *whole, self.part = self.part.split("\n")
                for line in whole:
                    self.take(line)
            try:
                number = os.stat(self.path).st_ino
            except OSError:
                return
            if number == self.number:
                return
            if self.file:
                # Renamed: what was written to it since.
                self.part += self.file.read()
                for line in self.part.splitlines():
                    self.take(line)
                self.file.close()
            self.file, self.part, self.number = open(self.path, encoding="utf-8", errors="replace"), "", number

    def take(self, line):
        now = time.monotonic()
        self.copy.write(line + "\n")
        self.copy.flush()
        stamp = STAMP.match(line)
        if stamp:
            self.stamp = (now, stamp[1])
        totals = TOTALS.search(line)
        if totals:
            self.totals = dict(zip(NAMES, map(int, totals.groups())))
            self.progress.append((now, self.totals["pictures"], self.totals["frames"]))
            latency = LATENCY.search(line)
            if latency:
                self.latencies.append((now, float(latency[1]), float(latency[2])))
            return
        for words, name in COUNTED.items():
            found = re.search(re.escape(words) + r"(?: \((\d+)\))?", line)
            if found:
                self.counts[name] += int(found[1] or 1)
        self.lines.append((now, line))

    def said(self, words, since):
        """The first line since then that has these words."""
        return next((line for at, line in reversed(self.lines) if at >= since and words in line), None)

    def shows_again(self, since):
        """True once frames and pictures have come since then."""
        later = [(pictures, frames) for at, pictures, frames in self.progress if at >= since]
        return len(later) > 1 and later[-1][0] > later[0][0] and later[-1][1] > later[0][1]


# Most seconds that one watch forgives.
FORGIVEN = 15.0


class Stopwatch:
    """Time in which the program could run. On a machine that is busy with other things its threads are ready to run and wait for a processor.
    What the one thread waited that waited longest does not count: at most half of the time since the start, and at most 15 s. So a limit of
    30 s is one of 45 s of the wall clock at most. Waits are not added over threads: fifteen threads that each wait a fifteenth of the time
    would make all of it free. A program that sleeps or blocks does not wait for a processor."""

    def __init__(self, kiosk, clock=time.monotonic):
        self.kiosk, self.clock = kiosk, clock
        self.begun, self.before = clock(), kiosk.waits()
        # Of each thread since the start; threads that have ended stay.
        self.threads, self.counted = {}, 0.0

    @property
    def waited(self):
        """Seconds that the thread has waited that waited longest."""
        return max(self.threads.values(), default=0.0)

    def seconds(self):
        for thread, wait in self.kiosk.waits().items():
            self.threads[thread] = max(self.threads.get(thread, 0.0), wait - self.before.get(thread, 0.0))
        passed = self.clock() - self.begun
        # A clock does not run backwards.
        self.counted = max(self.counted, passed - min(self.waited, passed / 2, FORGIVEN))
        return self.counted


class Kiosk:
    """`echolume view --kiosk`, as a service runs it."""

    def __init__(self, program, folder, screen, port, size, pictures, log, environment):
        self.screen, self.folder, self.pictures = screen, folder, Path(pictures)
        self.file = folder / "kiosk.toml"
        self.file.write_text(CONFIGURATION.format(port=port, width=size[0], height=size[1], pictures=pictures, log=log), encoding="utf-8")
        words = [program, "-vv", "view", "--kiosk", "--config", str(self.file), "--device-timeout", DEADLINE]
        said = subprocess.run([program, "view", "--help"], capture_output=True, text=True, timeout=60).stdout
        self.metrics = folder / "kiosk.prom" if "--prometheus" in said else None
        if self.metrics:
            words += ["--prometheus", str(self.metrics)]
        self.words, self.environment = words, {**os.environ, **environment, "DISPLAY": screen.display}
        self.environment.pop("WAYLAND_DISPLAY", None)
        self.process = None

    def start(self):
        with open(self.folder / "standard-error.log", "ab") as said:
            self.process = subprocess.Popen(self.words, env=self.environment, stdin=subprocess.DEVNULL, stdout=said, stderr=said, start_new_session=True)

    def is_running(self):
        return self.process is not None and self.process.poll() is None

    def signal(self, number):
        if self.is_running():
            self.process.send_signal(number)

    def end(self, number, patience):
        """Sends a signal. Returns the seconds that the program took to end, or None if it did not."""
        begun, watch = time.monotonic(), Stopwatch(self)
        self.signal(number)
        while self.is_running():
            if watch.seconds() > patience:
                return None
            time.sleep(0.05)
        return time.monotonic() - begun

    def exported(self):
        """The counters of the metrics by their names in the log, or None where the program exports none."""
        if not self.metrics:
            return None
        try:
            lines = self.metrics.read_text(encoding="utf-8").splitlines()
        except OSError:
            return {}
        values = dict(line.rsplit(" ", 1) for line in lines if line and not line.startswith("#"))
        return {name: int(float(values[metric])) for name, metric in METRICS.items() if metric in values}

    def kill(self):
        if self.is_running():
            self.signal(signal.SIGCONT)
            self.process.kill()
            self.process.wait()

    def waits(self):
        """Seconds that each thread has waited for a processor so far, while it was ready to run."""
        waits = {}
        for file in (Path("/proc") / str(self.process.pid) / "task").glob("*/schedstat"):
            try:
                waits[file.parent.name] = int(file.read_text().split()[1]) / 1e9
            except (OSError, IndexError, ValueError):
                pass
        return waits

    def usage(self):
        """Resident memory, MiB; open handles; threads; seconds of the processors. None once it has ended."""
        place = Path("/proc") / str(self.process.pid)
        try:
            status = dict(line.split(":", 1) for line in (place / "status").read_text().splitlines() if ":" in line)
            times = (place / "stat").read_text().rsplit(")", 1)[1].split()
            seconds = (int(times[11]) + int(times[12])) / os.sysconf("SC_CLK_TCK")
            return (int(status["VmRSS"].split()[0]) / 1024, len(os.listdir(place / "fd")), int(status["Threads"]), seconds)
        except (OSError, KeyError, IndexError, ValueError):
            return None
