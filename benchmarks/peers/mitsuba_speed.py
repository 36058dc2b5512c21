#!/usr/bin/env python3
"""Samples per second against Mitsuba 3 on the same scenes, `uniform` choice of light, direct light only.

    pip install mitsuba numpy                     (and DRJIT_LIBLLVM_PATH, if Dr.Jit does not find LLVM itself)
    cargo build --release
    python3 benchmarks/peers/mitsuba_speed.py [--manylight target/release/manylight] [--scenes one-light,points,rooms]
        [--repeats 5] [--passes 5] [--spp 64] [--size 256 192] [--threads 2] [--variant llvm_ad_rgb]

Each repeat renders `--passes` times with one and then with the other, so that both meet the same noise, and compares the
fastest of each. Prints one line per repeat, then least, median and greatest over the repeats. Millions of samples per
second by the clock, and per second and thread of the processors' time, which other work on the machine disturbs less;
ratio = manylight / Mitsuba. Times leave out loading, building and compiling.
"""

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path


def run(command):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


def manylight(arguments, scene, folder):
    """Samples per second of the clock, and per second of the processors' time."""
    stats = folder / "stats.json"

    def render(spp):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        run([arguments.manylight, "render", scene, "--sampler", "uniform", "--spp", spp,
             "--width", arguments.size[0], "--height", arguments.size[1], "--threads", arguments.threads,
             "--output", folder / "image.exr", "--stats", stats])
        return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before

    seconds, processor_seconds, start_seconds = [], [], []
    for _ in range(arguments.passes):
        processor_seconds.append(render(arguments.spp))
        seconds.append(json.loads(stats.read_text())["render_s"])
        # What loading and writing take, with one sample.
        start_seconds.append(render(1))
    pixels = arguments.size[0] * arguments.size[1]
    return (pixels * arguments.spp / min(seconds),
            pixels * (arguments.spp - 1) / (min(processor_seconds) - min(start_seconds)))


def mitsuba(arguments, scene, folder):
    """The same; the first pass, which compiles, is hardly ever the fastest."""
    lines = run([sys.executable, Path(__file__).parent / "mitsuba_run.py", scene, folder / "image.npy",
                 "--spp", arguments.spp, "--size", *arguments.size, "--passes", arguments.passes,
                 "--threads", arguments.threads, "--variant", arguments.variant])
    best = json.loads(lines.splitlines()[-1])
    samples = arguments.size[0] * arguments.size[1] * arguments.spp
    return samples / best["best_pass_s"], samples / best["best_pass_processor_s"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--manylight", default="target/release/manylight")
    parser.add_argument("--scenes", default="one-light,points,rooms")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--passes", type=int, default=5)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--size", type=int, nargs=2, default=(256, 192))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    arguments = parser.parse_args()
    print("scene\trepeat\tmitsuba\tmanylight\tratio\tmitsuba_processor\tmanylight_processor\tratio_processor")
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for name in arguments.scenes.split(","):
            scene = folder / f"{name}.glb"
            run([arguments.manylight, "info", f"demo:{name}", "--export", scene])
            rows = []
            for repeat in range(arguments.repeats):
                pairs = zip(mitsuba(arguments, scene, folder), manylight(arguments, scene, folder))
                rows.append([x for theirs, ours in pairs for x in (theirs * 1e-6, ours * 1e-6, ours / theirs)])
                print(name, repeat, *(f"{x:.2f}" for x in rows[-1]), sep="\t", flush=True)
            for label, pick in (("least", min), ("median", statistics.median), ("greatest", max)):
                print(name, label, *(f"{pick(column):.2f}" for column in zip(*rows)), sep="\t", flush=True)


if __name__ == "__main__":
    main()
