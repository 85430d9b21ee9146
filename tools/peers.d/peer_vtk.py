"""VTK: the fixed-point ray caster (CPU), the GPU ray caster on whatever OpenGL there is, reslicing, and isosurfaces as polygons.

A picture is finished when its pixels are in host memory, as Echolume's is.
"""

import types

import numpy as np
from vtkmodules import (
    vtkCommonCore, vtkCommonDataModel, vtkFiltersCore, vtkImagingCore, vtkRenderingCore, vtkRenderingOpenGL2, vtkRenderingVolume,
    vtkRenderingVolumeOpenGL2,
)
from vtkmodules.util import numpy_support

import phantom
import view

# What is used of VTK, and no more: a pack has nothing else of it (pack.py). The modules of OpenGL2 are the factories of the others.
MODULES = (
    vtkCommonCore, vtkCommonDataModel, vtkFiltersCore, vtkImagingCore, vtkRenderingCore, vtkRenderingOpenGL2, vtkRenderingVolume,
    vtkRenderingVolumeOpenGL2,
)
vtk = types.SimpleNamespace(**{name: value for module in MODULES for name, value in vars(module).items() if name.startswith("vtk")})


def version():
    return "VTK " + vtk.vtkVersion().GetVTKVersion()


def image(voxels):
    n = voxels.shape[0]
    out = vtk.vtkImageData()
    out.SetDimensions(n, n, n)
    out.SetSpacing([phantom.pitch(n)] * 3)
    out.SetOrigin([float(phantom.places(n)[0])] * 3)
    out.GetPointData().SetScalars(numpy_support.numpy_to_vtk(voxels.ravel(), deep=1))
    return out


class Arriving:
    """A volume that VTK holds, and others that arrive: their voxels are copied in, as Echolume copies every frame."""

    def __init__(self, volumes):
        self.volumes = volumes
        self.image = image(volumes[0])
        self.voxels = numpy_support.vtk_to_numpy(self.image.GetPointData().GetScalars())

    def take(self, volume):
        if volume is not None:
            self.voxels[:] = self.volumes[volume].ravel()
            self.image.GetPointData().GetScalars().Modified()
            self.image.Modified()


class Window:
    """An off-screen window with Echolume's camera and light."""

    def __init__(self):
        self.renderer = vtk.vtkRenderer()
        self.renderer.AutomaticLightCreationOff()
        light = vtk.vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(*view.LIGHT)
        light.SetFocalPoint(0, 0, 0)
        self.renderer.AddLight(light)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(view.SIZE, view.SIZE)
        self.window.AddRenderer(self.renderer)
        self.pixels = vtk.vtkUnsignedCharArray()

    def picture(self, n):
        camera, ours = self.renderer.GetActiveCamera(), view.Camera(n)
        camera.SetPosition(*ours.position)
        camera.SetFocalPoint(0, 0, 0)
        camera.SetViewUp(*ours.up)
        camera.SetViewAngle(view.FIELD)
        self.renderer.ResetCameraClippingRange()
        self.window.Render()
        self.window.GetRGBACharPixelData(0, 0, view.SIZE - 1, view.SIZE - 1, 0, self.pixels)

    def shown(self):
        rgba = numpy_support.vtk_to_numpy(self.pixels).reshape(view.SIZE, view.SIZE, 4)
        return rgba[::-1, :, :3].copy()

    def driver(self):
        lines = self.window.ReportCapabilities().splitlines()
        return ", ".join(l.split(":", 1)[1].strip() for l in lines if "renderer string" in l or "version string" in l)


def properties(n, shaded):
    opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    for at, grey, a in view.transfer(n):
        opacity.AddPoint(255 * at, a)
        colour.AddRGBPoint(255 * at, grey, grey, grey)
    out = vtk.vtkVolumeProperty()
    out.SetScalarOpacity(opacity)
    out.SetColor(colour)
    out.SetScalarOpacityUnitDistance(phantom.pitch(n))
    out.SetInterpolationTypeToLinear()
    if shaded:
        out.ShadeOn()
        out.SetAmbient(view.AMBIENT)
        out.SetDiffuse(view.DIFFUSE)
        out.SetSpecular(view.SPECULAR)
        out.SetSpecularPower(view.SHININESS)
    return out


def grey(out):
    """Brightness as it is, for projections."""
    ramp, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    ramp.AddPoint(0, 1)
    ramp.AddPoint(255, 1)
    colour.AddRGBPoint(0, 0, 0, 0)
    colour.AddRGBPoint(255, 1, 1, 1)
    out.SetScalarOpacity(ramp)
    out.SetColor(colour)


class RayCast:
    """`row` is one of vr, vr_shaded, vr_shadows, surface, mip, minip, mean."""

    def __init__(self, mapper, row, volumes):
        n = volumes[0].shape[0]
        self.arriving = Arriving(volumes)
        self.mapper = mapper
        if hasattr(mapper, "SetAutoAdjustSampleDistances"):
            mapper.AutoAdjustSampleDistancesOff()
        if hasattr(mapper, "SetUseJittering"):
            mapper.UseJitteringOff()
        mapper.SetSampleDistance(phantom.pitch(n))
        mapper.SetInputData(self.arriving.image)
        shown = properties(n, row in ("vr_shaded", "vr_shadows", "surface"))
        blend = {
            "mip": "SetBlendModeToMaximumIntensity",
            "minip": "SetBlendModeToMinimumIntensity",
            "mean": "SetBlendModeToAverageIntensity",
            "surface": "SetBlendModeToIsoSurface",
        }.get(row, "SetBlendModeToComposite")
        getattr(mapper, blend)()
        if row in ("mip", "minip", "mean"):
            grey(shown)
        if row == "surface":
            shown.GetIsoSurfaceValues().SetValue(0, 255 * view.ISO)
            solid = vtk.vtkPiecewiseFunction()
            solid.AddPoint(0, 1)
            solid.AddPoint(255, 1)
            shown.SetScalarOpacity(solid)
            colour = vtk.vtkColorTransferFunction()
            colour.AddRGBPoint(0, 0.93, 0.72, 0.56)
            shown.SetColor(colour)
        if row == "vr_shadows":
            mapper.SetGlobalIlluminationReach(1.0)
            mapper.SetVolumetricScatteringBlending(1.0)
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(shown)
        self.window = Window()
        self.window.renderer.AddVolume(volume)

    def picture(self, n, volume):
        self.arriving.take(volume)
        self.window.picture(n)

    def shown(self):
        return self.window.shown()

    def driver(self):
        return self.window.driver()


def fixed_point(row, volumes):
    return RayCast(vtk.vtkFixedPointVolumeRayCastMapper(), row, volumes)


def gpu(row, volumes):
    return RayCast(vtk.vtkGPUVolumeRayCastMapper(), row, volumes)


class FlyingEdges:
    """The isosurface as triangles with normals, drawn by OpenGL; a new volume is contoured anew."""

    def __init__(self, row, volumes):
        self.arriving = Arriving(volumes)
        self.contour = vtk.vtkFlyingEdges3D()
        self.contour.SetInputData(self.arriving.image)
        self.contour.SetValue(0, 255 * view.ISO)
        self.contour.ComputeNormalsOn()
        self.contour.ComputeScalarsOff()
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(self.contour.GetOutputPort())
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        shown = actor.GetProperty()
        shown.SetColor(0.93, 0.72, 0.56)
        shown.SetAmbient(view.AMBIENT)
        shown.SetDiffuse(view.DIFFUSE)
        shown.SetSpecular(view.SPECULAR)
        shown.SetSpecularPower(view.SHININESS)
        self.window = Window()
        self.window.renderer.AddActor(actor)

    def picture(self, n, volume):
        self.arriving.take(volume)
        self.window.picture(n)

    shown = RayCast.shown
    driver = RayCast.driver


class Reslice:
    """vtkImageReslice, linear, on all threads."""

    def __init__(self, row, volumes):
        n = volumes[0].shape[0]
        self.arriving = Arriving(volumes)
        self.reslice = vtk.vtkImageReslice()
        self.reslice.SetInputData(self.arriving.image)
        self.reslice.SetOutputDimensionality(2)
        self.reslice.SetInterpolationModeToLinear()
        self.reslice.SetBackgroundLevel(0)
        # Half a voxel beyond the outer centres counts as inside, as with Echolume.
        self.reslice.BorderOn()

    def picture(self, n, volume):
        self.arriving.take(volume)
        right, down = view.plane(n)
        extent = lambda axis: float(np.abs(axis).sum()) * phantom.BOX
        pixel = max(extent(right), extent(down)) / view.SIZE
        self.reslice.SetResliceAxesDirectionCosines(*right, *down, *np.cross(right, down))
        self.reslice.SetResliceAxesOrigin(0, 0, 0)
        self.reslice.SetOutputSpacing(pixel, pixel, 1)
        self.reslice.SetOutputOrigin(*[-pixel * (view.SIZE - 1) / 2] * 2, 0)
        self.reslice.SetOutputExtent(0, view.SIZE - 1, 0, view.SIZE - 1, 0, 0)
        self.reslice.Update()

    def shown(self):
        data = self.reslice.GetOutput().GetPointData().GetScalars()
        grey = numpy_support.vtk_to_numpy(data).reshape(view.SIZE, view.SIZE)
        return np.repeat(grey[:, :, None], 3, 2)

    def driver(self):
        return "CPU"
