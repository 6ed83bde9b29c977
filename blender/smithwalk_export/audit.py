"""No silent loss: what a converter did not read and differs from its default is named.

Converters look at Blender's structs through `Audit.view`, which records the
properties read, and at sockets through `nodes.Graph`, which records them too.
`Audit.leftovers` then compares everything else with a fresh struct of the
same kind. A property that a later Blender adds is therefore named without
anybody having to list it here.

What cannot change a picture is passed over by rule:
1. what all datablocks or all nodes share (names, users, the place in the editor);
2. computed, read-only values;
3. collections, whose items have converters of their own;
4. settings of the viewport, of editing and of playback (`_EDITING`);
5. settings of other engines (`_OTHER_ENGINES`);
6. settings that change noise, speed or memory but not what an image converges to (`_COST`).
"""

import re

import bpy

_EDITING = re.compile(
    r"show_|display_|preview_|use_preview|viewport_|hide_viewport|hide_select|active_|lock_|empty_|"
    r"use_empty|grease_pencil|is_grease|use_shape_key_edit|use_mesh_mirror|select|passepartout|"
    r"pose_library|use_camera_lock|add_rest_position|asset|texture_paint|paint_|line_|lineart|ui_|"
    r"is_active|warning_|use_extra_user|lightgroup|stereo|background_images|bake$|motion_path|"
    r"animation|sound|audio|use_audio|sync_mode|use_gravity|gravity|tool_settings|unit_settings|"
    r"timeline|keying|sequence|use_stamp|stamp|metadata|fps|frame_|filepath|use_overwrite|"
    r"use_placeholder|use_file_extension|views_format|cursor|safe_areas|transform_orientation|"
    r"use_lock_interface|use_render_cache|bake_|use_bake|image_settings|ffmpeg|sequencer_|use_sequencer|"
    r"compositor_|rigidbody|simulation_|lock_frame|use_single_layer|engine$|active_clip|texture_mesh|"
    r"use_custom_simulation|time_jump|bl_|shadow_buffer|specular_factor|diffuse_factor|volume_factor|"
    r"transmission_factor")
_OTHER_ENGINES = re.compile(
    r"eevee|display$|hydra|use_freestyle|freestyle|blend_method|shadow_method|surface_render|"
    r"use_backface_culling|use_screen_refraction|use_raytrace|refraction_depth|use_sss_translucency|"
    r"alpha_threshold|use_transparen|thickness_mode|use_thickness|volume_intersection|lightprobe|"
    r"metallic$|roughness$|specular_|diffuse_color|use_high_quality|gpencil|simplify_gpencil|"
    r"hair_type|hair_subdiv|filter_size|light_settings|mist_settings|probe_|sun_threshold|"
    r"sun_angle$|use_sun_shadow|use_eevee|sun_shadow|shadow_(filter|maximum|jitter|trace|overblur|color)|"
    r"use_contact|contact_|use_shadow_jitter|use_absolute_resolution|use_custom_distance|"
    r"cutoff_distance|distance$|falloff_|linear_|quadratic_|constant_|surface_cache|"
    r"use_grease|use_solid|use_strand|max_vertex_displacement")
_COST = re.compile(
    r"debug_|device$|(use_)?denois|(use_)?adaptive|scrambling|sampling_pattern|auto_scrambling|use_guiding|"
    r"guiding|use_deterministic|use_surface_guiding|surface_guiding|use_volume_guiding|volume_guiding|"
    r"direct_light_sampling|min_light_bounces|min_transparent|light_sampling_threshold|use_light_tree|"
    r"use_compositor_|tile_size|use_auto_tile|texture_limit|feature_set|shading_system|sample_offset|use_sample_subset|"
    r"sample_subset|use_persistent|threads|sampling_method|sample_map_resolution|emission_sampling|"
    r"sample_as_light|use_multiple_importance|use_mis|is_shadow_linking|offscreen_dicing|"
    r"use_layer_samples|use_pass|pass_|sample_count|use_animated_seed|fast_gi_method|homogeneous|"
    r"ao_bounces|heterogeneous|volume_preview|volume_unbiased|volume_biased|use_auto_smooth|name$")
_DEPTH = 2


def _passed_over(name):
    return bool(_EDITING.match(name) or _OTHER_ENGINES.match(name) or _COST.match(name))


def _names(kind):
    return {p.identifier for p in kind.bl_rna.properties} | {"animation_data"}


_OF_DATABLOCKS = _names(bpy.types.ID)
_OF_NODES = _names(bpy.types.Node)


def _value(struct, prop):
    """A property's value as plain Python, or None for one that is passed over."""
    value = getattr(struct, prop.identifier)
    if prop.type in {"BOOLEAN", "INT", "FLOAT"} and prop.is_array:
        flat = []
        for x in value:
            flat += list(x) if hasattr(x, "__len__") else [x]
        return tuple(flat)
    if prop.type == "ENUM" and prop.is_enum_flag:
        return frozenset(value)
    return value


def harvest(struct, depth=0):
    """The properties of a struct that can change a picture: {name: value or nested dict}."""
    found = {}
    shared = _OF_NODES if isinstance(struct, bpy.types.Node) else _OF_DATABLOCKS
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in shared or _passed_over(name) or prop.type == "COLLECTION":
            continue
        try:
            value = _value(struct, prop)
        except (AttributeError, TypeError, ValueError, RuntimeError):
            continue  # not of this datablock's kind
        if prop.type == "POINTER":
            if isinstance(value, bpy.types.ID):
                if not prop.is_readonly:
                    found[name] = value.name
            elif value is not None and depth < _DEPTH:
                found[name] = harvest(value, depth + 1)
            elif not prop.is_readonly:
                found[name] = None
        elif not prop.is_readonly:
            found[name] = value
    return found


def _same(a, b):
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= 1e-6 * max(1.0, abs(a), abs(b))
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(_same(float(x), float(y)) for x, y in zip(a, b))
    return a == b


def _shown(value):
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, tuple):
        return "(" + ", ".join(f"{x:.4g}" for x in value) + ")"
    return str(value).lower() if isinstance(value, bool) else str(value)


def differences(found, default, prefix=""):
    """Lines "name value (default …)" for what differs, nested structs by dotted names."""
    for name, value in found.items():
        if name not in default:
            continue
        usual = default[name]
        path = prefix + name
        if isinstance(value, dict):
            yield from differences(value, usual if isinstance(usual, dict) else {}, path + ".")
        elif isinstance(usual, dict):
            continue
        elif not _same(value, usual):
            yield path, f"{path.replace('_', ' ')} {_shown(value)}"


class Defaults:
    """Fresh structs of every kind, harvested once per process and kind.

    Made outside of a render, since it creates and removes datablocks.
    """

    def __init__(self):
        self._structs = {}
        self._nodes = {}

    def prepare(self):
        """Harvest what every scene has, and all shader nodes of this Blender."""
        if self._structs:
            return
        scene = bpy.data.scenes.new("smithwalk defaults")
        tree = bpy.data.node_groups.new("smithwalk defaults", "ShaderNodeTree")
        made = []
        try:
            self._structs["Scene"] = harvest(scene)
            self._structs["ViewLayer"] = harvest(scene.view_layers[0])
            collection = bpy.data.collections.new("smithwalk defaults")
            self._structs["Collection"] = harvest(collection)
            made.append((bpy.data.collections, collection))
            for store, kind in ((bpy.data.cameras, "Camera"), (bpy.data.worlds, "World"),
                                (bpy.data.materials, "Material"), (bpy.data.meshes, "Mesh")):
                block = store.new("smithwalk defaults")
                made.append((store, block))
                self._structs[kind] = harvest(block)
            for kind in ("POINT", "SUN", "SPOT", "AREA"):
                block = bpy.data.lights.new("smithwalk defaults", kind)
                made.append((bpy.data.lights, block))
                self._structs[type(block).__name__] = harvest(block)
            block = bpy.data.objects.new("smithwalk defaults", None)
            made.append((bpy.data.objects, block))
            self._structs["Object"] = harvest(block)
            for name in dir(bpy.types):
                kind = getattr(bpy.types, name)
                if not name.startswith("ShaderNode") or name in {"ShaderNode", "ShaderNodeTree"} \
                        or name.endswith("Group"):
                    continue
                try:
                    node = tree.nodes.new(name)
                except RuntimeError:  # a base class
                    continue
                self._nodes[name] = (harvest(node), {
                    s.identifier: _socket_value(s) for s in node.inputs})
        finally:
            for store, block in reversed(made):
                store.remove(block)
            bpy.data.node_groups.remove(tree)
            bpy.data.scenes.remove(scene)

    def of(self, struct):
        """The harvest of a fresh struct of the same kind, or None."""
        for kind in type(struct).__mro__:
            if kind.__name__ in self._structs:
                return self._structs[kind.__name__]
        return None

    def node(self, bl_idname):
        """Properties and socket values of a fresh node, or None for one that isn't a shader's."""
        return self._nodes.get(bl_idname)


DEFAULTS = Defaults()


def _socket_value(socket):
    value = getattr(socket, "default_value", None)
    return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


class View:
    """A struct that remembers which of its properties were read."""

    def __init__(self, struct, seen, prefix=""):
        self.__dict__.update(struct=struct, _seen=seen, _prefix=prefix)

    def __getattr__(self, name):
        value = getattr(self.struct, name)
        path = self._prefix + name
        prop = self.struct.bl_rna.properties.get(name)
        if prop is not None and prop.type == "POINTER" and prop.is_readonly \
                and value is not None and not isinstance(value, bpy.types.ID):
            return View(value, self._seen, path + ".")  # a struct within: its own reads count
        self._seen.add(path)
        return value

    def get(self, name, default=None):
        """The property, or a default in a Blender that does not have it."""
        return getattr(self, name) if hasattr(self.struct, name) else default

    def accept(self, *names):
        """Take these as read: what they say reaches the scene some other way."""
        self._seen.update(self._prefix + n for n in names)


class Audit:
    """What was read of which struct during one export."""

    def __init__(self):
        self._seen = {}  # pointer → names read

    def view(self, struct):
        """The struct, with its reads recorded."""
        return View(struct, self._seen.setdefault(struct.as_pointer(), set()))

    def leftovers(self, struct, accept=()):
        """What was not read of a struct and differs from a fresh one's, as short texts."""
        default = DEFAULTS.of(struct)
        if default is None:
            return []
        seen = self._seen.get(struct.as_pointer(), set()) | set(accept)
        return [text for path, text in differences(harvest(struct), default)
                if path not in seen and path.split(".")[0] not in seen]

    def node_leftovers(self, node, read_inputs):
        """The same for a node; `read_inputs` holds the identifiers of the inputs read."""
        default = DEFAULTS.node(node.bl_idname)
        if default is None:
            return []
        properties, sockets = default
        seen = self._seen.get(node.as_pointer(), set())
        lost = [text for path, text in differences(harvest(node), properties)
                if path not in seen and path.split(".")[0] not in seen]
        for socket in node.inputs:
            if socket.identifier in read_inputs or not socket.enabled \
                    or getattr(socket, "is_unavailable", False):
                continue
            if any(l.is_valid and not l.is_muted for l in socket.links):
                lost.append(f"input {socket.name} (linked)")
            elif socket.identifier in sockets:
                value, usual = _socket_value(socket), sockets[socket.identifier]
                if value is not None and usual is not None and not _same(value, usual):
                    lost.append(f"input {socket.name} {_shown(value)}")
        return lost
