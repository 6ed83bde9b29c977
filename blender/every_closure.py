"""Export every closure, light, world and camera that the exporter can write, at the ends of their ranges.

    blender -b --factory-startup --python blender/every_closure.py -- OUT_DIR

OUT_DIR/NAME/scene.yaml for each; `tests/blender.rs` loads them all.
"""

import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
from pinned_cycles import run  # noqa: E402
from smithwalk_export.scene import NO_BAKE, export  # noqa: E402

NUMBERS = (-1.0, 0.0, 0.5, 1.0, 7.0, math.inf)
COLORS = ((-1.0, 0.5, 3.0), (0.0, 0.0, 0.0))


def material(kind):
    """A material of one shader node, on a cube; the node."""
    mat = bpy.data.materials.new(kind)
    mat.use_nodes = True
    tree = mat.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(kind)
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    triangle().data.materials.append(mat)
    return node


def triangle():
    """An object of one triangle; operators would update the scene each time."""
    mesh = bpy.data.meshes.new("Triangle")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    ob = bpy.data.objects.new("Triangle", mesh)
    bpy.context.scene.collection.objects.link(ob)
    return ob


def closures():
    """A cube for each shader node and each value of its inputs, each of its menus' choices."""
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        if not name.startswith("ShaderNode") or name.endswith(("Tree", "Group")) or name == "ShaderNode":
            continue
        probe = bpy.data.node_groups.new("probe", "ShaderNodeTree")
        try:
            node = probe.nodes.new(name)
            shader = node.outputs and node.outputs[0].type == "SHADER"
            choices = [(p.identifier, item.identifier) for p in kind.bl_rna.properties if p.type == "ENUM"
                       and p.identifier not in bpy.types.Node.bl_rna.properties and not p.is_readonly
                       for item in p.enum_items] if shader else []
            inputs = sum(s.type in {"VALUE", "RGBA"} for s in node.inputs)
        finally:
            bpy.data.node_groups.remove(probe)
        if not shader:
            continue
        material(name)
        for attribute, choice in choices:
            try:
                setattr(material(name), attribute, choice)
            except TypeError:  # not in this Blender's build
                pass
        for i in range(inputs):
            for value in NUMBERS + COLORS:
                socket = [s for s in material(name).inputs if s.type in {"VALUE", "RGBA"}][i]
                if socket.type == "VALUE" and isinstance(value, float):
                    socket.default_value = value
                elif socket.type == "RGBA" and isinstance(value, tuple):
                    socket.default_value = (*value, 1.0)


def lights():
    """Lights of all kinds without power, size or area, and with too much."""
    for kind in ("POINT", "SUN", "SPOT", "AREA"):
        for energy in (-1.0, 0.0, 10.0, 1e30):
            for size in (0.0, 1.0):
                for scale in (0.0, 1.0):
                    data = bpy.data.lights.new("Light", kind)
                    data.energy = energy
                    for name, value in (("size", size), ("size_y", size), ("shadow_soft_size", size),
                                        ("angle", size * math.pi), ("spot_size", size * math.pi),
                                        ("spot_blend", size), ("spread", size * math.pi)):
                        if hasattr(data, name):
                            setattr(data, name, value)
                    ob = bpy.data.objects.new("Light", data)
                    ob.scale = (scale,) * 3
                    bpy.context.scene.collection.objects.link(ob)
    bpy.ops.mesh.primitive_cube_add()


def shapes():
    """Objects that are flattened, collapsed, far away, not finite."""
    for scale in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (1e-12, 1e-12, 1e-12), (-1, 1, 1), (1e9, 1e9, 1e9), (math.nan, 1, 1)):
        bpy.ops.mesh.primitive_cube_add()
        bpy.context.object.scale = scale
    for value in (math.nan, math.inf, 1e30):
        bpy.ops.mesh.primitive_cube_add()
        bpy.context.object.data.vertices[0].co.x = value
        bpy.context.object.data.uv_layers[0].data[0].uv = (value, 0.0)


def cameras():
    """A camera of scale 0 with f-stop 0."""
    bpy.ops.mesh.primitive_cube_add()
    ob = bpy.context.scene.camera
    ob.scale = (0.0, 0.0, 0.0)
    ob.data.dof.use_dof = True
    ob.data.dof.aperture_fstop = ob.data.dof.focus_distance = 0.0
    ob.data.lens = 1.0


def worlds():
    """A world of negative strength."""
    bpy.ops.mesh.primitive_cube_add()
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Strength"].default_value = -2.0
    background.inputs["Color"].default_value = (-1.0, 2.0, 3.0, 1.0)
    bpy.context.scene.world = world


def main(args):
    """Export each scene."""
    for build in (closures, lights, shapes, cameras, worlds):
        scene = common.empty_scene(16, 16)
        common.camera(scene, (0.0, -6.0, 0.0), (0.0, 0.0, 0.0), 40.0)
        build()
        export(scene, os.path.join(args[0], build.__name__), bake=NO_BAKE)


if __name__ == "__main__":
    run(main)
