// One path for every pixel: crates/render/src/path.rs, vertex by vertex.
#import "lib/constants.wgsl"
#import "lib/control.wgsl"
#import "lib/mis.wgsl"
#import "lib/sequence.wgsl"
#import "lib/sum.wgsl"
#import "lib/wide.wgsl"
#import "light_cache/sampler.wgsl"
#import "probe/probe.wgsl"
#import "record/film.wgsl"
#import "record/frame.wgsl"
#import "record/ray.wgsl"
#import "scene/bsdf.wgsl"
#import "scene/light.wgsl"
#import "scene/surface.wgsl"
#import "trace/bvh.wgsl"

@group(3) @binding(0) var<storage, read_write> film: array<FilmPixel>;
@group(3) @binding(1) var<storage, read_write> observations: array<Observation>;

// Whether the sampler wants to know what paths find out.
override LEARNS: bool = false;
// Whether choices come with a control variate.
override CONTROLLED: bool = false;
// Whether lights are compared at glossy surfaces.
override RESAMPLES: bool = false;

// twin: crates/render/src/path.rs GLOSSY_ALPHA
const GLOSSY_ALPHA: f32 = 0.5;
// twin: crates/render/src/path.rs ROULETTE_BELOW
const ROULETTE_BELOW: f32 = 0.25;
// twin: crates/render/src/path.rs MIN_SURVIVAL
const MIN_SURVIVAL: f32 = 0.05;
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

// What a path counts.
struct Log {
    rays_nearest: u32,
    rays_occluded: u32,
    observations: u32,
    pixel: u32,
    // The light that was chosen at the last vertex, the first of several, or NONE.
    light: u32,
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
    let bsdf = eval_bsdf(vertex.surface.bsdf, vertex.wo_ws, point.wi_ws);
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
        vertex.point.position_ws, light, vertex.point.normal_ws, flags, unshadowed, irradiance, pmf, 1u,
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

// What one path brings back.
// twin: crates/render/src/path.rs path
fn trace_path(pixel: u32, eye_ray: Ray, log: ptr<function, Log>) -> PathSample {
    var ray = eye_ray;
    var from_id = NO_PRIMITIVE;
    var brought = PathSample(vec3<f32>(0.0), vec3<f32>(0.0));
    var throughput = vec3<f32>(1.0);
    // The vertex that the path has left.
    var left: Local;
    var left_position_ws = vec3<f32>(0.0);
    var left_pdf = 0.0;
    var lights_tried = 0.0;
    var bounce = 0u;
    loop {
        (*log).rays_nearest += 1u;
        let hit = nearest(ray, from_id);
        if hit.id.x == NONE {
            break;
        }
        let surface = surface_at(ray, hit);

        // Its emission, weighed against the chance that light sampling at the vertex before had found it.
        if !is_black(surface.emitted) {
            var weight = 1.0;
            if bounce > 0u && surface.light != NONE {
                weight = 0.0;
                if HEURISTIC != NO_HEURISTIC {
                    let pdf_light = light_pdf(lights[surface.light], left_position_ws, ray.direction_ws, hit.t);
                    weight = mis_weight(left_pdf, lights_tried * sampler_pmf(left, surface.light) * pdf_light);
                }
            }
            brought.radiance += throughput * surface.emitted * weight;
        }
        if bounce > frame.max_bounces {
            break;
        }

        // Direct light.
        let glossy = !is_lambert(surface.bsdf) && surface.bsdf.alpha < GLOSSY_ALPHA;
        let shared_with_bsdf = HEURISTIC != NO_HEURISTIC && scene.area_lights != 0u;
        let black = is_black(surface.bsdf.diffuse) && is_lambert(surface.bsdf);
        let continues =
            (bounce < frame.max_bounces || (shared_with_bsdf && glossy)) && !black && scene.light_count > 0u;
        let point = ShadingPoint(surface.position_ws, bounce == 0u, surface.bsdf.normal_ws);
        let local = sampler_local(point);
        let vertex = Vertex(
            surface,
            -ray.direction_ws,
            throughput,
            point,
            shared_with_bsdf && continues,
            select(1u, frame.candidates, RESAMPLES && glossy),
        );
        let count = select(1u, frame.light_samples, bounce == 0u);
        (*log).light = NONE;
        if scene.light_count > 0u {
            for (var k = 0u; k < count; k++) {
                let index = select(frame.frame, frame.frame * frame.light_samples + k, bounce == 0u);
                let numbers = vertex_sequence(frame.seed, pixel, index, bounce);
                let for_light = LightNumbers(
                    sequence_bits(numbers, 2u),
                    vec2<u32>(sequence_bits(numbers, 3u), sequence_bits(numbers, 4u)),
                );
                let direct = direct_light(local, vertex, for_light, f32(count), log);
                brought.radiance += direct.radiance;
                brought.control += direct.control;
            }
        }
        if bounce == 0u {
            probe_first_hit(pixel, surface, hit.t, (*log).light);
        }
        if !continues {
            break;
        }

        // Russian roulette on the largest component.
        let numbers = vertex_sequence(frame.seed, pixel, frame.frame, bounce);
        let survival = clamp(max_element(throughput) / ROULETTE_BELOW, MIN_SURVIVAL, 1.0);
        let u = sequence_unit(numbers, 5u);
        if u >= survival {
            break;
        }

        // The next direction.
        let at = vec2<f32>(sequence_unit(numbers, 6u), sequence_unit(numbers, 7u));
        let sample = sample_bsdf(surface.bsdf, vertex.wo_ws, u / survival, at);
        if !(sample.pdf > 0.0) || dot(surface.geometric_normal_ws, sample.wi_ws) <= 0.0 {
            break;
        }
        throughput *= sample.value / (sample.pdf * survival);
        ray = ray_from(surface, sample.wi_ws, FAR);
        left = local;
        left_position_ws = surface.position_ws;
        left_pdf = sample.pdf;
        lights_tried = f32(count * vertex.candidates);
        from_id = surface.id;
        bounce += 1u;
    }
    return brought;
}

fn add_to_film(pixel: u32, brought: PathSample, log: Log) {
    var sums = film[pixel];
    var radiance = brought.radiance;
    if CONTROLLED {
        if frame.controls == CONTROLS_NEW {
            sums.control = new_control();
        } else if frame.controls == CONTROLS_LEARN {
            sums.control = learn_control(sums.control);
        }
        radiance += brought.control * sums.control.share;
        sums.control = note_control(sums.control, brought.radiance, brought.control);
    }
    if frame.clear != 0u {
        sums.hi = vec4<f32>(0.0);
        sums.lo = vec4<f32>(0.0);
        sums.weight_hi = 0.0;
        sums.weight_lo = 0.0;
        sums.count = 0u;
    }
    sums.rays_nearest += log.rays_nearest;
    sums.rays_occluded += log.rays_occluded;
    // The device adds in pairs of single precision, the CPU in double: what its squares would overflow is left out, and counted.
    let largest = 1e30;
    let size = abs(radiance.x) + abs(radiance.y) + abs(radiance.z);
    if is_finite(size) && size < largest {
        let y = luminance(radiance);
        let x = vec4<f32>(radiance, min(y * y, largest)) * frame.weight;
        let pair = add_to_pair(TwoSum(sums.hi, sums.lo), x);
        sums.hi = pair.sum;
        sums.lo = pair.error;
        let weight = add_to_pair(
            TwoSum(vec4<f32>(sums.weight_hi), vec4<f32>(sums.weight_lo)),
            vec4<f32>(frame.weight),
        );
        sums.weight_hi = weight.sum.x;
        sums.weight_lo = weight.error.x;
        sums.count += 1u;
    } else {
        sums.nonfinite += 1u;
    }
    film[pixel] = sums;
}

@compute @workgroup_size(8, 8)
fn path(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = id.x;
    let row = id.y;
    if column >= frame.width || row >= frame.height {
        return;
    }
    let pixel = row * frame.width + column;
    let numbers = vertex_sequence(frame.seed, pixel, frame.frame, 0u);
    let offset = vec2<f32>(sequence_unit(numbers, 0u), sequence_unit(numbers, 1u));
    let at = vec2<f32>(f32(column), f32(row)) + offset;
    let direction_ws = normalize(frame.corner_ws + frame.step_x_ws * at.x + frame.step_y_ws * at.y);
    var log = Log(0u, 0u, 0u, pixel, NONE);
    probe_pixel(pixel);
    let brought = trace_path(pixel, Ray(frame.origin_ws, direction_ws, FAR), &log);
    add_to_film(pixel, brought, log);
    if LEARNS {
        for (var slot = log.observations; slot < frame.slots; slot++) {
            observations[pixel * frame.slots + slot].light = NO_LIGHT;
        }
    }
}
