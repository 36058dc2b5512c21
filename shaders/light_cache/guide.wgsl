// Directions of a hemisphere, drawn more often where much light comes from: a guide is 4 starts of rings, then 16 starts of sectors of each.
#import "lib/constants.wgsl"
#import "lib/hemisphere.wgsl"
#import "light_cache/bindings.wgsl"

// Whether bounces are guided.
override GUIDED: bool = false;
// No guide, or none in use.
const NO_GUIDE: u32 = 0xffffffffu;

// twin: crates/sampling/src/guide.rs RINGS
const RINGS: u32 = 4u;
// twin: crates/sampling/src/guide.rs SECTORS
const SECTORS: u32 = 16u;
const PARTS: u32 = RINGS * SECTORS;
// Tangent of an eighth of pi.
// twin: crates/sampling/src/guide.rs TAN
const TAN: f32 = SQRT_2 - 1.0;
// The largest number below 1.
const BELOW_ONE: f32 = 0.99999994;

struct GuidedDirection {
    direction_ws: vec3<f32>,
    // Times cosine / pi it is the density per sr.
    factor: f32,
}

struct GuideInterval {
    index: u32,
    start: f32,
    width: f32,
}

// One of the `count` intervals whose starts are the words from `at` on.
// twin: crates/sampling/src/guide.rs interval
fn guide_interval(at: u32, count: u32, index: u32) -> GuideInterval {
    let start = cache_f32(at + index);
    var end = 1.0;
    if index + 1u < count {
        end = cache_f32(at + index + 1u);
    }
    return GuideInterval(index, start, end - start);
}

// The one that holds `u`.
// twin: crates/sampling/src/guide.rs interval_at
fn guide_interval_at(at: u32, count: u32, u: f32) -> GuideInterval {
    var begun = vec4<u32>(0u);
    for (var four = 0u; four < count / 4u; four++) {
        let starts = bitcast<vec4<f32>>(cache[(at >> 2u) + four]);
        begun += select(vec4<u32>(0u), vec4<u32>(1u), starts <= vec4<f32>(u));
    }
    return guide_interval(at, count, begun.x + begun.y + begun.z + begun.w - 1u);
}

fn sectors_of(guide: u32, ring: u32) -> u32 {
    return guide + RINGS + ring * SECTORS;
}

// twin: crates/sampling/src/guide.rs sample
fn sample_guide(guide: u32, normal_ws: vec3<f32>, u: vec2<f32>) -> GuidedDirection {
    let ring = guide_interval_at(guide, RINGS, u.x);
    let sin_sq = (f32(ring.index) + min((u.x - ring.start) / ring.width, BELOW_ONE)) / f32(RINGS);
    let sector = guide_interval_at(sectors_of(guide, ring.index), SECTORS, u.y);
    let turn = (f32(sector.index) + min((u.y - sector.start) / sector.width, BELOW_ONE)) / f32(SECTORS);
    // The rim would be a direction of density 0.
    let z = sqrt(max(1.0 - sin_sq, 1e-9));
    let local = vec3<f32>(unit_circle(turn) * sqrt(sin_sq), z);
    return GuidedDirection(to_world(steady_frame(normal_ws), local), ring.width * sector.width * f32(PARTS));
}

// The factor of a direction, 1 where nothing is guided.
// twin: crates/sampling/src/guide.rs density
fn guide_density(guide: u32, normal_ws: vec3<f32>, direction_ws: vec3<f32>) -> f32 {
    if !GUIDED || guide == NO_GUIDE {
        return 1.0;
    }
    let part = part_of(normal_ws, direction_ws);
    let ring = guide_interval(guide, RINGS, part / SECTORS);
    let sector = guide_interval(sectors_of(guide, ring.index), SECTORS, part % SECTORS);
    return ring.width * sector.width * f32(PARTS);
}

// twin: crates/sampling/src/guide.rs part_of
fn part_of(normal_ws: vec3<f32>, direction_ws: vec3<f32>) -> u32 {
    let around = to_local(steady_frame(normal_ws), direction_ws).xy;
    let ring = u32(dot(around, around) * f32(RINGS));
    return min(ring, RINGS - 1u) * SECTORS + sector_of(around);
}

// twin: crates/sampling/src/guide.rs sector_of
fn sector_of(v: vec2<f32>) -> u32 {
    let a = abs(v);
    let within = select(0u, 1u, a.y >= TAN * a.x) + select(0u, 1u, a.y >= a.x) + select(0u, 1u, TAN * a.y >= a.x);
    if v.y >= 0.0 {
        return select(7u - within, within, v.x >= 0.0);
    }
    return select(8u + within, 15u - within, v.x >= 0.0);
}
