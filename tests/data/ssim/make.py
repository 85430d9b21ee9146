# Makes pairs.json: small pictures and their SSIM by scikit-image (0.26.0; numpy 2.4.6, scipy 1.17.1).
# Values are thousandths, red green blue, rows from the top.
import json
import numpy as np
from skimage.metrics import structural_similarity

rng = np.random.default_rng(7)


def pair(name, a, b):
    a, b = (np.clip(np.round(v * 1000), 0, 1000).astype(int) for v in (a, b))
    grey = [v @ np.array([0.2126, 0.7152, 0.0722]) / 1000 for v in (a, b)]
    ssim = structural_similarity(*grey, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1)
    return {"name": name, "width": a.shape[1], "height": a.shape[0], "ssim": float(ssim),
            "a": a.ravel().tolist(), "b": b.ravel().tolist()}


y, x = np.mgrid[0:17, 0:24]
waves = np.stack([0.5 + 0.4 * np.sin(x / p) * np.cos(y / q) for p, q in ((2, 3), (3, 2), (4, 4))], -1)
edge = np.where((x > y)[..., None], [0.9, 0.7, 0.1], [0.1, 0.2, 0.3])
smallest = rng.random((11, 11, 3))
pairs = [
    pair("noise on waves", waves, waves + 0.1 * rng.standard_normal(waves.shape)),
    pair("a shifted edge", edge, np.roll(edge, 1, axis=1)),
    pair("half the contrast", waves, 0.25 + 0.5 * waves),
    pair("unrelated, one window", smallest, rng.random((11, 11, 3))),
]
json.dump(pairs, open("pairs.json", "w"), separators=(",", ":"))
