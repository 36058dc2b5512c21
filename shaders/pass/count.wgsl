// What all pixels of a film have counted: a sum per workgroup.
#import "lib/wide.wgsl"
#import "record/count.wgsl"
#import "record/film.wgsl"

@group(3) @binding(0) var<storage, read> film: array<FilmPixel>;
@group(3) @binding(1) var<storage, read_write> counts: array<Count>;

const THREADS: u32 = 64u;
// Pixels of a thread.
const COUNTED: u32 = 32u;
var<workgroup> sums: array<Count, THREADS>;

fn added(a: Count, b: Count) -> Count {
    return Count(
        wide_add(a.rays_nearest, b.rays_nearest),
        wide_add(a.rays_occluded, b.rays_occluded),
        wide_add(a.nonfinite, b.nonfinite),
    );
}

@compute @workgroup_size(THREADS)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    var own: Count;
    for (var i = 0u; i < COUNTED; i++) {
        let pixel = (group.x * COUNTED + i) * THREADS + thread;
        if pixel < arrayLength(&film) {
            own = added(
                own,
                Count(
                    vec2<u32>(film[pixel].rays_nearest, 0u),
                    vec2<u32>(film[pixel].rays_occluded, 0u),
                    vec2<u32>(film[pixel].nonfinite, 0u),
                ),
            );
        }
    }
    sums[thread] = own;
    workgroupBarrier();
    if thread == 0u {
        for (var i = 1u; i < THREADS; i++) {
            own = added(own, sums[i]);
        }
        counts[group.x] = own;
    }
}
