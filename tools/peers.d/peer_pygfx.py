"""pygfx on the same Vulkan driver, off-screen."""

import os

os.environ.setdefault("WGPU_BACKEND_TYPE", "Vulkan")

import jinja2
import numpy as np
import pygfx
import wgpu
from pygfx.renderers.wgpu.shader import templating

import phantom
import view


def version():
    return f"pygfx {pygfx.__version__}, wgpu {wgpu.__version__}"


STEP = "let relative_step_size = clamp(sqrt(max(sizef.x, max(sizef.y, sizef.z))) / 20.0, 0.1, 0.8);"


def same_step():
    """Its steps are 0.57 to 0.8 voxel and no setting: that line of its shader is replaced, so that it steps a voxel as all do."""
    loader = templating.root_loader.mapping["pygfx"]
    environment = jinja2.Environment()

    def source(name):
        text = loader.get_source(environment, name)[0]
        if name == "volume_ray.wgsl":
            if STEP not in text:
                raise RuntimeError("pygfx's step is set in another way than known here")
            text = text.replace(STEP, "let relative_step_size = 1.0;")
        return text

    templating.root_loader.mapping["pygfx"] = jinja2.FunctionLoader(source)


same_step()


class Rendered:
    """`row` is one of surface, mip, minip, mpr."""

    def __init__(self, row, volumes):
        n = volumes[0].shape[0]
        self.volumes = volumes
        self.texture = pygfx.Texture(volumes[0], dim=3)
        material = {
            "mip": lambda: pygfx.VolumeMipMaterial(clim=(0, 255)),
            "minip": lambda: pygfx.VolumeMinipMaterial(clim=(0, 255)),
            "surface": lambda: pygfx.VolumeIsoMaterial(
                clim=(0, 255), threshold=view.ISO, shininess=view.SHININESS, step_size=1.0, substep_size=0.1
            ),
        }[row]()
        if row == "surface":
            colours = np.tile(np.array([0.93, 0.72, 0.56, 1.0], np.float32), (2, 1))
            material.map = pygfx.Texture(colours, dim=1)
        volume = pygfx.Volume(pygfx.Geometry(grid=self.texture), material)
        pitch, first = phantom.pitch(n), float(phantom.places(n)[0])
        volume.local.scale = (pitch,) * 3
        volume.local.position = (first,) * 3
        self.scene = pygfx.Scene()
        self.scene.add(volume)
        self.light = pygfx.DirectionalLight(intensity=3 * view.DIFFUSE)
        self.scene.add(pygfx.AmbientLight(intensity=3 * view.AMBIENT), self.light)
        self.target = pygfx.Texture(dim=2, size=(view.SIZE, view.SIZE, 1), format="rgba8unorm", usage=wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC)
        self.renderer = pygfx.WgpuRenderer(self.target, pixel_ratio=1, ppaa="none")
        self.camera = pygfx.PerspectiveCamera(view.FIELD, 1.0, depth_range=(1, 2000))
        self.pixels = None

    def picture(self, n, volume):
        if volume is not None:
            self.texture.set_data(self.volumes[volume])
        ours = view.Camera(n)
        self.camera.local.position = ours.position
        self.camera.world.reference_up = ours.up
        self.camera.look_at((0, 0, 0))
        self.light.local.position = 500 * ours.light()
        self.renderer.render(self.scene, self.camera)
        self.pixels = self.renderer.snapshot()

    def shown(self):
        return np.ascontiguousarray(self.pixels[:, :, :3])

    def driver(self):
        info = pygfx.renderers.wgpu.get_shared().adapter.info
        return f"{info['device']}, {info['description']} ({info['backend_type']})"


def rendered(row, volumes):
    return Rendered(row, volumes)
