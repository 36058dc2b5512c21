#!/usr/bin/env python3
"""Ray queries against Embree 4 on the same triangles and rays, one thread.

    pip install embreex numpy
    benchmarks/embree/compare.py [--rounds 3] [--bench "cargo bench -p scene --bench rays --"] [--folder DIR]

Runs the benchmark of the scene crate and Embree in turns, so that both meet the same noise, and takes the best of each.
Prints a table and writes compare.json into the folder. Embree runs through embreex (rtcIntersect1 and rtcOccluded1 in a
compiled loop), with its own choice of instruction set and medium build quality.
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Before numpy and Embree start any thread.
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import numpy as np  # noqa: E402
from embreex import rtcore_scene  # noqa: E402
from embreex.mesh_construction import TriangleMesh  # noqa: E402

WORKLOADS = {"coherent": "INTERSECT", "incoherent": "INTERSECT", "shadow": "OCCLUDED"}


def embree_scene(folder: Path, name: str):
    corners = np.fromfile(folder / f"{name}.triangles.f32", dtype="<f4").reshape(-1, 3)
    scene = rtcore_scene.EmbreeScene()
    indices = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    TriangleMesh(scene, corners, indices)
    return scene


def embree_rate(scene, folder: Path, name: str, workload: str):
    """Millions of rays per second, and the share of rays that hit."""
    rays = np.fromfile(folder / f"{name}.{workload}.rays.f32", dtype="<f4").reshape(-1, 7)
    origins, directions = (np.ascontiguousarray(rays[:, i : i + 3]) for i in (0, 3))
    distances = np.ascontiguousarray(rays[:, 6])
    distances[~np.isfinite(distances)] = 1e37
    scene.run(origins[:1], directions[:1], distances[:1].copy())
    start = time.perf_counter()
    hits = scene.run(origins, directions, distances.copy(), query=WORKLOADS[workload])
    seconds = time.perf_counter() - start
    hit = hits != -1 if WORKLOADS[workload] == "INTERSECT" else hits == 0
    return len(rays) / seconds / 1e6, float(np.mean(hit))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bench", default="cargo bench -q -p scene --bench rays --")
    parser.add_argument("--scenes", default="box,rooms,bumps")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--rays", type=int, default=200_000)
    parser.add_argument("--folder", type=Path)
    arguments = parser.parse_args()
    folder = arguments.folder or Path(tempfile.mkdtemp())
    folder = folder.resolve()
    command = [*shlex.split(arguments.bench), "--scenes", arguments.scenes, "--rays", str(arguments.rays)]
    command += ["--rounds", "3", "--threads", "1", "--export", str(folder)]

    scenes, rows = {}, {}
    for _ in range(arguments.rounds):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for ours in json.loads((folder / "rays.json").read_text()):
            key = (ours["scene"], ours["rays"])
            row = rows.setdefault(key, {"scene": key[0], "rays": key[1], "triangles": ours["triangles"], "embree": 0.0})
            row["hit_share"] = ours["hit_share"]
            row[ours["kernel"]] = max(row.get(ours["kernel"], 0.0), ours["mrays_per_s"])
        for name, workload in rows:
            if name not in scenes:
                scenes[name] = embree_scene(folder, name)
            for _ in range(3):
                rate, hit_share = embree_rate(scenes[name], folder, name, workload)
                row = rows[name, workload]
                row["embree"] = max(row["embree"], rate)
                row["embree_hit_share"] = hit_share

    kernels = [k for k in ("portable", "avx2", "avx512") if any(k in row for row in rows.values())]
    print(f"{'scene':<8}{'triangles':>10} {'rays':<11}{'embree':>8}" + "".join(f"{k:>10}" for k in kernels) + "   best / embree   hit (ours, embree)")
    for row in rows.values():
        row["ratio"] = max(row[k] for k in kernels) / row["embree"]
        rates = "".join(f"{row[k]:10.3f}" for k in kernels)
        shares = f"{row['hit_share']:.5f}, {row['embree_hit_share']:.5f}"
        print(f"{row['scene']:<8}{row['triangles']:>10} {row['rays']:<11}{row['embree']:8.3f}{rates}{row['ratio']:16.2f}   {shares}")
    (folder / "compare.json").write_text(json.dumps(list(rows.values()), indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
