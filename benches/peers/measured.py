#!/usr/bin/env python3
"""Holds a measured material that we write against our own render of it, in Mitsuba 3.

    PYTHONPATH=<mitsuba> python3 benches/peers/measured.py -o DIR [--smithwalk BIN] [--alpha A]

Writes the gold sphere's material with `smithwalk bsdf table` (RGL's tensors), renders the
scene with it by Mitsuba's `measured` and with the model by smithwalk, and compares the
means of the pixels in which the sphere is. The same with a sphere of Lambert's law says
what else differs between the renderers. Before that it looks at how well the table is
interpolated: the albedo that Mitsuba's plugin has at angles between the table's, by
quadrature, against `smithwalk bsdf albedo`. Needs mitsuba and PyYAML.
"""

import argparse
import json
import os
import sys

import mitsuba as mi
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.normpath(os.path.join(HERE, "..", ".."))
SCENE = os.path.join(ROOT, "scenes", "gold_sphere")
COLOR = [1.0, 0.71, 0.29]
COSINES = (0.95, 0.8, 0.6, 0.4, 0.25, 0.15)

sys.path.insert(0, os.path.dirname(HERE))
from command import run  # noqa: E402


def albedos(bsdf, cosines, side):
    """What `bsdf` gives back at each cosine, by `side`² midpoints of the hemisphere."""
    middle = (np.arange(side) + 0.5) / side
    cos, phi = (a.ravel() for a in np.meshgrid(middle, 2.0 * np.pi * middle))
    sin = np.sqrt(1.0 - cos * cos)
    out = mi.Vector3f(sin * np.cos(phi), sin * np.sin(phi), cos)
    found = []
    for c in cosines:
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(float(np.sqrt(1.0 - c * c)), 0.0, float(c))
        value = np.array(bsdf.eval(mi.BSDFContext(), si, out)).reshape(3, -1)
        found.append(value.mean(axis=1) * 2.0 * np.pi)
    return np.array(found)


def main():
    """The table, then the sphere."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--alpha", type=float, default=0.5)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    args = parser.parse_args()
    os.makedirs(args.output, exist_ok=True)
    table = os.path.join(args.output, "gold.bsdf")
    material = f"conductor: {{alpha: {args.alpha}, color: {COLOR}}}"
    run([args.smithwalk, "bsdf", "table", "--material", material, "-o", table])
    mi.set_variant(args.variant)
    from mitsuba_worker import Translation

    measured = {"type": "measured", "filename": table}
    theirs = albedos(mi.load_dict(measured), COSINES, 512)
    rows = json.loads(run([args.smithwalk, "bsdf", "albedo", "--material", material, "--samples", "1000000",
                           "--cos", ",".join(map(str, COSINES))]))
    print("cosθ   albedo of the table, of the model, relative difference (green)")
    for cos, their, row in zip(COSINES, theirs, rows):
        ours = row["r"][1]
        print(f"{cos:4}   {their[1]:.5f}   {ours:.5f} ± {row['r_se'][1]:.5f}   {their[1] / ours - 1:+.3%}")
    worst = max(abs(their[1] / row["r"][1] - 1.0) for their, row in zip(theirs, rows))
    print(f"interpolation error: {worst:.3%} of the albedo at the most")

    for what, ours, theirs in (
        ("gold", f"{{conductor: {{color: {COLOR}, alpha: {args.alpha}}}}}", measured),
        ("Lambert", f"{{diffuse: {{color: {COLOR}}}}}",
         {"type": "diffuse", "reflectance": {"type": "rgb", "value": COLOR}}),
    ):
        class Changed(Translation):
            """The scene with another material on the sphere."""

            def bsdf(self, name, other=theirs):
                return other if name == "gold" else super().bsdf(name)

        path = os.path.join(args.output, f"{what}.exr")
        run([args.smithwalk, "render", os.path.join(SCENE, "scene.yaml"), "--spp", str(args.spp),
             "-D", f"materials.gold={ours}", "-o", path])
        ours = np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))
        parts = Changed(SCENE, "multijitter").scene()
        theirs = np.array(mi.render(mi.load_dict(parts), spp=args.spp, seed=7))
        parts["integrator"] = {"type": "aov", "aovs": "shape:shape_index"}
        shapes = np.array(mi.render(mi.load_dict(parts), spp=1))[:, :, -1]
        sphere = shapes == shapes[shapes.shape[0] // 2, shapes.shape[1] // 2]
        a, b = ours[sphere].mean(axis=0), theirs[sphere].mean(axis=0)
        print(f"mean of the sphere, {what}: smithwalk {np.round(a, 5)}, Mitsuba {np.round(b, 5)}, "
              f"Mitsuba/smithwalk − 1: {', '.join(f'{x:+.3%}' for x in b / a - 1.0)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
