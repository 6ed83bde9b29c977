"""Tiny scenes, each of one convention: lights, cameras, environment, textures, geometry.

Every case is a function that fills a fresh scene; `CASES` lists them with the
versions they exist in. All are 32 pixels on a side unless the case says
otherwise, with the box filter.
"""

import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
import pinned_cycles  # noqa: E402

CASES = {}


def case(note, width=32, height=32, bounces=0, since=(0, 0, 0)):
    """Register a case: `note` says what it shows; `since` is the first Blender that has it."""
    def register(function):
        CASES[function.__name__] = (note, width, height, bounces, since, function)
        return function
    return register


# Lights over a diffuse plane, seen from above by an orthographic camera

def plane_from_above(scene):
    """A diffuse 0.5 plane; 4 m of it are seen from 20 m, north up."""
    ground = common.plane("Ground", 40.0)
    ground.data.materials.append(common.diffuse("Ground", (0.5, 0.5, 0.5)))
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale = "ORTHO", 4.0
    ob = bpy.data.objects.new("Camera", data)
    ob.location = (0.0, 0.0, 20.0)
    scene.collection.objects.link(ob)
    scene.camera = ob
    return data


def lamp(scene, kind, location=(0.4, -0.3, 1.5), target=None, watts=100.0, **settings):
    """A light; looks straight down without a target."""
    data = bpy.data.lights.new("Lamp", kind)
    data.energy = watts
    for name, value in settings.items():
        setattr(data, name, value)
    ob = bpy.data.objects.new("Lamp", data)
    ob.location = location
    ob.visible_camera = False
    if target is not None:
        common.look_at(ob, target)
    scene.collection.objects.link(ob)
    return ob


@case("A point light of radius 0")
def point(scene):
    plane_from_above(scene)
    lamp(scene, "POINT", shadow_soft_size=0.0, color=(1.0, 0.5, 0.25))


@case("A point light of radius 0.5 with soft falloff: a disk that faces the shading point")
def point_soft(scene):
    plane_from_above(scene)
    lamp(scene, "POINT", shadow_soft_size=0.5)


@case("A point light of radius 0.5 without soft falloff: a sphere", since=(4, 1, 0))
def point_sphere(scene):
    plane_from_above(scene)
    lamp(scene, "POINT", shadow_soft_size=0.5, use_soft_falloff=False)


@case("A spot of 60 degrees, blend 0.15, straight down")
def spot(scene):
    plane_from_above(scene)
    lamp(scene, "SPOT", location=(0.0, 0.0, 2.0), shadow_soft_size=0.0,
         spot_size=math.radians(60.0), spot_blend=0.15)


@case("A spot of 70 degrees, blend 1, tilted")
def spot_tilted(scene):
    plane_from_above(scene)
    lamp(scene, "SPOT", location=(-1.5, -1.0, 2.0), target=(0.5, 0.3, 0.0), shadow_soft_size=0.0,
         spot_size=math.radians(70.0), spot_blend=1.0)


@case("A sun of angle 0, tilted")
def sun(scene):
    plane_from_above(scene)
    lamp(scene, "SUN", location=(3.0, 2.0, 4.0), target=(0.0, 0.0, 0.0), watts=2.0, angle=0.0)


@case("A sun of 30 degrees, tilted")
def sun_wide(scene):
    plane_from_above(scene)
    lamp(scene, "SUN", location=(3.0, 2.0, 4.0), target=(0.0, 0.0, 0.0), watts=2.0,
         angle=math.radians(30.0))


@case("The disk of a 40 degree sun, reflected by a mirror", bounces=1)
def sun_mirrored(scene):
    _mirror_from_above(scene)
    lamp(scene, "SUN", watts=2.0, angle=math.radians(40.0), target=(0.4, -0.3, 0.0))


@case("A rectangle area light 1.0 × 0.5, tilted")
def area_rectangle(scene):
    plane_from_above(scene)
    lamp(scene, "AREA", target=(-0.5, 0.5, 0.0), shape="RECTANGLE", size=1.0, size_y=0.5)


@case("A square area light; the object's scale is 2 × 1")
def area_scaled(scene):
    plane_from_above(scene)
    lamp(scene, "AREA", shape="SQUARE", size=0.5).scale = (2.0, 1.0, 1.0)


@case("A disk area light of diameter 1")
def area_disk(scene):
    plane_from_above(scene)
    lamp(scene, "AREA", shape="DISK", size=1.0)


@case("An ellipse area light 1.2 × 0.4")
def area_ellipse(scene):
    plane_from_above(scene)
    lamp(scene, "AREA", shape="ELLIPSE", size=1.2, size_y=0.4)


@case("An area light with a spread of 60 degrees")
def area_spread(scene):
    plane_from_above(scene)
    lamp(scene, "AREA", shape="RECTANGLE", size=0.5, size_y=0.5, spread=math.radians(60.0))


@case("An area light with exposure −1.5 and normalize off", since=(4, 5, 0))
def area_exposure(scene):
    plane_from_above(scene)
    lamp(scene, "AREA", shape="DISK", size=0.8, exposure=-1.5, normalize=False)


@case("Radiance of an area light that the camera sees")
def area_seen(scene):
    plane_from_above(scene).ortho_scale = 2.0
    light = lamp(scene, "AREA", shape="RECTANGLE", size=1.0, size_y=0.5)
    light.rotation_euler = (math.radians(150.0), 0.0, 0.3)
    light.visible_camera = True


@case("Radiance of a soft point light that the camera sees")
def point_seen(scene):
    plane_from_above(scene).ortho_scale = 2.0
    lamp(scene, "POINT", shadow_soft_size=0.5).visible_camera = True


@case("A plane with an emission material lights another plane")
def emissive_mesh(scene):
    # Small and far: at 0.8 m and 1.2 m Cycles 3.4 is up to 1.5 % below
    # Lambert's formula for the irradiance from a polygon.
    plane_from_above(scene)
    glow = common.plane("Glow", 0.3, location=(0.4, -0.3, 1.8))
    glow.rotation_euler = (0.5, 0.2, 0.1)
    glow.data.materials.append(
        common.material("Glow", "ShaderNodeEmission", Color=(1.0, 0.8, 0.3), Strength=40.0)[0])


# Cameras before coloured markers

def markers(scene):
    """Nine emissive cubes of different colours on a 3 × 3 grid, at different depths."""
    colors = [(1, .1, .1), (.1, 1, .1), (.1, .1, 1), (1, 1, .1), (1, .1, 1), (.1, 1, 1),
              (.9, .5, .1), (.5, .1, .9), (.6, .6, .6)]
    for i, color in enumerate(colors):
        x, z = i % 3 - 1, i // 3 - 1
        bpy.ops.mesh.primitive_cube_add(size=0.6, location=(x, 0.5 * x * z, z))
        mat = common.material(f"Marker{i}", "ShaderNodeEmission", Color=color, Strength=1.0)[0]
        bpy.context.object.data.materials.append(mat)
    ob = common.camera(scene, (0.4, -6.0, 0.7), (0.0, 0.0, 0.1), 45.0)
    ob.data.sensor_height = 20.0
    return ob


@case("Perspective, automatic fit, landscape", width=48)
def camera_landscape(scene):
    markers(scene)


@case("Perspective, automatic fit, portrait", height=48)
def camera_portrait(scene):
    markers(scene)


@case("Perspective, vertical fit, which takes the sensor's height", width=48)
def camera_vertical_fit(scene):
    markers(scene).data.sensor_fit = "VERTICAL"


@case("Perspective, horizontal fit, portrait", height=48)
def camera_horizontal_fit(scene):
    markers(scene).data.sensor_fit = "HORIZONTAL"


@case("Perspective with a shift", width=48)
def camera_shift(scene):
    data = markers(scene).data
    data.shift_x, data.shift_y = 0.12, -0.2


@case("Pixels twice as high as wide: the fit turns vertical", width=40)
def camera_pixel_aspect(scene):
    markers(scene)
    scene.render.pixel_aspect_y = 2.0


@case("Pixels wider than high, with a shift", width=40)
def camera_pixel_aspect_wide(scene):
    data = markers(scene).data
    scene.render.pixel_aspect_x = 1.5
    data.shift_x, data.shift_y = 0.1, 0.15


@case("Orthographic with a shift, portrait", height=48)
def camera_ortho(scene):
    data = markers(scene).data
    data.type, data.ortho_scale = "ORTHO", 4.5
    data.shift_x, data.shift_y = 0.1, -0.15


@case("Depth of field: f/0.2, focused on the origin's plane", width=48)
def camera_dof(scene):
    data = markers(scene).data
    data.dof.use_dof, data.dof.aperture_fstop, data.dof.focus_distance = True, 0.2, 4.0


@case("Depth of field of an orthographic camera", width=48)
def camera_ortho_dof(scene):
    data = markers(scene).data
    data.type, data.ortho_scale = "ORTHO", 4.5
    data.dof.use_dof, data.dof.aperture_fstop, data.dof.focus_distance = True, 2.0, 5.0


# World

def patches():
    """A 32 × 16 environment of distinct cells, no symmetry.

    Each pole is of one colour, the same for both: Cycles interpolates from the
    top row to the bottom one.
    """
    rng = np.random.default_rng(3)
    cells = rng.uniform(0.05, 2.0, (8, 16, 3))
    cells[0] = cells[-1] = 0.5
    return np.repeat(np.repeat(cells, 2, 0), 2, 1).astype(np.float32)


def environment(scene, rotation=None, strength=1.0):
    """`patches()` as the world, turned by a Mapping node."""
    common.constant_world(scene, (0.0, 0.0, 0.0), strength)
    path = os.path.join(bpy.app.tempdir, "patches.exr")
    pinned_cycles.write_exr(scene, path, patches())
    # The automatic importance map is large: most of the time of such a small render.
    scene.world.cycles.sampling_method = "MANUAL"
    scene.world.cycles.sample_map_resolution = 256
    tree = scene.world.node_tree
    lookup = tree.nodes.new("ShaderNodeTexEnvironment")
    lookup.image = bpy.data.images.load(path)
    lookup.image.pack()
    if rotation:
        mapping = tree.nodes.new("ShaderNodeMapping")
        mapping.inputs["Rotation"].default_value = [math.radians(a) for a in rotation]
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs[0], lookup.inputs[0])
    background = next(n for n in tree.nodes if n.type == "BACKGROUND")
    tree.links.new(lookup.outputs["Color"], background.inputs["Color"])


@case("An environment seen by a wide camera")
def environment_seen(scene):
    environment(scene)
    common.camera(scene, (0.0, 0.0, 0.0), (1.0, 2.0, 0.5), 100.0)
    _far_speck()


@case("An environment turned about three axes, strength 1.7")
def environment_turned(scene):
    environment(scene, (30.0, -40.0, 110.0), 1.7)
    common.camera(scene, (0.0, 0.0, 0.0), (1.0, 2.0, 0.5), 100.0)
    _far_speck()


@case("A diffuse sphere under a turned environment")
def environment_diffuse(scene):
    environment(scene, (0.0, 0.0, 70.0))
    ball = common.sphere("Ball", (0.0, 0.0, 0.0), segments=32, rings=16)
    ball.data.materials.append(common.diffuse("White", (0.8, 0.8, 0.8)))
    common.camera(scene, (0.0, -6.0, 1.0), (0.0, 0.0, 0.0), 25.0)


def _far_speck():
    """A surface out of sight, for scenes need one."""
    common.plane("Speck", 0.1, location=(-5.0, -5.0, -50.0)).data.materials.append(
        common.diffuse("Speck", (0.5, 0.5, 0.5)))


# Surfaces

def _mirror_from_above(scene):
    camera_data = plane_from_above(scene)
    ob = scene.camera
    camera_data.type, camera_data.lens = "PERSP", 18.0
    ob.location = (0.0, 0.0, 1.0)
    mat, node = common.material("Mirror", "ShaderNodeBsdfGlossy", Color=(0.9, 0.9, 0.9), Roughness=0.0)
    node.distribution = "GGX"
    bpy.data.objects["Ground"].data.materials[0] = mat


def _textured_plane(scene, interpolation, scale, location):
    """An emissive plane with an 8 × 8 sRGB texture, seen from above."""
    plane_from_above(scene)
    rng = np.random.default_rng(5)
    img = bpy.data.images.new("cells", 8, 8, alpha=False)
    rgba = np.ones((8, 8, 4), dtype=np.float32)
    rgba[:, :, :3] = rng.integers(0, 256, (8, 8, 3)) / 255.0
    img.pixels.foreach_set(rgba.ravel())
    img.update()
    img.pack()
    ground = bpy.data.objects["Ground"]
    ground.scale = (0.1, 0.1, 1.0)
    mat, emission = common.material("Cells", "ShaderNodeEmission", Strength=1.0)
    tree = mat.node_tree
    lookup = tree.nodes.new("ShaderNodeTexImage")
    lookup.image, lookup.interpolation = img, interpolation
    if scale:
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        mapping = tree.nodes.new("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = (*scale, 1.0)
        mapping.inputs["Location"].default_value = (*location, 0.0)
        tree.links.new(coordinates.outputs["UV"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs[0], lookup.inputs[0])
    tree.links.new(lookup.outputs["Color"], emission.inputs["Color"])
    ground.data.materials[0] = mat


@case("A texture: sRGB, bilinear in linear light, v up, repeating, scale and offset")
def texture_bilinear(scene):
    _textured_plane(scene, "Linear", (1.5, 0.75), (0.1, -0.2))


@case("A texture: sRGB, nearest texel")
def texture_closest(scene):
    _textured_plane(scene, "Closest", None, None)


@case("Collection instances, a mirrored one among them, and a material per face")
def instances(scene):
    collection = bpy.data.collections.new("Set")
    bpy.ops.mesh.primitive_cone_add(vertices=3, radius1=0.5, depth=1.0, location=(0.2, 0.1, 0.0))
    cone = bpy.context.object
    for i, color in enumerate(((1.0, 0.2, 0.1), (0.1, 0.7, 0.2), (0.2, 0.3, 1.0), (0.9, 0.9, 0.9))):
        cone.data.materials.append(
            common.material(f"Side{i}", "ShaderNodeEmission", Color=color, Strength=1.0)[0])
    for i, polygon in enumerate(cone.data.polygons):
        polygon.material_index = i
    scene.collection.objects.unlink(cone)
    collection.objects.link(cone)
    for location, rotation, scale in (((-1, 0, 0), (0, 0, 0), (1, 1, 1)),
                                      ((1, 0, 0), (0.3, 0.5, 1.0), (-1, 1, 1)),
                                      ((0, 0, 1), (1.0, 0, 0), (0.5, 1.5, 1))):
        ob = bpy.data.objects.new("Instance", None)
        ob.instance_type, ob.instance_collection = "COLLECTION", collection
        ob.location, ob.rotation_euler, ob.scale = location, rotation, scale
        scene.collection.objects.link(ob)
    common.camera(scene, (1.0, -6.0, 2.0), (0.0, 0.0, 0.2), 40.0)


def _glass_sphere(scene, scale):
    environment(scene)
    ball = common.sphere("Ball", (0.0, 0.0, 0.0), segments=32, rings=16)
    ball.scale = scale
    mat, node = common.material("Glass", "ShaderNodeBsdfGlass", Color=(0.9, 1.0, 0.8), Roughness=0.0, IOR=1.5)
    node.distribution = "GGX"
    ball.data.materials.append(mat)
    common.camera(scene, (0.0, -6.0, 1.0), (0.0, 0.0, 0.0), 25.0)


@case("Smooth glass under an environment", bounces=8)
def glass(scene):
    _glass_sphere(scene, (1.0, 1.0, 1.0))


@case("Smooth glass, mirrored: inside and outside must not swap", bounces=8)
def glass_mirrored(scene):
    _glass_sphere(scene, (-1.0, 0.8, 1.0))


@case("Mix of diffuse and transparent before an environment", bounces=12)
def mix_transparent(scene):
    _half_transparent(scene)


@case("As mix_transparent: passing straight through is no bounce", bounces=1)
def transparent_bounces(scene):
    _half_transparent(scene)


def _half_transparent(scene):
    environment(scene)
    ball = common.sphere("Ball", (0.0, 0.0, 0.0), segments=32, rings=16)
    mat, mix = common.material("Half", "ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.3
    tree = mat.node_tree
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    clear.inputs["Color"].default_value = (0.6, 0.8, 1.0, 1.0)
    tree.links.new(diffuse.outputs[0], mix.inputs[1])
    tree.links.new(clear.outputs[0], mix.inputs[2])
    ball.data.materials.append(mat)
    common.camera(scene, (0.0, -6.0, 1.0), (0.0, 0.0, 0.0), 25.0)


def _anisotropic(scene, anisotropy, rotation, radial):
    """Single-scattering anisotropic GGX under an environment."""
    environment(scene)
    ball = common.sphere("Ball", (0.0, 0.0, 0.0), segments=32, rings=16)
    mat, node = common.material("Brushed", "ShaderNodeBsdfAnisotropic", Color=(0.9, 0.9, 0.9),
                                Roughness=0.5, Anisotropy=anisotropy, Rotation=rotation)
    node.distribution = "GGX"
    if not radial:
        tangent = mat.node_tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.uv_map = "UV_MAP", ball.data.uv_layers[0].name
        mat.node_tree.links.new(tangent.outputs[0], node.inputs["Tangent"])
    ball.data.materials.append(mat)
    common.camera(scene, (0.0, -6.0, 1.0), (0.0, 0.0, 0.0), 25.0)


@case("Anisotropy 0.8, radial tangent", since=(4, 0, 0))
def anisotropic_radial(scene):
    _anisotropic(scene, 0.8, 0.0, radial=True)


@case("Anisotropy 0.8, rotation 0.15, radial tangent", since=(4, 0, 0))
def anisotropic_rotated(scene):
    _anisotropic(scene, 0.8, 0.15, radial=True)


@case("Anisotropy −0.6, UV tangent", since=(4, 0, 0))
def anisotropic_uv(scene):
    _anisotropic(scene, -0.6, 0.0, radial=False)


@case("Single-scattering GGX metal, roughness 0.5, under an environment", since=(4, 0, 0))
def ggx_metal(scene):
    _anisotropic(scene, 0.0, 0.0, radial=True)


@case("Single-scattering Beckmann metal, roughness 0.6, under an environment", since=(4, 0, 0))
def beckmann_metal(scene):
    _anisotropic(scene, 0.0, 0.0, radial=True)
    node = next(n for n in bpy.data.materials["Brushed"].node_tree.nodes if n.type == "BSDF_GLOSSY")
    node.distribution = "BECKMANN"
    node.inputs["Roughness"].default_value = 0.6
