// Integer-exact discrete distributions. Words of one: len, last, guide shift, offset of the starts, offset of the guide.
#import "light_cache/bindings.wgsl"

// Probability of a mass of the 2^32 random numbers; 0 stands for all of them where `whole`.
fn pmf_of_mass(mass: u32, whole: bool) -> f32 {
    return select(f32(mass) * (1.0 / 4294967296.0), 1.0, whole && mass == 0u);
}

// twin: crates/sampling/src/discrete.rs pmf
fn distribution_pmf(at: u32, index: u32) -> f32 {
    let last = cache_word(at + 1u);
    if index > last {
        return 0.0;
    }
    let starts = cache_word(at + 3u);
    let start = cache_word(starts + index);
    if index == last {
        return pmf_of_mass(0u - start, true);
    }
    return pmf_of_mass(cache_word(starts + index + 1u) - start, false);
}

// The entry that owns `u`: the last one that starts at or before it, by bisection between two cells of the guide.
// twin: crates/sampling/src/discrete.rs sample
fn distribution_index(at: u32, u: u32) -> u32 {
    let last = cache_word(at + 1u);
    let shift = cache_word(at + 2u);
    let starts = cache_word(at + 3u);
    let guide = cache_word(at + 4u);
    let cell = u >> shift;
    var low = cache_word(guide + cell);
    var high = last;
    if cell < (0xffffffffu >> shift) {
        high = min(cache_word(guide + cell + 1u), last);
    }
    while low < high {
        let middle = (low + high + 1u) / 2u;
        if cache_word(starts + middle) <= u {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    return low;
}
