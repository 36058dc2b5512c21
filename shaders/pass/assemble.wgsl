// The picture put together again; and of every workgroup how bright it is, for pass/typical.wgsl.
#import "lib/constants.wgsl"
#import "record/clean.wgsl"

@group(3) @binding(1) var<storage, read> tints: array<Tint>;
@group(3) @binding(2) var<storage, read> light: array<vec4<f32>>;
@group(3) @binding(3) var<storage, read_write> picture: array<vec4<f32>>;
// The logarithms of the luminances, and the number, of what is not black.
@group(3) @binding(4) var<storage, read_write> brightness: array<vec2<f32>>;

const SIDE: u32 = 8u;
var<workgroup> logarithms: array<vec2<f32>, SIDE * SIDE>;

// twin: crates/render/src/clean/frame.rs assembled
@compute @workgroup_size(SIDE, SIDE)
fn assemble(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    var own = vec2<f32>(0.0);
    if is_inside(id.xy) {
        let pixel = pixel_at(id.xy);
        let tint = tints[pixel];
        let radiance = light[pixel].rgb * tint.reflected + tint.added;
        picture[pixel] = vec4<f32>(radiance, 0.0);
        let y = luminance(radiance);
        if y > 0.0 && is_finite(y) {
            own = vec2<f32>(log(y), 1.0);
        }
    }
    logarithms[thread] = own;
    workgroupBarrier();
    if thread == 0u {
        var sum = vec2<f32>(0.0);
        for (var i = 0u; i < SIDE * SIDE; i++) {
            sum += logarithms[i];
        }
        brightness[group.y * groups.x + group.x] = sum;
    }
}
