"""Blender's converter nodes on constants, as Cycles computes them.

`converter(node, read)` returns the value of a node's first output, or None
where the node is none of these. `read(name or index)` evaluates an input; it
raises `NotConstant` when that input varies.
"""

import math


class NotConstant(Exception):
    """An input varies over the surface."""


def luminance(rgb):
    """Rec. 709 luminance: Blender's conversion of a colour to a number."""
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]


def _clamp(x):
    return min(max(x, 0.0), 1.0)


def _lerp(a, b, t):
    return a + (b - a) * t


def safe_divide(a, b):
    """a / b, and 0 where b is."""
    return a / b if b != 0.0 else 0.0


def _power(a, b):
    if a < 0.0 and b != math.floor(b) or a == 0.0 and b < 0.0:
        return 0.0
    return a ** b


def _log(a, b):
    return math.log(a) / math.log(b) if a > 0.0 and b > 0.0 and b != 1.0 else 0.0


def _smooth_min(a, b, k):
    if k == 0.0:
        return min(a, b)
    h = max(k - abs(a - b), 0.0) / k
    return min(a, b) - h * h * h * k / 6.0


def _wrap(x, high, low):
    span = high - low
    return x - span * math.floor((x - low) / span) if span != 0.0 else low


def _ping_pong(x, scale):
    if scale == 0.0:
        return 0.0
    t = (x - scale) / (2.0 * scale)
    return abs((t - math.floor(t)) * scale * 2.0 - scale)


MATH = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: safe_divide(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: _power(a, b),
    "LOGARITHM": lambda a, b, c: _log(a, b),
    "SQRT": lambda a, b, c: math.sqrt(max(a, 0.0)),
    "INVERSE_SQRT": lambda a, b, c: 1.0 / math.sqrt(a) if a > 0.0 else 0.0,
    "ABSOLUTE": lambda a, b, c: abs(a),
    "EXPONENT": lambda a, b, c: math.exp(a),
    "MINIMUM": lambda a, b, c: min(a, b),
    "MAXIMUM": lambda a, b, c: max(a, b),
    "LESS_THAN": lambda a, b, c: float(a < b),
    "GREATER_THAN": lambda a, b, c: float(a > b),
    "SIGN": lambda a, b, c: float((a > 0.0) - (a < 0.0)),
    "COMPARE": lambda a, b, c: float(abs(a - b) <= max(c, 1e-5)),
    "SMOOTH_MIN": _smooth_min,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_min(-a, -b, c),
    "ROUND": lambda a, b, c: math.floor(a + 0.5),
    "FLOOR": lambda a, b, c: math.floor(a),
    "CEIL": lambda a, b, c: math.ceil(a),
    "TRUNC": lambda a, b, c: math.trunc(a),
    "FRACT": lambda a, b, c: a - math.floor(a),
    "MODULO": lambda a, b, c: math.fmod(a, b) if b != 0.0 else 0.0,
    "FLOORED_MODULO": lambda a, b, c: a - math.floor(a / b) * b if b != 0.0 else 0.0,
    "WRAP": _wrap,
    "SNAP": lambda a, b, c: math.floor(safe_divide(a, b)) * b,
    "PINGPONG": lambda a, b, c: _ping_pong(a, b),
    "SINE": lambda a, b, c: math.sin(a),
    "COSINE": lambda a, b, c: math.cos(a),
    "TANGENT": lambda a, b, c: math.tan(a),
    "ARCSINE": lambda a, b, c: math.asin(min(max(a, -1.0), 1.0)),
    "ARCCOSINE": lambda a, b, c: math.acos(min(max(a, -1.0), 1.0)),
    "ARCTANGENT": lambda a, b, c: math.atan(a),
    "ARCTAN2": lambda a, b, c: math.atan2(a, b),
    "SINH": lambda a, b, c: math.sinh(a),
    "COSH": lambda a, b, c: math.cosh(a),
    "TANH": lambda a, b, c: math.tanh(a),
    "RADIANS": lambda a, b, c: math.radians(a),
    "DEGREES": lambda a, b, c: math.degrees(a),
}
_UNARY = {"SQRT", "INVERSE_SQRT", "ABSOLUTE", "EXPONENT", "SIGN", "ROUND", "FLOOR", "CEIL", "TRUNC", "FRACT",
          "SINE", "COSINE", "TANGENT", "ARCSINE", "ARCCOSINE", "ARCTANGENT", "SINH", "COSH", "TANH", "RADIANS",
          "DEGREES"}
_TERNARY = {"MULTIPLY_ADD", "COMPARE", "SMOOTH_MIN", "SMOOTH_MAX", "WRAP"}


def _math(node, read):
    operation = MATH.get(node.operation)
    if operation is None:
        return None
    a = read(0)
    b = read(1) if node.operation not in _UNARY else 0.0
    c = read(2) if node.operation in _TERNARY else 0.0
    try:
        value = float(operation(a, b, c))
    except (ValueError, OverflowError, ZeroDivisionError):
        value = 0.0
    return _clamp(value) if node.use_clamp else value


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def _scaled(a, s):
    return tuple(x * s for x in a)


def _each(f):
    return lambda a, b, c, s: tuple(f(x, y, z) for x, y, z in zip(a, b, c))


def _reflect(a, b):
    n = _scaled(b, safe_divide(1.0, math.sqrt(_dot(b, b))))
    return tuple(x - 2.0 * _dot(a, n) * y for x, y in zip(a, n))


VECTOR_MATH = {
    "ADD": _each(lambda x, y, z: x + y),
    "SUBTRACT": _each(lambda x, y, z: x - y),
    "MULTIPLY": _each(lambda x, y, z: x * y),
    "DIVIDE": _each(lambda x, y, z: safe_divide(x, y)),
    "MULTIPLY_ADD": _each(lambda x, y, z: x * y + z),
    "MINIMUM": _each(lambda x, y, z: min(x, y)),
    "MAXIMUM": _each(lambda x, y, z: max(x, y)),
    "FLOOR": _each(lambda x, y, z: math.floor(x)),
    "CEIL": _each(lambda x, y, z: math.ceil(x)),
    "FRACTION": _each(lambda x, y, z: x - math.floor(x)),
    "ABSOLUTE": _each(lambda x, y, z: abs(x)),
    "MODULO": _each(lambda x, y, z: math.fmod(x, y) if y else 0.0),
    "WRAP": _each(_wrap),
    "SNAP": _each(lambda x, y, z: math.floor(safe_divide(x, y)) * y),
    "SINE": _each(lambda x, y, z: math.sin(x)),
    "COSINE": _each(lambda x, y, z: math.cos(x)),
    "TANGENT": _each(lambda x, y, z: math.tan(x)),
    "CROSS_PRODUCT": lambda a, b, c, s: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                         a[0] * b[1] - a[1] * b[0]),
    "PROJECT": lambda a, b, c, s: _scaled(b, safe_divide(_dot(a, b), _dot(b, b))),
    "REFLECT": lambda a, b, c, s: _reflect(a, b),
    "FACEFORWARD": lambda a, b, c, s: a if _dot(b, c) < 0.0 else _scaled(a, -1.0),
    "SCALE": lambda a, b, c, s: _scaled(a, s),
    "NORMALIZE": lambda a, b, c, s: _scaled(a, safe_divide(1.0, math.sqrt(_dot(a, a)))),
    "DOT_PRODUCT": lambda a, b, c, s: _dot(a, b),
    "DISTANCE": lambda a, b, c, s: math.dist(a, b),
    "LENGTH": lambda a, b, c, s: math.sqrt(_dot(a, a)),
}


def _vector_math(node, read):
    operation = VECTOR_MATH.get(node.operation)
    if operation is None:
        return None

    def enabled(i):
        return i < len(node.inputs) and node.inputs[i].enabled

    zero = (0.0, 0.0, 0.0)
    a, b, c = (tuple(read(i)) if enabled(i) else zero for i in range(3))
    return operation(a, b, c, read(3) if enabled(3) else 1.0)


def _per_channel(f):
    return lambda t, a, b: tuple(f(t, x, y) for x, y in zip(a, b))


def _overlay(t, a, b):
    if a < 0.5:
        return a * (1.0 - t + 2.0 * t * b)
    return 1.0 - (1.0 - t + 2.0 * t * (1.0 - b)) * (1.0 - a)


def _dodge(t, a, b):
    if a == 0.0:
        return 0.0
    rest = 1.0 - t * b
    return min(a / rest, 1.0) if rest > 0.0 else 1.0


def _burn(t, a, b):
    rest = 1.0 - t + t * b
    return _clamp(1.0 - (1.0 - a) / rest) if rest > 0.0 else 0.0


BLEND = {name: _per_channel(f) for name, f in {
    "MIX": lambda t, a, b: _lerp(a, b, t),
    "ADD": lambda t, a, b: a + t * b,
    "SUBTRACT": lambda t, a, b: a - t * b,
    "MULTIPLY": lambda t, a, b: _lerp(a, a * b, t),
    "DIVIDE": lambda t, a, b: (1.0 - t) * a + t * a / b if b != 0.0 else a,
    "SCREEN": lambda t, a, b: 1.0 - (1.0 - t + t * (1.0 - b)) * (1.0 - a),
    "OVERLAY": _overlay,
    "DIFFERENCE": lambda t, a, b: _lerp(a, abs(a - b), t),
    "EXCLUSION": lambda t, a, b: max(_lerp(a, a + b - 2.0 * a * b, t), 0.0),
    "DARKEN": lambda t, a, b: _lerp(a, min(a, b), t),
    "LIGHTEN": lambda t, a, b: _lerp(a, max(a, b), t),
    "DODGE": _dodge,
    "BURN": _burn,
    "LINEAR_LIGHT": lambda t, a, b: a + t * (2.0 * b - 1.0),
    "SOFT_LIGHT": lambda t, a, b: (1.0 - t) * a + t * ((1.0 - a) * b * a + a * (1.0 - (1.0 - b) * (1.0 - a))),
}.items()}


def _mix(node, read):
    """The Mix node (3.4 and newer): numbers, vectors or colours."""
    enabled = [i for i, s in enumerate(node.inputs) if s.enabled]
    factor, a, b = (read(i) for i in enabled[:3])
    if node.clamp_factor:
        factor = tuple(map(_clamp, factor)) if isinstance(factor, tuple) else _clamp(factor)
    if isinstance(a, float):
        return _lerp(a, b, factor)
    if node.data_type == "RGBA":
        blend = BLEND.get(node.blend_type)
        if blend is None:
            return None
        value = blend(factor, a, b)
        return tuple(map(_clamp, value)) if node.clamp_result else value
    t = factor if isinstance(factor, tuple) else (factor,) * 3
    return tuple(_lerp(x, y, z) for x, y, z in zip(a, b, t))


def _mix_rgb(node, read):
    blend = BLEND.get(node.blend_type)
    if blend is None:
        return None
    value = blend(_clamp(read(0)), read(1), read(2))
    return tuple(map(_clamp, value)) if node.use_clamp else value


def rgb_to_hsv(rgb):
    """Hue in turns, saturation, value; values above 1 keep."""
    high, low = max(rgb), min(rgb)
    delta = high - low
    s = delta / high if high > 0.0 else 0.0
    if s == 0.0:
        return 0.0, 0.0, high
    r, g, b = rgb
    if high == r:
        h = (g - b) / delta
    elif high == g:
        h = 2.0 + (b - r) / delta
    else:
        h = 4.0 + (r - g) / delta
    return (h / 6.0) % 1.0, s, high


def hsv_to_rgb(h, s, v):
    """The inverse of `rgb_to_hsv`."""
    weights = (_clamp(abs(h * 6.0 - 3.0) - 1.0), _clamp(2.0 - abs(h * 6.0 - 2.0)), _clamp(2.0 - abs(h * 6.0 - 4.0)))
    return tuple(((w - 1.0) * s + 1.0) * v for w in weights)


def _hue_saturation(node, read):
    hue, saturation, value, factor, color = (read(n) for n in ("Hue", "Saturation", "Value", "Fac", "Color"))
    h, s, v = rgb_to_hsv(color)
    changed = hsv_to_rgb((h + hue + 0.5) % 1.0, _clamp(s * saturation), v * value)
    return tuple(max(_lerp(c, d, factor), 0.0) for c, d in zip(color, changed))


def _bright_contrast(node, read):
    contrast = read("Contrast")
    offset = read("Bright") - 0.5 * contrast
    return tuple(max((1.0 + contrast) * c + offset, 0.0) for c in read("Color"))


def _gamma(node, read):
    gamma = read("Gamma")
    return tuple(c ** gamma if c > 0.0 else c for c in read("Color"))


def _invert(node, read):
    factor = read("Fac")
    return tuple(_lerp(c, 1.0 - c, factor) for c in read("Color"))


def _clamp_node(node, read):
    value, low, high = read("Value"), read("Min"), read("Max")
    if node.clamp_type == "RANGE" and low > high:
        low, high = high, low
    return min(max(value, low), high)


def _map(kind, x, from_low, from_high, to_low, to_high, steps):
    t = safe_divide(x - from_low, from_high - from_low)
    if kind == "STEPPED":
        t = math.floor(t * (steps + 1.0)) / steps if steps > 0.0 else 0.0
    elif kind == "SMOOTHSTEP":
        t = _clamp(t)
        t = t * t * (3.0 - 2.0 * t)
    elif kind == "SMOOTHERSTEP":
        t = _clamp(t)
        t = t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
    return to_low + t * (to_high - to_low)


def _map_range(node, read):
    vector = getattr(node, "data_type", "FLOAT") == "FLOAT_VECTOR"
    enabled = [i for i, s in enumerate(node.inputs) if s.enabled]
    values = [read(i) for i in enabled]
    kind = node.interpolation_type
    x, a, b, c, d = values[:5]
    steps = values[5] if kind == "STEPPED" else ((4.0,) * 3 if vector else 4.0)
    columns = list(zip(x, a, b, c, d, steps)) if vector else [(x, a, b, c, d, steps)]
    result = []
    for x, a, b, c, d, s in columns:
        y = _map(kind, x, a, b, c, d, s)
        if node.clamp and kind in {"LINEAR", "STEPPED"}:
            y = min(max(y, min(c, d)), max(c, d))
        result.append(y)
    return tuple(result) if vector else result[0]


def _color_ramp(node, read):
    return tuple(node.color_ramp.evaluate(read(0)))[:3]


def _curve_rgb(node, read):
    mapping = node.mapping
    mapping.initialize()
    factor, color = read(0), read(1)
    curves = mapping.curves
    changed = (mapping.evaluate(curves[i], mapping.evaluate(curves[3], c)) for i, c in enumerate(color))
    return tuple(_lerp(c, d, factor) for c, d in zip(color, changed))


def _curve_vector(node, read):
    mapping = node.mapping
    mapping.initialize()
    factor, vector = read(0), read(1)
    changed = (mapping.evaluate(mapping.curves[i], c) for i, c in enumerate(vector))
    return tuple(_lerp(c, d, factor) for c, d in zip(vector, changed))


def _curve_float(node, read):
    mapping = node.mapping
    mapping.initialize()
    factor, value = read(0), read(1)
    return _lerp(value, mapping.evaluate(mapping.curves[0], value), factor)


def _combine(node, read):
    mode = getattr(node, "mode", "RGB")
    parts = tuple(read(i) for i in range(3))
    if mode == "HSV":
        return hsv_to_rgb(*parts)
    return parts if mode == "RGB" else None


def blackbody(kelvin):
    """Linear Rec. 709 colour of a black body, of luminance 1.

    Planck's law over the CIE 1931 observer in the analytic fit of Wyman,
    Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color
    Matching Functions" (JCGT 2, 2013).
    """
    def bump(x, mean, below, above):
        t = (x - mean) / (below if x < mean else above)
        return math.exp(-0.5 * t * t)

    kelvin = max(kelvin, 800.0)
    xyz = [0.0, 0.0, 0.0]
    for nm in range(380, 781, 5):
        power = nm ** -5.0 / math.expm1(1.438776877e7 / (nm * kelvin))
        x = 1.056 * bump(nm, 599.8, 37.9, 31.0) + 0.362 * bump(nm, 442.0, 16.0, 26.7) \
            - 0.065 * bump(nm, 501.1, 20.4, 26.2)
        y = 0.821 * bump(nm, 568.8, 46.9, 40.5) + 0.286 * bump(nm, 530.9, 16.3, 31.1)
        z = 1.217 * bump(nm, 437.0, 11.8, 36.0) + 0.681 * bump(nm, 459.0, 26.0, 13.8)
        xyz = [s + power * m for s, m in zip(xyz, (x, y, z))]
    x, y, z = (v / xyz[1] for v in xyz)
    return (3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
            -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
            0.0556434 * x - 0.2040259 * y + 1.0572252 * z)


def _blackbody(node, read):
    return blackbody(read(0))


_CONVERTERS = {
    "MATH": _math,
    "VECT_MATH": _vector_math,
    "MIX": _mix,
    "MIX_RGB": _mix_rgb,
    "HUE_SAT": _hue_saturation,
    "BRIGHTCONTRAST": _bright_contrast,
    "GAMMA": _gamma,
    "INVERT": _invert,
    "CLAMP": _clamp_node,
    "MAP_RANGE": _map_range,
    "VALTORGB": _color_ramp,
    "CURVE_RGB": _curve_rgb,
    "CURVE_VEC": _curve_vector,
    "CURVE_FLOAT": _curve_float,
    "COMBRGB": _combine,
    "COMBINE_COLOR": _combine,
    "COMBXYZ": _combine,
    "BLACKBODY": _blackbody,
}


def converter(node, read):
    """The folded value of a converter node's first output, or None for other nodes."""
    fold = _CONVERTERS.get(node.type)
    return fold(node, read) if fold else None
