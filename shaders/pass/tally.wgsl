// How much a frame has observed: one workgroup a tile.
#import "lib/tile.wgsl"
#import "record/film.wgsl"
#import "record/lesson.wgsl"

@group(3) @binding(0) var<storage, read> observations: array<Observation>;
@group(3) @binding(1) var<storage, read_write> counters: LessonCounters;

var<workgroup> of_tile: atomic<u32>;

@compute @workgroup_size(TILE_THREADS)
fn tally(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    var own = 0u;
    for (var place = thread * TILE_SHARE; place < (thread + 1u) * TILE_SHARE; place++) {
        let pixel = pixel_of_tile(tile.xy, place);
        if pixel == NO_PIXEL {
            continue;
        }
        for (var slot = 0u; slot < frame.slots; slot++) {
            own += select(0u, 1u, observations[pixel * frame.slots + slot].light != NO_LIGHT);
        }
    }
    atomicAdd(&of_tile, own);
    workgroupBarrier();
    if thread == 0u {
        atomicAdd(&counters.observed, atomicLoad(&of_tile));
    }
}
