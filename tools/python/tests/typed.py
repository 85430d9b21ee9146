"""What mypy has to accept, and each line that it has to refuse: with `warn_unused_ignores` one that is accepted is an error."""

import numpy as np
import numpy.typing as npt

import echolume

ball = np.zeros((3, 4, 5), np.uint8)
picture: npt.NDArray[np.uint8] = echolume.render(ball, spacing=(1, 1, 1), presets=["face"], camera={"azimuth": 30})
lattice, affine = echolume.convert("sweep.mha", voxel=0.5)
renderer = echolume.Renderer(ball, affine=affine, settings={"mode": "mip"})
angle: float = renderer.settings["camera"]["azimuth"]
for number, shown in echolume.stream([ball, ball]):
    last: tuple[int, ...] = shown.shape + (number,)

echolume.render(ball, presets="face")  # type: ignore[arg-type]
echolume.render(ball, presets=["nose"])  # type: ignore[list-item]
echolume.render(ball, spacing=1.0)  # type: ignore[arg-type]
echolume.render(3)  # type: ignore[arg-type]
echolume.phantom("nose")  # type: ignore[arg-type]
echolume.Probe.curved(40, sector_angle_deg=70)  # type: ignore[call-arg]
echolume.stream(3)  # type: ignore[arg-type]
