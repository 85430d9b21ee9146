"""vispy on whatever OpenGL there is, off-screen by EGL."""

import os

# Without a display: Mesa's own surfaceless platform.
os.environ.setdefault("EGL_PLATFORM", "surfaceless")
os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

import numpy as np
import vispy

vispy.use("egl")
from vispy import scene
from vispy.gloo import gl

import phantom
import view


def version():
    return f"vispy {vispy.__version__}"


class Rendered:
    """`row` is one of surface, mip, minip, mean."""

    def __init__(self, row, volumes):
        n = volumes[0].shape[0]
        self.volumes = volumes
        self.canvas = scene.SceneCanvas(size=(view.SIZE, view.SIZE), show=False, bgcolor="black")
        self.view = self.canvas.central_widget.add_view()
        method = {"mean": "average", "surface": "iso"}.get(row, row)
        self.volume = scene.visuals.Volume(
            volumes[0], clim=(0, 255), method=method, threshold=255 * view.ISO, relative_step_size=1.0,
            cmap="grays", interpolation="linear", parent=self.view.scene, texture_format="auto",
        )
        pitch, first = phantom.pitch(n), float(phantom.places(n)[0])
        self.volume.transform = scene.STTransform(scale=(pitch,) * 3, translate=(first,) * 3)
        self.camera = scene.TurntableCamera(fov=view.FIELD, up="+z", translate_speed=0)
        self.view.camera = self.camera
        self.pixels = None
        self.said = None

    def picture(self, n, volume):
        if volume is not None:
            self.volume.set_data(self.volumes[volume], clim=(0, 255), copy=False)
        ours = view.Camera(n)
        with self.camera.events.blocker():
            self.camera.azimuth = -(view.AZIMUTH + view.TURN * n)
            self.camera.elevation = -view.ELEVATION
            self.camera.center = (0, 0, 0)
            self.camera.scale_factor = 2 * ours.distance * np.tan(np.radians(view.FIELD) / 2)
            self.camera.distance = ours.distance
        self.camera.view_changed()
        self.pixels = self.canvas.render(alpha=False)
        if self.said is None:
            self.said = f"{gl.glGetParameter(gl.GL_RENDERER)}, {gl.glGetParameter(gl.GL_VERSION)}"

    def shown(self):
        return np.ascontiguousarray(self.pixels[:, :, :3])

    def driver(self):
        return self.said


def rendered(row, volumes):
    return Rendered(row, volumes)
