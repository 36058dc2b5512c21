// The BSDF: a Lambert lobe under a GGX lobe. See crates/scene/src/bsdf.rs for the model.
#import "lib/constants.wgsl"
#import "lib/ggx.wgsl"
#import "lib/hemisphere.wgsl"
#import "light_cache/guide.wgsl"
#import "scene/bindings.wgsl"

struct Bsdf {
    normal_ws: vec3<f32>,
    alpha: f32,
    diffuse: vec3<f32>,
    f90: f32,
    f0: vec3<f32>,
}

struct BsdfValue {
    // BSDF x cosine.
    value: vec3<f32>,
    // Density of sampling, solid angle.
    pdf: f32,
    // What it would be without a guide.
    pdf_unguided: f32,
}

struct BsdfSample {
    wi_ws: vec3<f32>,
    // 0: absorbed.
    pdf: f32,
    value: vec3<f32>,
    pdf_unguided: f32,
}

// Rows and columns of the table of specular albedos.
// twin: crates/scene/src/bsdf/albedo.rs ROWS
const ALBEDO_ROWS: u32 = 16u;
// twin: crates/scene/src/bsdf/albedo.rs COLUMNS
const ALBEDO_COLUMNS: u32 = 32u;
// twin: crates/scene/src/bsdf/albedo.rs LEAST
const ALBEDO_LEAST: f32 = 0.03162278;

struct SpecularAlbedo {
    reflectance: vec2<f32>,
    row: u32,
    fraction: f32,
}

// twin: crates/scene/src/bsdf/albedo.rs new
fn specular_albedo(bsdf: Bsdf) -> SpecularAlbedo {
    let place = max(sqrt(bsdf.alpha) - ALBEDO_LEAST, 0.0) * (f32(ALBEDO_ROWS - 1u) / (1.0 - ALBEDO_LEAST));
    let row = min(u32(place), ALBEDO_ROWS - 2u);
    return SpecularAlbedo(vec2<f32>(max_element(bsdf.f0), bsdf.f90), row, place - f32(row));
}

fn albedo_entry(row: u32, column: u32) -> vec2<f32> {
    return detail_vec2(scene.albedo + 2u * (row * ALBEDO_COLUMNS + column));
}

fn albedo_along(row: u32, column: u32, fraction: f32) -> vec2<f32> {
    return albedo_entry(row, column) * (1.0 - fraction) + albedo_entry(row, column + 1u) * fraction;
}

// twin: crates/scene/src/bsdf/albedo.rs at
fn albedo_at(albedo: SpecularAlbedo, cosine: f32) -> f32 {
    let place = sqrt(max(cosine, 0.0)) * f32(ALBEDO_COLUMNS - 1u);
    let column = min(u32(place), ALBEDO_COLUMNS - 2u);
    let fraction = place - f32(column);
    let low = albedo_along(albedo.row, column, fraction);
    let high = albedo_along(albedo.row + 1u, column, fraction);
    return dot(low * (1.0 - albedo.fraction) + high * albedo.fraction, albedo.reflectance);
}

// twin: crates/scene/src/bsdf.rs MOST_COUPLING
const MOST_COUPLING: f32 = 2.0;

// twin: crates/scene/src/bsdf/albedo.rs mean
fn albedo_mean(albedo: SpecularAlbedo) -> f32 {
    let means = scene.albedo + 2u * ALBEDO_ROWS * ALBEDO_COLUMNS;
    let low = detail_vec2(means + 2u * albedo.row);
    let high = detail_vec2(means + 2u * albedo.row + 2u);
    return dot(low * (1.0 - albedo.fraction) + high * albedo.fraction, albedo.reflectance);
}

// twin: crates/scene/src/bsdf.rs is_lambert
fn is_lambert(bsdf: Bsdf) -> bool {
    return bsdf.f90 == 0.0 && is_black(bsdf.f0);
}

// twin: crates/scene/src/bsdf.rs fresnel
fn fresnel(bsdf: Bsdf, cosine: f32) -> vec3<f32> {
    let away = clamp(1.0 - cosine, 0.0, 1.0);
    let fifth = (away * away) * (away * away) * away;
    return bsdf.f0 + (vec3<f32>(bsdf.f90) - bsdf.f0) * fifth;
}

// twin: crates/scene/src/bsdf.rs specular_probability
fn specular_probability(bsdf: Bsdf, specular: f32) -> f32 {
    let diffuse = max_element(bsdf.diffuse) * (1.0 - specular);
    if diffuse <= 0.0 {
        return 1.0;
    }
    return clamp(specular / (specular + diffuse), 0.1, 0.9);
}

// With the diffuse lobe drawn as `guide` says, unless that is NO_GUIDE.
// twin: crates/scene/src/bsdf.rs eval_pdf_guided
fn eval_bsdf(bsdf: Bsdf, wo_ws: vec3<f32>, wi_ws: vec3<f32>, guide: u32) -> BsdfValue {
    let cos_i = dot(bsdf.normal_ws, wi_ws);
    if !(cos_i > 0.0) {
        return BsdfValue(vec3<f32>(0.0), 0.0, 0.0);
    }
    let lambert = cos_i * FRAC_1_PI;
    let factor = guide_density(guide, bsdf.normal_ws, wi_ws);
    if is_lambert(bsdf) {
        return BsdfValue(bsdf.diffuse * lambert, lambert * factor, lambert);
    }
    return eval_layered(bsdf, wo_ws, wi_ws, cos_i, factor);
}

// The diffuse lobe's density is multiplied by `factor`.
// twin: crates/scene/src/bsdf.rs layered
fn eval_layered(bsdf: Bsdf, wo_ws: vec3<f32>, wi_ws: vec3<f32>, cos_i: f32, factor: f32) -> BsdfValue {
    let cos_o = dot(bsdf.normal_ws, wo_ws);
    let sum = wo_ws + wi_ws;
    let sum_sq = dot(sum, sum);
    if cos_o <= 0.0 || sum_sq <= 0.0 {
        return BsdfValue(vec3<f32>(0.0), 0.0, 0.0);
    }
    let half = sum / sqrt(sum_sq);
    let alpha_sq = bsdf.alpha * bsdf.alpha;
    let cos_h = dot(bsdf.normal_ws, half);
    let across = cross(bsdf.normal_ws, half);
    let t = dot(across, across) + cos_h * cos_h * alpha_sq;
    let d = alpha_sq / t / (PI * t);
    let seen_o = sqrt(cos_o * cos_o + alpha_sq * max(1.0 - cos_o * cos_o, 0.0));
    let seen_i = sqrt(cos_i * cos_i + alpha_sq * max(1.0 - cos_i * cos_i, 0.0));
    let visibility = 0.5 / (cos_i * seen_o + cos_o * seen_i);
    let specular = fresnel(bsdf, dot(wo_ws, half)) * (d * visibility * cos_i);
    let pdf_specular = d / (2.0 * (cos_o + seen_o));
    let lambert = cos_i * FRAC_1_PI;
    let albedo = specular_albedo(bsdf);
    let albedo_o = albedo_at(albedo, cos_o);
    let probability = specular_probability(bsdf, albedo_o);
    let from_specular = probability * pdf_specular;
    let from_diffuse = (1.0 - probability) * lambert;
    let mean = 1.0 - albedo_mean(albedo);
    var coupling = 0.0;
    if mean > 1e-6 {
        coupling = min(max((1.0 - albedo_at(albedo, cos_i)) * (1.0 - albedo_o), 0.0) / mean, MOST_COUPLING);
    }
    let value = specular + bsdf.diffuse * (coupling * lambert);
    return BsdfValue(value, from_specular + from_diffuse * factor, from_specular + from_diffuse);
}

// twin: crates/scene/src/bsdf.rs sample_guided
// twin: crates/scene/src/bsdf.rs sample_layered
fn sample_bsdf(bsdf: Bsdf, wo_ws: vec3<f32>, u_lobe: f32, u: vec2<f32>, guide: u32) -> BsdfSample {
    let around = frame_around(bsdf.normal_ws);
    var wi_ws: vec3<f32>;
    var lambert = 0.0;
    var factor = 1.0;
    var is_specular = false;
    if !is_lambert(bsdf) {
        let cos_o = dot(bsdf.normal_ws, wo_ws);
        is_specular = u_lobe < specular_probability(bsdf, albedo_at(specular_albedo(bsdf), cos_o));
    }
    if is_specular {
        let wo = to_local(around, wo_ws);
        let half = sample_vndf(wo, bsdf.alpha, u);
        wi_ws = normalize(to_world(around, half * (2.0 * dot(wo, half)) - wo));
    } else if GUIDED && guide != NO_GUIDE {
        let guided = sample_guide(guide, bsdf.normal_ws, u);
        wi_ws = guided.direction_ws;
        factor = guided.factor;
        // Rounding can put it on the horizon.
        lambert = max(dot(bsdf.normal_ws, wi_ws), 0.0) * FRAC_1_PI;
    } else {
        let local = cosine_hemisphere(u);
        wi_ws = to_world(around, local);
        lambert = local.z * FRAC_1_PI;
    }
    if is_lambert(bsdf) {
        return BsdfSample(wi_ws, lambert * factor, bsdf.diffuse * lambert, lambert);
    }
    let value = eval_bsdf(bsdf, wo_ws, wi_ws, guide);
    let usable = value.pdf > 0.0 && is_finite(value.pdf) && is_finite(value.value.x + value.value.y + value.value.z);
    return BsdfSample(wi_ws, select(0.0, value.pdf, usable), value.value, value.pdf_unguided);
}
