// Ray queries: `nearest` and `occluded`, on the tree of the CPU.
//
// The walk is that of crates/scene/src/bvh/traverse.rs, nearest child first. Nodes are eight quantised boxes (Ylitie, Karras and
// Laine 2017), leaves up to eight triangles; boxes and triangles are tested four at a time.
#import "record/ray.wgsl"
#import "scene/bindings.wgsl"
#import "scene/texture.wgsl"

const LEAF: u32 = 0x80000000u;
// In a triangle's tag.
const ONE_SIDED: u32 = 0x80000000u;
const MASKED: u32 = 0x40000000u;
const TRIANGLE_INDEX: u32 = 0x3fffffffu;

// Entries of the stack: trees that need more are refused.
// twin: crates/render/src/gpu/scene.rs STACK
const STACK: u32 = 160u;

// A ray in the space of what it is tested against.
// twin: crates/scene/src/bvh/kernel/mod.rs LocalRay
struct LocalRay {
    origin: vec3<f32>,
    inverse: vec3<f32>,
    axes: vec3<u32>,
    shear: vec3<f32>,
}

fn inverse_of(component: f32) -> f32 {
    let size = 1.0 / max(abs(component), 1e-20);
    return select(size, -size, (bitcast<u32>(component) >> 31u) != 0u);
}

// twin: crates/scene/src/bvh/kernel/mod.rs new
fn local_ray(origin: vec3<f32>, direction: vec3<f32>) -> LocalRay {
    let size = abs(direction);
    var largest = select(2u, 1u, size.y > size.z);
    if size.x > max(size.y, size.z) {
        largest = 0u;
    }
    let down = (bitcast<u32>(direction[largest]) >> 31u) != 0u;
    let next = (largest + 1u) % 3u;
    let after = (largest + 2u) % 3u;
    var axes = vec3<u32>(next, after, largest);
    if down {
        axes = vec3<u32>(after, next, largest);
    }
    let shear_z = 1.0 / direction[largest];
    return LocalRay(
        origin,
        vec3<f32>(inverse_of(direction.x), inverse_of(direction.y), inverse_of(direction.z)),
        axes,
        vec3<f32>(direction[axes.x] * shear_z, direction[axes.y] * shear_z, shear_z),
    );
}

// Where rays enter eight boxes; a box that is not met is entered after FAR.
struct Boxes {
    enter: array<vec4<f32>, 2>,
    children: array<vec4<u32>, 2>,
}

const MISSED: f32 = 3.2e38;

// twin: crates/scene/src/bvh/kernel/portable.rs boxes
fn test_boxes(node: u32, ray: LocalRay, t_max: f32) -> Boxes {
    let base = node * 8u;
    var enter = array<vec4<f32>, 2>(vec4<f32>(0.0), vec4<f32>(0.0));
    var leave = array<vec4<f32>, 2>(vec4<f32>(t_max), vec4<f32>(t_max));
    for (var axis = 0u; axis < 3u; axis++) {
        let planes = nodes[base + 2u * axis];
        let rest = nodes[base + 2u * axis + 1u];
        let offset = bitcast<f32>(rest.z) - ray.origin[axis];
        let step = bitcast<f32>(rest.w);
        let inverse = ray.inverse[axis];
        let inverse_far = inverse * (1.0 + 4.0 * 1.1920929e-7);
        var near = planes.xy;
        var far = planes.zw;
        if inverse < 0.0 {
            near = planes.zw;
            far = planes.xy;
        }
        for (var half = 0u; half < 2u; half++) {
            let t_near = vec4<f32>(unpack4xU8(near[half])) * (step * inverse) + offset * inverse;
            let t_far = vec4<f32>(unpack4xU8(far[half])) * (step * inverse_far) + offset * inverse_far;
            enter[half] = max(enter[half], t_near);
            leave[half] = min(leave[half], t_far);
        }
    }
    for (var half = 0u; half < 2u; half++) {
        enter[half] = select(vec4<f32>(MISSED), enter[half], enter[half] <= leave[half]);
    }
    return Boxes(enter, array<vec4<u32>, 2>(nodes[base + 6u], nodes[base + 7u]));
}

// Which triangles are tested.
struct Target {
    instance: u32,
    // Triangles of the instance that are not there for this ray.
    skip: vec2<u32>,
}

// Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection".
// twin: crates/scene/src/bvh/kernel/portable.rs triangles
fn test_pack(pack: u32, ray: LocalRay, tested: Target, best: ptr<function, Hit>) -> bool {
    var found = false;
    let base = pack * 20u;
    for (var half = 0u; half < 2u; half++) {
        let tags = pack_tags(base, half);
        if tags.x == TRIANGLE_INDEX {
            break;
        }
        var x: array<vec4<f32>, 3>;
        var y: array<vec4<f32>, 3>;
        var z: array<vec4<f32>, 3>;
        for (var corner = 0u; corner < 3u; corner++) {
            let at = base + corner * 6u + half;
            z[corner] = bitcast<vec4<f32>>(packs[at + 2u * ray.axes.z]) - ray.origin[ray.axes.z];
            x[corner] = bitcast<vec4<f32>>(packs[at + 2u * ray.axes.x]) - ray.origin[ray.axes.x] - ray.shear.x * z[corner];
            y[corner] = bitcast<vec4<f32>>(packs[at + 2u * ray.axes.y]) - ray.origin[ray.axes.y] - ray.shear.y * z[corner];
        }
        let w0 = x[2] * y[1] - y[2] * x[1];
        let w1 = x[0] * y[2] - y[0] * x[2];
        let w2 = x[1] * y[0] - y[1] * x[0];
        let det = w0 + w1 + w2;
        let inverse = 1.0 / det;
        let u = w1 * inverse;
        let v = w2 * inverse;
        let t = (w0 * inverse * z[0] + u * z[1] + v * z[2]) * ray.shear.z;
        let zero = vec4<f32>(0.0);
        let inside = ((w0 >= zero) & (w1 >= zero) & (w2 >= zero)) | ((w0 <= zero) & (w1 <= zero) & (w2 <= zero));
        let hit = inside & (det != zero) & (t > zero);
        for (var lane = 0u; lane < 4u; lane++) {
            if !(hit[lane] && t[lane] < (*best).t) {
                continue;
            }
            let tag = tags[lane];
            let triangle = tag & TRIANGLE_INDEX;
            let hidden = (tag & ONE_SIDED) != 0u && det[lane] < 0.0;
            if hidden || triangle == tested.skip.x || triangle == tested.skip.y {
                continue;
            }
            if HAS_MASKS && (tag & MASKED) != 0u && !mask_visible(tested.instance, triangle, u[lane], v[lane]) {
                continue;
            }
            *best = Hit(t[lane], u[lane], v[lane], vec2<u32>(tested.instance, triangle));
            found = true;
        }
    }
    return found;
}

fn pack_tags(base: u32, half: u32) -> vec4<u32> {
    return packs[base + 18u + half];
}

fn skip_in(instance: u32, from_id: vec2<u32>, to_id: vec2<u32>) -> vec2<u32> {
    return vec2<u32>(
        select(NONE, from_id.y, from_id.x == instance),
        select(NONE, to_id.y, to_id.x == instance),
    );
}

// What is placed once first, then the tree over the instances and those that the ray meets: one loop and one stack for all, because
// shader compilers inline every call. `any`: the first hit ends it.
// twin: crates/scene/src/bvh/traverse.rs walk
fn trace(ray: Ray, from_id: vec2<u32>, to_id: vec2<u32>, any: bool) -> Hit {
    var best = Hit(ray.t_max, 0.0, 0.0, NO_PRIMITIVE);
    var stack: array<u32, STACK>;
    var distances: array<f32, STACK>;
    var height = 0u;
    // The stack's height where the present tree began.
    var base = 0u;
    let world = local_ray(ray.origin_ws, ray.direction_ws);
    var local = world;
    var tested = Target(0u, skip_in(0u, from_id, to_id));
    var current = scene.fixed_root;
    var in_top = false;
    var top_begun = !HAS_INSTANCES || scene.top_root == NONE;
    if current == NONE {
        if top_begun {
            return best;
        }
        current = scene.top_root;
        in_top = true;
        top_begun = true;
    }
    loop {
        var enters = false;
        if (current & LEAF) == 0u {
            let boxes = test_boxes(current, local, best.t);
            var last = MISSED;
            let bottom = height;
            for (var lane = 0u; lane < 8u; lane++) {
                let near = boxes.enter[lane >> 2u][lane & 3u];
                if near >= MISSED {
                    continue;
                }
                let child = boxes.children[lane >> 2u][lane & 3u];
                if last == MISSED {
                    last = near;
                    current = child;
                    continue;
                }
                // `current` stays the nearest; those on the stack are sorted, the farthest lowest.
                var farther = child;
                var distance = near;
                if near < last {
                    farther = current;
                    distance = last;
                    current = child;
                    last = near;
                }
                var at = height;
                while at > bottom && distances[at - 1u] < distance {
                    stack[at] = stack[at - 1u];
                    distances[at] = distances[at - 1u];
                    at -= 1u;
                }
                stack[at] = farther;
                distances[at] = distance;
                height += 1u;
            }
            enters = last < MISSED;
        } else if HAS_INSTANCES && in_top {
            let placed = scene.placed + 2u * (current & ~LEAF);
            let root = details[placed + 1u];
            if root != NONE {
                let instance = details[placed];
                let at = instance_at(instance) + LOCAL_FROM_WORLD;
                let matrix = matrix_at(at);
                local = local_ray(matrix * ray.origin_ws + detail_vec3(at + 9u), matrix * ray.direction_ws);
                tested = Target(instance, skip_in(instance, from_id, to_id));
                current = root;
                base = height;
                in_top = false;
                enters = true;
            }
        } else if test_pack(current & ~LEAF, local, tested, &best) && any {
            return best;
        }
        while !enters {
            if height == base && !in_top {
                // This mesh is done.
                if !HAS_INSTANCES {
                    return best;
                }
                local = world;
                base = 0u;
                in_top = true;
                if !top_begun {
                    top_begun = true;
                    current = scene.top_root;
                    break;
                }
            }
            if height == 0u {
                return best;
            }
            height -= 1u;
            current = stack[height];
            enters = distances[height] <= best.t;
        }
    }
    return best;
}

// The nearest visible surface along the ray; `from_id` is the triangle that it starts on.
fn nearest(ray: Ray, from_id: vec2<u32>) -> Hit {
    return trace(ray, from_id, NO_PRIMITIVE, false);
}

// Whether anything but the triangles `from_id` and `to_id` stands on the ray.
fn occluded(ray: Ray, from_id: vec2<u32>, to_id: vec2<u32>) -> bool {
    return trace(ray, from_id, to_id, true).id.x != NONE;
}
