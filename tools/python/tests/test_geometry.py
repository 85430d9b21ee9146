"""Where samples are: against formulas, scipy, nibabel and SimpleITK."""

import nibabel
import numpy as np
import pytest
import SimpleITK
from conftest import SMALL, rotation
from scipy.ndimage import map_coordinates

import echolume
from echolume import Probe

FRAMES, LINES, SAMPLES = 7, 9, 16


def curved_fan(radius: float, wobble: float, start: float, pitch: float, lines: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """In-plane polar coordinates about the apex, turned about an axis `wobble` behind the face; rad."""
    depth = radius + start + pitch * np.arange(SAMPLES)
    motor, line, depth = np.meshgrid(frames, lines, depth, indexing="ij")
    x, y = depth * np.sin(line), depth * np.cos(line)
    axis = radius - wobble
    return np.stack([x, axis + (y - axis) * np.cos(motor), (y - axis) * np.sin(motor)], axis=-1)


def test_a_curved_array_that_turns() -> None:
    probe = Probe.curved(radius_mm=40, sector_angle_deg=70, start_mm=3, sample_pitch_mm=0.5).fan(angle_deg=60, wobble_radius_mm=25)
    lines, frames = np.radians(np.linspace(-35, 35, LINES)), np.radians(np.linspace(-30, 30, FRAMES))
    assert np.allclose(probe.places(FRAMES, LINES, SAMPLES), curved_fan(40, 25, 3, 0.5, lines, frames), atol=1e-9)


def test_a_phased_array_with_tables_of_angles() -> None:
    lines, frames = np.array([-40, -20, -11, -3, 0, 7, 12, 30, 41.0]), np.array([-20, -10, -9, 0, 4, 5, 21.0])
    probe = Probe.phased(angles_deg=lines, end_mm=30.0).fan(angles_deg=frames, wobble_radius_mm=10)
    expected = curved_fan(0, 10, 0, 30 / (SAMPLES - 1), np.radians(lines), np.radians(frames))
    assert np.allclose(probe.places(FRAMES, LINES, SAMPLES), expected, atol=1e-9)


def test_a_linear_array_that_is_moved() -> None:
    probe = Probe.linear(width_mm=38, sample_pitch_mm=0.2).translated(pitch_mm=0.7)
    z, x, y = np.meshgrid(0.7 * (np.arange(FRAMES) - 3), np.linspace(-19, 19, LINES), 0.2 * np.arange(SAMPLES), indexing="ij")
    assert np.allclose(probe.places(FRAMES, LINES, SAMPLES), np.stack([x, y, z], axis=-1), atol=1e-9)


def test_the_motor_travels_while_lines_fire() -> None:
    still = Probe.linear(width_mm=38, sample_pitch_mm=0.2)
    places = still.translated(pitch_mm=0.5, speed_ratio=0.5).places(FRAMES, LINES, SAMPLES)
    # Half of the way to the next frame within the lines of one.
    travel = places[:, :, 0, 2] - places[:, :1, 0, 2]
    assert np.allclose(travel, 0.25 * np.arange(LINES) / LINES, atol=1e-9)


def test_scan_conversion_is_that_of_scipy() -> None:
    """Voxels of random frames against map_coordinates at indices from the closed inverse of the sweep."""
    rng = np.random.default_rng(3)
    frames = rng.integers(0, 256, (FRAMES, LINES, SAMPLES)).astype(np.float32)
    probe = Probe.curved(radius_mm=20, sector_angle_deg=60, sample_pitch_mm=1.5).fan(angle_deg=50, wobble_radius_mm=12)
    lattice, affine = echolume.convert(frames, probe=probe, voxel=1.3, outside=-1)
    columns, rows, slices = np.meshgrid(*(np.arange(n) for n in lattice.shape[::-1]), indexing="ij")
    x, y, z = np.einsum("ij,jxyz->ixyz", affine[:3, :3], np.stack([columns, rows, slices]).astype(float)) + affine[:3, 3, None, None, None]
    axis = 20 - 12
    motor, depth = np.arctan2(z, y - axis), np.hypot(y - axis, z) + axis
    line, along = np.arctan2(x, depth), np.hypot(x, depth)
    step = lambda angle, count: np.radians(angle) / (count - 1)
    index = np.stack(
        [motor / step(50, FRAMES) + (FRAMES - 1) / 2, line / step(60, LINES) + (LINES - 1) / 2, (along - 20) / 1.5]
    )
    last = np.array(frames.shape).reshape(3, 1, 1, 1) - 1
    inside = ((index > 1e-6) & (index < last - 1e-6)).all(axis=0)
    expected = map_coordinates(frames, index, order=1)
    found = lattice.transpose(2, 1, 0)
    assert inside.sum() > 5000
    assert np.abs(found - expected)[inside].max() < 1e-3
    outside = ((index < -1e-6) | (index > last + 1e-6)).any(axis=0)
    assert (found[outside] == -1).all() and outside.sum() > 5000


def test_a_sphere_of_the_phantom_is_where_it_is_in_space() -> None:
    """Samples of a swept ball: bright on a shell. Its surface on the lattice is a sphere about the point that the samples have."""
    frames, probe = echolume.phantom("sphere", frames=37, lines=64, samples=256, speckle="none")
    places = probe.places(*frames.shape)
    assert frames.dtype == np.uint8 and frames.shape == (37, 64, 256)
    bright = places[frames > frames.max() / 2]
    lattice, affine = echolume.convert(frames, probe=probe, voxel=1.0)
    slices, rows, columns = np.nonzero(lattice > frames.max() / 2)
    there = np.stack([columns, rows, slices], axis=1) @ affine[:3, :3].T + affine[:3, 3]
    for low, high in ((bright.min(axis=0), there.min(axis=0)), (bright.max(axis=0), there.max(axis=0))):
        assert np.abs(low - high).max() < 2.5


def test_arrays_of_itk_keep_their_place(tmp_path) -> None:
    """An oblique volume that SimpleITK wrote is read as the same array with the affine of its header."""
    rng = np.random.default_rng(4)
    turn = rotation()
    image = SimpleITK.GetImageFromArray(rng.integers(-500, 900, (5, 6, 7)).astype(np.int16))
    image.SetSpacing((0.4, 0.6, 1.1))
    image.SetOrigin((-30.0, 7.0, 110.0))
    image.SetDirection(turn.ravel())
    path = str(tmp_path / "oblique.nrrd")
    SimpleITK.WriteImage(image, path)
    affine = np.eye(4)
    affine[:3, :3] = turn * image.GetSpacing()
    affine[:3, 3] = image.GetOrigin()
    view = SimpleITK.GetArrayViewFromImage(image)
    of_file, of_array = echolume.read(path), echolume.convert(view, affine=affine)
    assert (of_file["samples"] == view).all() and (of_array[0] == view).all()
    assert np.allclose(of_file["voxel_to_world"], affine, atol=1e-6) and np.allclose(of_array[1], affine, atol=1e-9)
    last = image.TransformIndexToPhysicalPoint((6, 5, 4))
    assert np.allclose(of_array[1] @ [6, 5, 4, 1], [*last, 1], atol=1e-9)
    same = echolume.render(path, mode="mip", **SMALL) == echolume.render(view, affine=affine, mode="mip", range=of_file["range"], **SMALL)
    assert same.all()


@pytest.mark.parametrize("signs", [(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1)])
def test_a_mirrored_volume_is_drawn_as_its_file_is(tmp_path, signs: tuple[int, int, int]) -> None:
    """nibabel writes a left-handed volume: the array with the same affine has its voxels at the same places, and the same picture."""
    rng = np.random.default_rng(5)
    volume = rng.integers(0, 256, (5, 6, 7), dtype=np.uint8)
    affine = np.diag([0.5, 0.6, 0.7, 1.0]) * (*signs, 1)
    affine[:3, 3] = (4, 5, 6)
    path = str(tmp_path / "mirrored.nii")
    nibabel.save(nibabel.Nifti1Image(volume.T, np.diag([-1, -1, 1, 1]) @ affine), path)
    samples, place = echolume.convert(volume, affine=affine)
    assert np.linalg.det(place[:3, :3]) > 0 > np.linalg.det(affine[:3, :3])
    for index in np.ndindex(volume.shape):
        z, y, x = index
        voxel = np.linalg.solve(place, affine @ [x, y, z, 1])[:3].round().astype(int)
        assert samples[tuple(voxel[::-1])] == volume[index]
    of_file = echolume.read(path)
    assert (of_file["samples"] == samples).all() and np.allclose(of_file["voxel_to_world"], place, atol=1e-5)


def test_a_lattice_for_nibabel_has_the_same_places(tmp_path, bone: str) -> None:
    """The line of docs/python.md: what is written so is read back by the program at the same places."""
    lattice, affine = echolume.convert(bone, voxel=1.0)
    path = str(tmp_path / "bone.nii.gz")
    nibabel.save(nibabel.Nifti1Image(lattice.T, np.diag([-1, -1, 1, 1]) @ affine), path)
    back = echolume.read(path)
    assert (back["samples"] == lattice).all() and np.allclose(back["voxel_to_world"], affine, atol=1e-4)


def test_polar_frames_are_drawn_as_their_file_is(tmp_path) -> None:
    """A sweep in a file with its probe file, and its samples with a Probe of the same numbers."""
    frames, probe = echolume.phantom("step", frames=9, lines=24, samples=64)
    image = SimpleITK.GetImageFromArray(frames)
    path, tables = tmp_path / "sweep.mha", tmp_path / "sweep.probe.toml"
    SimpleITK.WriteImage(image, str(path))
    tables.write_text(
        "[array]\nkind = 'curved'\nradius_mm = 40\n[lines]\nsector_angle_deg = 75\n[depth]\nend_mm = 120\n"
        "[motion]\nkind = 'fan'\nwobble_radius_mm = 25\nfan_angle_deg = 61\n"
    )
    of_file = echolume.render(str(path), mode="mip", **SMALL)
    for given in (probe, str(tables)):
        of_array = echolume.render(frames, probe=given, mode="mip", **SMALL)
        assert np.abs(of_file.astype(int) - of_array).max() <= 1, given


FAULTS = [
    (lambda: Probe.curved(radius_mm=40, end_mm=100), "lines: must have either sector_angle_deg or angles_deg"),
    (lambda: Probe.curved(radius_mm=-1, sector_angle_deg=60, end_mm=100), "array.radius_mm: is -1"),
    (lambda: Probe.linear(width_mm=38), "depth: must have either sample_pitch_mm or end_mm"),
    (lambda: Probe.linear(positions_mm=[1, 2], end_mm=10).translated(pitch_mm=1), "lines.positions_mm: has 2 entries"),
    (lambda: Probe.linear(width_mm=38, end_mm=10).fan(wobble_radius_mm=3), "motion: must have either"),
    (lambda: Probe.linear(width_mm=float("nan"), end_mm=10), "probe: "),
    (lambda: Probe.linear(width_mm=38, end_mm=10).translated(pitch_mm=1, speed_ratio=3), "motion.speed_ratio: is 3"),
]


@pytest.mark.parametrize(("make", "said"), FAULTS)
def test_a_wrong_probe_is_one_line(make, said: str) -> None:
    with pytest.raises(ValueError, match="^probe: ") as found:
        echolume.render(np.zeros((3, 4, 5), np.uint8), probe=make())
    assert said in str(found.value) and len(str(found.value).splitlines()) == 1


def test_a_probe_is_of_arrays_alone(bone: str) -> None:
    probe = Probe.linear(width_mm=38, end_mm=10)
    with pytest.raises(ValueError, match="^probe: is for arrays"):
        echolume.render(bone, probe=probe)
    with pytest.raises(ValueError, match="^affine: is for arrays"):
        echolume.render(bone, affine=np.eye(4))
    with pytest.raises(ValueError, match="^probe: polar frames have neither"):
        echolume.render(np.zeros((3, 4, 5), np.uint8), probe=probe, spacing=(1, 1, 1))
    assert probe == Probe.linear(width_mm=38, end_mm=10) != probe.translated(pitch_mm=1)
