// What earlier pictures knew about the light on the surfaces of this one: crates/render/src/clean/history.rs. A workgroup is a block, in
// which history is tested against the new samples.
#import "clean/guide.wgsl"
#import "clean/kept.wgsl"
#import "clean/projection.wgsl"
#import "lib/constants.wgsl"
#import "record/clean.wgsl"

@group(3) @binding(1) var<storage, read> guides: array<Guide>;
@group(3) @binding(2) var<storage, read> guides_before: array<Guide>;
@group(3) @binding(3) var<storage, read> known_before: array<Known>;
@group(3) @binding(4) var<storage, read_write> known_now: array<Known>;
// The new samples' light, then the mean with what was known, and its variance.
@group(3) @binding(5) var<storage, read_write> light: array<vec4<f32>>;

// twin: crates/render/src/clean/history.rs ALIKE_NORMALS
const ALIKE_NORMALS: f32 = 0.9;
// twin: crates/render/src/clean/history.rs ALIKE_PLANES
const ALIKE_PLANES: f32 = 1.0;
// twin: crates/render/src/clean/history.rs BLOCK
const BLOCK: u32 = 8u;
// twin: crates/render/src/clean/history.rs LEAST_TESTED
const LEAST_TESTED: f32 = 16.0;
// twin: crates/render/src/clean/history.rs CONTRADICTION
const CONTRADICTION: f32 = 4.0;
// twin: crates/render/src/clean/history.rs TWO_SAMPLES
const TWO_SAMPLES: f32 = 1.999;
// twin: crates/render/src/clean/history.rs LEAST
const LEAST: f32 = 0.05;

const PIXELS: u32 = BLOCK * BLOCK;
var<workgroup> differences: array<f32, PIXELS>;
var<workgroup> is_tested: array<bool, PIXELS>;
var<workgroup> trusted: f32;

// twin: crates/render/src/clean/history.rs is_same
fn is_same(a: Guide, b: Guide) -> bool {
    if dot(a.normal, b.normal) < ALIKE_NORMALS {
        return false;
    }
    if a.footprint > b.footprint {
        return off_plane(a, b.position) <= ALIKE_PLANES;
    }
    return off_plane(b, a.position) <= ALIKE_PLANES;
}

// Adds what is known at `at` in the picture before, if it shows the surface; returns the weight.
fn add_known(sum: ptr<function, Known>, at: vec2<i32>, weight: f32, guide: Guide) -> f32 {
    let size = vec2<i32>(i32(clean.before.width), i32(clean.before.height));
    if any(at < vec2<i32>(0)) || any(at >= size) {
        return 0.0;
    }
    let pixel = u32(at.y * size.x + at.x);
    let known = known_before[pixel];
    if !(known.samples > 0.0) || !is_same(guide, guides_before[pixel]) {
        return 0.0;
    }
    (*sum).irradiance += known.irradiance * weight;
    (*sum).luminance_sq += known.luminance_sq * weight;
    (*sum).samples += known.samples * weight;
    (*sum).spread += known.spread * weight;
    return weight;
}

// The mean of what was added; nothing if the weights sum to less than `least`.
// twin: crates/render/src/clean/history.rs mean
fn mean_known(sum: Known, weights: f32, least: f32) -> Known {
    if weights < least {
        return Known();
    }
    let scale = 1.0 / weights;
    var mean: Known;
    mean.irradiance = sum.irradiance * scale;
    mean.luminance_sq = sum.luminance_sq * scale;
    mean.samples = sum.samples * scale;
    mean.spread = sum.spread * scale;
    return mean;
}

// Places far aside stay outside, whatever a cast to integers makes of them.
fn whole(at: vec2<f32>) -> vec2<i32> {
    return vec2<i32>(clamp(floor(at), vec2<f32>(-65536.0), vec2<f32>(65536.0)));
}

// What is known about the surface at `at`, in pixels, between the four pixels around it.
// twin: crates/render/src/clean/history.rs bilinear
fn bilinear(at: vec2<f32>, guide: Guide) -> Known {
    let corner = whole(at - 0.5);
    let f = at - 0.5 - floor(at - 0.5);
    var sum: Known;
    var weights = 0.0;
    for (var tap = 0u; tap < 4u; tap++) {
        let offset = vec2<u32>(tap & 1u, tap >> 1u);
        let parts = select(1.0 - f, f, offset == vec2<u32>(1u));
        weights += add_known(&sum, corner + vec2<i32>(offset), parts.x * parts.y, guide);
    }
    return mean_known(sum, weights, LEAST);
}

// What is known about it in the three by three pixels around `at`: at the edges of things, where samples fall on either side.
// twin: crates/render/src/clean/history.rs near
fn near(at: vec2<f32>, guide: Guide) -> Known {
    let middle = whole(at);
    var sum: Known;
    var weights = 0.0;
    for (var tap = 0; tap < 9; tap++) {
        weights += add_known(&sum, middle + vec2<i32>(tap % 3 - 1, tap / 3 - 1), 1.0, guide);
    }
    return mean_known(sum, weights, 0.5);
}

// What was known about the surface of a pixel.
// twin: crates/render/src/clean/history.rs looked_up
fn looked_up(id: vec2<u32>, guide: Guide) -> Known {
    if clean.before.width == 0u || !is_surface(guide) {
        return Known();
    }
    let now = share(clean.now, guide.position);
    let before = share(clean.before, guide.position);
    if !now.exists || !before.exists {
        return Known();
    }
    let size = vec2<f32>(f32(clean.now.width), f32(clean.now.height));
    let size_before = vec2<f32>(f32(clean.before.width), f32(clean.before.height));
    let center = (vec2<f32>(id) + 0.5) / size;
    // The pixel's centre, and not the sample within it: else every picture would shift its history by the jitter.
    let at = (before.at + center - now.at) * size_before;
    var known = bilinear(at, guide);
    if !(known.samples > 0.0) {
        known = near(at, guide);
    }
    // Samples of coarser pixels are shared by several of the finer ones.
    known.samples *= min(size_before.x * size_before.y / (size.x * size.y), 1.0);
    return known;
}

// How far history is to be trusted, 0..1.
// twin: crates/render/src/clean/history.rs trust
fn trust() -> f32 {
    var count = 0.0;
    var sum = 0.0;
    var sum_sq = 0.0;
    for (var i = 0u; i < PIXELS; i++) {
        if is_tested[i] {
            count += 1.0;
            sum += differences[i];
            sum_sq += differences[i] * differences[i];
        }
    }
    if count < LEAST_TESTED {
        return 1.0;
    }
    let mean = sum / count;
    let error_sq = max(sum_sq / count - mean * mean, 0.0) / count;
    return min(CONTRADICTION * CONTRADICTION * error_sq / max(mean * mean, 1e-20), 1.0);
}

// With the light of `spp` samples more, where what was known counts as `kept` samples.
// twin: crates/render/src/clean/history.rs with
fn with_samples(known: Known, light: vec4<f32>, spp: f32, kept: f32) -> Known {
    let share = spp / (spp + kept);
    let y = luminance(light.rgb);
    let y_sq = y * y + light.w * spp;
    let old = 1.0 - share;
    var now: Known;
    now.irradiance = known.irradiance * old + light.rgb * share;
    now.luminance_sq = known.luminance_sq * old + y_sq * share;
    now.samples = spp + kept;
    now.spread = known.spread * old * old + share * share / spp;
    return now;
}

// Of the mean's luminance; 0 after one sample.
// twin: crates/render/src/clean/history.rs variance
fn variance_known(known: Known) -> f32 {
    if known.samples < TWO_SAMPLES {
        return 0.0;
    }
    let y = luminance(known.irradiance);
    let unbiased = max(1.0 - known.spread, 0.5);
    let variance = max(known.luminance_sq - y * y, 0.0) * known.spread / unbiased;
    return select(0.0, variance, is_finite(variance));
}

// twin: crates/render/src/clean/history.rs accumulate
@compute @workgroup_size(BLOCK, BLOCK)
fn recall(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let inside = is_inside(id.xy);
    let pixel = pixel_at(id.xy);
    var guide: Guide;
    var seen = vec4<f32>(0.0);
    var known: Known;
    if inside {
        guide = guides[pixel];
        seen = light[pixel];
        known = looked_up(id.xy, guide);
    }
    is_tested[thread] = known.samples > 0.0;
    differences[thread] = luminance(seen.rgb) - luminance(known.irradiance);
    workgroupBarrier();
    if thread == 0u {
        trusted = trust();
    }
    workgroupBarrier();
    if !inside {
        return;
    }
    if is_surface(guide) {
        known = with_samples(known, seen, clean.spp, samples_kept(known.samples, clean.spp) * trusted);
    }
    known_now[pixel] = known;
    light[pixel] = vec4<f32>(known.irradiance, variance_known(known));
}
