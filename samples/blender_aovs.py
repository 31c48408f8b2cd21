# Renders a small scene with Blender's Cycles into a multilayer OpenEXR file with the passes that Tessera shades from,
# and another one with the depths that the sun sees.
#   blender -b --factory-startup -P blender_aovs.py -- OUT.exr LIGHT.exr [WIDTH HEIGHT]
# Prints the camera as --camera numbers (world to clip, row by row), its eye, the sun's camera in the same way and the
# direction to the sun. Mist is linear from 5 over 30 units; the sun sees from 5 to 45 units.
import math
import sys

import bpy
import mathutils

words = sys.argv[sys.argv.index("--") + 1:]
out, light_out = words[0], words[1]
width, height = (int(words[2]), int(words[3])) if len(words) > 3 else (640, 360)

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def material(name, color):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    m.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
    return m


def add(kind, color, index, **arguments):
    getattr(bpy.ops.mesh, kind)(**arguments)
    thing = bpy.context.object
    thing.data.materials.append(material(kind, color))
    thing.pass_index = index
    if "cube" not in kind:
        bpy.ops.object.shade_smooth()
    return thing


add("primitive_plane_add", (0.3, 0.4, 0.2), 1, size=60)
add("primitive_uv_sphere_add", (0.7, 0.2, 0.1), 2, segments=128, ring_count=64, radius=1.2, location=(-2, 0, 1.2))
add("primitive_cube_add", (0.2, 0.3, 0.7), 3, size=2, location=(1.5, 1, 1), rotation=(0, 0, 0.5))
add("primitive_torus_add", (0.8, 0.6, 0.1), 4, location=(0.3, -2.2, 0.5), major_radius=0.9, minor_radius=0.25,
    major_segments=128, minor_segments=48)

sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy, sun.data.angle, sun.rotation_euler = 3, 0, (0.8, 0.3, 0.4)
scene.collection.objects.link(sun)

camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = (6, -9, 4)
direction = mathutils.Vector((0, 0, 0.8)) - camera.location
camera.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
scene.collection.objects.link(camera)
scene.camera = camera

scene.world = bpy.data.worlds.new("world")
scene.world.color = (0.35, 0.5, 0.8)
scene.world.mist_settings.start, scene.world.mist_settings.depth = 5, 30
scene.world.mist_settings.falloff = "LINEAR"

layer = bpy.context.view_layer
for name in ("position", "normal", "z", "mist", "object_index", "vector", "shadow", "diffuse_color"):
    setattr(layer, "use_pass_" + name, True)
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 1, False
scene.cycles.pixel_filter_type = "BOX"
scene.cycles.filter_width = 0.01  # positions are those of the pixels' centres
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = out
bpy.context.view_layer.update()



def clip_of(view, x, y):
    graph = bpy.context.evaluated_depsgraph_get()
    matrix = view.calc_matrix_camera(graph, x=x, y=y) @ view.matrix_world.inverted()
    return ",".join("%.9g" % v for row in matrix for v in row)


print("camera=" + clip_of(camera, width, height))
print("eye=" + ",".join("%.9g" % v for v in camera.matrix_world.translation))
bpy.ops.render.render(write_still=True)

# From the sun: a parallel camera that looks along its rays.
view = bpy.data.objects.new("from the sun", bpy.data.cameras.new("from the sun"))
view.data.type, view.data.ortho_scale, view.data.clip_start, view.data.clip_end = "ORTHO", 16, 5, 45
view.rotation_euler = sun.rotation_euler
towards = sun.rotation_euler.to_matrix() @ mathutils.Vector((0, 0, 1))
view.location = mathutils.Vector((0, 0, 0.8)) + 20 * towards
scene.collection.objects.link(view)
scene.camera = view
scene.render.resolution_x = scene.render.resolution_y = 512
for name in ("position", "normal", "mist", "object_index", "vector", "shadow", "diffuse_color"):
    setattr(layer, "use_pass_" + name, False)
scene.render.filepath = light_out
bpy.context.view_layer.update()
print("light=" + clip_of(view, 512, 512))
print("sun=" + ",".join("%.9g" % v for v in towards))
bpy.ops.render.render(write_still=True)
