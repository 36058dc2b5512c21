// What a path notes: rays, what its vertices found out about lights, and what its bounces found.
#import "lib/constants.wgsl"
#import "light_cache/guide.wgsl"
#import "record/film.wgsl"

// Of the path pass.
@group(3) @binding(1) var<storage, read_write> observations: array<Observation>;

// Whether the sampler wants to know what paths find out.
override LEARNS: bool = false;

// Bounces of a path that are learned from.
// twin: crates/render/src/bounces.rs MOST
const MOST: u32 = 8u;

struct Log {
    rays_nearest: u32,
    rays_occluded: u32,
    observations: u32,
    pixel: u32,
    // The light that was chosen at the last vertex, the first of several, or NONE.
    light: u32,
}

// A bounce on its way.
// twin: crates/render/src/bounces.rs Open
struct Open {
    // The observation that was made where it began: its place among all.
    observation: u32,
    // The direction.
    part: u32,
    // Luminance of what the path had found before.
    before: f32,
    // Luminance of what the path is worth from then on.
    throughput: f32,
}

// The bounces of one path, whose outcome is known when it is over.
// twin: crates/render/src/bounces.rs Bounces
struct Bounces {
    open: array<Open, MOST>,
    count: u32,
}

// The path has left the point of that observation with `throughput`, having found `radiance` so far.
// twin: crates/render/src/bounces.rs begin
fn begin_bounce(
    bounces: ptr<function, Bounces>,
    observation: u32,
    normal_ws: vec3<f32>,
    wi_ws: vec3<f32>,
    radiance: vec3<f32>,
    throughput: vec3<f32>,
) {
    if (*bounces).count < MOST {
        let part = part_of(normal_ws, wi_ws);
        (*bounces).open[(*bounces).count] = Open(observation, part, luminance(radiance), luminance(throughput));
        (*bounces).count += 1u;
    }
}

// The path is over and has found `radiance` in all.
// twin: crates/render/src/bounces.rs end
fn end_bounces(bounces: ptr<function, Bounces>, radiance: vec3<f32>) {
    let all = luminance(radiance);
    for (var i = 0u; i < (*bounces).count; i++) {
        let open = (*bounces).open[i];
        // Rounding can take away more than was found before.
        let found = max(all - open.before, 0.0) / open.throughput;
        if is_finite(found) {
            observations[open.observation].flags |= OBSERVED_BOUNCE | (open.part << OBSERVED_PART);
            observations[open.observation].bounce_radiance = found;
        }
    }
}
