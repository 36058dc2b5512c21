"""Is the mean of many learning frames what `exact` says, block by block?

    python blocks.py --manylight PROGRAM [--scenes rooms:256,points:256,...] [--sampler adaptive] [--spp 1000] -o DIR

Renders each generated scene with several seeds by the sampler and by `exact`, direct light, and compares the means of 32x32 pixel
blocks: z = difference / its standard error, the errors taken from the spread between seeds, pooled over neighbouring blocks (3x3),
so that few seeds suffice. Says how many blocks lie beyond 3 standard errors; 0.27 % would do so by chance if errors were normal.
Writes blocks.json. Needs `pip install mitsuba numpy` to read OpenEXR.
"""
import argparse
import json
import pathlib
import subprocess
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
BLOCK = 32
SIZE = (256, 192)


def block_means(args, scene, sampler, spp, seed, folder):
    out = folder / f"{scene.replace(':', '-')}-{sampler}-{seed}.exr"
    if not out.exists():
        command = [args.manylight, "render", f"demo:{scene}", "-q", "-o", out, "--spp", spp, "--seed", seed, "--sampler", sampler,
                   "--max-bounces", 0, "--width", SIZE[0], "--height", SIZE[1]]
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    rgb = np.array(mi.Bitmap(str(out)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    gray = rgb.astype(np.float64) @ np.array((0.2126, 0.7152, 0.0722))
    return gray.reshape(SIZE[1] // BLOCK, BLOCK, SIZE[0] // BLOCK, BLOCK).mean((1, 3))


def mean_and_variance(images):
    """Mean of the seeds, and its variance relative to the square of the mean, pooled over 3x3 blocks."""
    images = np.array(images)
    mean = images.mean(0)
    relative = images.var(0, ddof=1) / len(images) / mean**2
    padded = np.pad(relative, 1, mode="edge")
    rows, columns = relative.shape
    pooled = sum(padded[y : y + rows, x : x + columns] for y in range(3) for x in range(3)) / 9
    return mean, pooled * mean**2


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--manylight", required=True)
    parser.add_argument("--scenes", default="rooms:256,points:256,plaza:256,keyhole:256,sun-outside:256,spheres:64,one-light")
    parser.add_argument("--sampler", default="adaptive")
    parser.add_argument("--spp", type=int, default=1000)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--exact-spp", type=int, default=4)
    parser.add_argument("--exact-seeds", type=int, default=6)
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    args = parser.parse_args()
    images = args.out / "images"
    images.mkdir(parents=True, exist_ok=True)
    results = {}
    for scene in args.scenes.split(","):
        ours, our_variance = mean_and_variance([block_means(args, scene, args.sampler, args.spp, seed, images) for seed in range(args.seeds)])
        exact, exact_variance = mean_and_variance(
            [block_means(args, scene, "exact", args.exact_spp, 1000 + seed, images) for seed in range(args.exact_seeds)])
        z = (ours - exact) / np.sqrt(our_variance + exact_variance)
        results[scene] = {
            "blocks": z.size, "beyond_3": int((abs(z) > 3).sum()), "largest": float(abs(z).max()), "rms_z": float(np.sqrt((z**2).mean())),
            "ratio_of_means": float(ours.mean() / exact.mean()), "relative_error_of_a_block": float(np.sqrt(np.median((our_variance + exact_variance) / exact**2))),
            "z": [[round(float(v), 2) for v in row] for row in z],
        }
        told = results[scene]
        print(f"{scene:16} {told['beyond_3']} of {told['blocks']} blocks beyond 3, largest {told['largest']:.2f}, rms z {told['rms_z']:.2f}, "
              f"means {told['ratio_of_means']:.5f}, error of a block {told['relative_error_of_a_block']:.1e}", flush=True)
    (args.out / "blocks.json").write_text(json.dumps({"sampler": args.sampler, "spp": args.spp, "scenes": results}, indent=1))


if __name__ == "__main__":
    main()
