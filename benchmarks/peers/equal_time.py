"""How noisy are manylight, Mitsuba 3, Cycles and LuxCore after the same time on the same scene?

    python equal_time.py --manylight PROGRAM [--cycles-python PYTHON] [--lux-python PYTHON] [--scenes rooms,points,...] [--seconds 5] -o DIR

Exports each generated scene and renders its direct light with each program on 2 threads, three seeds in turn. Learning and LuxCore's cache
count as time; loading, acceleration structures and Cycles' light tree do not. A peer renders for a moment first, to learn
how many samples it makes in the time. Errors are relMSE without the worst 0.1 % of the pixels, against two independent halves of a reference
by manylight's `exact` (kept in DIR/references), medians over the seeds. Writes equal_time.json and prints a table.
Needs `pip install mitsuba numpy`; Cycles and LuxCore need a Python of their own with `pip install bpy==5.0.1 numpy`, `pip install pyluxcore numpy`.
"""
import argparse
import json
import math
import pathlib
import statistics
import subprocess
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
HERE = pathlib.Path(__file__).parent
SIZE = (256, 192)
LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
SEEDS = range(3)
LEARN_SPP = 16


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


def exr(path):
    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False), np.float64)


def error(image, halves):
    """Cross product of two halves, relative to their mean: the noise of a good reference adds next to no offset."""
    x, a, b = (np.asarray(i, np.float64)[..., :3] @ LUMINANCE for i in (image, *halves))
    r = (a + b) / 2
    relative = ((x - a) * (x - b) / (r**2 + 1e-2 * r.mean() ** 2)).ravel()
    kept = relative[np.argsort(np.abs(relative))][: relative.size - relative.size // 1000]
    return float(kept.mean())


def halves(args, scene):
    folder = args.out / "references"
    folder.mkdir(exist_ok=True)
    for half, seed in (("a", 900), ("b", 901)):
        if not (folder / f"{scene}-{half}.exr").exists():
            ours(args, f"demo:{scene}", folder / f"{scene}-{half}.exr", "--sampler", "exact", "--spp", args.reference_spp // 2, "--seed", seed)
    return [exr(folder / f"{scene}-{half}.exr") for half in "ab"]


def ours(args, scene, out, *options):
    stats = out.with_suffix(".json")
    run(args.manylight, "render", scene, "-o", out, "--stats", stats, "--max-bounces", 0, "--threads", 2, "--width", SIZE[0], "--height", SIZE[1], *options)
    return json.loads(stats.read_text())


def manylight(args, glb, work, sampler):
    for seed in SEEDS:
        told = ours(args, glb, work / "ours.exr", "--sampler", sampler, "--time", args.seconds, "--seed", seed)
        yield exr(work / "ours.exr"), told["spp"], told["render_s"] + told["light_build_s"]


def mitsuba(args, glb, work):
    def render(spp, passes, seed):
        told = run(sys.executable, HERE / "mitsuba_run.py", glb, work / "mitsuba.npy", "--spp", spp, "--passes", passes, "--seed", seed, "--size", *SIZE)
        return json.loads(told.splitlines()[-1])

    # Of two passes the first may compile. A pass costs something whatever its samples, so the speed is measured again at about the number wanted.
    spp = LEARN_SPP
    for _ in range(3):
        measured, seconds = spp, render(spp, 2, 0)["best_pass_s"]
        spp = max(1, round(spp * args.seconds / seconds))
    for seed in SEEDS:
        render(spp, 1, 1000 * (seed + 1))
        yield np.load(work / "mitsuba.npy"), spp, seconds * spp / measured


def cycles(args, glb, work):
    def render(spp, seed):
        told = run(args.cycles_python, HERE / "cycles_run.py", glb, work / "cycles", "--spp", spp, "--seed", seed, "--size", f"{SIZE[0]}x{SIZE[1]}")
        return json.loads(next(line for line in reversed(told.splitlines()) if line.startswith("{")))

    spp = max(1, round(LEARN_SPP * args.seconds / render(LEARN_SPP, 9)["render_s"]))
    for seed in SEEDS:
        told = render(spp, seed)
        yield np.load(work / f"cycles-{spp}-{seed}.npy"), spp, told["render_s"]


def luxcore(args, glb, work):
    def render(spp, count):
        told = run(args.lux_python, HERE / "lux_run.py", glb, work / "lux", "--spp", f"{spp}x{count}", "--size", f"{SIZE[0]}x{SIZE[1]}", "--engine", "PATHCPU", "--strategy", "DLS_CACHE")
        return [json.loads(line) for line in told.splitlines() if line.startswith("{")]

    first = render(LEARN_SPP, 1)[0]
    left = max(args.seconds - first["cache_s"], 0.1 * args.seconds)
    spp = max(1, math.floor(LEARN_SPP * left / first["render_s"]))
    for seed, told in enumerate(render(spp, len(SEEDS))):
        yield np.load(work / f"lux-{spp}-{seed}.npy"), told["spp_done"], told["cache_s"] + told["render_s"]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--manylight", required=True)
    p.add_argument("--cycles-python")
    p.add_argument("--lux-python")
    p.add_argument("--scenes", default="rooms,points,keyhole,sun-outside")
    p.add_argument("--seconds", type=float, default=5)
    p.add_argument("--reference-spp", type=int, default=48)
    p.add_argument("-o", "--out", required=True, type=pathlib.Path)
    args = p.parse_args()
    work = args.out / "work"
    work.mkdir(parents=True, exist_ok=True)
    ways = {"manylight adaptive": lambda *a: manylight(*a, "adaptive"), "manylight tree": lambda *a: manylight(*a, "tree"), "Mitsuba": mitsuba}
    if args.cycles_python:
        ways["Cycles light tree"] = cycles
    if args.lux_python:
        ways["LuxCore DLS_CACHE"] = luxcore
    results = {}
    for scene in args.scenes.split(","):
        glb = work / f"{scene}.glb"
        run(args.manylight, "info", f"demo:{scene}", "--export", glb)
        reference = halves(args, scene)
        for name, way in ways.items():
            rows = [{"relmse_trimmed": error(image, reference), "spp": spp, "seconds": seconds} for image, spp, seconds in way(args, glb, work)]
            results.setdefault(scene, {})[name] = rows
            middle = {key: statistics.median(row[key] for row in rows) for key in rows[0]}
            print(f"{scene:12} {name:20} relMSE {middle['relmse_trimmed']:.3g}   {middle['spp']:.0f} spp   {middle['seconds']:.2f} s", flush=True)
        (args.out / "equal_time.json").write_text(json.dumps({"seconds": args.seconds, "size": SIZE, "reference_spp": args.reference_spp, "results": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
