// Takes a film's picture apart: what falls on the surfaces, and what is known of the surfaces.
#import "clean/film.wgsl"
#import "lib/constants.wgsl"
#import "record/aov.wgsl"
#import "record/clean.wgsl"
#import "record/film.wgsl"

@group(3) @binding(1) var<storage, read> film: array<FilmPixel>;
@group(3) @binding(2) var<storage, read> aovs: array<AovPixel>;
@group(3) @binding(3) var<storage, read_write> guides: array<Guide>;
@group(3) @binding(4) var<storage, read_write> tints: array<Tint>;
// What falls on each surface; w is the variance of its luminance, 0 where that is not known yet.
@group(3) @binding(5) var<storage, read_write> light: array<vec4<f32>>;

// twin: crates/render/src/clean/frame.rs BLACK
const BLACK: f32 = 0.02;

// twin: crates/render/src/film/blocks.rs variance
fn variance_of(mean: vec4<f32>, count: u32) -> f32 {
    let y = luminance(mean.rgb);
    let variance = max(mean.w - y * y, 0.0) * clean.variance_scale;
    return select(0.0, variance, count >= 2u && is_finite(variance));
}

// twin: crates/render/src/clean/frame.rs Frame
@compute @workgroup_size(8, 8)
fn split(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy) {
        return;
    }
    let pixel = pixel_at(id.xy);
    let sums = aovs[pixel];
    let per_sample = 1.0 / clean.spp;
    let per_hit = 1.0 / f32(max(sums.hits, 1u));
    let first = sums.hi[0] + sums.lo[0];
    let second = sums.hi[1] + sums.lo[1];
    let third = sums.hi[2] + sums.lo[2];
    let albedo = first.xyz * per_sample;
    let normal = vec3<f32>(first.w, second.xy) * per_sample;
    let emitted = third.yzw * per_sample;
    let depth = (sums.depth_hi + sums.depth_lo) * per_hit;

    let reflects = sums.hits > 0u && luminance(albedo) >= BLACK;
    let turned = length(normal);
    var guide: Guide;
    guide.normal = select(vec3<f32>(0.0), normal / max(turned, MIN_POSITIVE), turned > 0.0);
    guide.footprint = select(0.0, depth * clean.pixel_size, reflects);
    guide.position = vec3<f32>(second.zw, third.x) * per_hit;
    guide.depth = select(FAR, depth, sums.hits > 0u);
    guides[pixel] = guide;

    let seen = film[pixel];
    let raw = mean_of(seen);
    let reflected = max(albedo, vec3<f32>(BLACK));
    let scale = max(luminance(albedo), BLACK);
    let irradiance = max(raw.rgb - emitted, vec3<f32>(0.0)) / reflected;
    light[pixel] = vec4<f32>(irradiance, variance_of(raw, seen.count) / (scale * scale));

    var tint: Tint;
    let is_surface = guide.footprint > 0.0;
    tint.reflected = select(vec3<f32>(0.0), reflected, is_surface);
    tint.added = select(raw.rgb, emitted, is_surface);
    tints[pixel] = tint;
}
