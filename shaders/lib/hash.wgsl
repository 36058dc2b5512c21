// Integer hashes and what is made of their bits. All of it is exact.

// twin: crates/sampling/src/hash.rs mix
fn mix_bits(bits: u32) -> u32 {
    var x = bits;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ (x >> 16u);
}

const GOLDEN: u32 = 0x9e3779b9u;

// twin: crates/sampling/src/hash.rs hash2
fn hash2(a: u32, b: u32) -> u32 {
    return mix_bits(mix_bits(a + GOLDEN) ^ b);
}

// twin: crates/sampling/src/hash.rs hash3
fn hash3(a: u32, b: u32, c: u32) -> u32 {
    return mix_bits(hash2(a, b) ^ c);
}

// twin: crates/sampling/src/random.rs unit_f32
fn unit_f32(bits: u32) -> f32 {
    return f32(bits >> 8u) * (1.0 / 16777216.0);
}
