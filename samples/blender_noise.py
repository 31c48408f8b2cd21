# Renders a plane and a sphere with Blender's Cycles into a multilayer OpenEXR file: their positions, and the values of
# Cycles' noise textures there as AOVs.
#   blender -b --factory-startup -P blender_noise.py -- OUT.exr [WIDTH HEIGHT]
import sys

import bpy
import mathutils

words = sys.argv[sys.argv.index("--") + 1:]
width, height = (int(words[1]), int(words[2])) if len(words) > 2 else (320, 180)

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
layer = bpy.context.view_layer

m = bpy.data.materials.new("noise")
m.use_nodes = True
nodes, links = m.node_tree.nodes, m.node_tree.links
geometry = nodes.new("ShaderNodeNewGeometry")


def output(name, node, socket):
    layer.aovs.add().name = name
    layer.aovs[name].type = "VALUE"
    aov = nodes.new("ShaderNodeOutputAOV")
    aov.name = name
    links.new(node.outputs[socket], aov.inputs["Value"])


for dims in ("2D", "3D"):
    for detail in (0, 3):
        noise = nodes.new("ShaderNodeTexNoise")
        noise.noise_dimensions = dims
        links.new(geometry.outputs["Position"], noise.inputs["Vector"])
        noise.inputs["Scale"].default_value = 2
        noise.inputs["Detail"].default_value = detail
        noise.inputs["Roughness"].default_value = 0.5
        noise.inputs["Distortion"].default_value = 0
        output(f"perlin{dims}detail{detail}", noise, "Fac")
white = nodes.new("ShaderNodeTexWhiteNoise")
white.noise_dimensions = "3D"
links.new(geometry.outputs["Position"], white.inputs["Vector"])
output("white", white, "Value")

for kind, arguments in (("primitive_plane_add", {"size": 60}),
                        ("primitive_uv_sphere_add", {"segments": 64, "ring_count": 32, "location": (0, 0, 1)})):
    getattr(bpy.ops.mesh, kind)(**arguments)
    bpy.context.object.data.materials.append(m)

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = (4, -5, 5)
direction = mathutils.Vector((0, 0, 0.5)) - camera.location
camera.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
scene.collection.objects.link(camera)
scene.camera = camera

layer.use_pass_position = True
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 1, False
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = words[0]
bpy.ops.render.render(write_still=True)
