// Everything that must be exact: six words in, eight words out.
#import "lib/interval.wgsl"
#import "lib/sequence.wgsl"

@group(3) @binding(0) var<storage, read> input: array<u32>;
@group(3) @binding(1) var<storage, read_write> output: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = 6u * id.x;
    if at + 6u > arrayLength(&input) {
        return;
    }
    let a = input[at];
    let b = input[at + 1u];
    let c = input[at + 2u];
    let d = input[at + 3u];
    let numbers = vertex_sequence(vec2<u32>(a, b), c, d, input[at + 4u]);
    let position = position_in_unit(a, b);
    let product = wide_mul(a, b);
    output[8u * id.x] = hash3(a, b, c);
    output[8u * id.x + 1u] = sequence_bits(numbers, input[at + 5u]);
    output[8u * id.x + 2u] = position.x;
    output[8u * id.x + 3u] = position.y;
    output[8u * id.x + 4u] = product.x;
    output[8u * id.x + 5u] = product.y;
    // The quotient fits: the upper word is less than the divisor.
    output[8u * id.x + 6u] = wide_div(vec2<u32>(c, a % max(d, 1u)), max(d, 1u));
    output[8u * id.x + 7u] = bitcast<u32>(unit_f32(a));
}
