"""Is the mean of many learning frames what `exact` says, block by block?

    python blocks.py --manylight PROGRAM [--scenes rooms:256,points:256,...] [--sampler adaptive] [--spp 1000] -o DIR

Renders each generated scene with several seeds by the sampler and by `exact`, direct light, and compares the means of 32x32 pixel
blocks, without the pixels that are much brighter than those around them: a lamp that covers a sliver of a pixel is met by some eye ray of a
thousand and by none of 32, which says nothing about how lights are chosen. Welch's t between the seeds, said as the normal deviate of the same probability (Wallace 1959), since a standard error from few
seeds is uncertain itself. Says how many blocks lie beyond 3; by chance 0.27 % do.
With --against PREFIX one scene is compared with another renderer's images PREFIX-*.npy in place of `exact` (peers/lux_run.py writes such).
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
BRIGHTER = 1.5
LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
SIZE = (256, 192)


def luminance(args, scene, sampler, spp, seed, folder):
    out = folder / f"{scene.replace(':', '-')}-{sampler}-{seed}.exr"
    if not out.exists():
        command = [args.manylight, "render", f"demo:{scene}", "-q", "-o", out, "--spp", spp, "--seed", seed, "--sampler", sampler,
                   "--max-bounces", 0, "--width", SIZE[0], "--height", SIZE[1]]
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    rgb = np.array(mi.Bitmap(str(out)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    return rgb.astype(np.float64) @ LUMINANCE


def without_lamps(image):
    """Which pixels are not much brighter than the median of the 5x5 around them."""
    padded = np.pad(image, 2, mode="reflect")
    around = [padded[y : y + image.shape[0], x : x + image.shape[1]] for y in range(5) for x in range(5)]
    return image <= BRIGHTER * np.median(around, 0)


def block_sums(image):
    return image.reshape(SIZE[1] // BLOCK, BLOCK, SIZE[0] // BLOCK, BLOCK).sum((1, 3))


def deviates(ours, exact):
    """The deviate of each block that is not black, NaN for the others; the relative standard error of the difference; the ratio of the means."""
    means, variances, dofs = zip(*((x.mean(0), x.var(0, ddof=1) / len(x), len(x) - 1) for x in (np.array(ours), np.array(exact))))
    if ((means[0] == 0) != (means[1] == 0)).any():
        sys.exit("a block is black in one of the images only")
    with np.errstate(invalid="ignore"):
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
    parser.add_argument("--against", type=pathlib.Path, metavar="PREFIX")
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    args = parser.parse_args()
    images = args.out / "images"
    images.mkdir(parents=True, exist_ok=True)
    results = {}
    for scene in args.scenes.split(","):
        ours = [luminance(args, scene, args.sampler, args.spp, seed, images) for seed in range(args.seeds)]
        if args.against:
            exact = [np.load(file) @ LUMINANCE for file in sorted(args.against.parent.glob(f"{args.against.name}-*.npy"))]
        else:
            exact = [luminance(args, scene, "exact", args.exact_spp, 1000 + seed, images) for seed in range(args.exact_seeds)]
        kept = without_lamps(np.mean(ours, 0))
        ours, exact = ([block_sums(image * kept) for image in all_seeds] for all_seeds in (ours, exact))
        z, error, ratio = deviates(ours, exact)
        results[scene] = {
            "pixels_left_out": int((~kept).sum()), "blocks": int(np.isfinite(z).sum()), "beyond_3": int((abs(z) > 3).sum()), "largest": float(np.nanmax(abs(z))), "rms_z": float(np.sqrt(np.nanmean(z**2))),
            "ratio_of_means": float(ratio), "relative_error_of_a_block": float(np.nanmedian(error)),
            "z": [[round(float(v), 2) if np.isfinite(v) else None for v in row] for row in z],
        }
        told = results[scene]
        print(f"{scene:16} {told['beyond_3']} of {told['blocks']} blocks beyond 3 ({told['pixels_left_out']} pixels left out), largest {told['largest']:.2f}, rms z {told['rms_z']:.2f}, "
              f"means {told['ratio_of_means']:.5f}, error of a block {told['relative_error_of_a_block']:.1e}", flush=True)
    (args.out / "blocks.json").write_text(json.dumps({"sampler": args.sampler, "spp": args.spp, "against": args.against.name if args.against else "exact", "scenes": results}, indent=1))


if __name__ == "__main__":
    main()
