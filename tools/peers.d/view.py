"""The camera and the light of every picture, as Echolume has them (src/core/scene/camera.rs), for peers that want a position."""

import math

import numpy as np

import phantom

SIZE = 512  # pixels along both edges of a picture
FIELD = 30.0  # vertical field of view, deg
ZOOM = 2.56  # the head covers 80 % of the pixels
AZIMUTH, ELEVATION = -12.0, 8.0  # of the first picture, deg
TURN = 2.0  # from one picture to the next, deg
# Towards the light, in the camera's axes: right, up, towards the viewer.
LIGHT = np.array([-0.5, 0.6, 0.6]) / math.sqrt(0.25 + 0.36 + 0.36)
AMBIENT, DIFFUSE, SPECULAR, SHININESS = 0.18, 0.75, 0.18, 24.0


class Camera:
    """Of the n-th picture, which is turned by n times TURN."""

    def __init__(self, n):
        azimuth, elevation = math.radians(AZIMUTH + TURN * n), math.radians(ELEVATION)
        sin, cos = math.sin(azimuth), math.cos(azimuth)
        self.forward = np.array([sin * math.cos(elevation), cos * math.cos(elevation), math.sin(elevation)])
        self.right = np.array([cos, -sin, 0.0])
        self.up = np.cross(self.right, self.forward)
        half = phantom.BOX / 2
        along = lambda axis: float(np.abs(axis).sum()) * half
        fit = max(along(self.up), along(self.right)) / SIZE
        pixel = 2 * fit / ZOOM
        spread = 2 * math.tan(math.radians(FIELD) / 2) / SIZE
        self.distance = pixel / spread + along(self.forward)
        self.position = -self.forward * self.distance

    def light(self):
        """Towards the light, in space."""
        return self.right * LIGHT[0] + self.up * LIGHT[1] - self.forward * LIGHT[2]


def arguments():
    """The same for Echolume."""
    return [
        "--size", f"{SIZE}x{SIZE}",
        "--camera", f"azimuth={AZIMUTH},elevation={ELEVATION},zoom={ZOOM},fov={FIELD}",
        "--set", f"light.direction=[{LIGHT[0]},{LIGHT[1]},{LIGHT[2]}]",
    ]


# Grey value (0..1), brightness, opacity of 1 mm: fluid is clear, the scalp opaque within a few mm.
TRANSFER = ((0.0, 0.0, 0.0), (0.12, 0.05, 0.0), (0.25, 0.4, 0.1), (0.4, 0.75, 0.5), (0.8, 1.0, 0.8))
# The surface: the grey value that isosurfaces follow.
ISO = 0.2


def transfer(n):
    """Points (grey, brightness, opacity of one voxel): what Echolume's transfer functions are given by, and VTK's with a unit
    distance of one voxel."""
    share = phantom.pitch(n)
    return [(at, grey, 1 - (1 - a) ** share) for at, grey, a in TRANSFER]


def plane(n):
    """The oblique plane of the n-th picture: right and down, unit length, through the middle (src/core/scene/planes.rs, plane A)."""
    azimuth, tilt = math.radians(20 + TURN * n), math.radians(25)
    turn = lambda a: np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])
    lean = np.array([[1, 0, 0], [0, math.cos(tilt), -math.sin(tilt)], [0, math.sin(tilt), math.cos(tilt)]])
    frame = turn(-azimuth) @ lean
    return frame @ np.array([1.0, 0, 0]), frame @ np.array([0, 1.0, 0])


PLANE = ["planes.azimuth=20", "planes.tilt=25"]
