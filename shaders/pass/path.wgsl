// One path for every pixel: crates/render/src/path.rs, vertex by vertex.
#import "lib/constants.wgsl"
#import "lib/control.wgsl"
#import "lib/mis.wgsl"
#import "lib/sequence.wgsl"
#import "lib/sum.wgsl"
#import "light_cache/guide.wgsl"
#import "light_cache/sampler.wgsl"
#import "path/direct.wgsl"
#import "path/log.wgsl"
#import "probe/probe.wgsl"
#import "record/film.wgsl"
#import "record/frame.wgsl"
#import "record/ray.wgsl"
#import "scene/bsdf.wgsl"
#import "scene/light.wgsl"
#import "scene/surface.wgsl"
#import "trace/bvh.wgsl"

@group(3) @binding(0) var<storage, read_write> film: array<FilmPixel>;

// Whether choices come with a control variate.
override CONTROLLED: bool = false;

// twin: crates/render/src/path.rs GLOSSY_ALPHA
const GLOSSY_ALPHA: f32 = 0.5;
// twin: crates/render/src/path.rs ROULETTE_BELOW
const ROULETTE_BELOW: f32 = 0.25;
// twin: crates/render/src/path.rs MIN_SURVIVAL
const MIN_SURVIVAL: f32 = 0.05;

// What one path brings back.
// twin: crates/render/src/path.rs path
fn trace_path(pixel: u32, eye_ray: Ray, log: ptr<function, Log>) -> PathSample {
    var ray = eye_ray;
    var from_id = NO_PRIMITIVE;
    var brought = PathSample(vec3<f32>(0.0), vec3<f32>(0.0));
    var throughput = vec3<f32>(1.0);
    // What it would be if directions were not guided: a path is worth as much where they are.
    var unguided = vec3<f32>(1.0);
    // The vertex that the path has left.
    var left: Local;
    var left_position_ws = vec3<f32>(0.0);
    var left_pdf = 0.0;
    var lights_tried = 0.0;
    var bounce = 0u;
    var bounces: Bounces;
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
        // Where no bounce follows, only lamps are looked for.
        let guided = GUIDED && bounce < frame.max_bounces;
        var guide = NO_GUIDE;
        if guided {
            guide = sampler_guide(local);
        }
        let vertex = Vertex(
            surface,
            -ray.direction_ws,
            throughput,
            point,
            shared_with_bsdf && continues,
            select(1u, frame.candidates, RESAMPLES && glossy),
            guide,
        );
        let observed = (*log).observations;
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
        let survival = clamp(max_element(select(throughput, unguided, GUIDED)) / ROULETTE_BELOW, MIN_SURVIVAL, 1.0);
        let u = sequence_unit(numbers, 5u);
        if u >= survival {
            break;
        }

        // The next direction.
        let at = vec2<f32>(sequence_unit(numbers, 6u), sequence_unit(numbers, 7u));
        let sample = sample_bsdf(surface.bsdf, vertex.wo_ws, u / survival, at, guide);
        if !(sample.pdf > 0.0) || dot(surface.geometric_normal_ws, sample.wi_ws) <= 0.0 {
            break;
        }
        throughput *= sample.value / (sample.pdf * survival);
        if GUIDED {
            unguided *= sample.value / (sample.pdf_unguided * survival);
        }
        if guided && (*log).observations > observed {
            let observation = pixel * frame.slots + observed;
            let normal_ws = surface.bsdf.normal_ws;
            begin_bounce(&bounces, observation, normal_ws, sample.wi_ws, brought.radiance, throughput);
        }
        ray = ray_from(surface, sample.wi_ws, FAR);
        left = local;
        left_position_ws = surface.position_ws;
        left_pdf = sample.pdf;
        lights_tried = f32(count * vertex.candidates);
        from_id = surface.id;
        bounce += 1u;
    }
    if GUIDED {
        end_bounces(&bounces, brought.radiance);
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
