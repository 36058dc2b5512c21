// The numbers that a path consumes: Owen-scrambled Sobol' points. All of it is exact.
#import "lib/hash.wgsl"
#import "record/frame.wgsl"

// twin: crates/sampling/src/sobol.rs reversed_owen_scramble
fn reversed_owen_scramble(number: u32, seed: u32) -> u32 {
    var x = number;
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ (x * 0x53a22864u);
}

fn sobol_row(position: u32, reversed_index: u32, dimension: u32) -> u32 {
    let nibble = (reversed_index >> (4u * position)) & 15u;
    return sobol_rows[(position * 16u + nibble) * 2u + (dimension >> 2u)][dimension & 3u];
}

// twin: crates/sampling/src/sobol.rs reversed_sobol
fn reversed_sobol(reversed_index: u32, dimension: u32) -> u32 {
    var point = 0u;
    for (var position = 4u; position < 8u; position++) {
        point ^= sobol_row(position, reversed_index, dimension);
    }
    if (reversed_index & 0xffffu) != 0u {
        for (var position = 0u; position < 4u; position++) {
            point ^= sobol_row(position, reversed_index, dimension);
        }
    }
    return point;
}

struct VertexSequence {
    key: u32,
    step: u32,
    reversed_index: u32,
}

// twin: crates/sampling/src/sequence.rs vertex
fn vertex_sequence(seed: vec2<u32>, pixel: u32, sample: u32, vertex: u32) -> VertexSequence {
    let of_pixel = hash3(seed.y, seed.x, pixel);
    let key = mix_bits(of_pixel + GOLDEN * vertex);
    let step = mix_bits(key ^ ((of_pixel << 16u) | (of_pixel >> 16u))) | 1u;
    var index = reverseBits(sample);
    if vertex > 0u {
        index = (reversed_owen_scramble(index, key) & 0xffff0000u) | (index & 0xffffu);
    }
    return VertexSequence(key, step, index);
}

// twin: crates/sampling/src/sequence.rs u32
fn sequence_bits(sequence: VertexSequence, dimension: u32) -> u32 {
    let seed = mix_bits(sequence.key + sequence.step * dimension);
    return reverseBits(reversed_owen_scramble(reversed_sobol(sequence.reversed_index, dimension), seed));
}

// twin: crates/sampling/src/sequence.rs f32
fn sequence_unit(sequence: VertexSequence, dimension: u32) -> f32 {
    return unit_f32(sequence_bits(sequence, dimension));
}
