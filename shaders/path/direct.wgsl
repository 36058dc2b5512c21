// Direct light at a path vertex by drawing one light: crates/render/src/direct.rs, crates/render/src/resampling.rs.
#import "lib/constants.wgsl"
#import "lib/hash.wgsl"
#import "lib/mis.wgsl"
#import "lib/sequence.wgsl"
#import "lib/wide.wgsl"
#import "light_cache/sampler.wgsl"
#import "path/log.wgsl"
#import "record/film.wgsl"
#import "record/frame.wgsl"
#import "record/ray.wgsl"
#import "scene/bsdf.wgsl"
#import "scene/light.wgsl"
#import "scene/surface.wgsl"
#import "trace/bvh.wgsl"

// Whether lights are compared at glossy surfaces.
override RESAMPLES: bool = false;

// twin: crates/render/src/settings.rs MAX_CANDIDATES
const MAX_CANDIDATES: u32 = 8u;

// A path vertex that wants direct light.
struct Vertex {
    surface: Surface,
    wo_ws: vec3<f32>,
    throughput: vec3<f32>,
    point: ShadingPoint,
    // A direction drawn from the BSDF will also look for lights.
    shared_with_bsdf: bool,
    candidates: u32,
    // How the diffuse lobe is drawn where the path goes on, or NO_GUIDE.
    guide: u32,
}

struct LightNumbers {
    choice: u32,
    point: vec2<u32>,
}

// What a path brings back.
struct PathSample {
    // Without the control variate.
    radiance: vec3<f32>,
    // A control variate, of mean zero.
    control: vec3<f32>,
}

// A vertex joined with a point on a light, visibility unknown.
struct Connection {
    unweighted: vec3<f32>,
    // 0 where no light can arrive.
    irradiance: f32,
    weight: f32,
    weight_if_certain: f32,
    shadow_ray: Ray,
    to_id: vec2<u32>,
    exists: bool,
}

// twin: crates/render/src/direct.rs new
fn connect(vertex: Vertex, index: u32, pmf: f32, u: vec2<f32>) -> Connection {
    var connection: Connection;
    let light = lights[index];
    let point = sample_light(light, vertex.surface.position_ws, u);
    if !(point.pdf_solid_angle > 0.0) || dot(vertex.surface.geometric_normal_ws, point.wi_ws) <= 0.0 {
        return connection;
    }
    let bsdf = eval_bsdf(vertex.surface.bsdf, vertex.wo_ws, point.wi_ws, vertex.guide);
    connection.unweighted = vertex.throughput * bsdf.value * point.radiance / point.pdf_solid_angle;
    if is_black(connection.unweighted) {
        return connection;
    }
    connection.exists = true;
    connection.weight = 1.0;
    connection.weight_if_certain = 1.0;
    if vertex.shared_with_bsdf && !is_delta(light) {
        connection.weight = mis_weight(pmf * point.pdf_solid_angle, bsdf.pdf);
        connection.weight_if_certain = mis_weight(point.pdf_solid_angle, bsdf.pdf);
    }
    connection.irradiance =
        luminance(point.radiance) * max(dot(vertex.surface.bsdf.normal_ws, point.wi_ws), 0.0) / point.pdf_solid_angle;
    connection.shadow_ray = shadow_ray(vertex.surface, point.wi_ws, point.distance);
    connection.to_id = light.primitive;
    return connection;
}

// twin: crates/render/src/direct.rs reflected_share
fn reflected_share(connection: Connection) -> f32 {
    let share = luminance(connection.unweighted) * connection.weight / connection.irradiance;
    if share > MIN_POSITIVE {
        return min(share, 1e30);
    }
    return MIN_POSITIVE;
}

// twin: crates/render/src/direct.rs observation
fn observe(vertex: Vertex, light: u32, pmf: f32, connection: Connection, visible: bool, log: ptr<function, Log>) {
    if !LEARNS {
        return;
    }
    var unshadowed = 0.0;
    var irradiance = 0.0;
    if connection.exists {
        let y = luminance(connection.unweighted) * connection.weight_if_certain;
        unshadowed = select(0.0, y, is_finite(y));
        irradiance = connection.irradiance;
    }
    let flags = select(0u, OBSERVED_PRIMARY, vertex.point.primary) | select(0u, OBSERVED_VISIBLE, visible);
    let at = (*log).pixel * frame.slots + (*log).observations;
    observations[at] = Observation(
        vertex.point.position_ws, light, vertex.point.normal_ws, flags, unshadowed, irradiance, pmf, 0.0,
    );
    (*log).observations += 1u;
}

// One light, chosen by the sampler; at glossy surfaces one of several, kept by how it is reflected. One more round makes the
// connection of the kept one again: cheaper than to keep them all, and connections are made in one place.
// twin: crates/render/src/direct.rs estimate
// twin: crates/render/src/resampling.rs estimate
fn direct_light(local: Local, vertex: Vertex, numbers: LightNumbers, count: f32, log: ptr<function, Log>) -> PathSample {
    let on_light = vec2<f32>(unit_f32(numbers.point.x), unit_f32(numbers.point.y));
    let candidates = vertex.candidates;
    let tried = count * f32(candidates);
    let salt = hash3(numbers.choice, numbers.point.x, numbers.point.y);
    var choices: array<Choice, MAX_CANDIDATES>;
    var shares: array<f32, MAX_CANDIDATES>;
    var total = 0.0;
    var any = NONE;
    var kept = 0u;
    var connection: Connection;
    for (var part = 0u; part <= candidates; part++) {
        if part < candidates {
            var u = numbers.choice;
            if candidates > 1u {
                u = wide_div(vec2<u32>(hash2(salt, part), part), candidates);
            }
            choices[part] = sampler_draw(local, u);
            if !(choices[part].pmf > 0.0) {
                continue;
            }
            any = min(any, part);
            kept = part;
        } else {
            if any == NONE {
                return PathSample(vec3<f32>(0.0), vec3<f32>(0.0));
            }
            if candidates == 1u {
                break;
            }
            if !(total > 0.0 && is_finite(total)) {
                connection.exists = false;
                kept = any;
                break;
            }
            kept = kept_candidate(shares, candidates, unit_f32(numbers.choice) * total);
        }
        connection = connect(vertex, choices[kept].light, tried * choices[kept].pmf, on_light);
        if RESAMPLES && candidates > 1u && part < candidates && connection.exists {
            shares[part] = reflected_share(connection);
            total += shares[part];
        }
    }
    let choice = choices[kept];
    var pmf = choice.pmf;
    if RESAMPLES && candidates > 1u && connection.exists {
        pmf *= f32(candidates) * (shares[kept] / total);
    }
    var visible = false;
    if connection.exists {
        (*log).rays_occluded += 1u;
        visible = !occluded(connection.shadow_ray, vertex.surface.id, connection.to_id);
    }
    if (*log).light == NONE && (connection.exists || candidates == 1u) {
        (*log).light = choice.light;
    }
    observe(vertex, choice.light, pmf, connection, visible, log);
    var direct = PathSample(vec3<f32>(0.0), vec3<f32>(0.0));
    if candidates == 1u {
        // Whether or not the light arrives: the mean over all draws is zero.
        direct.control = vertex.throughput * vertex.surface.bsdf.diffuse * choice.control * (FRAC_1_PI / count);
    }
    if visible {
        direct.radiance = connection.unweighted * (connection.weight / (count * pmf));
    }
    return direct;
}

// twin: crates/render/src/resampling.rs keep
fn kept_candidate(shares: array<f32, MAX_CANDIDATES>, candidates: u32, position: f32) -> u32 {
    var each = shares;
    var rest = position;
    var kept = 0u;
    for (var index = 0u; index < candidates; index++) {
        if each[index] > 0.0 {
            kept = index;
            if rest < each[index] {
                break;
            }
            rest -= each[index];
        }
    }
    return kept;
}
