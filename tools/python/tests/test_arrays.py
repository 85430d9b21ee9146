"""Arrays of every kind and their faults."""

import threading

import numpy as np
import pytest
import xarray
from conftest import SMALL
from scipy.ndimage import gaussian_filter

import echolume
from echolume._inputs import array_of


def test_a_projection_is_the_maximum_of_numpy() -> None:
    """From the probe into the body, with eleven pixels for a voxel: in its middle nothing is interpolated. The first slice is below."""
    volume = gaussian_filter(np.random.default_rng(1).normal(size=(24, 32, 40)), 2)
    volume = (255 * (volume - volume.min()) / np.ptp(volume)).round().astype(np.uint8)
    plain = {"projection": {"window": [0, 1]}, "slices": {"smooth": None}, "ray": {"elevation": "linear"}}
    picture = echolume.render(volume, mode="mip", picture={"size": [440, 264]}, settings=plain)
    middle = picture[5::11, 5::11].astype(int)
    assert np.abs(middle[..., 0] - volume.max(axis=1)[::-1]).max() <= 2
    assert (middle[..., 0] == middle[..., 2]).all() and (middle[..., 3] == 255).all()
    # The same samples as signed ones, in a range of their own.
    signed = volume.astype(np.int16) * 10 - 1200
    other = echolume.render(signed, mode="mip", picture={"size": [440, 264]}, settings=plain, range=(-1200, 1350))
    assert np.abs(other.astype(int) - picture).max() <= 1


def test_the_same_samples_in_any_memory_make_the_same_picture(ball: np.ndarray) -> None:
    expected = echolume.render(ball, mode="mip", **SMALL)
    padded = np.zeros((33, 33, 66), np.uint8)
    padded[:, :, ::2] = ball
    read_only = ball.copy()
    read_only.flags.writeable = False
    others = {
        "strided": padded[:, :, ::2],
        "turned round": np.ascontiguousarray(ball[::-1, :, ::-1])[::-1, :, ::-1],
        "Fortran": np.asfortranarray(ball),
        "read only": read_only,
        "xarray": xarray.DataArray(ball, dims=("z", "y", "x")),
        "one of several": np.stack([ball // 2, ball]),
    }
    for name, other in others.items():
        number = 1 if getattr(other, "ndim", 3) == 4 else 0
        assert (echolume.render(other, number, mode="mip", **SMALL) == expected).all(), name
        assert (echolume.convert(other, number)[0] == ball).all(), name


class OnlyDLPack:
    """What torch.Tensor offers, and nothing else of numpy's."""

    def __init__(self, array: np.ndarray) -> None:
        self.array, self.asked = array, 0

    def __dlpack__(self, **words: object) -> object:
        self.asked += 1
        return self.array.__dlpack__(**words)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.array.__dlpack_device__()


def test_dlpack_is_read_where_it_is(ball: np.ndarray) -> None:
    tensor = OnlyDLPack(ball)
    assert np.shares_memory(array_of(tensor), ball)
    assert (echolume.convert(tensor)[0] == ball).all()
    assert tensor.asked == 2

    class OfDevice(OnlyDLPack):
        def __dlpack_device__(self) -> tuple[int, int]:
            return (2, 0)

        def __dlpack__(self, **words: object) -> object:
            raise BufferError("a CUDA tensor\nhas to be brought to the CPU first")

    with pytest.raises(ValueError, match="^array: a OfDevice is not readable by numpy: .*$"):
        echolume.render(OfDevice(ball))


def test_views_of_numpy_and_xarray_are_not_copied(ball: np.ndarray) -> None:
    assert np.shares_memory(array_of(xarray.DataArray(ball)), ball)
    assert np.shares_memory(array_of(ball[::2, ::-1]), ball)


def test_what_is_returned_belongs_to_numpy(bone: str) -> None:
    picture = echolume.render(bone, presets=["bone"], **SMALL)
    assert picture.flags.writeable and picture.flags.c_contiguous
    assert np.shares_memory(np.from_dlpack(picture), picture)
    samples = echolume.read(bone)["samples"]
    samples[:] = 0
    assert echolume.read(bone)["samples"].any()


def test_what_is_written_to_an_array_later_changes_no_picture(ball: np.ndarray) -> None:
    renderer = echolume.Renderer(ball, mode="mip", **SMALL)
    before = renderer.picture()
    ball[:] = 0
    renderer.set(camera={"azimuth": 90})
    renderer.set(camera={"azimuth": 0})
    assert (renderer.picture() == before).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16, np.float32, ">u2", ">i2", ">f4"])
def test_samples_of_every_type_come_back(dtype: str) -> None:
    rng = np.random.default_rng(2)
    low = -1000 if np.dtype(dtype).kind in "if" else 0
    high = 255 if np.dtype(dtype).itemsize == 1 else 3000
    volume = rng.integers(low, high, (3, 4, 5)).astype(dtype)
    back, affine = echolume.convert(volume, spacing=(0.5, 0.6, 0.7))
    assert back.dtype == volume.dtype.newbyteorder("=") and (back == volume).all()
    assert np.allclose(affine, np.diag([0.5, 0.6, 0.7, 1]), atol=0)


FAULTS = [
    (lambda a: a.astype(float), {}, "array: dtype float64: must be uint8, uint16, int16 or float32"),
    (lambda a: a > 3, {}, "array: dtype bool"),
    (lambda a: a.astype(np.complex64), {}, "array: dtype complex64"),
    (lambda a: a.astype(object), {}, "array: dtype object"),
    (lambda a: [[["x"]]], {}, "array: dtype <U1"),
    (lambda a: [[1], [1, 2]], {}, "array: a list is not readable"),
    (lambda a: a[0, 0], {}, r"array: shape \(33,\): must be \(slices, rows, columns\)"),
    (lambda a: a[None, None], {}, r"array: shape \(1, 1, 33, 33, 33\)"),
    (lambda a: a[:0], {}, r"array: shape \(0, 33, 33\)"),
    (lambda a: np.ma.masked_less(a, 3), {}, "array: is masked"),
    (lambda a: np.where(a == 255, np.nan, 1).astype(np.float32), {}, r"array: sample \[9, 16, 16\] is NaN"),
    (lambda a: np.where(a == 255, -np.inf, 1).astype(np.float32), {}, "array: sample .* is -inf"),
    (lambda a: a, {"spacing": (1, 1)}, "spacing: must be three lengths"),
    (lambda a: a, {"spacing": (1, 0, 1)}, "spacing: .* above 0 mm"),
    (lambda a: a, {"spacing": (1, np.nan, 1)}, "spacing: .* above 0 mm"),
    (lambda a: a, {"spacing": (1, 1e9, 1)}, "spacing: is 1e9 mm, must lie in"),
    (lambda a: a, {"affine": np.eye(3)}, r"affine: must be \(4, 4\)"),
    (lambda a: a, {"affine": np.diag([1, 1, 0, 1])}, "affine: has an axis of no length"),
    (lambda a: a, {"affine": np.eye(4) + np.eye(4, k=1) * [0, 1, 0, 0]}, "affine: has axes 45.00 degrees apart"),
    (lambda a: a, {"affine": np.diag([1, 1, 1, 2])}, "affine: its last row"),
    (lambda a: a, {"affine": np.full((4, 4), np.nan)}, "affine: its last row"),
    (lambda a: a, {"affine": np.eye(4), "spacing": (1, 1, 1)}, "spacing: follows from affine"),
    (lambda a: a, {"range": (3, 3)}, r"range: \(3, 3\): must be two rising finite numbers"),
    (lambda a: a, {"range": (3,)}, "range: must be two numbers"),
    (lambda a: a, {"presets": "face"}, r"presets: 'face': must be a sequence of names"),
    (lambda a: a, {"presets": ["nose"]}, 'preset "nose" is unknown'),
    (lambda a: a, {"settings": "mode=mip"}, "settings: 'mode=mip': must be a table"),
    (lambda a: a, {"camera": {"azimut": 3}}, "settings: camera: .*azimut"),
    (lambda a: a, {"camera": {"azimuth": float("nan")}}, "settings: "),
    (lambda a: a, {"camera": {"azimuth": object()}}, "settings: "),
    (lambda a: a, {"settings": {"mode.x": 1, "mode": 2}}, "settings: "),
]


@pytest.mark.parametrize(("change", "words", "said"), FAULTS)
def test_every_fault_is_one_line_that_says_what_is_allowed(ball, change, words, said) -> None:
    with pytest.raises(ValueError, match=f"^{said}") as found:
        echolume.Renderer(change(ball), **words)
    assert len(str(found.value).splitlines()) == 1


@pytest.mark.parametrize("number", [-1, 1, 10**30])
def test_volumes_that_are_not_there_are_index_errors(ball: np.ndarray, bone: str, number: int) -> None:
    for source in (ball, ball[None], None):
        with pytest.raises(IndexError, match="there are 1, numbered from 0"):
            echolume.Renderer(source, number)
    if number < 2**63:
        with pytest.raises(IndexError, match="there are 1, numbered from 0"):
            echolume.read(bone, number)


def test_work_is_done_without_the_gil(ball: np.ndarray) -> None:
    """Another thread of Python counts while a turn is drawn. Were the GIL held, it could not."""
    renderer = echolume.Renderer(ball, presets=["bone"], **SMALL)
    counted, is_over = 0, threading.Event()

    def draw() -> None:
        renderer.turntable(8)
        is_over.set()

    thread = threading.Thread(target=draw)
    thread.start()
    while not is_over.is_set():
        counted += 1
    thread.join()
    # The calls of a thread that waits for the GIL come every 5 ms at most.
    assert counted > 10_000
