"""The examples of docs/python.md and README.md, and the notebook, as a user runs them."""

import pathlib
import re
import shutil

import nbclient
import nbformat
import numpy as np
import pytest
import SimpleITK
from conftest import REPOSITORY

import echolume


def examples(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", (REPOSITORY / page).read_text(), flags=re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(("page", "least"), [("docs/python.md", 8), ("tools/python/README.md", 1)])
def test_the_examples_of_a_page_run(page: str, least: int, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One after another, in a folder with the files that they name."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(REPOSITORY / "tests/data/bone-l14/bone.mha", tmp_path)
    frames, _ = echolume.phantom("head", frames=9, lines=24, samples=64)
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(frames), "frames.mha")
    np.save("frames.npy", frames)
    found = examples(page)
    assert len(found) >= least
    names: dict[str, object] = {}
    for example in found:
        exec(compile(example, page, "exec"), names)  # noqa: S102


def test_the_notebook_runs_and_finds_what_is_known() -> None:
    notebook = nbformat.read(REPOSITORY / "tools/python/echolume.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "it is kept without outputs"
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    said = "".join(output.get("text", "") for output in outputs)
    depth, radius = map(float, re.search(r"depth ([\d.]+) mm, radius ([\d.]+) mm", said).groups())
    # The look smooths the samples, and the ramp of the ball is 3 mm wide.
    assert depth == pytest.approx(35, abs=1) and radius == pytest.approx(20, abs=1)
    volume = float(re.search(r"([\d.]+) ml, a ball", said).group(1))
    assert volume == pytest.approx(4 / 3 * np.pi * 20**3 / 1000, rel=0.02)
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 3
