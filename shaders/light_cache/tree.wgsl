// The plain light tree as a sampler. Header: the tree.
#import "light_cache/guide.wgsl"
#import "light_cache/light_tree.wgsl"

struct Local {
    descent: Descent,
    salt: u32,
}

// twin: crates/light-cache/src/tree/sampler.rs local
fn sampler_local(point: ShadingPoint) -> Local {
    return Local(descent_at(0u, Receiver(point.position_ws, point.normal_ws)), salt_of(point));
}

// twin: crates/light-cache/src/tree/sampler.rs sample
fn sampler_draw(local: Local, u: u32) -> Choice {
    if !(local.descent.near > 0.0 || local.descent.far > 0.0) {
        return plain_choice(0u, 0.0);
    }
    let drawn = descent_draw(local.descent, position_in_unit(u, local.salt), UNIT_WIDTH);
    return plain_choice(light_at(0u, drawn.place), probability(drawn.width));
}

// twin: crates/light-cache/src/tree/sampler.rs pmf
fn sampler_pmf(local: Local, light: u32) -> f32 {
    if !(local.descent.near > 0.0 || local.descent.far > 0.0) {
        return 0.0;
    }
    return probability(descent_width(local.descent, place_of(0u, light), UNIT_WIDTH));
}

// Nothing is known.
fn sampler_guide(local: Local) -> u32 {
    return NO_GUIDE;
}
