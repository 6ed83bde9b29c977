"""Lights, camera and world.

Blender's light power stays in watts: `light_units` tells the renderer how the
Cycles of this Blender turns watts into radiance (3.x and 4.x differ).
"""

import math

import bpy

from .nodes import Unknown, evaluate, follow


def matrix(m):
    """A transform: four rows of four numbers, object to world."""
    return {"matrix": [[float(x) for x in row] for row in m]}


def light_units():
    """Which Cycles this Blender carries: area light and spot radiometry changed in 4.0."""
    return "cycles_3" if bpy.app.version < (4, 0, 0) else "cycles_4"


def light(ob, world_matrix, log):
    """One light of the scene format, from an evaluated light object."""
    data = ob.data
    where = f'light "{ob.name}"'
    rgb, power = _emission(data, where, log)
    keys = {"name": ob.name, "transform": matrix(world_matrix)}
    if rgb != [1.0, 1.0, 1.0]:
        keys["color"] = rgb
    if getattr(data, "exposure", 0.0) != 0.0:  # 4.5 and newer, stops
        keys["exposure"] = data.exposure
    if ob.visible_camera:
        keys["visible_to_camera"] = True
    for kind in ("diffuse", "glossy", "transmission"):
        if not getattr(ob, f"visible_{kind}"):
            log.warn(where, f"hidden from {kind} rays in Blender, visible here")
    if not getattr(data, "use_shadow", True) or not getattr(data.cycles, "cast_shadow", True):
        log.warn(where, "casts shadows here though not in Blender")
    if getattr(data.cycles, "is_portal", False):
        log.warn(where, "a portal is no light: left out")
        return None

    if data.type == "SUN":
        return {"sun": {**keys, "strength": power, "angle": math.degrees(data.angle)}}
    if data.type == "AREA":
        return {"area": _area(data, keys, power, world_matrix)}

    if not getattr(data, "normalize", True):
        log.warn(where, "normalize off has no counterpart for this kind: power written as if on")
    if data.shadow_soft_size > 0.0:
        keys["radius"] = data.shadow_soft_size
    keys["power"] = power
    soft = getattr(data, "use_soft_falloff", True)
    if data.type == "SPOT":
        if not soft and data.shadow_soft_size > 0.0:
            log.warn(where, "soft falloff off has no counterpart for spots")
        keys.update(size=math.degrees(data.spot_size), blend=data.spot_blend)
        return {"spot": keys}
    if not soft:
        keys["soft_falloff"] = False
    return {"point": keys}


def _area(data, keys, power, world_matrix):
    width = data.size
    height = data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
    shape = "disk" if data.shape in {"DISK", "ELLIPSE"} else "rectangle"
    if not getattr(data, "normalize", True):
        # L = P/π whatever the size: the power of a light of that radiance.
        x, y = (world_matrix.to_3x3().col[i] for i in (0, 1))
        area = x.cross(y).length * width * height * (math.pi / 4.0 if shape == "disk" else 1.0)
        power *= area
    keys.update(shape={shape: {"width": width, "height": height}}, power=power)
    if data.spread < math.pi * (1.0 - 1e-6):
        keys["spread"] = math.degrees(data.spread)
    return keys


def _emission(data, where, log):
    """Colour and power of a light, with a constant Emission node folded in."""
    rgb = [float(c) for c in data.color]
    if getattr(data, "use_temperature", False):  # 4.5 and newer
        rgb = [c * t for c, t in zip(rgb, data.temperature_color)]
    power = data.energy
    tree = data.node_tree if data.use_nodes else None
    output = tree.get_output_node("CYCLES") if tree else None
    if output:
        source = follow(output.inputs["Surface"])
        constant = None
        if source.linked and source.node.type == "EMISSION":
            strength = evaluate(source.node.inputs["Strength"], source.groups)
            tint = evaluate(source.node.inputs["Color"], source.groups)
            if isinstance(strength, float) and isinstance(tint, tuple):
                constant = (strength, tint)
        if constant:
            power *= constant[0]
            rgb = [c * t for c, t in zip(rgb, constant[1])]
        else:
            log.warn(where, "its node tree is not one constant Emission: left out, power and colour kept")
    return rgb, power


def camera(scene, depsgraph, log):
    """The camera section, or None without a camera. Clipping distances are not carried."""
    if scene.camera is None:
        log.warn("scene", "has no camera")
        return None
    ob = scene.camera.evaluated_get(depsgraph)
    data, render = ob.data, scene.render
    where = f'camera "{ob.name}"'
    shift = {f"shift_{axis}": getattr(data, f"shift_{axis}") for axis in "xy"
             if getattr(data, f"shift_{axis}") != 0.0}
    fit = {} if data.sensor_fit == "AUTO" else {"sensor_fit": data.sensor_fit.lower()}
    aspect = render.pixel_aspect_y / render.pixel_aspect_x
    if data.type == "ORTHO":
        projection = {"orthographic": {"scale": data.ortho_scale, **fit, **shift}}
        if aspect != 1.0:
            log.warn(where, "pixel aspect is left out of an orthographic camera")
    elif data.type == "PERSP":
        keys = {"lens": data.lens, "sensor_width": data.sensor_width,
                "sensor_height": data.sensor_height, **fit, **shift}
        if aspect != 1.0:
            keys["pixel_aspect"] = aspect
        projection = {"perspective": keys}
    else:
        log.warn(where, f"{data.type.lower()} camera written as perspective")
        projection = {"perspective": {"lens": data.lens}}
    section = {"transform": matrix(ob.matrix_world), "projection": projection}

    dof = data.dof
    if dof.use_dof:
        distance = dof.focus_distance
        if dof.focus_object:
            target = dof.focus_object.evaluated_get(depsgraph).matrix_world.translation
            axis = ob.matrix_world.to_3x3().col[2].normalized()
            distance = abs(axis.dot(target - ob.matrix_world.translation))
        section["depth_of_field"] = {"fstop": dof.aperture_fstop, "focus_distance": distance}
        if dof.aperture_blades >= 3 or dof.aperture_ratio != 1.0:
            log.warn(where, "bokeh blades and ratio are left out: a round aperture")
    return section


def world(scene, images, log):
    """The world section: constant, or an equirectangular image; None when black."""
    data = scene.world
    if data is None:
        return None
    where = f'world "{data.name}"'
    if not data.use_nodes or data.node_tree is None:
        return {"constant": {"color": [float(c) for c in data.color]}}
    output = data.node_tree.get_output_node("CYCLES")
    if output is None:
        return None
    if output.inputs["Volume"].is_linked:
        log.warn(where, "volume is left out")
    source = follow(output.inputs["Surface"])
    if not source.linked:
        return None
    if source.node.type != "BACKGROUND":
        return _lost_world(data, where, f'"{source.node.name}" is not a Background', log)

    strength = evaluate(source.node.inputs["Strength"], source.groups)
    if not isinstance(strength, float):
        log.warn(where, "a strength that is not constant is left out")
        strength = 1.0
    rgb = evaluate(source.node.inputs["Color"], source.groups)
    if isinstance(rgb, tuple):
        return {"constant": {"color": list(rgb), "strength": strength}}
    below = follow(source.node.inputs["Color"], source.groups)
    if below.linked and below.node.type == "TEX_ENVIRONMENT":
        return _environment(data, below, strength, where, images, log)
    what = rgb.what if isinstance(rgb, Unknown) else "a flat image"
    return _lost_world(data, where, f"colour comes from {what}", log)


def _lost_world(data, where, why, log):
    rgb = [float(c) for c in data.color]
    log.warn(where, f"{why}: replaced by the viewport colour {rgb}")
    return {"constant": {"color": rgb}}


def _environment(data, source, strength, where, images, log):
    node = source.node
    if node.image is None or node.projection != "EQUIRECTANGULAR":
        return _lost_world(data, where, f'"{node.name}" has no equirectangular image', log)
    space = node.image.colorspace_settings.name
    if not node.image.is_float and space == "sRGB":
        log.warn(where, f'"{node.image.name}" holds 8-bit sRGB: an EXR or HDR is expected')
    elif space not in {"Non-Color", "Raw", "Linear", "Linear Rec.709", "Linear BT.709"}:
        log.warn(where, f'"{node.image.name}" in colour space {space} is read as linear Rec. 709')
    file = images.add(node.image, where)
    if file is None:
        return _lost_world(data, where, f'image "{node.image.name}" is missing', log)
    keys = {"file": file, "strength": strength}
    vector = follow(node.inputs["Vector"], source.groups)
    if vector.linked and vector.node.type == "MAPPING":
        mapping = vector.node
        location, rotation, scale = (evaluate(mapping.inputs[n], vector.groups)
                                     for n in ("Location", "Rotation", "Scale"))
        plain = all(isinstance(v, tuple) for v in (location, rotation, scale))
        if plain and mapping.vector_type in {"POINT", "VECTOR"}:
            if any(rotation):
                keys["rotation"] = [math.degrees(a) for a in rotation]
            moved = any(location) and mapping.vector_type == "POINT"
            if moved or scale != (1.0, 1.0, 1.0):
                log.warn(where, f'location and scale of "{mapping.name}" are left out')
        else:
            log.warn(where, f'"{mapping.name}" ({mapping.vector_type.lower()}) is left out')
        vector = follow(mapping.inputs["Vector"], vector.groups)
    generated = vector.node.type in {"TEX_COORD", "NEW_GEOMETRY"}
    if vector.linked and not generated:
        log.warn(where, f'coordinates from "{vector.node.name}" are left out')
    return {"environment": keys}
