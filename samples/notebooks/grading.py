# %% [markdown]
# # Grading with OpenColorIO
# A scene-linear picture is graded by numbers, then shown through the view of OpenColorIO's built-in ACES config.

# %%
import os

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 1024))
sky = ts.clouds((SIZE, SIZE // 2), 3, octaves=5) * [0.5, 0.55, 0.6] + [0.02, 0.05, 0.12]
sun = ts.ramp((SIZE, SIZE // 2), 3).powc(6)[..., [0, 0, 0]] * [6.0, 3.0, 1.0]
scene = sky + sun

# %% [markdown]
# Grades are operations like all others, and fuse: one pass over the pixels.

# %%
graded = scene.cdl(slope=[1.05, 1.0, 0.95], power=[1.0, 1.02, 1.05], saturation=1.3).exposure(-0.5)
print(graded.explain())
view = graded.ociodisplay("", "")  # the config's default display and view
view

# %% [markdown]
# The same baked into a table of 33 entries a side, and how far it is from the exact one:

# %%
baked = graded.ociodisplay("", "", bake=33)
found = ts.compare(view, baked)
print(found)
found

# %% [markdown]
# A grade is a graph; a graph is a file that the command line runs: `tessera run grade.json -i plate=shot.exr -o out.png`.

# %%
grade = ts.graph(lambda plate: plate.cdl(
    slope=[1.05, 1.0, 0.95], power=[1.0, 1.02, 1.05], saturation=1.3).exposure(-0.5))
grade.save("grade.json")
assert np.array_equal(np.asarray(ts.load_graph("grade.json")(scene)), np.asarray(graded))
