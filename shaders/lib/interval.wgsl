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
    return split_among(width, first, second, 1u, 1u);
}

// twin: crates/light-cache/src/tree/interval.rs split_among
fn split_among(width: vec2<u32>, first: f32, second: f32, count_first: u32, count_second: u32) -> vec2<u32> {
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
    let least = select(count_second, count_first, first <= second);
    let least_other = vec2<u32>(select(count_first, count_second, first <= second), 0u);
    var part = wide_scaled(width, ratio);
    if wide_less(part, vec2<u32>(least, 0u)) {
        part = vec2<u32>(least, 0u);
    }
    var most = vec2<u32>(0u);
    if wide_less(least_other, width) {
        most = wide_sub(width, least_other);
    }
    part = wide_min(part, most);
    if first <= second {
        return part;
    }
    return wide_sub(width, part);
}
