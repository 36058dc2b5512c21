"""Does manylight show the same image as other renderers, within noise?

    python agree.py --manylight PROGRAM [--cycles-python PYTHON] [--scenes rooms:256,points:256,...] [--spp 64] [--seeds 8] -o DIR

Exports each generated scene, renders it with manylight, Mitsuba 3 and (where given a Python that has bpy) Cycles, each
with several seeds, direct light only, and compares the means of 16x16 pixel blocks by Welch's t between the seeds.
Writes agree.json and, per scene, a picture: manylight, the peers, and the blocks' t values (blue -4 .. white 0 .. red 4).
Needs `pip install mitsuba numpy`; Cycles needs a Python of its own with `pip install bpy==5.0.1 numpy`.
"""
import argparse
import json
import pathlib
import subprocess
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
HERE = pathlib.Path(__file__).parent
BLOCK = 16
SIZE = (256, 192)


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


def ours(args, glb, seed, out):
    run(args.manylight, "render", glb, "-o", out, "--spp", args.spp, "--seed", seed, "--sampler", args.sampler, "--max-bounces", 0, "--width", SIZE[0], "--height", SIZE[1])
    return np.array(mi.Bitmap(str(out)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))


def mitsuba(args, glb, seeds, out):
    images = []
    for seed in seeds:
        run(sys.executable, HERE / "mitsuba_run.py", glb, out, "--spp", args.spp, "--seed", 1000 * (seed + 1), "--size", *SIZE)
        images.append(np.load(out))
    return images


def cycles(args, glb, seeds, out):
    run(args.cycles_python, HERE / "cycles_run.py", glb, out, "--spp", f"{args.spp}x{len(seeds)}", "--size", f"{SIZE[0]}x{SIZE[1]}")
    return [np.load(f"{out}-{args.spp}-{seed}.npy") for seed in seeds]


def blocks(image):
    gray = image[..., :3].astype(np.float64) @ np.array((0.2126, 0.7152, 0.0722))
    h, w = gray.shape
    return gray.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK).mean((1, 3))


def compare(a, b):
    """Welch's t of each block's mean, and the ratio of the images' means with its standard error."""
    a, b = (np.array([blocks(image) for image in images]) for images in (a, b))
    n, m = len(a), len(b)
    spread = np.sqrt(a.var(0, ddof=1) / n + b.var(0, ddof=1) / m)
    t = (a.mean(0) - b.mean(0)) / np.maximum(spread, 1e-9)
    means_a, means_b = a.mean((1, 2)), b.mean((1, 2))
    ratio = means_a.mean() / means_b.mean()
    error = ratio * np.hypot(means_a.std(ddof=1) / means_a.mean() / n**0.5, means_b.std(ddof=1) / means_b.mean() / m**0.5)
    relative = np.abs(a.mean(0) - b.mean(0)) / np.maximum(b.mean(0), 1e-3 * b.mean())
    return t, {
        "mean_ratio": round(float(ratio), 5), "mean_ratio_standard_error": round(float(error), 5),
        "blocks": int(t.size), "blocks_beyond_3": int((np.abs(t) > 3).sum()), "blocks_beyond_5": int((np.abs(t) > 5).sum()),
        "median_block_difference": round(float(np.median(relative)), 5), "worst_block_difference": round(float(relative.max()), 4),
    }


def picture(path, columns, maps):
    scale = 0.5 / max(np.percentile(columns[0], 90), 1e-9)
    shown = [np.clip(c * scale, 0, 1) ** (1 / 2.2) for c in columns]
    for t in maps:
        x = np.clip(np.kron(t, np.ones((BLOCK, BLOCK))) / 4, -1, 1)[..., None]
        shown.append(np.where(x > 0, np.array((1, 1, 1)) - x * np.array((0, 1, 1)), np.array((1, 1, 1)) + x * np.array((1, 1, 0))))
    strip = (np.concatenate(shown, 1) * 255).astype(np.uint8)
    mi.Bitmap(strip).write(str(path))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--manylight", required=True)
    p.add_argument("--cycles-python")
    p.add_argument("--scenes", default="rooms:256,points:256,plaza:256,keyhole:256,sun-outside:256,one-light")
    p.add_argument("--sampler", default="tree-visible")
    p.add_argument("--spp", type=int, default=64)
    p.add_argument("--seeds", type=int, default=8)
    p.add_argument("-o", "--out", required=True, type=pathlib.Path)
    args = p.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    work = args.out / "work"
    work.mkdir(exist_ok=True)
    seeds = range(args.seeds)
    results = {}
    for scene in args.scenes.split(","):
        name = scene.replace(":", "-")
        glb = work / f"{name}.glb"
        run(args.manylight, "info", f"demo:{scene}", "--export", glb)
        images = {"manylight": [ours(args, glb, seed, work / "ours.exr") for seed in seeds], "mitsuba": mitsuba(args, glb, seeds, work / "mitsuba.npy")}
        if args.cycles_python:
            images["cycles"] = cycles(args, glb, seeds, work / f"{name}-cycles")
        maps = []
        for peer in list(images)[1:]:
            t, row = compare(images["manylight"], images[peer])
            maps.append(t)
            results[f"{scene} against {peer}"] = row
            print(f"{scene:16} against {peer:8} {json.dumps(row)}", flush=True)
        picture(args.out / f"{name}.png", [np.mean(v, 0) for v in images.values()], maps)
        (args.out / "agree.json").write_text(json.dumps({"spp": args.spp, "seeds": args.seeds, "size": SIZE, "sampler": args.sampler, "results": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
