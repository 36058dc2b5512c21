// A light sampler at points: eight words in (position, normal, another light and whether the point is a first hit, a random number),
// eight out: the light drawn, its probability as drawn and as asked for, the probability of the other light, and the control variate.
#import "light_cache/sampler.wgsl"

@group(3) @binding(0) var<storage, read> input: array<vec4<u32>>;
@group(3) @binding(1) var<storage, read_write> output: array<vec4<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if 2u * id.x + 1u >= arrayLength(&input) {
        return;
    }
    let a = input[2u * id.x];
    let b = input[2u * id.x + 1u];
    let point = ShadingPoint(
        bitcast<vec3<f32>>(a.xyz),
        (b.z & 1u) != 0u,
        bitcast<vec3<f32>>(vec3<u32>(a.w, b.xy)),
    );
    let local = sampler_local(point);
    let choice = sampler_draw(local, b.w);
    var asked = 0.0;
    if choice.pmf > 0.0 {
        asked = sampler_pmf(local, choice.light);
    }
    let other = sampler_pmf(local, b.z >> 1u);
    output[2u * id.x + 1u] = vec4<u32>(bitcast<vec3<u32>>(choice.control), 0u);
    output[2u * id.x] = vec4<u32>(choice.light, bitcast<u32>(choice.pmf), bitcast<u32>(asked), bitcast<u32>(other));
}
