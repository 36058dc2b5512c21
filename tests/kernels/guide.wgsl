// How paths go on at points: twelve words in (position, normal, another direction, two random numbers, whether the point is a first hit), six
// out: the direction drawn, its factor as drawn and as asked for, and that of the other direction; all 0 where nothing is guided.
#import "light_cache/sampler.wgsl"

@group(3) @binding(0) var<storage, read> input: array<u32>;
@group(3) @binding(1) var<storage, read_write> output: array<f32>;

fn input_vec3(at: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(vec3<u32>(input[at], input[at + 1u], input[at + 2u]));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = 12u * id.x;
    if at + 12u > arrayLength(&input) {
        return;
    }
    let normal_ws = input_vec3(at + 3u);
    let other_ws = input_vec3(at + 6u);
    let u = bitcast<vec2<f32>>(vec2<u32>(input[at + 9u], input[at + 10u]));
    let guide = sampler_guide(sampler_local(ShadingPoint(input_vec3(at), input[at + 11u] != 0u, normal_ws)));
    if guide == NO_GUIDE {
        return;
    }
    let drawn = sample_guide(guide, normal_ws, u);
    output[6u * id.x] = drawn.direction_ws.x;
    output[6u * id.x + 1u] = drawn.direction_ws.y;
    output[6u * id.x + 2u] = drawn.direction_ws.z;
    output[6u * id.x + 3u] = drawn.factor;
    output[6u * id.x + 4u] = guide_density(guide, normal_ws, drawn.direction_ws);
    output[6u * id.x + 5u] = guide_density(guide, normal_ws, other_ws);
}
