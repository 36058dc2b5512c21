// Every light alike. Header: count, units, longer, boundary, both probabilities.
#import "light_cache/bindings.wgsl"
#import "light_cache/guide.wgsl"

struct Local {
    point: ShadingPoint,
}

fn sampler_local(point: ShadingPoint) -> Local {
    return Local(point);
}

// twin: crates/light-cache/src/uniform.rs sample
fn sampler_draw(local: Local, u: u32) -> Choice {
    let count = cache_word(0u);
    if count < 2u {
        return plain_choice(0u, f32(count));
    }
    let units = cache_word(1u);
    let boundary = cache_word(3u);
    if u < boundary {
        return plain_choice(u / (units + 1u), cache_f32(4u));
    }
    return plain_choice(cache_word(2u) + (u - boundary) / units, cache_f32(5u));
}

// twin: crates/light-cache/src/uniform.rs pmf
fn sampler_pmf(local: Local, light: u32) -> f32 {
    return cache_f32(select(5u, 4u, light < cache_word(2u)));
}

// Nothing is known.
fn sampler_guide(local: Local) -> u32 {
    return NO_GUIDE;
}
