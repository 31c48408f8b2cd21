# %% [markdown]
# # Noise taken away, and what it costs
# A clean picture, noise of a known strength, three ways to take it away, and the numbers of each.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 512))
clean = ts.from_array(np.asarray(ts.checker((SIZE, SIZE), 3, width=SIZE // 8, height=SIZE // 8).blur(sigma=1) * 0.6 +
                                 ts.clouds((SIZE, SIZE), 3) * 0.4))
rng = np.random.default_rng(5)
noisy = ts.from_array(np.asarray(clean) + rng.normal(0, 0.08, clean.shape).astype(np.float32))
noisy

# %%
ways = {
    "nothing": noisy,
    "blur": noisy.blur(sigma=1.2),
    "bilateral": noisy.bilateral(sigma=2.5, range=0.25),
    "non-local means": noisy.nlmeans(sigma=0.08, search=13),
}
for name, image in ways.items():
    found = ts.compare(clean, image)
    print(f"{name:>16}: PSNR {found.psnr:5.2f} dB, max {found.max:.3f}")
assert ts.compare(clean, ways["non-local means"]).psnr > ts.compare(clean, noisy).psnr

# %% [markdown]
# Where they are wrong: the wipe and the heat map.

# %%
ts.compare(clean, ways["non-local means"])
