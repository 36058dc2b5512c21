// Frames around a normal, and directions around it.
#import "lib/constants.wgsl"

// The sine and the cosine of an angle in [-pi/4, pi/4].
// twin: crates/sampling/src/hemisphere.rs sin_cos_eighth
fn sin_cos_eighth(angle: f32) -> vec2<f32> {
    let x = angle * angle;
    let sine = angle * (1.0 + x * (-1.0 / 6.0 + x * (1.0 / 120.0 + x * (-1.0 / 5040.0 + x * (1.0 / 362880.0)))));
    let cosine = 1.0 + x * (-0.5 + x * (1.0 / 24.0 + x * (-1.0 / 720.0 + x * (1.0 / 40320.0))));
    return vec2<f32>(sine, cosine);
}

// twin: crates/sampling/src/hemisphere.rs unit_circle
fn unit_circle(turn: f32) -> vec2<f32> {
    let quarters = turn * 4.0;
    let nearest = floor(quarters + 0.5);
    let sc = sin_cos_eighth((quarters - nearest) * FRAC_PI_2);
    switch u32(nearest) % 4u {
        case 0u: { return vec2<f32>(sc.y, sc.x); }
        case 1u: { return vec2<f32>(-sc.x, sc.y); }
        case 2u: { return vec2<f32>(-sc.y, -sc.x); }
        default: { return vec2<f32>(sc.x, -sc.y); }
    }
}

// twin: crates/sampling/src/hemisphere.rs uniform_disk
fn uniform_disk(u: vec2<f32>) -> vec2<f32> {
    let p = 2.0 * u - vec2<f32>(1.0);
    if abs(p.x) > abs(p.y) {
        let sc = sin_cos_eighth(FRAC_PI_4 * (p.y / p.x));
        return vec2<f32>(sc.y, sc.x) * p.x;
    }
    if p.y != 0.0 {
        return sin_cos_eighth(FRAC_PI_4 * (p.x / p.y)) * p.y;
    }
    return vec2<f32>(0.0);
}

// twin: crates/sampling/src/hemisphere.rs cosine_hemisphere
fn cosine_hemisphere(u: vec2<f32>) -> vec3<f32> {
    let disk = uniform_disk(u);
    return vec3<f32>(disk, sqrt(max(1.0 - dot(disk, disk), 1e-9)));
}

// twin: crates/sampling/src/hemisphere.rs Frame
struct Frame {
    tangent: vec3<f32>,
    bitangent: vec3<f32>,
    normal: vec3<f32>,
}

// Duff et al. 2017, "Building an Orthonormal Basis, Revisited", listing 3.
fn frame_around(normal: vec3<f32>) -> Frame {
    let s = select(1.0, -1.0, (bitcast<u32>(normal.z) >> 31u) != 0u);
    let a = -1.0 / (s + normal.z);
    let b = normal.x * normal.y * a;
    return Frame(
        vec3<f32>(1.0 + s * normal.x * normal.x * a, s * b, -s * normal.x),
        vec3<f32>(b, s + normal.y * normal.y * a, -normal.y),
        normal,
    );
}

// Around a normal, turning with it.
// twin: crates/sampling/src/hemisphere.rs steady
fn steady_frame(normal: vec3<f32>) -> Frame {
    let a = abs(normal);
    var across = vec3<f32>(1.0, 0.0, 0.0);
    if a.x >= a.y && a.x >= a.z {
        across = vec3<f32>(0.0, 1.0, 0.0);
    } else if a.y >= a.z {
        across = vec3<f32>(0.0, 0.0, 1.0);
    }
    let tangent = normalize(across - normal * dot(normal, across));
    return Frame(tangent, cross(normal, tangent), normal);
}

// twin: crates/sampling/src/hemisphere.rs to_world
fn to_world(frame: Frame, local: vec3<f32>) -> vec3<f32> {
    return frame.tangent * local.x + frame.bitangent * local.y + frame.normal * local.z;
}

// twin: crates/sampling/src/hemisphere.rs to_local
fn to_local(frame: Frame, world: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(frame.tangent, world), dot(frame.bitangent, world), dot(frame.normal, world));
}
