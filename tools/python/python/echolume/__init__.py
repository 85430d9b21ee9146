"""Echolume: sweeps of a 3D/4D ultrasound probe as volumes and pictures, on Vulkan. Not a medical device.

A volume in memory, (slices, rows, columns), and where its voxels are:

>>> import echolume
>>> bone = echolume.read(BONE)
>>> bone["samples"].shape, bone["samples"].dtype.name, bone["geometry"]
((33, 216, 160), 'uint8', 'cartesian')

A picture, (height, width, 4); what is changed later runs only the passes that depend on it:

>>> renderer = echolume.Renderer(BONE, presets=["bone"], settings=["picture.size=[96,64]"])
>>> picture = renderer.picture()
>>> picture.shape, picture.dtype.name, bool(picture[..., :3].max() > 100)
((64, 96, 4), 'uint8', True)
>>> renderer.set("camera.azimuth=30", "mode=mip")
>>> bool((renderer.picture() != picture).any())
True
>>> renderer.turntable(3).shape
(3, 64, 96, 4)

Settings do what they do in `echolume render`: the range of the samples, measurements, and a bar below the picture:

>>> before = renderer.picture()
>>> renderer.set("samples.range=[0,100]")
>>> bool((renderer.picture() != before).any())
True
>>> renderer.set("samples.range=[0,255]")
>>> bool((renderer.picture() == before).all())
True
>>> renderer.set("marks.bar=true")
>>> barred = renderer.picture()
>>> barred.shape[0] > 64, barred.shape[1:]
(True, (96, 4))
>>> renderer.turntable(2).shape == (2, *barred.shape)
True
>>> renderer.set("marks.bar=false", 'measure=[{kind="distance",points=[[-10,10,0],[10,30,0]],on_surface=true}]')
>>> measured = renderer.picture()
>>> measured.shape == before.shape, bool((measured != before).any())
(True, True)

The volumes of a recording as they are played:

>>> [(volume, picture.shape) for volume, picture in echolume.stream(BONE, settings=["mode=mip", "picture.size=[32,24]"])]
[(0, (24, 32, 4))]

Errors are one line that names what was being done to what:

>>> echolume.read("nowhere.mha")
Traceback (most recent call last):
ValueError: nowhere.mha: file: cannot be read: No such file or directory (os error 2)
>>> renderer.set("mode=sideways")  # doctest: +ELLIPSIS
Traceback (most recent call last):
ValueError: ...mode...
>>> echolume.stream(BONE, settings=["samples.range=[0,100]"])
Traceback (most recent call last):
ValueError: samples.range: a stream has the range that its recording states; only a Renderer takes another
>>> renderer.set("mode=plane")
>>> renderer.turntable(3)
Traceback (most recent call last):
ValueError: scene: mode: shows planes, which do not turn with the view: a turntable needs a rendering
>>> echolume.Renderer(BONE, 1)
Traceback (most recent call last):
IndexError: volume 1: there are 1, numbered from 0
"""

from ._echolume import DeviceError, Renderer, Stream, read, stream

__all__ = ["DeviceError", "Renderer", "Stream", "read", "stream"]
