// One distribution over all lights for first hits, one for later ones: `power` and `table`. Header: where both are.
#import "light_cache/distribution.wgsl"
#import "light_cache/guide.wgsl"

struct Local {
    distribution: u32,
}

fn sampler_local(point: ShadingPoint) -> Local {
    return Local(cache_word(select(1u, 0u, point.primary)));
}

fn sampler_draw(local: Local, u: u32) -> Choice {
    let light = distribution_index(local.distribution, u);
    return plain_choice(light, distribution_pmf(local.distribution, light));
}

fn sampler_pmf(local: Local, light: u32) -> f32 {
    return distribution_pmf(local.distribution, light);
}

// Nothing is known.
fn sampler_guide(local: Local) -> u32 {
    return NO_GUIDE;
}
