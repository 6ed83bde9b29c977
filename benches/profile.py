#!/usr/bin/env python3
"""Where a render's time goes, by the parts of the program.

    benches/profile.py [--smithwalk BINARY] [--spp N] [SCENE]...

Runs `perf record` on a render of each scene and counts samples by the source
line they fell on. A line of another crate, or of the standard library, that was
inlined counts for the innermost line of ours that it was inlined into, but for
random numbers, which are other crates' work. Time in the kernel is left out.
Release builds have the line tables this needs; `perf` and `llvm-addr2line`, or
binutils' slower `addr2line`, do the rest. Prints a table for docs/speed.md.
"""

import argparse
import bisect
import collections
import os
import re
import shutil
import subprocess
import tempfile

from command import run

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
SCENES = ("gold_sphere", "interior", "rough_glass", "brushed_metal")

# Rows, and the libraries, crates and folders or files of src/ that belong to each.
PARTS = (
    ("Embree", ("libembree", "libtbb")),
    ("hand-over to Embree", ("src/embree/",)),
    ("microsurface and BSDFs", ("crates/model/src/", "src/bsdf/")),
    ("mathematical functions (libm)", ("libm.so", "libm-", "/libm/")),
    ("random numbers", ("src/sampler/", "sobol_burley-", "rand_pcg-", "rand-", "rand_core-")),
    ("lights", ("src/light/",)),
    ("surfaces, materials, textures", ("src/scene/", "src/texture/")),
    ("paths", ("src/integrator/", "src/color.rs")),
    ("camera and film", ("src/camera.rs", "src/film/")),
    ("copying memory (libc)", ("libc.so", "libc-")),
)
REST = "the rest"


def samples(data):
    """Library and file offset of every sample, None where it fell on no file."""
    mappings, found = {}, []
    mapping = re.compile(r"PERF_RECORD_MMAP2? .*: "
                         r"\[0x([0-9a-f]+)\(0x([0-9a-f]+)\) @ (?:0x)?([0-9a-f]+) .*\]: \S+ (\S+)")
    for line in run(["perf", "script", "-i", data, "-F", "ip", "--show-mmap-events"]).splitlines():
        if event := mapping.search(line):
            start, length, offset = (int(text, 16) for text in event.groups()[:3])
            mappings[start] = (start + length, offset, event[4])
        elif re.fullmatch(r"\s*[0-9a-f]+\s*", line):
            found.append(int(line, 16))
    starts = sorted(mappings)
    for address in found:
        index = bisect.bisect(starts, address) - 1
        end, offset, path = mappings[starts[index]] if index >= 0 else (0, 0, "")
        inside = address < end
        yield (path, address - starts[index] + offset) if inside else (None, 0)


def segments(binary):
    """File offset, size and address of what is loaded from a binary."""
    text = run(["readelf", "--segments", "--wide", binary])
    rows = re.findall(r"^\s*LOAD\s+0x(\w+)\s+0x(\w+)\s+0x\w+\s+0x(\w+)", text, re.MULTILINE)
    return [(int(offset, 16), int(size, 16), int(address, 16)) for offset, address, size in rows]


def source_files(binary, offsets):
    """For each file offset the source files of its line, innermost inlined one first."""
    loaded = segments(binary)
    addresses = {}
    for offset in offsets:
        for begin, size, address in loaded:
            if begin <= offset < begin + size:
                addresses[offset - begin + address] = offset
    tool = shutil.which("llvm-addr2line") or "addr2line"
    asked = "".join(f"{address:#x}\n" for address in addresses)
    said = subprocess.run([tool, "-a", "-i", "-e", binary], input=asked, capture_output=True, text=True, check=True)
    files, current = {}, []
    for line in said.stdout.splitlines():
        if re.fullmatch(r"0x[0-9a-f]+", line):
            current = files.setdefault(addresses[int(line, 16)], [])
        else:
            current.append(line)
    return files


def part_of(names):
    """The row of the first name that belongs to one."""
    for name in names:
        for part, marks in PARTS:
            if any(mark in name for mark in marks):
                return part
    return REST


def profile(args, scene, folder):
    """Share of each part in the samples of a render."""
    data = os.path.join(folder, "perf.data")
    run(["perf", "record", "-q", "-e", "cpu-clock:u", "-F", "997", "-o", data, "--",
         args.smithwalk, "render", os.path.join(ROOT, "scenes", scene, "scene.yaml"),
         "--spp", str(args.spp), "-o", os.path.join(folder, "out.exr")])
    counts = collections.Counter(samples(data))
    binary = os.path.realpath(args.smithwalk)
    ours = [offset for path, offset in counts if path and os.path.realpath(path) == binary]
    files = source_files(binary, ours)
    parts = collections.Counter()
    for (path, offset), count in counts.items():
        library = [os.path.basename(path)] if path else []
        is_ours = path and os.path.realpath(path) == binary
        names = files.get(offset, []) if is_ours else library
        parts[part_of(names)] += count
    total = sum(parts.values())
    return {part: 100.0 * count / total for part, count in parts.items()}, total


def main():
    """Parse, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES, metavar="SCENE", help="names of scenes/")
    parser.add_argument("--smithwalk", default=os.path.join(ROOT, "target", "release", "smithwalk"))
    parser.add_argument("--spp", type=int, default=32, help="samples per pixel")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        columns = [profile(args, scene, folder) for scene in args.scenes]
    print(f"| percent of the time | {' | '.join(args.scenes)} |")
    print("|---|" + "---|" * len(columns))
    for part in [*(part for part, _ in PARTS), REST]:
        print(f"| {part} | {' | '.join(f'{shares.get(part, 0.0):.1f}' for shares, _ in columns)} |")
    print(f"| samples | {' | '.join(str(total) for _, total in columns)} |")


if __name__ == "__main__":
    main()
