"""More tiny scenes for measure_parity.py: normal maps and what else textures do."""

import numpy as np

import bpy
import common
from parity_cases import case, lamp, plane_from_above


def image(name, pixels, space="Non-Color", alpha=False):
    """A packed 8-bit image of stored values, (height, width, channels), bottom row first."""
    pixels = np.rint(np.clip(pixels, 0.0, 1.0) * 255.0) / 255.0
    height, width, channels = pixels.shape
    img = bpy.data.images.new(name, width, height, alpha=alpha)
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :channels] = pixels
    img.pixels.foreach_set(rgba.ravel())
    img.update()
    img.pack()
    img.colorspace_settings.name = space
    return img


def hills(size, tilt, seed=3):
    """Normals that lean by up to about `tilt` as slopes, as stored."""
    rng = np.random.default_rng(seed)
    slopes = rng.uniform(-tilt, tilt, (size, size, 2))
    normals = np.dstack([slopes, np.ones((size, size))])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return normals * 0.5 + 0.5


def dome(scene, mat):
    """A square of smooth normals on a mirrored, stretched object, its texture mirrored on half of
    it, under a sun that stands high above all of its normals, where all horizons are far."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, size=4.0)
    ob = bpy.context.object
    ob.name = ob.data.name = "Dome"
    ob.scale, ob.rotation_euler = (-1.2, 0.9, 1.0), (0.0, 0.0, 0.4)
    for vertex in ob.data.vertices:
        vertex.co.z = -0.04 * (vertex.co.x ** 2 + vertex.co.y ** 2)
    layer = ob.data.uv_layers[0]
    uv = np.empty(len(layer.data) * 2, dtype=np.float32)
    layer.data.foreach_get("uv", uv)
    uv = uv.reshape(-1, 2)
    uv[:, 0] = np.abs(uv[:, 0] - 0.5) * 3.0
    layer.data.foreach_set("uv", uv.ravel())
    common.smooth(ob)
    ob.data.materials.append(mat)
    lamp(scene, "SUN", (0.0, 0.0, 5.0), (0.8, 0.6, 0.0), watts=3.0)
    common.camera(scene, (0.0, -2.0, 7.0), (0.0, 0.0, 0.0), 30.0)
    return ob


def diffuse():
    """A white material and its node."""
    return common.material("White", "ShaderNodeBsdfDiffuse", Color=(0.8, 0.8, 0.8))


def normal_mapped(mat, node, space="TANGENT", strength=1.0):
    """Feeds the node's normal with a map."""
    tree = mat.node_tree
    lookup, normal = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    lookup.image = image("normals", hills(8, 0.2))
    normal.space = space
    normal.inputs["Strength"].default_value = strength
    tree.links.new(lookup.outputs["Color"], normal.inputs["Color"])
    tree.links.new(normal.outputs[0], node.inputs["Normal"])


@case("A normal map: tangents of a texture mirrored on half of a stretched, mirrored object")
def normal_map(scene):
    mat, node = diffuse()
    normal_mapped(mat, node)
    dome(scene, mat)


@case("As normal_map, by half, on flat faces")
def normal_map_flat(scene):
    mat, node = diffuse()
    normal_mapped(mat, node, strength=0.5)
    ob = dome(scene, mat)
    ob.data.polygons.foreach_set("use_smooth", [False] * len(ob.data.polygons))


@case("As normal_map, in object space")
def normal_map_object(scene):
    mat, node = diffuse()
    normal_mapped(mat, node, space="OBJECT")
    dome(scene, mat)


@case("As normal_map, more than the map's, on a metal of one scattering", since=(4, 0, 0))
def normal_map_metal(scene):
    mat, node = common.material("Metal", "ShaderNodeBsdfGlossy", Color=(0.8, 0.8, 0.8), Roughness=0.6)
    node.distribution = "GGX"
    normal_mapped(mat, node, strength=1.5)
    dome(scene, mat)


# Images, on a plane that shines with them, seen from above

def shining(scene, img, interpolation="Linear", extension="REPEAT", mapping=None):
    """A plane with the image on it; returns its lookup node. UVs go from −1 to 2."""
    plane_from_above(scene)
    ground = bpy.data.objects["Ground"]
    ground.scale = (0.1, 0.1, 1.0)
    layer = ground.data.uv_layers[0]
    uv = np.empty(len(layer.data) * 2, dtype=np.float32)
    layer.data.foreach_get("uv", uv)
    layer.data.foreach_set("uv", uv * 3.0 - 1.0)
    mat, emission = common.material("Shining", "ShaderNodeEmission", Strength=1.0)
    tree = mat.node_tree
    lookup = tree.nodes.new("ShaderNodeTexImage")
    lookup.image, lookup.interpolation, lookup.extension = img, interpolation, extension
    if mapping:
        coordinates, node = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
        node.vector_type = mapping.pop("vector_type", "POINT")
        for name, value in mapping.items():
            node.inputs[name].default_value = value
        tree.links.new(coordinates.outputs["UV"], node.inputs["Vector"])
        tree.links.new(node.outputs[0], lookup.inputs[0])
    tree.links.new(lookup.outputs["Color"], emission.inputs["Color"])
    ground.data.materials[0] = mat
    return lookup


def cells(alpha=False, seed=5):
    """8 × 6 random pixels."""
    rng = np.random.default_rng(seed)
    return image("cells", rng.random((6, 8, 4 if alpha else 3)), "sRGB", alpha)


@case("A texture clipped at its edges, which are halved by interpolation")
def texture_clip(scene):
    shining(scene, cells(), extension="CLIP")


@case("A texture extended beyond its edges, nearest pixels")
def texture_extend(scene):
    shining(scene, cells(), "Closest", "EXTEND")


@case("A texture mirrored at its edges", since=(3, 5, 0))
def texture_mirror(scene):
    shining(scene, cells(), extension="MIRROR")


@case("Cubic interpolation, extended")
def texture_cubic(scene):
    shining(scene, cells(), "Cubic", "EXTEND")


@case("A texture scaled, turned and moved")
def texture_turned(scene):
    shining(scene, cells(), mapping={"Rotation": (0.0, 0.0, 0.5), "Scale": (1.5, 0.7, 1.0),
                                     "Location": (0.1, 0.2, 0.0)})


@case("A texture placed by a Mapping node of the kind Texture, about two axes")
def texture_placed(scene):
    shining(scene, cells(), mapping={"vector_type": "TEXTURE", "Rotation": (0.4, 0.0, 0.5),
                                     "Scale": (1.5, 0.7, 1.0), "Location": (0.1, 0.2, 0.0)})


@case("A colour with alpha that nobody asks for: multiplied")
def texture_alpha(scene):
    shining(scene, cells(alpha=True))


@case("A colour with alpha that is asked for: alpha weighs neighbours")
def texture_alpha_asked(scene):
    lookup = shining(scene, cells(alpha=True))
    tree = lookup.id_data
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(lookup.outputs["Alpha"], emission.inputs["Strength"])


# Bump

def bumpy(mat, node, interpolation="Cubic", **inputs):
    """Feeds the node's normal with a height texture."""
    tree = mat.node_tree
    lookup, bump = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeBump")
    lookup.image, lookup.interpolation = image("heights", np.random.default_rng(4).random((8, 8, 1)).repeat(3, 2)), \
        interpolation
    for name, value in inputs.items():
        bump.inputs[name].default_value = value
    tree.links.new(lookup.outputs["Color"], bump.inputs["Height"])
    tree.links.new(bump.outputs[0], node.inputs["Normal"])
    return bump


@case("Bump from a texture of heights that is mirrored, on a stretched and mirrored object")
def bump(scene):
    mat, node = diffuse()
    bumpy(mat, node, Distance=0.1)
    dome(scene, mat)


@case("As bump, inverted, by half, over a normal map")
def bump_on_normal_map(scene):
    mat, node = diffuse()
    normal_mapped(mat, node, strength=0.5)
    below = node.inputs["Normal"].links[0].from_socket
    over = bumpy(mat, node, Distance=0.1, Strength=0.5)
    over.invert = True
    mat.node_tree.links.new(below, over.inputs["Normal"])
    dome(scene, mat)


# What vertices have

@case("A texture on a second UV map, another on the active one")
def texture_uv_maps(scene):
    lookup = shining(scene, cells())
    ground = bpy.data.objects["Ground"]
    second = ground.data.uv_layers.new(name="Second")
    uv = np.random.default_rng(8).random(len(second.data) * 2).astype(np.float32)
    second.data.foreach_set("uv", uv)
    tree = lookup.id_data
    other, coordinates = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeUVMap")
    other.image, coordinates.uv_map = cells(seed=9), "Second"
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(coordinates.outputs[0], other.inputs[0])
    tree.links.new(other.outputs["Color"], emission.inputs["Strength"])


@case("Colours of corners, stored as bytes")
def vertex_colors(scene):
    lookup = shining(scene, cells())
    ground = bpy.data.objects["Ground"]
    layer = ground.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    values = np.random.default_rng(8).random(len(layer.data) * 4).astype(np.float32)
    layer.data.foreach_set("color", values)
    tree = lookup.id_data
    paint = tree.nodes.new("ShaderNodeVertexColor")
    paint.layer_name = "Paint"
    emission = next(n for n in tree.nodes if n.type == "EMISSION")
    tree.links.new(paint.outputs["Color"], emission.inputs["Color"])
