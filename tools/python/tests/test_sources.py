"""Files, live sources, settings and what the machine has."""

import importlib.metadata
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import threading
import typing
import warnings

import numpy as np
import pyigtl
import pytest
from conftest import REPOSITORY, SMALL

import echolume
from echolume import _inputs


def test_settings_that_are_read_back_make_the_same_picture(bone: str) -> None:
    first = echolume.Renderer(bone, settings={"picture.size": [96, 64], "camera.azimuth": 20}, light={"shadow": {}})
    settings = first.settings
    assert settings["camera"]["azimuth"] == 20 and settings["picture"]["size"] == [96, 64]
    second = echolume.Renderer(bone, settings=settings)
    assert second.settings == settings
    assert (second.picture() == first.picture()).all()
    # None takes a setting away.
    assert "shadow" in settings["light"]
    first.set(light={"shadow": None})
    assert "shadow" not in first.settings["light"]
    # What is refused changes nothing.
    before = first.settings
    with pytest.raises(ValueError, match="^settings: "):
        first.set(mode="mip", camera={"azimuth": "north"})
    assert first.settings == before


def test_words_tables_and_keywords_say_the_same(bone: str) -> None:
    of = [
        echolume.Renderer(bone, settings=["mode=mip", "picture.size=[96,64]"]),
        echolume.Renderer(bone, settings={"mode": "mip", "picture": {"size": (96, 64)}}),
        echolume.Renderer(bone, settings={"mode": "mip", "picture.size": np.array([96, 64])}),
        echolume.Renderer(bone, settings={"mode": "mip"}, picture={"size": [96, 64]}),
    ]
    assert all(renderer.settings == of[0].settings for renderer in of)


def test_the_presets_are_those_that_types_know() -> None:
    known = [name for part in typing.get_args(_inputs.Preset) for name in typing.get_args(part)]
    assert echolume.presets() == known


def test_another_volume_is_drawn_as_a_renderer_of_its_own_would(ball: np.ndarray) -> None:
    other = np.roll(ball, 5, axis=2)
    # Of which no setting follows from the echoes.
    preset = {"presets": ["bmode"], "mode": "mip", **SMALL}
    renderer = echolume.Renderer(ball, **preset)
    first = renderer.picture()
    renderer.update(other)
    alone = echolume.Renderer(other, **preset)
    assert (renderer.picture() == alone.picture()).all() and (renderer.picture() != first).any()
    with pytest.raises(ValueError, match="^update: another geometry"):
        renderer.update(other[1:])
    with pytest.raises(IndexError):
        renderer.update(other, 1)
    with pytest.raises(ValueError, match="^update: another geometry or type"):
        renderer.update(other.astype(np.uint16))


def test_a_stream_of_arrays_is_each_of_them(ball: np.ndarray) -> None:
    volumes = np.stack([ball, ball // 2, ball[::-1]])
    # With the look of the first, which follows from its echoes.
    settings = echolume.Renderer(ball, mode="mip", **SMALL).settings
    expected = [echolume.render(volume, settings=settings) for volume in volumes]
    settings = {"mode": "mip", **SMALL}
    for source in (volumes, list(volumes), iter(volumes)):
        with echolume.stream(source, settings=settings) as stream:
            assert stream.settings is None
            shown = []
            for number, picture in stream:
                shown.append((number, (picture == expected[number]).all()))
                assert stream.settings["mode"] == "mip"
        assert shown == [(0, True), (1, True), (2, True)]
    with pytest.raises(ValueError, match="^array: shape .*: a stream takes"):
        echolume.stream(ball)


def test_a_pipe_is_drawn_as_it_comes() -> None:
    script = REPOSITORY / "tools/pipe_frames.py"
    with subprocess.Popen([sys.executable, script, "1000", "62"], stdout=subprocess.PIPE) as process:
        with echolume.stream(process.stdout, mode="mip", **SMALL) as stream:
            shown = list(stream)
    # The newest volume that is there.
    assert shown[-1][0] == 1
    assert all(picture.shape == (64, 96, 4) and picture[..., :3].max() > 100 for _, picture in shown)


def test_the_phantom_has_no_end() -> None:
    with echolume.stream("phantom", mode="mip", rate=1e6, **SMALL) as stream:
        numbers = [next(stream)[0] for _ in range(2)]
    assert numbers[1] > numbers[0]
    assert list(stream) == []


def test_a_volume_of_an_openigtlink_server_is_drawn(ball: np.ndarray) -> None:
    """The server is pyigtl's."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = pyigtl.OpenIGTLinkServer(port=port, local_server=True)
    is_over = threading.Event()

    def send() -> None:
        while not is_over.wait(0.1):
            if server.is_connected():
                server.send_message(pyigtl.ImageMessage(ball, device_name="Volume"), wait=True)

    thread = threading.Thread(target=send)
    thread.start()
    try:
        with warnings.catch_warnings():
            # It may not listen yet.
            warnings.simplefilter("ignore", RuntimeWarning)
            with echolume.stream(f"igtl://127.0.0.1:{port}", mode="mip", **SMALL) as stream:
                _, picture = next(stream)
    finally:
        is_over.set()
        thread.join()
        server.stop()
    expected = echolume.render(ball, mode="mip", **SMALL)
    assert picture.shape == expected.shape
    assert np.abs(picture.astype(int) - expected).mean() < 2


def test_ctrl_c_ends_a_wait_for_a_server() -> None:
    code = (
        "import echolume, os, signal, threading, warnings\n"
        "warnings.simplefilter('ignore')\n"
        "stream = echolume.stream('igtl://127.0.0.1:9', mode='mip')\n"
        "print('waits', flush=True)\n"
        "next(stream)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "waits\n"
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert "KeyboardInterrupt" in said


def test_a_turn_that_is_ended_half_way_leaves_the_camera_as_it_was(bone: str) -> None:
    def stop(*_: object) -> None:
        raise TimeoutError("half-way")

    renderer = echolume.Renderer(bone, presets=["bone"], mode="mip", **SMALL)
    before = renderer.picture()
    former = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        with pytest.raises(TimeoutError):
            renderer.turntable(3600)
    finally:
        signal.signal(signal.SIGALRM, former)
    assert (renderer.picture() == before).all()


FAULTS = [
    (("nowhere.mha",), {}, "nowhere.mha: file: cannot be read"),
    (("igtl://",), {}, "igtl://: must read igtl://HOST"),
    (("igtl://host:0",), {}, "igtl://host:0: must read"),
    (("phantom",), {"rate": 0}, "rate=0: must be above 0"),
    (("phantom",), {"rounds": 0}, "rounds=0"),
    (("phantom",), {"affine": np.eye(4)}, "affine: is for arrays"),
    (("phantom",), {"presets": "face"}, "presets: 'face'"),
]


@pytest.mark.parametrize(("source", "words", "said"), FAULTS)
def test_a_wrong_stream_is_one_line(source, words, said: str) -> None:
    with pytest.raises(ValueError, match=f"^{said}") as found:
        echolume.stream(*source, **words)
    assert len(str(found.value).splitlines()) == 1


def test_info_is_what_the_file_says(bone: str) -> None:
    about = echolume.info(bone)
    assert any("160 x 216 x 33" in value for value in about.values()), about
    with pytest.raises(ValueError, match="^nowhere.mha: "):
        echolume.info("nowhere.mha")


def test_devices_are_those_of_vulkaninfo() -> None:
    devices = echolume.devices()
    assert sum(device.is_default for device in devices) == 1
    tool = shutil.which("vulkaninfo")
    if tool:
        said = subprocess.run([tool, "--summary"], capture_output=True, text=True, check=True).stdout
        assert [d.name for d in devices] == [line.split("=", 1)[1].strip() for line in said.splitlines() if "deviceName" in line]
    default = next(device for device in devices if device.is_default)
    small = np.zeros((3, 4, 5), np.uint8)
    assert echolume.render(small, device=devices.index(default), mode="mip", **SMALL).shape == (64, 96, 4)
    with pytest.raises(echolume.DeviceError):
        echolume.render(small, device="no such device")


def test_the_phantom_depends_on_its_numbers_alone() -> None:
    of = {"frames": 5, "lines": 8, "samples": 64}
    first, probe = echolume.phantom("constant", **of, speckle="none")
    assert first.shape == (5, 8, 64) and len(np.unique(first)) == 1
    assert (echolume.phantom(seed=3, **of)[0] == echolume.phantom(seed=3, **of)[0]).all()
    assert (echolume.phantom(seed=3, **of)[0] != echolume.phantom(seed=4, **of)[0]).any()
    assert (echolume.phantom(volume=2000, speckle="none", **of)[0] != echolume.phantom(speckle="none", **of)[0]).any()
    with pytest.raises(ValueError, match="must be one of head, sphere"):
        echolume.phantom("nose")  # type: ignore[arg-type]
    with pytest.raises(IndexError):
        echolume.phantom(volume=-1)


def test_names_version_and_metadata() -> None:
    about = importlib.metadata.metadata("echolume")
    assert echolume.__version__ == about["Version"]
    assert "No licence has been chosen" in about["License"]
    assert "not a medical device" in about.get_payload()
    assert "ultrasound" in about["Keywords"]
    assert "Private :: Do Not Upload" in about.get_all("Classifier")
    for name in echolume.__all__:
        thing = getattr(echolume, name)
        assert name.startswith("__") or (thing.__module__ == "echolume" and thing.__doc__), name
    files = pathlib.Path(echolume.__file__).parent
    assert {"py.typed", "_echolume.pyi"} <= {path.name for path in files.iterdir()}
