// The light tree seen from a point: drawing a light, and the probability of one.
//
// Both cut the same interval with the same arithmetic. See crates/light-cache/src/tree.
#import "lib/constants.wgsl"
#import "lib/interval.wgsl"
#import "light_cache/bindings.wgsl"

// Words of the tree's header, from where it is.
const TREE_NODES: u32 = 0u;
const TREE_LEAVES: u32 = 1u;
const TREE_DISTANT: u32 = 2u;
const TREE_RANKS: u32 = 3u;
const TREE_NODE_COUNT: u32 = 4u;
const TREE_LEAF_COUNT: u32 = 5u;
const TREE_DISTANT_COUNT: u32 = 6u;
const TREE_LEAST_SECOND: u32 = 7u;

const NO_CHILD: u32 = 0xffffffffu;
const NO_NODE: u32 = 0xffffffffu;
// twin: crates/light-cache/src/tree/importance.rs TINY_SQ
const TINY_SQ: f32 = 1e-18;
// twin: crates/light-cache/src/tree/importance.rs PARALLEL
const PARALLEL: f32 = 0.999999;
// Root of the least positive number.
const TINY: f32 = 1.0842022e-19;

struct Receiver {
    position: vec3<f32>,
    normal: vec3<f32>,
}

// twin: crates/light-cache/src/tree/mod.rs Node
struct TreeNode {
    center: vec3<f32>,
    half: vec3<f32>,
    axis: vec3<f32>,
    cos_o: f32,
    sin_o: f32,
    cos_e: f32,
    weight: f32,
    first: u32,
    count: u32,
    child: u32,
}

fn tree_node(tree: u32, node: u32) -> TreeNode {
    let at = (cache_word(tree + TREE_NODES) >> 2u) + 4u * node;
    let a = cache[at];
    let b = cache[at + 1u];
    let c = cache[at + 2u];
    let d = cache[at + 3u];
    return TreeNode(
        bitcast<vec3<f32>>(a.xyz),
        bitcast<vec3<f32>>(vec3<u32>(a.w, b.xy)),
        bitcast<vec3<f32>>(vec3<u32>(b.zw, c.x)),
        bitcast<f32>(c.y),
        bitcast<f32>(c.z),
        bitcast<f32>(c.w),
        bitcast<f32>(d.x),
        d.y,
        d.z,
        d.w,
    );
}

// twin: crates/light-cache/src/tree/bounds.rs LeafLight
struct LeafLight {
    center: vec3<f32>,
    radius: f32,
    axis: vec3<f32>,
    weight: f32,
    cone_scale: f32,
    cone_offset: f32,
    inverse_range_sq: f32,
    tag: u32,
}

fn leaf_light(tree: u32, place: u32) -> LeafLight {
    let at = (cache_word(tree + TREE_LEAVES) >> 2u) + 3u * place;
    let a = bitcast<vec4<f32>>(cache[at]);
    let b = bitcast<vec4<f32>>(cache[at + 1u]);
    let c = cache[at + 2u];
    return LeafLight(a.xyz, a.w, b.xyz, b.w, bitcast<f32>(c.x), bitcast<f32>(c.y), bitcast<f32>(c.z), c.w);
}

// twin: crates/light-cache/src/tree/importance.rs mean_above
fn mean_above(middle: f32, reach: f32) -> f32 {
    if middle >= reach {
        return middle;
    }
    let above = max(middle + reach, 0.0);
    return above * above / max(4.0 * reach, MIN_POSITIVE);
}

// twin: crates/light-cache/src/tree/importance.rs cos_from_cone
fn cos_from_cone(node: TreeNode, to: vec3<f32>, distance_sq: f32, radius_sq: f32) -> f32 {
    if distance_sq <= radius_sq {
        return 1.0;
    }
    let inverse_distance = 1.0 / sqrt(distance_sq);
    let sin_u = sqrt(radius_sq) * inverse_distance;
    let cos_u = sqrt(max(1.0 - sin_u * sin_u, 0.0));
    let cos_t = -dot(node.axis, to) * inverse_distance;
    let sin_t = sqrt(max(1.0 - cos_t * cos_t, 0.0));
    var cos_x = 1.0;
    var sin_x = 0.0;
    if cos_t < node.cos_o {
        cos_x = cos_t * node.cos_o + sin_t * node.sin_o;
        sin_x = sin_t * node.cos_o - cos_t * node.sin_o;
    }
    if cos_x >= cos_u {
        cos_x = 1.0;
    } else {
        cos_x = cos_x * cos_u + sin_x * sin_u;
    }
    if cos_x <= node.cos_e {
        return 0.0;
    }
    return max(cos_x, 1e-4);
}

// twin: crates/light-cache/src/tree/importance.rs group
fn group_importance(node: TreeNode, at: Receiver) -> f32 {
    let to = node.center - at.position;
    let height = mean_above(dot(at.normal, to), dot(abs(at.normal), node.half));
    let radius_sq = dot(node.half, node.half);
    let outside = max(abs(to) - node.half, vec3<f32>(0.0));
    let nearest_sq = max(max(dot(outside, outside), 1e-6 * radius_sq), TINY_SQ);
    let nearest_distance = sqrt(nearest_sq);
    let distance_sq = max(max(dot(to, to), radius_sq), TINY_SQ);
    var facing = nearest_distance;
    if node.cos_o >= PARALLEL {
        facing = mean_above(-dot(node.axis, to), dot(abs(node.axis), node.half));
    } else if node.cos_o > -1.0 {
        facing = nearest_distance * cos_from_cone(node, to, distance_sq, radius_sq);
    }
    return node.weight * (min(height, nearest_distance) / nearest_sq) * (min(facing, nearest_distance) / distance_sq);
}

// twin: crates/light-cache/src/tree/bounds.rs attenuation
fn attenuation(light: LeafLight, distance: f32, cos_axis: f32) -> f32 {
    let cone = cos_axis * light.cone_scale + light.cone_offset;
    let relative_sq = distance * distance * light.inverse_range_sq;
    let window = 1.0 - relative_sq * relative_sq;
    if cone <= -1e-4 * light.cone_scale || window <= -1e-4 {
        return 0.0;
    }
    let inside = clamp(cone, 0.03, 1.0);
    return inside * inside * clamp(window, 1e-4, 1.0);
}

// twin: crates/light-cache/src/tree/importance.rs light
fn light_importance(light: LeafLight, at: Receiver) -> f32 {
    let to = light.center - at.position;
    let distance_sq = dot(to, to);
    let radius = light.radius;
    let middle = dot(at.normal, to);
    let emission_kind = light.tag >> 30u;
    if emission_kind >= 2u {
        let d_sq = max(distance_sq, TINY);
        let inverse_distance = 1.0 / sqrt(d_sq);
        if middle <= 0.0 {
            return 0.0;
        }
        let reached = attenuation(light, d_sq * inverse_distance, -dot(light.axis, to) * inverse_distance);
        return light.weight * reached * (middle * inverse_distance * inverse_distance * inverse_distance);
    }
    let height = mean_above(middle, radius);
    if height <= 0.0 {
        return 0.0;
    }
    let radius_sq = radius * radius;
    var plane = -dot(light.axis, to);
    if emission_kind == 1u {
        plane = abs(plane);
    }
    if plane <= -1e-4 * radius {
        return 0.0;
    }
    let d_sq = max(max(distance_sq, 0.5 * radius_sq), TINY);
    plane = max(plane, 0.0) + 0.5 * radius * radius_sq / (d_sq + radius_sq);
    let inverse_sq = 1.0 / d_sq;
    return light.weight * (height * inverse_sq) * (plane * inverse_sq);
}

// The tree as seen from one point.
// twin: crates/light-cache/src/tree/sample.rs Descent
struct Descent {
    tree: u32,
    at: Receiver,
    near: f32,
    far: f32,
}

fn distant_importance(tree: u32, index: u32, at: Receiver) -> f32 {
    let record = cache[(cache_word(tree + TREE_DISTANT) >> 2u) + 2u * index];
    return bitcast<f32>(record.w) * max(-dot(at.normal, bitcast<vec3<f32>>(record.xyz)), 0.0);
}

// twin: crates/light-cache/src/tree/sample.rs leaf
fn leaf_weights(tree: u32, node: TreeNode, at: Receiver) -> vec4<f32> {
    var weights = vec4<f32>(0.0);
    for (var slot = 0u; slot < min(node.count, 4u); slot++) {
        weights[slot] = light_importance(leaf_light(tree, node.first + slot), at);
    }
    if all(weights <= vec4<f32>(0.0)) {
        weights = select(vec4<f32>(0.0), vec4<f32>(1.0), vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(node.count));
    }
    return weights;
}

// twin: crates/light-cache/src/tree/sample.rs one_level_below
fn one_level_below(tree: u32, node: TreeNode, at: Receiver) -> f32 {
    if node.child == NO_CHILD {
        var sum = 0.0;
        for (var slot = 0u; slot < min(node.count, 4u); slot++) {
            sum += light_importance(leaf_light(tree, node.first + slot), at);
        }
        return sum;
    }
    return group_importance(tree_node(tree, node.child), at) + group_importance(tree_node(tree, node.child + 1u), at);
}

// twin: crates/light-cache/src/tree/sample.rs refined
fn refined_importance(tree: u32, near: f32, at: Receiver) -> f32 {
    var importances: array<f32, 8>;
    var found: array<u32, 8>;
    importances[0] = near;
    for (var used = 1u; used < 8u; used++) {
        var largest = NO_NODE;
        for (var i = 0u; i < used; i++) {
            let inner = tree_node(tree, found[i]).child != NO_CHILD;
            if inner && (largest == NO_NODE || importances[i] >= importances[largest]) {
                largest = i;
            }
        }
        if largest == NO_NODE {
            break;
        }
        let child = tree_node(tree, found[largest]).child;
        importances[largest] = one_level_below(tree, tree_node(tree, child), at);
        importances[used] = one_level_below(tree, tree_node(tree, child + 1u), at);
        found[largest] = child;
        found[used] = child + 1u;
    }
    var sum = 0.0;
    for (var i = 0u; i < 8u; i++) {
        sum += importances[i];
    }
    return select(near, sum, sum > 0.0);
}

// twin: crates/light-cache/src/tree/sample.rs new
fn descent_at(tree: u32, at: Receiver) -> Descent {
    var near = 0.0;
    var far = 0.0;
    if cache_word(tree + TREE_NODE_COUNT) > 0u {
        near = one_level_below(tree, tree_node(tree, 0u), at);
    }
    let distant = cache_word(tree + TREE_DISTANT_COUNT);
    for (var index = 0u; index < distant; index++) {
        far += distant_importance(tree, index, at);
    }
    if far > 0.0 && near > 0.0 {
        near = refined_importance(tree, near, at);
    }
    return Descent(tree, at, near, far);
}

// twin: crates/light-cache/src/tree/sample.rs near_part
fn near_part(descent: Descent, width: vec2<u32>) -> vec2<u32> {
    let placed = cache_word(descent.tree + TREE_LEAF_COUNT);
    return split_among(width, descent.near, descent.far, placed, cache_word(descent.tree + TREE_DISTANT_COUNT));
}

// twin: crates/light-cache/src/tree/sample.rs first_part
fn first_part(width: vec2<u32>, first: TreeNode, second: TreeNode, at: Receiver) -> vec2<u32> {
    return split_among(width, group_importance(first, at), group_importance(second, at), first.count, second.count);
}

// twin: crates/light-cache/src/tree/sample.rs first_pair
fn first_pair(width: vec2<u32>, weights: vec4<f32>) -> vec2<u32> {
    let positive = select(vec4<u32>(0u), vec4<u32>(1u), weights > vec4<f32>(0.0));
    let counts = positive.xz + positive.yw;
    return split_among(width, weights.x + weights.y, weights.z + weights.w, counts.x, counts.y);
}

// A light's place in tree order, and the width that it owns.
struct Drawn {
    place: u32,
    width: vec2<u32>,
}

// twin: crates/light-cache/src/tree/sample.rs draw_in
fn draw_in_node(tree: u32, at: Receiver, start: u32, position: vec2<u32>, interval: vec2<u32>) -> Drawn {
    var x = position;
    var width = interval;
    var node = tree_node(tree, start);
    while node.child != NO_CHILD {
        let first = tree_node(tree, node.child);
        let second = tree_node(tree, node.child + 1u);
        let left = first_part(width, first, second, at);
        if wide_less(x, left) {
            node = first;
            width = left;
        } else {
            node = second;
            x = wide_sub(x, left);
            width = wide_sub(width, left);
        }
    }
    let weights = leaf_weights(tree, node, at);
    var left = first_pair(width, weights);
    var pair = 0u;
    if wide_less(x, left) {
        width = left;
    } else {
        pair = 2u;
        x = wide_sub(x, left);
        width = wide_sub(width, left);
    }
    left = split(width, weights[pair], weights[pair + 1u]);
    if wide_less(x, left) {
        return Drawn(node.first + pair, left);
    }
    return Drawn(node.first + pair + 1u, wide_sub(width, left));
}

// twin: crates/light-cache/src/tree/sample.rs width_in
fn width_in_node(tree: u32, at: Receiver, start: u32, place: u32, interval: vec2<u32>) -> vec2<u32> {
    var width = interval;
    var node = tree_node(tree, start);
    while node.child != NO_CHILD {
        let first = tree_node(tree, node.child);
        let second = tree_node(tree, node.child + 1u);
        let left = first_part(width, first, second, at);
        if place < second.first {
            node = first;
            width = left;
        } else {
            node = second;
            width = wide_sub(width, left);
        }
        if wide_is_zero(width) {
            return width;
        }
    }
    let weights = leaf_weights(tree, node, at);
    let slot = place - node.first;
    let half = first_pair(width, weights);
    let pair = slot & 2u;
    width = select(wide_sub(width, half), half, vec2<bool>(pair == 0u));
    let left = split(width, weights[pair], weights[pair + 1u]);
    if slot == pair {
        return left;
    }
    return wide_sub(width, left);
}

// The part of a light at infinity that begins after those before it: where it starts, and its width. The search ends at `wanted`, or
// where the part holds `x`.
// Differs: running sums are single precision, so where there are several, parts differ from the CPU's by rounding.
// twin: crates/light-cache/src/tree/sample.rs DistantEnds
fn distant_part(tree: u32, at: Receiver, wanted: u32, x: vec2<u32>, width: vec2<u32>) -> Drawn {
    let count = cache_word(tree + TREE_DISTANT_COUNT);
    var total = 0.0;
    var left = 0u;
    for (var index = 0u; index < count; index++) {
        let weight = distant_importance(tree, index, at);
        total += weight;
        left += select(0u, 1u, weight > 0.0);
    }
    let spare = wide_sub(width, wide_min(width, vec2<u32>(left, 0u)));
    var used = 0u;
    var sum = 0.0;
    var start = vec2<u32>(0u);
    var drawn = Drawn(0u, vec2<u32>(0u));
    for (var index = 0u; index < count; index++) {
        let weight = distant_importance(tree, index, at);
        if weight > 0.0 {
            sum += weight;
            used += 1u;
            left -= 1u;
        }
        var end = width;
        if left > 0u {
            let ratio = u32(clamp(sum / total * 4294967040.0, 0.0, 4294967040.0));
            end = wide_min(wide_add(wide_scaled(spare, ratio), vec2<u32>(used, 0u)), width);
        }
        let own = wide_sub(end, start);
        if index == wanted {
            return Drawn(index, own);
        }
        if wanted == NO_NODE && !wide_is_zero(own) {
            drawn = Drawn(index, own);
            if wide_less(x, end) {
                return drawn;
            }
        }
        start = end;
    }
    return drawn;
}

fn draw_distant(tree: u32, at: Receiver, x: vec2<u32>, width: vec2<u32>) -> Drawn {
    var drawn = distant_part(tree, at, NO_NODE, x, width);
    drawn.place += cache_word(tree + TREE_LEAF_COUNT);
    return drawn;
}

fn width_of_distant(tree: u32, at: Receiver, place: u32, width: vec2<u32>) -> vec2<u32> {
    return distant_part(tree, at, place - cache_word(tree + TREE_LEAF_COUNT), vec2<u32>(0u), width).width;
}

// If the root's children are of different standing, the width of the first of them; else nothing, NO_NODE low.
struct TwoStandings {
    first: u32,
    left: vec2<u32>,
}

// twin: crates/light-cache/src/tree/sample.rs first_of_two
fn first_of_two(descent: Descent, width: vec2<u32>) -> TwoStandings {
    let least = cache_f32(descent.tree + TREE_LEAST_SECOND);
    if least <= 0.0 {
        return TwoStandings(NO_NODE, vec2<u32>(0u));
    }
    let root = tree_node(descent.tree, 0u);
    let first_node = tree_node(descent.tree, root.child);
    let second_node = tree_node(descent.tree, root.child + 1u);
    let first = group_importance(first_node, descent.at);
    var second = group_importance(second_node, descent.at);
    if second > 0.0 {
        second = max(second, first * (least / (1.0 - least)));
    }
    return TwoStandings(root.child, split_among(width, first, second, first_node.count, second_node.count));
}

// twin: crates/light-cache/src/tree/sample.rs draw
fn descent_draw(descent: Descent, position: vec2<u32>, interval: vec2<u32>) -> Drawn {
    var x = position;
    var width = near_part(descent, interval);
    if !wide_less(x, width) {
        return draw_distant(descent.tree, descent.at, wide_sub(x, width), wide_sub(interval, width));
    }
    let two = first_of_two(descent, width);
    var start = 0u;
    if two.first != NO_NODE {
        start = two.first;
        if wide_less(x, two.left) {
            width = two.left;
        } else {
            start += 1u;
            x = wide_sub(x, two.left);
            width = wide_sub(width, two.left);
        }
    }
    return draw_in_node(descent.tree, descent.at, start, x, width);
}

// twin: crates/light-cache/src/tree/sample.rs width_of
fn descent_width(descent: Descent, place: u32, interval: vec2<u32>) -> vec2<u32> {
    var width = near_part(descent, interval);
    if place >= cache_word(descent.tree + TREE_LEAF_COUNT) {
        return width_of_distant(descent.tree, descent.at, place, wide_sub(interval, width));
    }
    let two = first_of_two(descent, width);
    var start = 0u;
    if two.first != NO_NODE {
        start = two.first;
        if place < tree_node(descent.tree, two.first + 1u).first {
            width = two.left;
        } else {
            start += 1u;
            width = wide_sub(width, two.left);
        }
    }
    return width_in_node(descent.tree, descent.at, start, place, width);
}

// twin: crates/light-cache/src/tree/mod.rs light_at
fn light_at(tree: u32, place: u32) -> u32 {
    let leaves = cache_word(tree + TREE_LEAF_COUNT);
    if place < leaves {
        return leaf_light(tree, place).tag & 0x3fffffffu;
    }
    return cache[(cache_word(tree + TREE_DISTANT) >> 2u) + 2u * (place - leaves) + 1u].x;
}

fn place_of(tree: u32, light: u32) -> u32 {
    return cache_word(cache_word(tree + TREE_RANKS) + light);
}
