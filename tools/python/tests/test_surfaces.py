"""Meshes and measurements: against formulas and trimesh."""

import numpy as np
import pytest
import trimesh
from conftest import rotation

import echolume


def test_the_mesh_of_a_ball_has_its_volume_and_place(ball: np.ndarray) -> None:
    affine = np.eye(4)
    affine[:3, :3] = rotation() * 0.5
    affine[:3, 3] = (11, -7, 30)
    found = echolume.mesh(ball, affine=affine, threshold=0.5)
    solid = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert solid.is_watertight and solid.is_winding_consistent and found.closed and found.threshold == 0.5
    # 9 voxels of 0.5 mm. The corners of a polyhedron lie on the sphere, and its faces within.
    assert solid.volume == pytest.approx(4 / 3 * np.pi * 4.5**3, rel=0.02)
    assert solid.area == pytest.approx(4 * np.pi * 4.5**2, rel=0.02)
    centre = (affine @ [16, 16, 16, 1])[:3]
    assert np.allclose(solid.center_mass, centre, atol=0.01)
    assert np.allclose(np.linalg.norm(found.vertices - centre, axis=1), 4.5, atol=0.05)


def test_fewer_triangles_stay_within_the_tolerance(ball: np.ndarray) -> None:
    fine, coarse = (echolume.mesh(ball, threshold=0.5, simplify=simplify) for simplify in (None, 0.2))
    assert len(coarse.triangles) < len(fine.triangles) / 2
    solid = trimesh.Trimesh(coarse.vertices, coarse.triangles, process=False)
    assert solid.is_watertight
    assert np.abs(np.linalg.norm(fine.vertices - 16, axis=1) - 9).max() < 0.1
    assert np.abs(np.linalg.norm(solid.triangles_center - 16, axis=1) - 9).max() < 0.1 + 0.2


def test_the_threshold_that_nobody_gave_lies_between_two_classes(ball: np.ndarray) -> None:
    found = echolume.mesh(np.where(ball > 127, 200, 40).astype(np.uint8))
    assert 40 / 255 < found.threshold < 200 / 255
    with pytest.raises(ValueError, match="^threshold: the echoes have no two classes"):
        echolume.mesh(np.zeros((9, 9, 9), np.uint8))
    with pytest.raises(ValueError, match="^threshold: 2: must lie in"):
        echolume.mesh(ball, threshold=2)
    with pytest.raises(ValueError, match="^simplify: 0"):
        echolume.mesh(ball, threshold=0.5, simplify=0)
    with pytest.raises(ValueError, match="^smooth: "):
        echolume.mesh(ball, threshold=0.5, smooth=1e3)


def test_an_open_mesh_ends_at_the_border() -> None:
    half = np.repeat(np.linspace(0, 255, 12).round().astype(np.uint8)[:, None, None], 9, axis=1).repeat(9, axis=2)
    found = echolume.mesh(half, threshold=0.5, closed=False)
    assert not found.closed and np.allclose(found.vertices[:, 2], 5.5, atol=0.02)
    assert echolume.mesh(half, threshold=0.5).closed


def test_a_point_is_picked_on_the_sphere_that_is_seen(ball: np.ndarray) -> None:
    """In an orthographic or perspective view the middle of the picture hits the near pole of a ball in the middle of the volume."""
    renderer = echolume.Renderer(ball, mode="surface", picture={"size": [96, 96]}, surface={"threshold": 0.5}, slices={"smooth": None})
    point = renderer.pick(48, 48)
    assert point is not None
    assert np.linalg.norm(np.subtract(point, 16)) == pytest.approx(9, abs=0.4)
    assert renderer.pick(0.5, 0.5) is None and renderer.pick(-3, 5) is None
    renderer.set(mode="mip")
    with pytest.raises(ValueError, match="^pick: this mode finds no surface"):
        renderer.pick(48, 48)


def test_measurements_are_those_of_formulas(ball: np.ndarray) -> None:
    renderer = echolume.Renderer(ball, mode="plane", picture={"size": [96, 64]})
    assert renderer.measurements == []
    square = [[x, y, 5] for x, y in ((0, 0), (10, 0), (10, 10), (0, 10))]
    renderer.set(
        measure=[
            {"kind": "distance", "points": [[1, 2, 3], [4, 6, 15]], "text": "bone"},
            {"kind": "angle", "points": [[1, 0, 0], [0, 0, 0], [0, 1, 0]]},
            {"kind": "trace", "points": square},
        ]
    )
    found = renderer.measurements
    assert found[0] == {"kind": "distance", "text": "bone", "quantities": {"distance": (13.0, "mm")}}
    assert found[1]["quantities"]["angle"] == (pytest.approx(90), "deg")
    assert found[2]["quantities"]["area"] == (pytest.approx(1.0), "cm2")
    assert found[2]["quantities"]["circumference"] == (pytest.approx(40.0), "mm")
