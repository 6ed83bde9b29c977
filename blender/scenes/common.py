"""What the scene scripts share: an empty scene, objects, materials, lights."""

import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

import bpy  # noqa: E402
from mathutils import Vector  # noqa: E402


def empty_scene(width, height, spp=64, bounces=12, note=""):
    """A factory scene without objects; the pixel filter is a box."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.samples, cycles.seed = spp, 0
    for kind in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, f"{kind}_bounces", bounces)
    cycles.sample_clamp_indirect = 0.0
    cycles.pixel_filter_type = "BOX"
    scene["smithwalk_note"] = note
    return scene


def look_at(ob, target):
    """Turn an object's −z to a point, y up."""
    direction = Vector(target) - ob.location
    ob.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()


def camera(scene, location, target, fov):
    """A perspective camera; `fov` in degrees over the larger side."""
    data = bpy.data.cameras.new("Camera")
    data.angle = math.radians(fov)
    ob = bpy.data.objects.new("Camera", data)
    ob.location = location
    look_at(ob, target)
    scene.collection.objects.link(ob)
    scene.camera = ob
    return ob


def area_light(scene, name, location, target, size, watts, color=(1.0, 1.0, 1.0)):
    """A rectangle light; `size` is (width, height) in metres, `watts` are Blender 3's."""
    data = bpy.data.lights.new(name, "AREA")
    data.shape = "RECTANGLE"
    data.size, data.size_y = size
    data.energy = watts if bpy.app.version < (4, 0, 0) else watts * math.pi / 4.0  # the same radiance
    data.color = color
    ob = bpy.data.objects.new(name, data)
    ob.location = location
    ob.visible_camera = False  # what the user interface sets on a new light
    look_at(ob, target)
    scene.collection.objects.link(ob)
    return ob


def sphere(name, location, radius=1.0, segments=64, rings=32):
    """A smooth UV sphere."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=rings,
                                         radius=radius, location=location)
    ob = bpy.context.object
    ob.name = ob.data.name = name
    for polygon in ob.data.polygons:
        polygon.use_smooth = True
    return ob


def plane(name, size, location=(0.0, 0.0, 0.0)):
    """A horizontal square with UVs 0…1."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=location)
    ob = bpy.context.object
    ob.name = ob.data.name = name
    return ob


def box(name, location, size, bevel=0.0):
    """A cuboid; `size` is (x, y, z) in metres, `bevel` the radius of its edges."""
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=location)
    ob = bpy.context.object
    ob.name = ob.data.name = name
    ob.scale = size
    bpy.ops.object.transform_apply(location=False, rotation=False)
    if bevel:
        modifier = ob.modifiers.new("Bevel", "BEVEL")
        modifier.width, modifier.segments = bevel, 3
    return ob


def mesh(name, vertices, faces, mat):
    """An object of vertices and faces, at the origin."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    data.materials.append(mat)
    ob = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(ob)
    return ob


def quad(name, corners, mat):
    """A quadrilateral."""
    return mesh(name, corners, [(0, 1, 2, 3)], mat)


def turned(name, location, outline, mat, segments=48):
    """A solid of revolution about z; `outline` holds (radius, height), from axis to axis.

    Smooth but where the outline turns by more than 30°.
    """
    runs, before = [[Vector(outline[0])]], None
    for a, b in zip(map(Vector, outline), map(Vector, outline[1:])):
        if before and abs(before.angle_signed(b - a)) > math.radians(30.0):
            runs.append([a])  # a ring of its own: normals are not shared
        runs[-1].append(b)
        before = b - a
    vertices, faces = [], []
    for run in runs:
        below = None
        for radius, z in run:
            first, count = len(vertices), segments if radius > 0.0 else 1
            turns = (2.0 * math.pi * s / segments for s in range(count))
            vertices += [(radius * math.cos(turn), radius * math.sin(turn), z) for turn in turns]
            ring = [first + s % count for s in range(segments + 1)]
            for s in range(segments if below else 0):
                corners = below[s], below[s + 1], ring[s + 1], ring[s]
                faces.append(tuple(dict.fromkeys(corners)))
            below = ring
    ob = mesh(name, vertices, faces, mat)
    ob.location = location
    return smooth(ob)


def rounded(radius, height, edge, steps=5):
    """The outline of a cylinder that stands on 0, its edges rounded off."""
    corner = [(math.sin(a), math.cos(a)) for a in (0.5 * math.pi * k / steps for k in range(steps + 1))]
    below = [(radius - edge + edge * x, edge - edge * y) for x, y in corner]
    return [(0.0, 0.0), *below, *((r, height - z) for r, z in reversed(below)), (0.0, height)]


def smooth(ob):
    """Interpolate the normals of all faces."""
    for polygon in ob.data.polygons:
        polygon.use_smooth = True
    return ob


def material(name, node_type, **inputs):
    """A material of one shader node; returns it and the node.

    Keyword arguments are input names with `_` for a space, e.g. Color, Roughness.
    """
    mat = bpy.data.materials.new(name)
    mat.use_nodes = True
    tree = mat.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    node = tree.nodes.new(node_type)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    for key, value in inputs.items():
        socket = node.inputs[key.replace("_", " ")]
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    return mat, node


def conductor(name, color, roughness):
    """Multiscatter GGX metal."""
    mat, node = material(name, "ShaderNodeBsdfGlossy", Color=color, Roughness=roughness)
    node.distribution = "MULTI_GGX"
    return mat


def glass(name, roughness, ior=1.5, color=(1.0, 1.0, 1.0)):
    """Multiscatter GGX glass."""
    mat, node = material(name, "ShaderNodeBsdfGlass", Color=color, Roughness=roughness, IOR=ior)
    node.distribution = "MULTI_GGX"
    return mat


def principled(name, color, roughness=0.5, metallic=0.0):
    """The Principled node, all other sockets as they come."""
    mat, node = material(name, "ShaderNodeBsdfPrincipled", Base_Color=color, Roughness=roughness, Metallic=metallic)
    node.distribution = "MULTI_GGX"  # what new nodes have since 4.0
    return mat


def diffuse(name, color):
    """Lambert."""
    return material(name, "ShaderNodeBsdfDiffuse", Color=color)[0]


def constant_world(scene, color, strength):
    """A world of one colour."""
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength
    scene.world = world


def save(path):
    """Save the .blend, without a backup file."""
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(path))


def main(build):
    """Run `build()` and save to the path after `--` (Blender) or in argv[1] (bpy)."""
    from pinned_cycles import run

    def job(args):
        if len(args) != 1:
            sys.exit("one argument is expected: the .blend to write")
        build()
        save(args[0])

    run(job)
