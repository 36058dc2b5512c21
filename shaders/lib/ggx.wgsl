// The isotropic GGX microfacet distribution: sampling of visible normals.
#import "lib/constants.wgsl"
#import "lib/hemisphere.wgsl"

fn normalize_or_up(v: vec3<f32>) -> vec3<f32> {
    let inverse = 1.0 / length(v);
    if is_finite(inverse) && inverse > 0.0 {
        return v * inverse;
    }
    return vec3<f32>(0.0, 0.0, 1.0);
}

// Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps", listing 3.
// twin: crates/sampling/src/ggx.rs sample_vndf
fn sample_vndf(wo: vec3<f32>, alpha: f32, u: vec2<f32>) -> vec3<f32> {
    let stretched = normalize_or_up(vec3<f32>(alpha * wo.x, alpha * wo.y, wo.z));
    let circle = unit_circle(u.x);
    let below = u.y * (1.0 + stretched.z);
    let radius = sqrt(max(below * (2.0 - below), 0.0));
    let h = vec3<f32>(circle * radius, 1.0 - below) + stretched;
    return normalize_or_up(vec3<f32>(alpha * h.x, alpha * h.y, max(h.z, 0.0)));
}
