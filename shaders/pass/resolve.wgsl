// Edges smoothed over time: crates/render/src/clean/resolve.rs.
#import "clean/kept.wgsl"
#import "clean/projection.wgsl"
#import "lib/constants.wgsl"
#import "record/clean.wgsl"

@group(3) @binding(1) var<storage, read> guides: array<Guide>;
@group(3) @binding(2) var<storage, read> picture: array<vec4<f32>>;
@group(3) @binding(3) var<storage, read> typical_luminance: array<f32>;
// Radiance, and the samples that it rests on.
@group(3) @binding(4) var<storage, read> shown_before: array<vec4<f32>>;
@group(3) @binding(5) var<storage, read_write> shown: array<vec4<f32>>;

// twin: crates/render/src/clean/resolve.rs CLIP
const CLIP: f32 = 1.0;

// Of the three by three pixels around.
struct Neighbourhood {
    mean: vec3<f32>,
    deviation: vec3<f32>,
    // The point nearest to the camera, whose edge it is.
    nearest_ws: vec3<f32>,
    // FAR: there is none.
    depth: f32,
}

// What was shown at a place.
struct Past {
    radiance: vec3<f32>,
    // 0 outside.
    samples: f32,
}

// Radiance to 0..1 (Karis 2014): what is bright counts less.
// twin: crates/render/src/clean/resolve.rs compress
fn compress(color: vec3<f32>) -> vec3<f32> {
    return color / (1.0 + luminance(color));
}

// twin: crates/render/src/clean/resolve.rs expand
fn expand(color: vec3<f32>) -> vec3<f32> {
    return color / max(1.0 - luminance(color), 1e-4);
}

// twin: crates/render/src/clean/resolve.rs catmull_rom
fn catmull_rom(f: f32) -> array<f32, 4> {
    return array<f32, 4>(
        f * (-0.5 + f * (1.0 - 0.5 * f)),
        1.0 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2.0 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f),
    );
}

// What was shown at this share of width and height.
// twin: crates/render/src/clean/resolve.rs at
fn shown_at(at_share: vec2<f32>) -> Past {
    if any(at_share < vec2<f32>(0.0)) || any(at_share > vec2<f32>(1.0)) {
        return Past();
    }
    let size = vec2<i32>(i32(clean.before.width), i32(clean.before.height));
    let at = at_share * vec2<f32>(size) - 0.5;
    let corner = floor(at);
    let f = at - corner;
    var columns = catmull_rom(f.x);
    var rows = catmull_rom(f.y);
    var sum = vec3<f32>(0.0);
    var least = vec3<f32>(FLT_MAX);
    var most = vec3<f32>(0.0);
    for (var dy = 0; dy < 4; dy++) {
        for (var dx = 0; dx < 4; dx++) {
            let tap = clamp(vec2<i32>(corner) + vec2<i32>(dx, dy) - 1, vec2<i32>(0), size - 1);
            let pixel = shown_before[u32(tap.y * size.x + tap.x)].rgb;
            sum += pixel * (rows[dy] * columns[dx]);
            if dx >= 1 && dx < 3 && dy >= 1 && dy < 3 {
                least = min(least, pixel);
                most = max(most, pixel);
            }
        }
    }
    let nearest = vec2<u32>(min(at + 0.5, vec2<f32>(size) - 1.0));
    let samples = shown_before[nearest.y * clean.before.width + nearest.x].w;
    // The cubic overshoots at edges.
    return Past(clamp(sum, least, most), samples);
}

// twin: crates/render/src/clean/resolve.rs neighbourhood
fn neighbourhood(at: vec2<u32>, scale: f32) -> Neighbourhood {
    var found: Neighbourhood;
    found.depth = FAR;
    var count = 0.0;
    var sum = vec3<f32>(0.0);
    var sum_sq = vec3<f32>(0.0);
    let first = at - min(at, vec2<u32>(1u));
    let end = min(at + 2u, vec2<u32>(clean.now.width, clean.now.height));
    for (var v = first.y; v < end.y; v++) {
        for (var u = first.x; u < end.x; u++) {
            let pixel = pixel_at(vec2<u32>(u, v));
            let compressed = compress(picture[pixel].rgb * scale);
            count += 1.0;
            sum += compressed;
            sum_sq += compressed * compressed;
            if guides[pixel].depth < found.depth {
                found.depth = guides[pixel].depth;
                found.nearest_ws = guides[pixel].position;
            }
        }
    }
    found.mean = sum / count;
    found.deviation = sqrt(max(sum_sq / count - found.mean * found.mean, vec3<f32>(0.0)));
    return found;
}

// The point on the way from `color` to `mean` that first lies in the box of half size `reach` around it.
// twin: crates/render/src/clean/resolve.rs drawn_towards
fn drawn_towards(color: vec3<f32>, mean: vec3<f32>, reach: vec3<f32>) -> vec3<f32> {
    let away = color - mean;
    let excess = max_element(abs(away) / max(reach, vec3<f32>(1e-6)));
    if excess > 1.0 {
        return mean + away / excess;
    }
    return color;
}

// What was shown before where the nearest surface around a pixel was then.
fn shown_there(id: vec2<u32>, around: Neighbourhood) -> Past {
    if clean.before.width == 0u || around.depth >= FAR {
        return Past();
    }
    let now = share(clean.now, around.nearest_ws);
    let before = share(clean.before, around.nearest_ws);
    if !now.exists || !before.exists {
        return Past();
    }
    let size = vec2<f32>(f32(clean.now.width), f32(clean.now.height));
    return shown_at((vec2<f32>(id) + 0.5) / size + (before.at - now.at));
}

// twin: crates/render/src/clean/resolve.rs resolve
@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy) {
        return;
    }
    let pixel = pixel_at(id.xy);
    let radiance = picture[pixel].rgb;
    let scale = 1.0 / typical_luminance[0];
    let around = neighbourhood(id.xy, scale);
    let past = shown_there(id.xy, around);
    if !(past.samples > 0.0) {
        shown[pixel] = vec4<f32>(radiance, clean.spp);
        return;
    }
    let kept = samples_kept(past.samples, clean.spp);
    let known = drawn_towards(compress(past.radiance * scale), around.mean, around.deviation * CLIP);
    let mixed = mix(known, compress(radiance * scale), clean.spp / (clean.spp + kept));
    shown[pixel] = vec4<f32>(expand(mixed) / scale, clean.spp + kept);
}
