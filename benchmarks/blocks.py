"""Is the mean of many learning frames what `exact` says, block by block?

    python blocks.py --manylight PROGRAM [--scenes rooms:256,points:256,...] [--sampler adaptive] [--spp 1000] -o DIR

Renders each generated scene with several seeds by the sampler and by `exact`, direct light, and compares the means of 32x32 pixel
blocks: Welch's t between the seeds, said as the normal deviate of the same probability (Wallace 1959), since a standard error from few
seeds is uncertain itself. Says how many blocks lie beyond 3; by chance 0.27 % do.
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


def deviates(ours, exact):
    """The deviate of each block, and the relative standard error of the difference."""
    means, variances, dofs = zip(*((x.mean(0), x.var(0, ddof=1) / len(x), len(x) - 1) for x in (np.array(ours), np.array(exact))))
    variance = variances[0] + variances[1]
    t = (means[0] - means[1]) / np.sqrt(variance)
    dof = variance**2 / (variances[0] ** 2 / dofs[0] + variances[1] ** 2 / dofs[1])
    z = np.sign(t) * (8 * dof + 1) / (8 * dof + 3) * np.sqrt(dof * np.log1p(t**2 / dof))
    return z, np.sqrt(variance) / means[1], means[0].mean() / means[1].mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--manylight", required=True)
    parser.add_argument("--scenes", default="rooms:256,points:256,plaza:256,keyhole:256,sun-outside:256,spheres:64,one-light")
    parser.add_argument("--sampler", default="adaptive")
    parser.add_argument("--spp", type=int, default=1000)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--exact-spp", type=int, default=2)
    parser.add_argument("--exact-seeds", type=int, default=16)
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    args = parser.parse_args()
    images = args.out / "images"
    images.mkdir(parents=True, exist_ok=True)
    results = {}
    for scene in args.scenes.split(","):
        ours = [block_means(args, scene, args.sampler, args.spp, seed, images) for seed in range(args.seeds)]
        exact = [block_means(args, scene, "exact", args.exact_spp, 1000 + seed, images) for seed in range(args.exact_seeds)]
        z, error, ratio = deviates(ours, exact)
        results[scene] = {
            "blocks": z.size, "beyond_3": int((abs(z) > 3).sum()), "largest": float(abs(z).max()), "rms_z": float(np.sqrt((z**2).mean())),
            "ratio_of_means": float(ratio), "relative_error_of_a_block": float(np.median(error)),
            "z": [[round(float(v), 2) for v in row] for row in z],
        }
        told = results[scene]
        print(f"{scene:16} {told['beyond_3']} of {told['blocks']} blocks beyond 3, largest {told['largest']:.2f}, rms z {told['rms_z']:.2f}, "
              f"means {told['ratio_of_means']:.5f}, error of a block {told['relative_error_of_a_block']:.1e}", flush=True)
    (args.out / "blocks.json").write_text(json.dumps({"sampler": args.sampler, "spp": args.spp, "scenes": results}, indent=1))


if __name__ == "__main__":
    main()
