"""The scene's settings: film, sampling, and what the renderer has no setting for."""

from . import view
from .nodes import working_space

# Settings whose default already is another picture than the renderer's: told
# once, in short, while they have the default.
DENOISE = "--denoise"
_LIMITS = ("diffuse", "glossy", "transmission")
# Settings with a default that depends on the file, read by others, or without a say.
_ACCEPTED = (
    "camera", "world", "view_layers", "collection", "name", "use_nodes", "node_tree", "compositing_node_group",
    "display_settings", "sequencer_colorspace_settings", "cycles_curves", "frame_current", "frame_subframe",
    "render.engine", "render.use_compositing", "render.use_sequencer", "render.use_border",
    "render.border_min_x", "render.border_max_x", "render.border_min_y", "render.border_max_y",
    "render.use_crop_to_border", "render.resolution_x", "render.resolution_y", "render.resolution_percentage",
    "render.pixel_aspect_x", "render.pixel_aspect_y", "render.dither_intensity", "render.image_settings",
    "render.motion_blur_shutter", "render.motion_blur_shutter_curve", "render.motion_blur_position",
    "render.use_simplify", "render.simplify_subdivision", "render.simplify_subdivision_render",
    "render.simplify_child_particles", "render.simplify_child_particles_render", "render.simplify_volumes",
    "render.use_multiview", "render.compositor", "render.line_thickness_mode", "render.line_thickness",
    "view_settings", "smithwalk", "cycles.samples", "cycles.seed", "cycles.time_limit", "cycles.volume_step_rate", "cycles.volume_bounces",
    "cycles.volume_max_steps", "cycles.dicing_rate", "cycles.max_subdivisions", "cycles.dicing_camera",
    "cycles.film_transparent_glass", "cycles.film_transparent_roughness", "cycles.rolling_shutter_type",
    "cycles.rolling_shutter_duration", "cycles.motion_blur_position",
    "cycles.bake_type", "cycles.pixel_filter_type", "cycles.filter_width", "cycles.fast_gi_method",
    "cycles.camera_cull_margin", "cycles.distance_cull_margin", "cycles.use_camera_cull",
    "cycles.use_distance_cull", "cycles.samples",
)


def resolution(render):
    """Width and height in pixels, as Blender rounds them."""
    return (max(render.resolution_x * render.resolution_percentage // 100, 1),
            max(render.resolution_y * render.resolution_percentage // 100, 1))


def film(scene, log, view_section=None):
    """The film section; `view_section` is how PNGs look, where that is not plain sRGB."""
    render, cycles = scene.render, scene.cycles
    width, height = resolution(render)
    section = {"width": width, "height": height}
    kind = cycles.pixel_filter_type
    if kind == "BOX":
        section["filter"] = {"box": {}}
    else:
        if kind != "BLACKMAN_HARRIS":
            log.warn("scene", f"pixel filter {kind.lower()} is written as Blackman-Harris")
        # Cycles' window is twice as wide as the setting says.
        section["filter"] = {"blackman_harris": {"width": 2.0 * max(cycles.filter_width, 0.01)}}
    if view.exposure(scene) != 0.0:
        section["exposure"] = view.exposure(scene)
    if cycles.film_exposure != 1.0:
        section["gain"] = max(cycles.film_exposure, 0.0)
    if render.film_transparent:
        section["transparent"] = True
    if view_section:
        section["view"] = view_section
        if "false" in view.transform(scene).lower():
            log.warn("scene", "the steps of false colours are met between them alone: PNGs blend them")
    return section


def sampling(scene, view_layer):
    """The sampling section. A view layer's own samples go before the scene's."""
    cycles = scene.cycles
    samples = view_layer.samples if view_layer.samples > 0 \
        and getattr(cycles, "use_layer_samples", "USE") == "USE" else cycles.samples
    return {"spp": max(samples, 1), "seed": max(cycles.seed, 0), "max_bounces": max(cycles.max_bounces, 0)}


def options(scene):
    """What of the settings `smithwalk render` takes as options: noise, time, denoising, region."""
    cycles, render = scene.cycles, scene.render
    chosen = []
    if cycles.use_adaptive_sampling or cycles.time_limit > 0.0:
        chosen += ["--spp", str(max(cycles.samples, 1))]  # else noise or time alone decide
    if cycles.use_adaptive_sampling:
        # 0 lets Cycles choose by the samples: 1/√samples is about what it takes.
        chosen += ["--noise", f"{cycles.adaptive_threshold or cycles.samples ** -0.5:.4g}"]
    if cycles.time_limit > 0.0:
        chosen += ["--time", f"{cycles.time_limit:g}"]
    if cycles.use_denoising:
        chosen.append(DENOISE)
    region = border(render)
    if region:
        chosen += ["--crop", ",".join(map(str, region))]
    return chosen


def border(render):
    """The render region in pixels from the top left (x0, y0, x1, y1), or None."""
    if not render.use_border:
        return None
    width, height = resolution(render)
    x0, x1 = int(width * render.border_min_x), int(width * render.border_max_x)
    y0, y1 = int(height * render.border_min_y), int(height * render.border_max_y)
    if x1 <= x0 or y1 <= y0:
        return None
    return x0, height - y1, x1, height - y0


def tell(scene, view_layer, audit, log, composited, by_engine=False):
    """Name every setting that the scene file does not hold."""
    cycles, render = scene.cycles, scene.render
    seen = audit.view(scene)
    seen.accept(*_ACCEPTED)

    if working_space() != "Linear Rec.709":
        log.warn("scene", f"the working space is {working_space()}: images and colours are carried, black bodies, "
                          "greys of colours and skies are computed as in Rec. 709")
    general = []
    if cycles.sample_clamp_direct or cycles.sample_clamp_indirect:
        values = f"direct {cycles.sample_clamp_direct:g}, indirect {cycles.sample_clamp_indirect:g}"
        usual = cycles.sample_clamp_direct == 0.0 and cycles.sample_clamp_indirect == 10.0
        if usual:
            general.append("clamping of indirect light at 10")
        else:
            log.warn("scene", f"clamping of samples is left out ({values})")
    if cycles.blur_glossy == 1.0:
        general.append("filter glossy 1")
    elif cycles.blur_glossy:
        log.warn("scene", f"filter glossy {cycles.blur_glossy:g} is left out")
    lower = {kind: getattr(cycles, f"{kind}_bounces") for kind in _LIMITS
             if getattr(cycles, f"{kind}_bounces") < cycles.max_bounces}
    if lower:
        text = ", ".join(f"{kind} {n}" for kind, n in lower.items())
        if cycles.max_bounces == 12 and all(n == 4 for n in lower.values()) \
                and set(lower) <= {"diffuse", "glossy"}:
            general.append(f"bounce limits by kind ({text})")
        else:
            log.warn("scene", f"bounce limits by kind are left out ({text}): {cycles.max_bounces} for all")
    if cycles.use_denoising:
        log.general("scene", "Cycles' denoising is an option of `smithwalk render`: --denoise")
    seen.accept("cycles.sample_clamp_direct", "cycles.sample_clamp_indirect", "cycles.blur_glossy",
                "cycles.max_bounces", *(f"cycles.{kind}_bounces" for kind in _LIMITS))
    if general:
        log.general("scene", "Cycles' " + ", ".join(general) + " have no counterpart")

    for kind in ("reflective", "refractive"):
        if not getattr(cycles, f"caustics_{kind}"):
            log.warn("scene", f"{kind} caustics are off in Blender and are rendered here")
    if render.film_transparent and cycles.film_transparent_glass:
        log.warn("scene", "transparent glass is left out: glass is opaque on a transparent film")
    if render.use_motion_blur:
        log.warn("scene", "motion blur is left out")
    if getattr(cycles, "use_fast_gi", False):
        log.warn("scene", "fast global illumination is left out: all bounces are traced")
    seen.accept("cycles.caustics_reflective", "cycles.caustics_refractive", "cycles.film_exposure",
                "render.film_transparent", "render.use_motion_blur", "cycles.use_fast_gi")
    if render.use_simplify and (cycles.use_camera_cull or getattr(cycles, "use_distance_cull", False)):
        log.warn("scene", "culling by camera or distance is left out: more objects than in Blender")
    if render.use_simplify and getattr(cycles, "texture_limit_render", "OFF") != "OFF":
        log.warn("scene", f"the texture limit of {cycles.texture_limit_render} pixels is left out: whole images")
    if render.use_freestyle and view_layer.use_freestyle:
        log.warn("scene", "Freestyle's lines are left out")
    if composited:
        log.warn("scene", "the compositor is left out")
    if scene.sequence_editor and len(getattr(scene.sequence_editor, "strips",
                                             getattr(scene.sequence_editor, "sequences", ()))) \
            and render.use_sequencer and not by_engine:
        log.warn("scene", "the sequencer is left out")
    region = border(render)
    if region and not by_engine:
        log.warn("scene", "the render region is not part of a scene: the whole frame is written "
                          f"(render it with --crop {','.join(map(str, region))})")
    for what in audit.leftovers(scene):
        log.warn("scene", f"{what}: left out")
    layer = audit.view(view_layer)
    layer.accept("samples", "material_override", "world_override", "layer_collection", "use", "name")
    for what in audit.leftovers(view_layer):
        log.warn(f'view layer "{view_layer.name}"', f"{what}: left out")


def has_compositor(scene):
    """Whether compositing nodes would change the picture."""
    if not scene.render.use_compositing:
        return False
    tree = getattr(scene, "compositing_node_group", None)
    if tree is None and getattr(scene, "use_nodes", False):
        tree = getattr(scene, "node_tree", None)
    plain = {"R_LAYERS", "COMPOSITE", "VIEWER", "REROUTE", "GROUP_OUTPUT", "FRAME"}
    return tree is not None and any(n.type not in plain and not n.mute for n in tree.nodes)
