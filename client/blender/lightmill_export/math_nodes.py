"""Nodes that compute values. They act on constants and on texels."""
import colorsys
import math

import numpy as np

from .values import Value, constant, luminance

MATH = {
    "ADD": lambda a, b, c: a + b, "SUBTRACT": lambda a, b, c: a - b, "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: np.where(b == 0, 0, a / np.where(b == 0, 1, b)), "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: np.power(np.maximum(a, 0), b), "LOGARITHM": lambda a, b, c: np.log(a) / np.log(b),
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)), "INVERSE_SQRT": lambda a, b, c: 1 / np.sqrt(a),
    "ABSOLUTE": lambda a, b, c: np.abs(a), "EXPONENT": lambda a, b, c: np.exp(a), "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b), "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0, "SIGN": lambda a, b, c: np.sign(a),
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)) * 1.0, "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a), "CEIL": lambda a, b, c: np.ceil(a), "TRUNC": lambda a, b, c: np.trunc(a),
    "FRACT": lambda a, b, c: a - np.floor(a), "MODULO": lambda a, b, c: np.where(b == 0, 0, np.fmod(a, np.where(b == 0, 1, b))),
    "SINE": lambda a, b, c: np.sin(a), "COSINE": lambda a, b, c: np.cos(a), "TANGENT": lambda a, b, c: np.tan(a),
    "ARCSINE": lambda a, b, c: np.arcsin(np.clip(a, -1, 1)), "ARCCOSINE": lambda a, b, c: np.arccos(np.clip(a, -1, 1)),
    "ARCTANGENT": lambda a, b, c: np.arctan(a), "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "RADIANS": lambda a, b, c: np.radians(a), "DEGREES": lambda a, b, c: np.degrees(a),
}

BLENDS = {
    "MIX": lambda a, b: b, "ADD": lambda a, b: a + b, "MULTIPLY": lambda a, b: a * b, "SUBTRACT": lambda a, b: a - b,
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b), "DIFFERENCE": lambda a, b: np.abs(a - b), "DARKEN": np.minimum,
    "LIGHTEN": np.maximum, "OVERLAY": lambda a, b: np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b)),
    "DIVIDE": lambda a, b: np.where(b == 0, a, a / np.where(b == 0, 1, b)),
    "EXCLUSION": lambda a, b: np.maximum(a + b - 2 * a * b, 0),
}


def read_math(reader, node, _output):
    operation = node.node.operation
    if operation not in MATH:
        reader.notices.node(node.node, f"{operation} is not supported. Its first value is used")
        return reader.scalar(node.input(0))
    values = [reader.scalar(node.input(i)) for i in range(len(node.node.inputs))]
    values += [constant(0.0)] * (3 - len(values))
    if operation == "MULTIPLY" and not node.node.use_clamp:
        return reader.multiply(values[0], values[1], node.node)
    out = reader.combine(MATH[operation], values, node.node)
    return reader.combine(lambda a: np.clip(a, 0, 1), [out], node.node) if node.node.use_clamp else out


def mix(reader, node, factor, a, b, blend, clamp):
    """Blends from `a` (factor 0) to `b` (factor 1)."""
    if blend not in BLENDS:
        reader.notices.node(node, f"{blend} is not supported. It is treated as MIX")
        blend = "MIX"
    if blend == "MULTIPLY" and not clamp and factor.is_constant() and np.all(factor.rgb == 1):
        return reader.multiply(a, b, node)
    if factor.is_constant() and np.all(factor.rgb == 0):
        return a
    if blend == "MIX" and factor.is_constant() and np.all(factor.rgb == 1):
        return b
    f = BLENDS[blend]
    out = reader.combine(lambda t, x, y: (1 - t) * x + t * f(x, y), [factor, a, b], node)
    return reader.combine(lambda x: np.clip(x, 0, 1), [out], node) if clamp else out


def clamped(reader, value, node):
    if value.is_constant():
        return Value(np.clip(value.rgb, 0, 1))
    return value  # of texels in [0, 1]


def read_mix_rgb(reader, node, _output):
    factor = clamped(reader, reader.scalar(node.input(0)), node.node)
    return mix(reader, node.node, factor, reader.color(node.input(1)), reader.color(node.input(2)), node.node.blend_type,
               node.node.use_clamp)


def read_mix(reader, node, _output):
    n = node.node
    enabled = [i for i, socket in enumerate(n.inputs) if socket.enabled]
    factor, a, b = (node.input(i) for i in enabled[:3])
    factor = reader.scalar(factor) if n.data_type != "VECTOR" or n.factor_mode == "UNIFORM" else reader.color(factor)
    if n.clamp_factor:
        factor = clamped(reader, factor, n)
    if n.data_type == "FLOAT":
        return mix(reader, n, factor, reader.scalar(a), reader.scalar(b), "MIX", False)
    color = n.data_type == "RGBA"
    return mix(reader, n, factor, reader.color(a), reader.color(b), n.blend_type if color else "MIX", color and n.clamp_result)


def read_invert(reader, node, _output):
    return reader.combine(lambda t, c: c + t * (1 - 2 * c), [reader.scalar(node.input("Fac", "Factor")),
                                                            reader.color(node.input("Color"))], node.node)


def read_gamma(reader, node, _output):
    return reader.combine(lambda c, g: np.where(c > 0, np.power(np.maximum(c, 1e-30), g), c),
                          [reader.color(node.input("Color")), reader.scalar(node.input("Gamma"))], node.node)


def read_bright_contrast(reader, node, _output):
    return reader.combine(lambda c, bright, contrast: np.maximum((1 + contrast) * c + bright - contrast * 0.5, 0),
                          [reader.color(node.input("Color")), reader.scalar(node.input("Bright", "Brightness")),
                           reader.scalar(node.input("Contrast"))], node.node)


def each_color(function):
    """Applies a function of one colour to arrays. Equal colours are computed once."""
    def over_arrays(rgb):
        flat, back = np.unique(np.asarray(rgb, dtype=float).reshape(-1, 3), axis=0, return_inverse=True)
        return np.array([function(*c) for c in flat])[back.reshape(-1)].reshape(np.shape(rgb))
    return over_arrays


def read_hue_saturation(reader, node, _output):
    hue, saturation, value, factor = (reader.number(node.input(*names), node.node)
                                      for names in (("Hue",), ("Saturation",), ("Value",), ("Fac", "Factor")))

    def change(r, g, b):
        h, s, v = colorsys.rgb_to_hsv(r, g, b)
        changed = colorsys.hsv_to_rgb((h + hue + 0.5) % 1.0, min(max(s * saturation, 0), 1), v * value)
        return [max((1 - factor) * old + factor * new, 0) for old, new in zip((r, g, b), changed)]
    return reader.combine(each_color(change), [reader.color(node.input("Color"))], node.node)


def by_table(evaluate):
    """A function of numbers in [0, 1] as a table of 256 steps, as Cycles has it."""
    table = np.array([evaluate(i / 255)[:3] for i in range(256)])

    def look_up(number):
        at = np.clip(number[..., 0], 0, 1) * 255
        low = np.minimum(at.astype(int), 254)
        return table[low] + (table[low + 1] - table[low]) * (at - low)[..., None]
    return look_up


def read_color_ramp(reader, node, output):
    if output.name == "Alpha":
        return reader.combine(by_table(lambda x: [node.node.color_ramp.evaluate(x)[3]] * 3),
                              [reader.scalar(node.input("Fac", "Factor"))], node.node)
    value = reader.scalar(node.input("Fac", "Factor"))
    if value.is_constant():  # the table has steps
        return constant(*node.node.color_ramp.evaluate(float(np.clip(value.rgb[0], 0, 1)))[:3])
    return reader.combine(by_table(node.node.color_ramp.evaluate), [value], node.node)


def read_curves(reader, node, _output):
    mapping = node.node.mapping
    mapping.update()
    curves = mapping.curves
    if node.node.type == "CURVE_FLOAT":
        def shape(x):
            return [mapping.evaluate(curves[0], x)] * 3
        value = reader.scalar(node.input("Value"))
        curved = reader.combine(by_table(shape), [value], node.node)
    else:
        def curve(channel):
            return by_table(lambda x: [mapping.evaluate(curves[channel], mapping.evaluate(curves[3], x))] * 3)
        tables = [curve(i) for i in range(3)]
        value = reader.color(node.input("Color"))
        curved = reader.combine(lambda c: np.stack([tables[i](c[..., i:i + 1])[..., 0] for i in range(3)], axis=-1), [value],
                                node.node)
    return mix(reader, node.node, reader.scalar(node.input("Fac", "Factor")), value, curved, "MIX", False)


def read_clamp(reader, node, _output):
    swap = node.node.clamp_type == "RANGE"
    return reader.combine(lambda x, a, b: np.clip(x, np.minimum(a, b), np.maximum(a, b)) if swap
                          else np.minimum(np.maximum(x, a), b),
                          [reader.scalar(node.input(i)) for i in range(3)], node.node)


def read_map_range(reader, node, _output):
    n = node.node
    if n.data_type != "FLOAT" or n.interpolation_type != "LINEAR":
        n_kind = n.interpolation_type if n.data_type == "FLOAT" else n.data_type
        reader.notices.node(n, f"{n_kind} is not supported. It is treated as LINEAR")
    value, low, high, to_low, to_high = (reader.scalar(node.input(i)) for i in range(5))
    out = reader.combine(lambda x, a, b, c, d: np.where(b == a, 0, c + (x - a) / np.where(b == a, 1, b - a) * (d - c)),
                         [value, low, high, to_low, to_high], n)
    if not n.clamp:
        return out
    return reader.combine(lambda x, c, d: np.clip(x, np.minimum(c, d), np.maximum(c, d)), [out, to_low, to_high], n)


def read_combine(reader, node, _output):
    mode = getattr(node.node, "mode", {"COMBHSV": "HSV"}.get(node.node.type, "RGB"))
    to_rgb = {"HSV": colorsys.hsv_to_rgb, "HSL": lambda h, s, v: colorsys.hls_to_rgb(h, v, s)}.get(mode)
    joined = reader.combine(lambda r, g, b: np.stack(np.broadcast_arrays(r[..., 0], g[..., 0], b[..., 0]), axis=-1),
                            [reader.scalar(node.input(i)) for i in range(3)], node.node)
    return joined if to_rgb is None else reader.combine(each_color(to_rgb), [joined], node.node)


def read_separate(reader, node, output):
    mode = getattr(node.node, "mode", {"SEPHSV": "HSV"}.get(node.node.type, "RGB"))
    value = reader.color(node.input(0))
    index = list(node.node.outputs).index(output)

    def hsl(r, g, b):
        h, light, s = colorsys.rgb_to_hls(r, g, b)
        return h, s, light
    to_parts = {"HSV": colorsys.rgb_to_hsv, "HSL": hsl}.get(mode)
    if to_parts is None and value.image is not None and value.image.channel == "COLOR" and value.colors is None:
        return Value(np.full(3, value.rgb[index]), value.image.as_channel("RGB"[index]))
    parts = value if to_parts is None else reader.combine(each_color(to_parts), [value], node.node)
    return reader.combine(lambda c: np.repeat(c[..., index:index + 1], 3, axis=-1), [parts], node.node)


def read_blackbody(reader, node, _output):
    kelvin = reader.number(node.input("Temperature"), node.node)
    return constant(*blackbody(kelvin))


def blackbody(kelvin):
    """Rec. 709 colour of luminance 1: Planck's law over fits of the CIE observer (Wyman, Sloan and Shirley 2013)."""
    nm = np.arange(380.0, 781.0, 5.0)
    power = nm ** -5.0 / np.expm1(1.4387769e7 / (nm * max(kelvin, 800.0)))

    def lobe(mean, low, high):
        return np.exp(-0.5 * ((nm - mean) * np.where(nm < mean, low, high)) ** 2)
    x = 0.362 * lobe(442, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437, 0.0845, 0.0278) + 0.681 * lobe(459, 0.0385, 0.0725)
    xyz = np.array([(power * f).sum() for f in (x, y, z)])
    rgb = np.array(((3.2404542, -1.5371385, -0.4985314), (-0.9692660, 1.8760108, 0.0415560),
                    (0.0556434, -0.2040259, 1.0572252))) @ (xyz / xyz[1])
    return np.maximum(rgb, 0)


def mean_over_hemisphere(function):
    """The cosine-weighted mean of a function of the cosine, as uniform light shows it."""
    cosines = (np.arange(256) + 0.5) / 256
    return float(sum(2 * c * function(c) for c in cosines) / 256)


def fresnel(cosine, ior):
    g2 = ior * ior - 1 + cosine * cosine
    if g2 <= 0:
        return 1.0
    g = math.sqrt(g2)
    a, b = (g - cosine) / (g + cosine), (cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1)
    return 0.5 * a * a * (1 + b * b)


def read_view_dependent(reader, node, output):
    n = node.node
    if n.type == "FRESNEL":
        ior = max(reader.number(node.input("IOR"), n), 1e-5)
        value = mean_over_hemisphere(lambda c: fresnel(c, ior))
    else:
        blend = min(max(reader.number(node.input("Blend"), n), 0.0), 1 - 1e-5)
        exponent = 2 * blend if blend < 0.5 else 0.5 / (1 - blend)
        value = (mean_over_hemisphere(lambda c: fresnel(c, 1 / max(1 - blend, 1e-5))) if output.name == "Fresnel"
                 else mean_over_hemisphere(lambda c: 1 - c ** exponent))
    reader.notices.node(n, f"it depends on the view. Its mean {value:.3f} is used")
    return constant(value)


def read_light_path(reader, node, output):
    reader.notices.node(node.node, f"{output.name} is treated as 0 for all rays")
    return constant(0.0)


def read_constant(_reader, node, _output):
    value = node.node.outputs[0].default_value
    return constant(value) if node.node.type == "VALUE" else constant(*value[:3])


def read_grey(reader, node, _output):
    return reader.scalar(node.input("Color"))


COMPUTED = {
    "VALUE": read_constant, "RGB": read_constant, "MATH": read_math, "MIX_RGB": read_mix_rgb, "MIX": read_mix,
    "INVERT": read_invert, "GAMMA": read_gamma, "BRIGHTCONTRAST": read_bright_contrast, "HUE_SAT": read_hue_saturation,
    "VALTORGB": read_color_ramp, "CURVE_RGB": read_curves, "CURVE_FLOAT": read_curves, "CLAMP": read_clamp,
    "MAP_RANGE": read_map_range, "RGBTOBW": read_grey, "BLACKBODY": read_blackbody, "FRESNEL": read_view_dependent,
    "LAYER_WEIGHT": read_view_dependent, "LIGHT_PATH": read_light_path, "COMBRGB": read_combine, "COMBXYZ": read_combine,
    "COMBHSV": read_combine, "COMBINE_COLOR": read_combine, "SEPRGB": read_separate, "SEPXYZ": read_separate,
    "SEPHSV": read_separate, "SEPARATE_COLOR": read_separate,
}
