// Keeps the observations of a tile that surprise, and a few of the others, each of which then stands for many: one workgroup a tile.
// Differs: the mean of a tile is summed in another order than on the CPU, so what is within rounding of surprising may be taken otherwise.
// twin: crates/light-cache/src/schedule.rs thinned
#import "lib/hash.wgsl"
#import "lib/tile.wgsl"
#import "record/film.wgsl"
#import "record/lesson.wgsl"

@group(3) @binding(0) var<storage, read> observations: array<Observation>;
@group(3) @binding(1) var<storage, read_write> counters: LessonCounters;
@group(3) @binding(2) var<uniform> lesson: LessonParams;
@group(3) @binding(3) var<storage, read_write> kept: array<Observation>;
@group(3) @binding(4) var<storage, read_write> runs: array<Run>;

// twin: crates/light-cache/src/schedule.rs MAX_OBSERVATIONS
const MAX_OBSERVATIONS: u32 = 1u << 16u;
// twin: crates/light-cache/src/schedule.rs SURPRISE
const SURPRISE: f32 = 2.0;
// twin: crates/light-cache/src/schedule.rs SURPRISE_PER_WEIGHT
const SURPRISE_PER_WEIGHT: f32 = 0.25;

var<workgroup> counts: array<u32, TILE_THREADS>;
var<workgroup> amounts: array<f32, TILE_THREADS>;
var<workgroup> first: u32;

// What the observation adds to its pixel.
fn added(seen: Observation) -> f32 {
    if (seen.flags & OBSERVED_VISIBLE) == 0u {
        return 0.0;
    }
    return seen.unshadowed / seen.pmf;
}

// Sums of `own` over the threads before this one, and over all.
fn running_count(thread: u32, own: u32) -> vec2<u32> {
    workgroupBarrier();
    counts[thread] = own;
    workgroupBarrier();
    var sums = vec2<u32>(0u);
    for (var other = 0u; other < TILE_THREADS; other++) {
        sums += vec2<u32>(select(0u, counts[other], other < thread), counts[other]);
    }
    return sums;
}

// Whether one observation is kept, and for how many it stands then; 0: it is not.
fn weight_kept(seen: Observation, weight: u32, surprising: f32, salt: vec3<u32>) -> u32 {
    if added(seen) > surprising {
        return 1u;
    }
    return select(0u, weight, hash3(salt.x, salt.y, salt.z) <= 0xffffffffu / weight);
}

@compute @workgroup_size(TILE_THREADS)
fn thin(
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(num_workgroups) tiles: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let number = tile.y * tiles.x + tile.x;
    var observed = 0u;
    var amount = 0.0;
    var before = 0u;
    var surprising = 0.0;
    var keeps = 0u;
    let observed_by_all = max(atomicLoad(&counters.observed), 1u);
    let weight = lesson.stride * ((observed_by_all + MAX_OBSERVATIONS - 1u) / MAX_OBSERVATIONS);
    // Three rounds over the same observations: what there is, how many are kept, and keeping them.
    for (var round = 0u; round < 3u; round++) {
        var index = before;
        var next = first;
        if round == 2u {
            let sums = running_count(thread, keeps);
            if thread == 0u && sums.y > 0u {
                first = atomicAdd(&counters.kept, sums.y);
                let run = atomicAdd(&counters.runs, 1u);
                if run < arrayLength(&runs) {
                    runs[run] = Run(lesson.frame, number, first, sums.y, weight);
                }
            }
            workgroupBarrier();
            next = first + sums.x;
        }
        for (var place = thread * TILE_SHARE; place < (thread + 1u) * TILE_SHARE; place++) {
            let pixel = pixel_of_tile(tile.xy, place);
            if pixel == NO_PIXEL {
                continue;
            }
            for (var slot = 0u; slot < frame.slots; slot++) {
                var seen = observations[pixel * frame.slots + slot];
                if seen.light == NO_LIGHT {
                    continue;
                }
                if round == 0u {
                    observed += 1u;
                    amount += added(seen);
                    continue;
                }
                let stands_for = weight_kept(seen, weight, surprising, vec3<u32>(lesson.frame, number, index));
                index += 1u;
                if stands_for == 0u {
                    continue;
                }
                if round == 1u {
                    keeps += 1u;
                } else if next < arrayLength(&kept) {
                    if stands_for > 1u {
                        seen.flags |= OBSERVED_FOR_MANY;
                    }
                    kept[next] = seen;
                    next += 1u;
                }
            }
        }
        if round == 0u {
            let sums = running_count(thread, observed);
            before = sums.x;
            amounts[thread] = amount;
            workgroupBarrier();
            var total = 0.0;
            for (var other = 0u; other < TILE_THREADS; other++) {
                total += amounts[other];
            }
            surprising = total / f32(max(sums.y, 1u)) * max(SURPRISE, SURPRISE_PER_WEIGHT * f32(weight));
        }
    }
}
