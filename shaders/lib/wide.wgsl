// Unsigned integers of 64 bits, low word first: WGSL has none, and probabilities are exact in them.

// The product of two words.
fn wide_mul(a: u32, b: u32) -> vec2<u32> {
    let a_low = a & 0xffffu;
    let a_high = a >> 16u;
    let b_low = b & 0xffffu;
    let b_high = b >> 16u;
    let low = a_low * b_low;
    let middle = a_high * b_low + (low >> 16u);
    let other = a_low * b_high + (middle & 0xffffu);
    return vec2<u32>((other << 16u) | (low & 0xffffu), a_high * b_high + (middle >> 16u) + (other >> 16u));
}

fn wide_add(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = a.x + b.x;
    return vec2<u32>(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn wide_sub(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    return vec2<u32>(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}

fn wide_less(a: vec2<u32>, b: vec2<u32>) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn wide_min(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    if wide_less(b, a) {
        return b;
    }
    return a;
}

fn wide_is_zero(a: vec2<u32>) -> bool {
    return (a.x | a.y) == 0u;
}

// a / 2^bits, bits in 1..=31.
fn wide_shift_right(a: vec2<u32>, bits: u32) -> vec2<u32> {
    return vec2<u32>((a.x >> bits) | (a.y << (32u - bits)), a.y >> bits);
}

// a * 2^bits, bits in 1..=31.
fn wide_shift_left(a: vec2<u32>, bits: u32) -> vec2<u32> {
    return vec2<u32>(a.x << bits, (a.y << bits) | (a.x >> (32u - bits)));
}

// a * b / 2^32, which must fit.
fn wide_scaled(a: vec2<u32>, b: u32) -> vec2<u32> {
    return wide_add(wide_mul(a.y, b), vec2<u32>(wide_mul(a.x, b).y, 0u));
}

// a / b of which the quotient fits into a word: bit by bit.
fn wide_div(a: vec2<u32>, b: u32) -> u32 {
    var rest = a.y;
    var quotient = 0u;
    for (var bit = 0u; bit < 32u; bit++) {
        let carry = rest >> 31u;
        rest = (rest << 1u) | ((a.x >> (31u - bit)) & 1u);
        quotient <<= 1u;
        if carry != 0u || rest >= b {
            rest -= b;
            quotient |= 1u;
        }
    }
    return quotient;
}

fn wide_f32(a: vec2<u32>) -> f32 {
    return f32(a.y) * 4294967296.0 + f32(a.x);
}
