// Points on lights.
#import "lib/constants.wgsl"
#import "lib/triangle.wgsl"
#import "scene/bindings.wgsl"
#import "scene/texture.wgsl"

const TRIANGLE_LIGHT: u32 = 0u;
const POINT_LIGHT: u32 = 1u;
const SPOT_LIGHT: u32 = 2u;
const DIRECTIONAL_LIGHT: u32 = 3u;
// Above the kind.
const LIGHT_DOUBLE_SIDED: u32 = 256u;
const LIGHT_TEXTURED: u32 = 512u;

// twin: crates/scene/src/light/triangle.rs LEAST_COSINE
const LEAST_COSINE: f32 = 1e-5;
// twin: crates/scene/src/light/triangle.rs EXTENT_SQ_PER_DISTANCE_SQ
const EXTENT_SQ_PER_DISTANCE_SQ: f32 = 0.5;

struct LightPoint {
    wi_ws: vec3<f32>,
    // FAR: at infinity.
    distance: f32,
    radiance: vec3<f32>,
    // 1 for delta lights; 0: no light can arrive.
    pdf_solid_angle: f32,
}

fn is_delta(light: Light) -> bool {
    return (light.kind & 255u) != TRIANGLE_LIGHT;
}

// twin: crates/scene/src/light/triangle.rs spherical
fn spherical_light(light: Light, to_first: vec3<f32>) -> SphericalTriangle {
    let to_center = to_first + (light.edge1_ws + light.edge2_ws) * (1.0 / 3.0);
    let extent_sq = dot(light.edge1_ws, light.edge1_ws) + dot(light.edge2_ws, light.edge2_ws);
    if extent_sq < EXTENT_SQ_PER_DISTANCE_SQ * dot(to_center, to_center) {
        var none: SphericalTriangle;
        return none;
    }
    return spherical_triangle(to_first, to_first + light.edge1_ws, to_first + light.edge2_ws);
}

// twin: crates/scene/src/light/triangle.rs sample_triangle
fn sample_triangle_light(light: Light, from_ws: vec3<f32>, u: vec2<f32>) -> LightPoint {
    var point = LightPoint(vec3<f32>(0.0), 0.0, light.intensity, 0.0);
    let to_first = light.position_ws - from_ws;
    let height = -dot(light.normal_ws, to_first);
    if height <= 0.0 && (light.kind & LIGHT_DOUBLE_SIDED) == 0u {
        return point;
    }
    let spherical = spherical_light(light, to_first);
    var cosine: f32;
    var pdf: f32;
    if spherical.solid_angle > 0.0 {
        point.wi_ws = sample_spherical_triangle(spherical, u);
        cosine = abs(dot(light.normal_ws, point.wi_ws));
        point.distance = abs(height) / cosine;
        pdf = 1.0 / spherical.solid_angle;
    } else {
        let at = uniform_triangle(u);
        let towards = to_first + light.edge1_ws * at.x + light.edge2_ws * at.y;
        let distance_sq = dot(towards, towards);
        let inverse = 1.0 / sqrt(distance_sq);
        point.wi_ws = towards * inverse;
        cosine = abs(dot(light.normal_ws, point.wi_ws));
        point.distance = distance_sq * inverse;
        pdf = distance_sq / (cosine * light.area);
    }
    if cosine > LEAST_COSINE && pdf > 0.0 && is_finite(pdf) && point.distance > 0.0 {
        point.pdf_solid_angle = pdf;
    }
    return point;
}

// twin: crates/scene/src/light/triangle.rs pdf_triangle
fn light_pdf(light: Light, from_ws: vec3<f32>, wi_ws: vec3<f32>, distance: f32) -> f32 {
    if is_delta(light) {
        return 0.0;
    }
    let facing = -dot(light.normal_ws, wi_ws);
    let cosine = select(facing, abs(facing), (light.kind & LIGHT_DOUBLE_SIDED) != 0u);
    if cosine <= LEAST_COSINE {
        return 0.0;
    }
    let spherical = spherical_light(light, light.position_ws - from_ws);
    var pdf = distance * distance / (cosine * light.area);
    if spherical.solid_angle > 0.0 {
        pdf = 1.0 / spherical.solid_angle;
    }
    return select(0.0, pdf, is_finite(pdf));
}

// twin: crates/scene/src/light/punctual.rs illuminate
fn sample_punctual_light(light: Light, at_ws: vec3<f32>) -> LightPoint {
    let kind = light.kind & 255u;
    var point = LightPoint(-light.normal_ws, FAR, light.intensity, 0.0);
    if kind != DIRECTIONAL_LIGHT {
        let towards = light.position_ws - at_ws;
        let distance_sq = dot(towards, towards);
        let inverse = 1.0 / sqrt(distance_sq);
        point.wi_ws = towards * inverse;
        point.distance = distance_sq * inverse;
        var share = 1.0;
        if kind == SPOT_LIGHT {
            let width = max(light.cos_inner - light.cos_outer, 1e-7);
            let ramp = clamp((-dot(point.wi_ws, light.normal_ws) - light.cos_outer) / width, 0.0, 1.0);
            share = ramp * ramp;
        }
        if light.range < FAR {
            let ratio_sq = distance_sq / (light.range * light.range);
            share *= max(1.0 - ratio_sq * ratio_sq, 0.0);
        }
        point.radiance = light.intensity * (share * inverse * inverse);
    }
    if max_element(point.radiance) > 0.0 && is_finite(point.radiance.x + point.radiance.y + point.radiance.z) {
        point.pdf_solid_angle = 1.0;
    }
    return point;
}

// twin: crates/scene/src/light/triangle.rs barycentrics
fn light_barycentrics(light: Light, from_ws: vec3<f32>, wi_ws: vec3<f32>, distance: f32) -> vec2<f32> {
    let at = from_ws - light.position_ws + wi_ws * distance;
    let normal = cross(light.edge1_ws, light.edge2_ws);
    let scale = 1.0 / max(dot(normal, normal), MIN_POSITIVE);
    let u = clamp(dot(cross(at, light.edge2_ws), normal) * scale, 0.0, 1.0);
    return vec2<f32>(u, clamp(dot(cross(light.edge1_ws, at), normal) * scale, 0.0, 1.0 - u));
}

// twin: crates/scene/src/scene.rs sample_light
fn sample_light(light: Light, from_ws: vec3<f32>, u: vec2<f32>) -> LightPoint {
    if is_delta(light) {
        return sample_punctual_light(light, from_ws);
    }
    var point = sample_triangle_light(light, from_ws, u);
    if HAS_DETAIL && (light.kind & LIGHT_TEXTURED) != 0u && point.pdf_solid_angle > 0.0 {
        let at = light_barycentrics(light, from_ws, point.wi_ws, point.distance);
        let id = light.primitive;
        let record = scene.triangles + (details[instance_at(id.x) + INSTANCE_FIRST_TRIANGLE] + id.y) * TRIANGLE_WORDS;
        let material = material_at(details[record + 4u] & 0x3fffffffu);
        point.radiance = emission(place_on(mesh_of(id.x), id.y, at.x, at.y), material);
        if is_black(point.radiance) {
            point.pdf_solid_angle = 0.0;
        }
    }
    return point;
}
