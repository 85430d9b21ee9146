"""A scanner that can fail: an OpenIGTLink server of small volumes, which counts what it sent."""
import math
import select
import socket
import struct
import threading
import time

# Columns, rows and slices of a volume, one byte a voxel. The program emits a frame for each slice.
SIZE = (24, 24, 16)
# Different volumes, sent in turn.
VOLUMES = 6


def crc64(data):
    """CRC-64/ECMA-182, as OpenIGTLink has it."""
    table = crc64.table
    crc = 0
    for byte in data:
        crc = table[(crc >> 56) ^ byte] ^ (crc << 8 & 0xFFFFFFFFFFFFFFFF)
    return crc


def entry(byte):
    crc = byte << 56
    for _ in range(8):
        crc = (crc << 1 ^ (0x42F0E1EBA9EA3693 if crc >> 63 else 0)) & 0xFFFFFFFFFFFFFFFF
    return crc


crc64.table = [entry(byte) for byte in range(256)]


def body(turn):
    """An IMAGE of a ball that moves with `turn`, 0 to 1."""
    nx, ny, nz = SIZE
    centre = [n / 2 + n / 5 * math.sin(math.tau * (turn + k / 3)) for k, n in enumerate(SIZE)]
    radius = nx / 3

    def sample(x, y, z):
        away = math.dist((x, y, z), centre) / radius
        return max(0, min(255, round(60 * (1.7 - away) + 60 + 40 * math.sin(x * 1.7 + y * 2.3 + z * 3.1))))

    samples = bytes(sample(x, y, z) for z in range(nz) for y in range(ny) for x in range(nx))
    axes = (2.0, 0, 0, 0, 2.0, 0, 0, 0, 2.0, 0, 0, 0)
    return struct.pack(">HBBBB3H12f6H", 1, 1, 3, 2, 1, *SIZE, *axes, 0, 0, 0, *SIZE) + samples


class Sender(threading.Thread):
    """Sends whole volumes at `rate` a second to whoever is connected, one at a time."""

    def __init__(self, rate):
        super().__init__(daemon=True)
        self.rate = rate
        self.bodies = [(content, crc64(content)) for content in (body(n / VOLUMES) for n in range(VOLUMES))]
        self.lock = threading.Lock()
        self.listener = self.peer = None
        self.port = 0
        self.silent = self.over = False
        # What is done with the next message: None, "damage" or "cut".
        self.next = None
        # Messages that were sent whole, with a wrong checksum, in part; and connections that the program closed while one was sent.
        self.whole = self.damaged = self.cut = self.refused = self.connections = 0
        self.listen()

    def listen(self):
        """Begins to accept connections, at the same port every time."""
        with self.lock:
            listener = socket.socket()
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(("127.0.0.1", self.port))
            listener.listen(1)
            self.port = listener.getsockname()[1]
            self.listener = listener

    def leave(self, listens=False):
        """Closes the connection and, unless `listens`, refuses new ones. What was sent still arrives: the program sends nothing."""
        with self.lock:
            self.close(listens)

    def close(self, listens):
        if self.peer:
            self.peer.close()
            self.peer = None
        if self.listener and not listens:
            self.listener.close()
            self.listener = None

    def do_next(self, what):
        """Damages or cuts the next message. A cut one ends its connection."""
        with self.lock:
            self.next = what

    def run(self):
        due = time.monotonic()
        while not self.over:
            with self.lock:
                self.accept()
                if self.peer and not self.silent:
                    self.send()
            # Without catching up after a pause.
            due = max(due + 1 / self.rate, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))

    def accept(self):
        if self.peer and select.select([self.peer], [], [], 0)[0]:
            # The program sends nothing: it has closed the connection.
            self.peer.close()
            self.peer = None
        if self.listener and not self.peer and select.select([self.listener], [], [], 0)[0]:
            self.peer = self.listener.accept()[0]
            self.peer.settimeout(60)
            self.connections += 1

    def send(self):
        content, crc = self.bodies[self.whole % VOLUMES]
        what, self.next = self.next, None
        now = time.time()
        head = struct.pack(">H12s20sIIQQ", 1, b"IMAGE", b"Soak", int(now), int(now % 1 * 2**32), len(content), crc)
        message = head + content
        if what == "damage":
            message = message[:-1] + bytes([message[-1] ^ 1])
        if what == "cut":
            message = message[:len(message) // 2]
        try:
            self.peer.sendall(message)
        except OSError:
            self.refused += 1
            self.close(True)
            return
        self.whole += what is None
        self.damaged += what == "damage"
        self.cut += what == "cut"
        if what == "cut":
            self.close(True)
