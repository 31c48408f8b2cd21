# %% [markdown]
# # Graphs as data
# A graph with open inputs is recorded from a function, saved as JSON, run by the command line, sent to other processes.

# %%
import os
import pickle

import numpy as np
import tessera as ts

SIZE = int(os.environ.get("TESSERA_NOTEBOOK_SIZE", 512))


def look(plate, light):
    """What is done to every shot."""
    glow = plate.blur(sigma=6) * 0.3
    return plate.saturate(1.1) + glow * light


graph = ts.graph(look)
print(graph.inputs)
print(graph.text)

# %%
plate, light = ts.clouds((SIZE, SIZE), 3, seed=1), ts.ramp((SIZE, SIZE), 3)
picture = graph(plate, light)  # as lazy as any other image
picture

# %% [markdown]
# Saved, loaded, pickled: the same bits. It holds no code, only operations by their names.

# %%
graph.save("look.json")
for same in (ts.load_graph("look.json"), pickle.loads(pickle.dumps(graph))):
    assert np.array_equal(np.asarray(same(plate, light)), np.asarray(picture))
plate.write("plate.exr", dtype="float")
light.write("light.exr", dtype="float")
print("tessera run look.json -i plate=plate.exr -i light=light.exr -o out.exr")

# %% [markdown]
# What is wrong is said where it is written, with what was found and what was expected:

# %%
try:
    ts.graph(lambda plate: plate.blur(sigmma=3))
except ts.UsageError as error:
    print(error, "|", error.hint)
