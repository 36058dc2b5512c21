// Points on a triangle, by area and by solid angle.
#import "lib/constants.wgsl"
#import "lib/hemisphere.wgsl"

// twin: crates/sampling/src/triangle.rs uniform_triangle
fn uniform_triangle(u: vec2<f32>) -> vec2<f32> {
    if u.y > u.x {
        let b1 = 0.5 * u.x;
        return vec2<f32>(b1, u.y - b1);
    }
    let b2 = 0.5 * u.y;
    return vec2<f32>(u.x - b2, b2);
}

// twin: crates/sampling/src/triangle.rs atan2_upper
fn atan2_upper(y: f32, x: f32) -> f32 {
    let steep = y > abs(x);
    var z = y / abs(x);
    if steep {
        z = abs(x) / y;
    }
    let q = z * z;
    var sum = -0.004559792;
    sum = sum * q + 0.02378052;
    sum = sum * q - 0.058829753;
    sum = sum * q + 0.098688655;
    sum = sum * q - 0.1400329;
    sum = sum * q + 0.19966962;
    sum = sum * q - 0.33331813;
    sum = sum * q + 0.9999999;
    var angle = z * sum;
    if steep {
        angle = FRAC_PI_2 - angle;
    }
    return select(angle, PI - angle, x < 0.0);
}

// twin: crates/sampling/src/triangle.rs SphericalTriangle
struct SphericalTriangle {
    // 0 if there is none.
    solid_angle: f32,
    a: vec3<f32>,
    b_minus_a: vec3<f32>,
    tangent_ac: vec3<f32>,
    half_ab: vec2<f32>,
    half_ac: vec2<f32>,
    sin_alpha: f32,
    cos_alpha: f32,
}

// twin: crates/sampling/src/triangle.rs new
fn spherical_triangle(first: vec3<f32>, second: vec3<f32>, third: vec3<f32>) -> SphericalTriangle {
    let unit = 1.0 / length(first);
    let a = first * unit;
    let edge_ab = (second - first) * unit;
    let edge_ac = (third - first) * unit;
    let b = a + edge_ab;
    let c = a + edge_ac;
    let length_b = length(b);
    let length_c = length(c);
    let dot_ab = dot(a, b);
    let dot_ac = dot(a, c);
    let determinant = abs(dot(a, cross(edge_ab, edge_ac)));
    let denominator = length_b * length_c + dot(b, c) + dot_ab * length_c + dot_ac * length_b;
    let solid_angle = 2.0 * atan2_upper(determinant, denominator);
    let normal_ab = cross(a, edge_ab);
    let normal_ac = cross(a, edge_ac);
    let sin_ab = length(normal_ab);
    let sin_ac = length(normal_ac);
    let per_normals = 1.0 / (sin_ab * sin_ac);
    var triangle: SphericalTriangle;
    if !(solid_angle > 0.0 && is_finite(solid_angle) && per_normals > 0.0 && is_finite(per_normals)) {
        return triangle;
    }
    let per_lengths = 1.0 / (length_b * (1.0 + length_b));
    let length_change = dot(edge_ab, a + b) * (per_lengths * length_b);
    triangle.solid_angle = solid_angle;
    triangle.a = a;
    triangle.b_minus_a = (edge_ab - a * length_change) * (per_lengths * (1.0 + length_b));
    triangle.tangent_ac = cross(normal_ac, a) * (sin_ab * per_normals);
    triangle.half_ab = vec2<f32>(sin_ab, length_b + dot_ab);
    triangle.half_ac = vec2<f32>(sin_ac, length_c + dot_ac);
    triangle.sin_alpha = determinant * per_normals;
    triangle.cos_alpha = dot(normal_ab, normal_ac) * per_normals;
    return triangle;
}

// twin: crates/sampling/src/triangle.rs sample
fn sample_spherical_triangle(triangle: SphericalTriangle, u: vec2<f32>) -> vec3<f32> {
    let half = unit_circle(triangle.solid_angle * u.x * (0.25 / PI));
    let angle_rest = max(triangle.sin_alpha * half.x - triangle.cos_alpha * half.y, 0.0);
    var t = vec2<f32>(half.y * triangle.half_ab.y, angle_rest * triangle.half_ab.x);
    if t.x * triangle.half_ac.y > t.y * triangle.half_ac.x {
        t = triangle.half_ac;
    }
    let scale = 2.0 * t.x / max(dot(t, t), MIN_POSITIVE);
    let versine_ad = scale * t.x;
    let sin_ad = scale * t.y;
    let d_minus_b = triangle.tangent_ac * sin_ad - triangle.a * versine_ad - triangle.b_minus_a;
    let b = triangle.a + triangle.b_minus_a;
    let versine_bd = 0.5 * dot(d_minus_b, d_minus_b);
    var tangent = d_minus_b + b * versine_bd;
    let size = length(tangent);
    if size > 0.0 {
        tangent = tangent * (1.0 / size);
    } else {
        tangent = vec3<f32>(0.0);
    }
    let versine = u.y * versine_bd;
    let sine = sqrt(max(versine * (2.0 - versine), 0.0));
    return normalize(b * (1.0 - versine) + tangent * sine);
}
