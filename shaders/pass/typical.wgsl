// The geometric mean of what is not black, 1 if all is: one workgroup.
#import "record/clean.wgsl"

// Of every workgroup of pass/assemble.wgsl.
@group(3) @binding(1) var<storage, read> brightness: array<vec2<f32>>;
@group(3) @binding(2) var<storage, read_write> typical_luminance: array<f32>;

const THREADS: u32 = 256u;
const SIDE: u32 = 8u;
var<workgroup> sums: array<vec2<f32>, THREADS>;

// twin: crates/render/src/clean/resolve.rs typical_luminance
@compute @workgroup_size(THREADS)
fn typical(@builtin(local_invocation_index) thread: u32) {
    let groups = ((clean.now.width + SIDE - 1u) / SIDE) * ((clean.now.height + SIDE - 1u) / SIDE);
    var own = vec2<f32>(0.0);
    for (var group = thread; group < groups; group += THREADS) {
        own += brightness[group];
    }
    sums[thread] = own;
    workgroupBarrier();
    if thread == 0u {
        var sum = vec2<f32>(0.0);
        for (var i = 0u; i < THREADS; i++) {
            sum += sums[i];
        }
        typical_luminance[0] = select(1.0, exp(sum.x / max(sum.y, 1.0)), sum.y > 0.0);
    }
}
