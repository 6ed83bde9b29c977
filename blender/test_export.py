"""Tests of the exporter: scenes built node by node, exported, and read back.

    blender -b --factory-startup --python blender/test_export.py
    PYTHONPATH=<bpy> python3 blender/test_export.py

Exits with 1 on a failure. Runs in Blender 3.4, 4.5 and 5.0.
"""

import os
import re
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes"))

import bpy  # noqa: E402
import common  # noqa: E402
from smithwalk_export import exr, yaml  # noqa: E402
from smithwalk_export.log import APPROXIMATE, WRONG  # noqa: E402
from smithwalk_export.scene import NO_BAKE, export  # noqa: E402

NEW = bpy.app.version >= (4, 0, 0)
STORES = ("scenes", "objects", "meshes", "materials", "worlds", "images", "node_groups", "cameras", "lights",
          "collections")


def stored():
    """The names of all datablocks that an export could leave behind."""
    return {store: sorted(b.name for b in getattr(bpy.data, store) if b.name != "Render Result")
            for store in STORES}


class ExportTest(unittest.TestCase):
    """Each test starts from an empty scene with a camera, and exports to a folder of its own."""

    def setUp(self):
        self.scene = common.empty_scene(64, 48)
        common.camera(self.scene, (0.0, -6.0, 0.0), (0.0, 0.0, 0.0), 40.0)
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def export(self, **options):
        """Export; the lines of scene.yaml, without the leading spaces, and the warnings."""
        self.log = export(self.scene, self.folder.name, **options)
        with open(self.path("scene.yaml"), encoding="utf-8") as f:
            self.lines = [line.strip(" -\n") for line in f]
        return self.lines

    def losses(self):
        """What the export said is wrong or approximate."""
        return [str(e) for e in self.log.of(WRONG, APPROXIMATE)]

    def path(self, name):
        """A file of the export."""
        return os.path.join(self.folder.name, name)

    def line(self, start):
        """The one line that starts so."""
        found = [line for line in self.lines if line.startswith(start)]
        self.assertEqual(len(found), 1, f"{start!r} in {self.lines}")
        return found[0]

    def faces(self, name):
        """Vertex positions and triangles (position indices, from 0) of an OBJ."""
        positions, triangles = [], []
        with open(self.path(name), encoding="ascii") as f:
            for line in f:
                words = line.split()
                if words[0] == "v":
                    positions.append(tuple(float(w) for w in words[1:]))
                elif words[0] == "f":
                    corners = [int(w.split("/")[0]) - 1 for w in words[1:]]
                    triangles += [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]  # as a fan
        return positions, triangles

    def cube(self, **settings):
        """A cube with a diffuse material."""
        bpy.ops.mesh.primitive_cube_add(**settings)
        ob = bpy.context.object
        ob.data.materials.append(common.diffuse("Grey", (0.5, 0.5, 0.5)))
        return ob

    def surface(self, node_type, **inputs):
        """A cube of one shader node; returns material, node."""
        mat, node = common.material("Test", node_type, **inputs)
        self.cube().data.materials[0] = mat
        return mat, node

    # Geometry

    def test_render_visibility_and_subdivision(self):
        """What is rendered counts, not what the viewport shows."""
        ob = self.cube()
        modifier = ob.modifiers.new("s", "SUBSURF")
        modifier.levels, modifier.render_levels = 0, 2
        ob.hide_viewport = True
        self.cube(location=(3.0, 0.0, 0.0)).hide_render = True
        self.export()
        self.assertEqual(sum(line.startswith("{name: Cube") for line in self.lines), 1)
        self.assertEqual(len(self.faces("cube.obj")[1]), 6 * 16 * 2)
        self.assertEqual(self.losses(), [])

    def test_instances_share_a_mesh(self):
        """A mesh is written once; a mirrored instance keeps its negative determinant."""
        ob = self.cube()
        copy = bpy.data.objects.new("Copy", ob.data)
        copy.scale = (-1.0, 2.0, 1.0)
        self.scene.collection.objects.link(copy)
        self.export()
        self.assertEqual(self.log.counts["meshes"], 1)
        self.assertEqual(self.log.counts["objects"], 2)
        self.assertIn("[[-1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]", self.line("{name: Copy"))

    def test_geometry_nodes_instances(self):
        """Instances made by geometry nodes become objects with matrices of their own."""
        ob = self.cube()
        tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
        if NEW:
            tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
            tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        else:
            tree.inputs.new("NodeSocketGeometry", "Geometry")
            tree.outputs.new("NodeSocketGeometry", "Geometry")
        enter, leave = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
        points = tree.nodes.new("GeometryNodeInstanceOnPoints")
        cone = tree.nodes.new("GeometryNodeMeshCone")
        tree.links.new(enter.outputs[0], points.inputs["Points"])
        tree.links.new(cone.outputs["Mesh"], points.inputs["Instance"])
        tree.links.new(points.outputs[0], leave.inputs[0])
        ob.modifiers.new("n", "NODES").node_group = tree
        self.export()
        self.assertEqual(self.log.counts["objects"], 8)
        self.assertEqual(self.log.counts["meshes"], 1)

    def test_curves_and_text_become_triangles(self):
        """Whatever Blender can turn into a mesh is carried."""
        bpy.ops.object.text_add()
        bpy.ops.curve.primitive_bezier_circle_add()
        bpy.context.object.data.bevel_depth = 0.1
        self.export()
        self.assertEqual(self.log.counts["objects"], 2)
        self.assertEqual(self.losses(), [])

    def test_concave_polygons_are_triangulated_as_in_blender(self):
        """A fan over an L would cover its notch."""
        corners = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)]
        mesh = bpy.data.meshes.new("L")
        mesh.from_pydata(corners[1:] + corners[:1], [], [tuple(range(6))])
        self.scene.collection.objects.link(bpy.data.objects.new("L", mesh))
        self.export()
        positions, triangles = self.faces("l.obj")
        area = 0.0
        for a, b, c in triangles:
            (ax, ay, _), (bx, by, _), (cx, cy, _) = positions[a], positions[b], positions[c]
            signed = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) / 2.0
            self.assertGreater(signed, 0.0)
            area += signed
        self.assertAlmostEqual(area, 3.0)

    def test_normals_far_from_the_faces_are_named(self):
        for make, named in ((bpy.ops.mesh.primitive_uv_sphere_add, False), (bpy.ops.mesh.primitive_cylinder_add, True)):
            make()
            ob = bpy.context.object
            ob.data.polygons.foreach_set("use_smooth", [True] * len(ob.data.polygons))
            self.export()
            self.assertEqual(any("smooth normals lean" in loss for loss in self.losses()), named, self.losses())

    def test_materials_per_face_and_object_slots(self):
        """Faces go to `usemtl slot_n`; a slot linked to the object overrides the mesh's."""
        ob = self.cube()
        ob.data.materials.append(common.diffuse("Red", (1.0, 0.0, 0.0)))
        ob.data.polygons[3].material_index = 1
        ob.material_slots[0].link = "OBJECT"
        ob.material_slots[0].material = common.diffuse("Blue", (0.0, 0.0, 1.0))
        self.export()
        self.assertIn("materials: {slot_0: blue, slot_1: red}", self.line("{name: Cube"))
        with open(self.path("cube.obj"), encoding="ascii") as f:
            text = f.read()
        self.assertEqual(re.findall("usemtl (.*)", text), ["slot_0", "slot_1"])

    # Materials

    def test_distributions(self):
        """Blender's menus against distribution and scattering."""
        for choice, expected in (("MULTI_GGX", "{roughness: 0.25, color: 0.5}"),
                                 ("GGX", "{scattering: single, roughness: 0.25, color: 0.5}"),
                                 ("BECKMANN", "{distribution: beckmann, scattering: single, "
                                              "roughness: 0.25, color: 0.5}")):
            self.setUp()
            _, node = self.surface("ShaderNodeBsdfGlossy", Color=(0.5, 0.5, 0.5), Roughness=0.25)
            node.distribution = choice
            self.export()
            self.assertEqual(self.line("test:"), "test: {conductor: " + expected + "}")

    def test_anisotropy(self):
        """Anisotropy, rotation and the default tangent, which is radial about z."""
        _, node = self.surface("ShaderNodeBsdfAnisotropic", Color=(1.0, 1.0, 1.0), Roughness=0.5,
                               Anisotropy=-0.5, Rotation=0.125)
        node.distribution = "MULTI_GGX"
        self.export()
        self.assertEqual(self.line("test:"),
                         "test: {conductor: {roughness: 0.5, anisotropy: -0.5, rotation: 0.125, "
                         "tangent: {radial: z}, color: 1}}")

    def test_glass_emission_and_mix(self):
        """A mix of glass and emission, through a reroute and with a folded Math factor."""
        mat, mix = self.surface("ShaderNodeMixShader")
        tree = mat.node_tree
        glass, glow, value, math_node, reroute = (tree.nodes.new(n) for n in (
            "ShaderNodeBsdfGlass", "ShaderNodeEmission", "ShaderNodeValue", "ShaderNodeMath", "NodeReroute"))
        glass.distribution = "MULTI_GGX"
        glass.inputs["Roughness"].default_value = 0.5
        glass.inputs["IOR"].default_value = 1.25
        glow.inputs["Color"].default_value = (2.0, 1.0, 0.5, 1.0)
        glow.inputs["Strength"].default_value = 3.0
        value.outputs[0].default_value = 0.5
        math_node.operation = "MULTIPLY"
        math_node.inputs[1].default_value = 0.25
        tree.links.new(value.outputs[0], math_node.inputs[0])
        tree.links.new(math_node.outputs[0], mix.inputs[0])
        tree.links.new(glass.outputs[0], reroute.inputs[0])
        tree.links.new(reroute.outputs[0], mix.inputs[1])
        tree.links.new(glow.outputs[0], mix.inputs[2])
        self.export()
        self.assertEqual(self.line("test:"),
                         "test: {mix: {factor: 0.125, a: {dielectric: {roughness: 0.5, ior: 1.25, color: 1}}, "
                         "b: {emission: {color: [2, 1, 0.5], strength: 3}}}}")
        self.assertEqual(self.losses(), [])

    def test_node_groups_are_looked_into(self):
        """A shader inside a group, with a colour from the group's input."""
        mat = bpy.data.materials.new("Test")
        mat.use_nodes = True
        tree = mat.node_tree
        tree.nodes.clear()
        inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
        if NEW:
            inner.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
            inner.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
        else:
            inner.inputs.new("NodeSocketColor", "Tint")
            inner.outputs.new("NodeSocketShader", "Surface")
        enter, leave, diffuse = (inner.nodes.new(n) for n in (
            "NodeGroupInput", "NodeGroupOutput", "ShaderNodeBsdfDiffuse"))
        inner.links.new(enter.outputs[0], diffuse.inputs["Color"])
        inner.links.new(diffuse.outputs[0], leave.inputs[0])
        group, output = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeOutputMaterial")
        group.node_tree = inner
        group.inputs[0].default_value = (0.25, 0.5, 0.75, 1.0)
        tree.links.new(group.outputs[0], output.inputs["Surface"])
        self.cube().data.materials[0] = mat
        self.export()
        self.assertEqual(self.line("test:"), "test: {diffuse: {color: [0.25, 0.5, 0.75]}}")

    def test_textures(self):
        """A packed image on colour and, by one channel, on roughness; scale and offset."""
        image = bpy.data.images.new("cells", 4, 4)
        image.generated_color = (0.25, 0.5, 0.75, 1.0)
        image.pack()
        mat, node = self.surface("ShaderNodeBsdfGlossy")
        node.distribution = "MULTI_GGX"
        tree = mat.node_tree
        lookup, split, mapping, uv = (tree.nodes.new(n) for n in (
            "ShaderNodeTexImage", "ShaderNodeSeparateColor", "ShaderNodeMapping", "ShaderNodeTexCoord"))
        lookup.image = image
        mapping.inputs["Scale"].default_value = (2.0, 3.0, 1.0)
        mapping.inputs["Location"].default_value = (0.5, 0.25, 0.0)
        tree.links.new(uv.outputs["UV"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs[0], lookup.inputs[0])
        tree.links.new(lookup.outputs["Color"], node.inputs["Color"])
        tree.links.new(lookup.outputs["Color"], split.inputs[0])
        tree.links.new(split.outputs[1], node.inputs["Roughness"])
        self.export()
        self.assertEqual(self.line("cells:"), "cells: {file: cells.png, color_space: srgb, "
                                              "scale: [2, 3], offset: [0.5, 0.25]}")
        self.assertEqual(self.line("test:"), "test: {conductor: {roughness: {texture: cells, channel: g}, "
                                             "color: {texture: cells}}}")
        self.assertTrue(os.path.isfile(self.path("cells.png")))
        self.assertEqual(self.losses(), [])

    def test_normals(self):
        """A normal map on a named UV map that is not the active one, and bump on it."""
        image = bpy.data.images.new("hills", 4, 4)
        image.colorspace_settings.name = "Non-Color"
        image.pixels.foreach_set([0.5, 0.5, 1.0, 1.0] * 16)
        image.pack()
        mat, node = self.surface("ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5))
        bpy.context.object.data.uv_layers.new(name="Second")
        tree = mat.node_tree
        lookup, normal, bump, uv = (tree.nodes.new(n) for n in (
            "ShaderNodeTexImage", "ShaderNodeNormalMap", "ShaderNodeBump", "ShaderNodeUVMap"))
        lookup.image, uv.uv_map, normal.uv_map = image, "Second", "Second"
        normal.inputs["Strength"].default_value = 0.5
        bump.inputs["Distance"].default_value = 0.25
        tree.links.new(uv.outputs[0], lookup.inputs[0])
        tree.links.new(lookup.outputs["Color"], normal.inputs["Color"])
        tree.links.new(lookup.outputs["Color"], bump.inputs["Height"])
        tree.links.new(normal.outputs[0], bump.inputs["Normal"])
        tree.links.new(bump.outputs[0], node.inputs["Normal"])
        self.export()
        self.assertEqual(self.line("hills:"), "hills: {file: hills.png, color_space: non_color, uv_map: Second}")
        width = "" if "Filter Width" in bump.inputs else ", filter_width: 1"
        self.assertEqual(self.line("test:"), "test: {diffuse: {color: 0.5, normal: {texture: hills, strength: 0.5}, "
                                             f"bump: {{texture: hills, distance: 0.25{width}}}}}}}")
        self.assertEqual(self.losses(), [])
        with open(self.path("cube_second.obj"), encoding="ascii") as f:
            kinds = [line.split()[0] for line in f]
        self.assertEqual((kinds.count("v"), kinds.count("f")), (8, 6))

    def test_steep_normals_are_told(self):
        """A normal map that leans far, and heights that rise fast: Cycles loses light there."""
        image = bpy.data.images.new("steep", 4, 4)
        image.colorspace_settings.name = "Non-Color"
        image.pixels.foreach_set([0.9, 0.5, 0.7, 1.0, 0.1, 0.5, 0.7, 1.0] * 8)
        image.pack()
        mat, node = self.surface("ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5))
        tree = mat.node_tree
        lookup, normal, bump = (tree.nodes.new(n) for n in (
            "ShaderNodeTexImage", "ShaderNodeNormalMap", "ShaderNodeBump"))
        lookup.image = image
        bump.inputs["Distance"].default_value = 2.0
        tree.links.new(lookup.outputs["Color"], normal.inputs["Color"])
        tree.links.new(normal.outputs[0], node.inputs["Normal"])
        self.export()
        self.assertRegex("".join(self.losses()), "its normals lean by 63° and more")
        tree.links.new(lookup.outputs["Color"], bump.inputs["Height"])
        tree.links.new(bump.outputs[0], node.inputs["Normal"])
        self.export()
        self.assertRegex("".join(self.losses()), "bumps lean normals by some")

    def test_color_spaces(self):
        """An image of another colour space is converted as Blender does it; what passes 1 is told."""
        image = bpy.data.images.new("log", 2, 1)
        image.pixels.foreach_set([0.25, 0.25, 0.25, 1.0, 1.0, 1.0, 1.0, 1.0])
        image.pack()
        image.colorspace_settings.name = "Filmic Log"
        mat, node = self.surface("ShaderNodeBsdfDiffuse")
        lookup = mat.node_tree.nodes.new("ShaderNodeTexImage")
        lookup.image = image
        mat.node_tree.links.new(lookup.outputs["Color"], node.inputs["Color"])
        self.export()
        self.assertEqual(self.line("log:"), "log: {file: log.exr, color_space: linear}")
        dark, light = exr.read_channels(self.path("log.exr"))["R"][0]
        # Filmic's logarithm: 2⁻¹²·⁴⁷³⁹³ to 2⁴·⁰²⁶⁰⁶ of 0.18, here 0.25 rounded to 64 of 255.
        self.assertAlmostEqual(dark, 2.0 ** (-12.473931188 + 16.5 * 64 / 255), delta=2e-5)
        self.assertRegex("".join(self.losses()), "values up to .*: clamped to 1")

    def test_random_numbers_are_the_objects_own(self):
        """Object Info's random number comes out of a bake, different for two cubes of one material."""
        mat, node = self.surface("ShaderNodeBsdfDiffuse")
        info = mat.node_tree.nodes.new("ShaderNodeObjectInfo")
        mat.node_tree.links.new(info.outputs["Random"], node.inputs["Color"])
        names = [bpy.context.object.name, self.cube(location=(2.0, 0.0, 0.0)).name]
        bpy.context.object.data.materials[0] = mat
        self.export(bake_size=16)
        baked = [f for f in os.listdir(self.folder.name) if f.startswith("baked_test")]
        self.assertEqual(len({exr.read_channels(self.path(f))["R"].max() for f in baked}), 2, baked)
        self.assertEqual(self.losses(), [])
        self.assertEqual([ob.name for ob in bpy.data.objects if ob.type == "MESH"], names)

    def test_vertex_colors(self):
        """Colours of corners: a file beside the mesh, linear."""
        mat, node = self.surface("ShaderNodeBsdfDiffuse")
        layer = bpy.context.object.data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
        for i, corner in enumerate(layer.data):
            corner.color = (i / 32.0, 0.5, 0.25, 1.0)
        paint = mat.node_tree.nodes.new("ShaderNodeVertexColor")
        paint.layer_name = "Paint"
        mat.node_tree.links.new(paint.outputs["Color"], node.inputs["Color"])
        self.export()
        self.assertEqual(self.line("paint:"), "paint: {colors: Paint, color_space: linear}")
        self.assertEqual(self.line("cube:"), "cube: {file: cube.obj, colors: {Paint: cube_paint.obj}}")
        with open(self.path("cube_paint.obj"), encoding="ascii") as f:
            colors = {tuple(map(float, line.split()[4:])) for line in f if line.startswith("v ")}
        self.assertEqual(colors, {(i / 32.0, 0.5, 0.25) for i in range(24)})
        self.assertEqual(self.losses(), [])

    def test_principled(self):
        """The node's sockets as they are; what has the node's default is left out."""
        _, node = self.surface("ShaderNodeBsdfPrincipled", Base_Color=(1.0, 0.75, 0.25), Metallic=1.0,
                               Roughness=0.25, Anisotropic=0.5)
        node.distribution = "MULTI_GGX"
        self.export()
        version, choice = (4.5 if bpy.app.version < (5, 0, 0) else 5, "") if NEW else (3.4, "distribution: multi_ggx, ")
        line = self.line("test:")
        self.assertTrue(line.startswith(f"test: {{principled: {{version: {version}, layering: cycles, {choice}"), line)
        for key in ("base_color: [1, 0.75, 0.25]", "metallic: 1", "roughness: 0.25", "anisotropic: 0.5",
                    "tangent: {radial: z}"):
            self.assertIn(key, line)
        if NEW:  # Cycles scales by an albedo there
            self.assertRegex("".join(self.losses()), "its Multiscatter GGX is scaled in Cycles")
        else:
            self.assertEqual(self.losses(), [])

    def test_losses_are_named(self):
        """A shader without counterpart: a magenta placeholder, and a warning with material and node."""
        self.surface("ShaderNodeBsdfHair")
        self.export()
        self.assertEqual(self.line("test:"), "test: {diffuse: {color: [1, 0, 1]}}")
        self.assertEqual(len(self.losses()), 1)
        self.assertRegex(self.losses()[0], 'material "Test", node "Hair BSDF"')
        self.assertIn("1 thing(s) not carried", self.log.summary())

    def noise_on_roughness(self):
        """A glossy cube whose roughness is a noise texture."""
        mat, node = self.surface("ShaderNodeBsdfGlossy", Roughness=0.25)
        noise = mat.node_tree.nodes.new("ShaderNodeTexNoise")
        mat.node_tree.links.new(noise.outputs[0], node.inputs["Roughness"])

    def test_without_bakes_procedural_values_are_named(self):
        """A noise texture on roughness: its default, and a warning."""
        self.noise_on_roughness()
        self.export(bake=NO_BAKE)
        self.assertIn("roughness: 0.25", self.line("test:"))
        self.assertRegex(self.losses()[0], 'material "Test", node "Glossy BSDF": Roughness comes from node "Noise')

    def test_procedural_values_are_baked(self):
        """A noise texture on roughness: an image over the unwrapped cube, and no warning."""
        self.noise_on_roughness()
        before = stored()
        self.export(bake_size=64)
        self.assertIn("roughness: {texture: baked_test_glossy_bsdf_roughness, channel: r}", self.line("test:"))
        self.assertEqual(self.losses(), [])
        self.assertEqual(stored(), before)

    # Lights, camera, settings

    def test_light_node_tree_and_power(self):
        """A constant Emission node multiplies power and colour."""
        self.cube()
        light = common.area_light(self.scene, "Key", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (2.0, 1.0), 100.0)
        light.data.use_nodes = True
        emission = next(n for n in light.data.node_tree.nodes if n.type == "EMISSION")
        emission.inputs["Strength"].default_value = 0.5
        emission.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
        self.export()
        line = self.line("{area:")
        self.assertIn(f"power: {0.5 * light.data.energy:.7g}", line)
        self.assertIn("color: [1, 0.5, 0.25]", line)
        self.assertIn("shape: {rectangle: {width: 2, height: 1}}", line)
        self.assertEqual(self.line("light_units:"), f"light_units: cycles_{4 if NEW else 3}")

    def test_focus_object_and_resolution(self):
        """The focus distance is along the view axis; the percentage scales the resolution."""
        target = self.cube(location=(2.0, -2.0, 1.0))
        dof = self.scene.camera.data.dof
        dof.use_dof, dof.focus_object, dof.aperture_fstop = True, target, 2.0
        self.scene.render.resolution_percentage = 50
        self.export()
        self.assertEqual(self.line("depth_of_field:"), "depth_of_field: {fstop: 2, focus_distance: 4}")
        self.assertEqual((self.line("width:"), self.line("height:")), ("width: 32", "height: 24"))

    # Visibility, film, view

    def test_visibility(self):
        """Rays that pass an object, a light and the world; a holdout; what the camera's planes cut."""
        ob = self.cube()
        ob.visible_diffuse = ob.visible_shadow = False
        ob.is_holdout = True
        lamp = common.area_light(self.scene, "Lamp", (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (1.0, 1.0), 10.0)
        lamp.visible_glossy = False
        common.constant_world(self.scene, (1.0, 1.0, 1.0), 1.0)
        visibility = getattr(self.scene.world, "cycles_visibility", None)
        if visibility:
            visibility.camera = False
        self.scene.camera.data.clip_end = 6.0
        self.export()
        self.assertIn("hidden_from: [diffuse, shadow], holdout: true", self.line("{name: Cube"))
        self.assertIn("hidden_from: [glossy]", self.line("{area: "))
        self.assertEqual(sum("hidden_from: [camera]" in line for line in self.lines), 1 if visibility else 0)
        self.assertIn("[0.1, 6]", self.line("clip:"))
        self.assertEqual(self.losses(), [])

    def test_a_backdrop_for_the_camera(self):
        """A world that is another colour to the camera: a box that the camera alone sees."""
        self.cube()
        common.constant_world(self.scene, (0.25, 0.5, 1.0), 1.0)
        tree = self.scene.world.node_tree
        mix, white, path = (tree.nodes.new(f"ShaderNode{n}") for n in ("MixShader", "Background", "LightPath"))
        white.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        background = next(n for n in tree.nodes if n.type == "BACKGROUND" and n != white)
        tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
        tree.links.new(background.outputs[0], mix.inputs[1])
        tree.links.new(white.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
        self.export()
        self.assertEqual(self.line("constant:"), "constant: {color: [0.25, 0.5, 1]}")
        self.assertEqual(self.line("backdrop: {em"), "backdrop: {emission: {color: [1, 1, 1]}}")
        self.assertIn("hidden_from: [diffuse, glossy, transmission, shadow]", self.line("{name: Backdrop"))
        self.assertEqual(self.losses(), [])

    def test_film(self):
        """Film exposure and transparency are the renderer's; plain sRGB needs no table."""
        self.scene.cycles.film_exposure = 2.0
        self.scene.render.film_transparent = True
        self.scene.view_settings.view_transform = "Standard"
        self.scene.view_settings.exposure = 0.5
        self.cube()
        self.export()
        self.assertEqual((self.line("gain:"), self.line("transparent:"), self.line("exposure:")),
                         ("gain: 2", "transparent: true", "exposure: 0.5"))
        self.assertFalse(os.path.exists(self.path("view.cube")))
        self.scene.view_settings.view_transform = "Filmic"
        self.scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
        self.export()
        self.assertEqual(self.line("filter:"), "filter: {blackman_harris: {width: 3}}")
        self.assertIn("{lut: view.cube, log2: {offset: 0.00390625", self.line("view:"))
        self.assertEqual(self.losses(), [])

    def test_frames(self):
        """What moves is in the files of all frames, what does not is written once."""
        still, moving, bending = (self.cube(location=(x, 0.0, 0.0)) for x in (-3.0, 0.0, 3.0))
        for number, height in ((1, 0.0), (3, 2.0)):
            moving.location.z = height
            moving.keyframe_insert("location", frame=number)
        bending.shape_key_add(name="Basis")
        key = bending.shape_key_add(name="Bent")
        key.data[0].co.z += 1.0
        for number, value in ((2, 0.0), (3, 1.0)):
            key.value = value
            key.keyframe_insert("value", frame=number)
        self.scene.frame_set(2)
        self.export(frames=range(1, 4))
        self.assertEqual(self.scene.frame_current, 2)
        self.assertEqual(self.line("frames:"), 'frames: "frame_####.yaml"')
        self.assertEqual(self.losses(), [])
        names = [ob.name for ob in (still, moving, bending)]
        order = [next(n for n in names if line.startswith(f"{{name: {yaml.flow(n)},"))
                 for line in self.lines if line.startswith("{name: ")]
        at = order.index(moving.name)
        frames = []
        for number in (1, 2, 3):
            with open(self.path(f"frame_{number:04}.yaml"), encoding="utf-8") as f:
                frames.append(dict(line.rstrip("\n").split(": ", 1) for line in f))
        self.assertTrue(all(f.keys() == frames[0].keys() for f in frames))
        self.assertEqual(len(frames[0]), 2, frames[0])
        place = f"objects.{at}.transform"
        self.assertEqual([f[place].split("], [")[2].split(", ")[3] for f in frames], ["0", "1", "2"])
        mesh, = frames[0].keys() - {place}
        self.assertEqual(frames[0][mesh], frames[1][mesh])
        self.assertNotEqual(frames[1][mesh], frames[2][mesh])
        self.assertEqual(len([f for f in os.listdir(self.folder.name) if f.endswith(".obj")]), 2)

    def test_settings_are_restored(self):
        """The export leaves the scene as it was."""
        self.cube()
        before = (self.scene.render.engine, self.scene.render.use_compositing)
        self.export()
        self.assertEqual((self.scene.render.engine, self.scene.render.use_compositing), before)

    def test_names_are_quoted(self):
        """YAML's own words and signs are quoted."""
        for text, expected in (("plain", "plain"), ("yes", '"yes"'), ("a: b", '"a: b"'), ("1", '"1"'),
                               ('say "hi"', '"say \\"hi\\""'), ("", '""'), ("Würfel", '"Würfel"')):
            self.assertEqual(yaml.flow(text), expected)


if __name__ == "__main__":
    outcome = unittest.TextTestRunner(verbosity=2).run(
        unittest.defaultTestLoader.loadTestsFromTestCase(ExportTest))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0 if outcome.wasSuccessful() else 1)
