"""Reference values of `tests/compare.rs`: two synthetic images, compared with independent programs.

    python3 -m venv venv && venv/bin/pip install scikit-image==0.26.0 flip-evaluator==1.7 && venv/bin/python tests/compare/reference.py
"""

import flip_evaluator
import numpy as np
from skimage.color import deltaE_ciede2000, rgb2lab
from skimage.metrics import structural_similarity

y, x, c = np.mgrid[0:48, 0:64, 0:3]
a = (x * 5 + y * 3 + c * 40 + (x * y) % 17 * 4) % 256
b = np.clip(a + (x * 7 + y * 13 + c * 5) % 23 - 11, 0, 255)
labels = (x[:, :, 0] // 10 + y[:, :, 0] // 12) % 3
labels[:, 0] = 255

squares = ((a / 255 - b / 255) ** 2).mean(2)
luma = lambda of: (of / 255) @ [0.299, 0.587, 0.114]
_, ssim = structural_similarity(
    luma(a), luma(b), data_range=1, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True
)
inner = np.zeros(labels.shape, bool)
inner[5:-5, 5:-5] = True
linear = lambda of: (of / 255).astype(np.float32)
flip = {ppd: flip_evaluator.evaluate(linear(a), linear(b), "LDR", applyMagma=False, parameters={"ppd": ppd})[0][:, :, 0]
        for ppd in (67.0, 30.0)}
delta = deltaE_ciede2000(rgb2lab(a.astype(np.uint8)), rgb2lab(b.astype(np.uint8)))

for name, region in [
    ("all", labels < 999), ("soil", labels == 0), ("crop", labels == 1), ("weed", labels == 2),
    ("vegetation", (labels == 1) | (labels == 2)),
]:
    means = [squares[region].mean(), ssim[region & inner].mean()]
    means += [flip[67.0][region].mean(), flip[30.0][region].mean(), delta[region].mean()]
    print(name, region.sum(), ", ".join(f"{mean:.7f}" for mean in means))
