"""What the tests share. Each compares the module with something else: a formula, numpy, scipy, or a library that reads the same files."""

import pathlib

import numpy as np
import pytest

REPOSITORY = pathlib.Path(__file__).parents[3]
SMALL = {"picture": {"size": [96, 64]}}


@pytest.fixture
def bone() -> str:
    return str(REPOSITORY / "tests/data/bone-l14/bone.mha")


@pytest.fixture
def ball() -> np.ndarray:
    """A ball of radius 9 voxels that fades over 4 voxels: its surface at half of the range has this radius."""
    z, y, x = np.mgrid[-16:17, -16:17, -16:17].astype(float)
    return np.clip(127.5 + 63.75 * (9 - np.sqrt(x**2 + y**2 + z**2)), 0, 255).round().astype(np.uint8)


def rotation() -> np.ndarray:
    """A rotation about no axis of the lattice."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()
