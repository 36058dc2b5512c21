// Integer arithmetic of a descent through a light tree: every choice cuts an interval, whose width is the probability.
#import "lib/hash.wgsl"
#import "lib/wide.wgsl"

// twin: crates/light-cache/src/tree/interval.rs UNIT
const UNIT_WIDTH: vec2<u32> = vec2<u32>(0u, 0x80000000u);

// twin: crates/light-cache/src/tree/interval.rs probability
fn probability(width: vec2<u32>) -> f32 {
    return wide_f32(width) * (1.0 / 9223372036854775808.0);
}

// twin: crates/light-cache/src/tree/interval.rs position
fn position_in_unit(u: u32, salt: u32) -> vec2<u32> {
    return vec2<u32>((u << 31u) | (hash2(u, salt) >> 1u), u >> 1u);
}

// twin: crates/light-cache/src/tree/interval.rs split
fn split(width: vec2<u32>, first: f32, second: f32) -> vec2<u32> {
    let smaller = min(first, second);
    if smaller <= 0.0 {
        if first > 0.0 {
            return width;
        }
        if second > 0.0 {
            return vec2<u32>(0u);
        }
        return wide_shift_right(width, 1u);
    }
    let ratio = min(u32(smaller / (first + second) * 4294967296.0), 0x80000000u);
    var part = wide_scaled(width, ratio);
    if wide_is_zero(part) {
        part = vec2<u32>(1u, 0u);
    }
    if wide_is_zero(width) {
        part = vec2<u32>(0u);
    } else {
        part = wide_min(part, wide_sub(width, vec2<u32>(1u, 0u)));
    }
    if first <= second {
        return part;
    }
    return wide_sub(width, part);
}
