// The weights of a cell's cut at a point, and the exact probabilities made from them.
//
// Entries stand in tree order, in sixteen lanes of consecutive ones: a draw looks at the sums of the lanes first and then at one lane.
// See crates/light-cache/src/adaptive/weights.rs.
#import "lib/constants.wgsl"
#import "lib/hash.wgsl"
#import "lib/wide.wgsl"
#import "light_cache/bindings.wgsl"
#import "light_cache/grid.wgsl"
#import "light_cache/guide.wgsl"
#import "light_cache/light_tree.wgsl"

// Words of the header: cells of 8 words each, and the hash table of what is kept for cubes within them.
const CUT_CELLS: u32 = 21u;
const CUT_CUBES: u32 = 22u;
const CUT_CUBE_BITS: u32 = 23u;

// twin: crates/light-cache/src/adaptive/row.rs LANES
const LANES: u32 = 16u;
// twin: crates/light-cache/src/adaptive/branch.rs LIGHT
const LIGHT_BRANCH: u32 = 1u << 31u;
const DISTANT_BRANCH: u32 = 0xffffffffu;
const NO_FACTORS: u32 = 0xffffffffu;
// twin: crates/light-cache/src/adaptive/directions.rs PLACES
const PLACES: u32 = 3u;
// twin: crates/light-cache/src/adaptive/subcells.rs LARGE_LAYER
const LARGE_LAYER: u32 = 2u;
// twin: crates/light-cache/src/adaptive/subcells.rs MIDDLE_LAYER
const MIDDLE_LAYER: u32 = 4u;
// twin: crates/light-cache/src/adaptive/packed.rs GUIDE
const KEPT_GUIDE: u32 = 3u;

// A cell as seen from one of its cubes; no entries: no cell.
struct Cut {
    count: u32,
    rows: u32,
    // Where the entries are, 16 words each, by vectors; the attenuations, 4 words each, NO_FACTORS if there are none.
    entries: u32,
    attenuations: u32,
    // First light of each entry.
    firsts: u32,
    // What entries are expected to bring over what they weigh, 4 words each, NO_FACTORS without a control variate.
    expected: u32,
    // Of the cube, two to an entry: first all for drawing, then all for what is expected.
    factors: u32,
    // How paths go on from there, or NO_GUIDE.
    guide: u32,
}

struct Part {
    found: bool,
    branch: u32,
    start: vec2<u32>,
    width: vec2<u32>,
    // What all entries together are expected to bring, and the part's entry over its share of the interval.
    expected_total: vec3<f32>,
    expected_own: vec3<f32>,
}

fn is_one_light(branch: u32) -> bool {
    return (branch & LIGHT_BRANCH) != 0u && branch != DISTANT_BRANCH;
}

// Where what is kept for one cube of a cell lies, factors or a guide, or NO_FACTORS.
fn kept_for(key: u32) -> u32 {
    let bits = cache_word(CUT_CUBE_BITS);
    let table = cache_word(CUT_CUBES);
    var at = (key * GOLDEN) >> (32u - bits);
    loop {
        let found = cache_word(table + 2u * at);
        if found == NO_FACTORS {
            return NO_FACTORS;
        }
        if found == key {
            return cache_word(table + 2u * at + 1u);
        }
        at = (at + 1u) & ((1u << bits) - 1u);
    }
    return NO_FACTORS;
}

// Of what is kept for one of 2^`bits` cubes along an edge of a cell, the one that holds the smallest cube `cube`.
// twin: crates/light-cache/src/adaptive/packed.rs key
fn cube_key(cell: u32, kind: u32, cube: vec3<u32>, bits: u32) -> u32 {
    let place = cube >> vec3<u32>(LEVELS - bits);
    return (cell << 17u) | (kind << 15u) | place.x | (place.y << bits) | (place.z << (2u * bits));
}

// twin: crates/light-cache/src/adaptive/subcells.rs factors
fn factors_at(cell: u32, cube: vec3<u32>) -> u32 {
    var found = kept_for(cube_key(cell, 2u, cube, LEVELS));
    if found == NO_FACTORS {
        found = kept_for(cube_key(cell, 1u, cube, MIDDLE_LAYER));
    }
    if found == NO_FACTORS {
        found = kept_for(cube_key(cell, 0u, cube, LARGE_LAYER));
    }
    return found;
}

// twin: crates/light-cache/src/adaptive/directions.rs guide
fn guide_at(cell: u32, cube: vec3<u32>, of_whole_cell: u32) -> u32 {
    let own = kept_for(cube_key(cell, KEPT_GUIDE, cube, PLACES));
    return select(own, of_whole_cell, own == NO_GUIDE);
}

fn cut_at(cell: u32, cube: vec3<u32>) -> Cut {
    var cut: Cut;
    cut.guide = NO_GUIDE;
    if cell == 0xffffffffu {
        return cut;
    }
    let at = (cache_word(CUT_CELLS) >> 2u) + 2u * cell;
    let first = cache[at];
    cut.count = first.x;
    cut.rows = (first.x + LANES - 1u) / LANES;
    cut.entries = first.y >> 2u;
    cut.attenuations = first.z;
    cut.firsts = first.w;
    let second = cache[at + 1u];
    cut.expected = second.x;
    cut.factors = factors_at(cell, cube);
    if GUIDED {
        cut.guide = guide_at(cell, cube, second.y);
    }
    return cut;
}

// The entry that holds the light at `place` in tree order.
// twin: crates/light-cache/src/adaptive/cell.rs entry_of
fn entry_of(cut: Cut, place: u32) -> u32 {
    var low = 0u;
    var high = cut.count - 1u;
    while low < high {
        let middle = (low + high + 1u) / 2u;
        if cache_word(cut.firsts + middle) <= place {
            low = middle;
        } else {
            high = middle - 1u;
        }
    }
    return low;
}

// Estimate of the irradiance at a point, as learned by the cell as a whole.
// twin: crates/light-cache/src/adaptive/emitter.rs importance
fn entry_importance(cut: Cut, entry: u32, at: Receiver) -> f32 {
    if entry >= cut.count {
        return 0.0;
    }
    let words = cut.entries + 4u * entry;
    // Center and radius; axis and depth; both quarter inverses, one_sided, isotropic; weight, everywhere, branch.
    let a = bitcast<vec4<f32>>(cache[words]);
    let b = bitcast<vec4<f32>>(cache[words + 1u]);
    let c = bitcast<vec4<f32>>(cache[words + 2u]);
    let d = bitcast<vec4<f32>>(cache[words + 3u]);
    let to = a.xyz - at.position;
    let radius = a.w;
    let depth = b.w;
    let radius_sq = radius * radius;
    let d_sq = max(max(dot(to, to), 0.5 * radius_sq), 1e-18);
    let inverse_sq = 1.0 / d_sq;
    let distance = sqrt(d_sq);
    let middle = dot(at.normal, to);
    let above = max(middle + radius, 0.0);
    let height = select(above * above * c.x, middle, middle >= radius);
    let facing = -dot(b.xyz, to);
    let front = max(facing, -facing - c.z);
    let over = max(front + depth, 0.0);
    let mean_front = select(over * over * c.y, front, front >= depth);
    let isotropic = c.w;
    var plane = (1.0 - isotropic) * mean_front + 0.5 * radius * min(radius_sq * inverse_sq, 1.0) + isotropic * distance;
    if !(front > -1e-4 * radius - depth || isotropic > 0.0) {
        plane = 0.0;
    }
    var strength = d.x;
    if cut.attenuations != NO_FACTORS {
        let e = bitcast<vec4<f32>>(cache[(cut.attenuations >> 2u) + entry]);
        let cone = front * inverse_sq * distance * e.x + e.y;
        let relative_sq = d_sq * e.z;
        let window = 1.0 - relative_sq * relative_sq;
        if cone > -1e-4 * e.x && window > -1e-4 {
            let inside = clamp(cone, 0.03, 1.0);
            strength *= inside * inside * clamp(window, 1e-4, 1.0);
        } else {
            strength = 0.0;
        }
    }
    return strength * (height * inverse_sq) * (plane * inverse_sq) + d.y;
}

// By what the cube differs from the cell: how often the entry is drawn, and what it is expected to bring.
// twin: crates/light-cache/src/adaptive/weights.rs Factors
fn entry_factors(cut: Cut, entry: u32) -> vec2<f32> {
    if cut.factors == NO_FACTORS || entry >= cut.count {
        return vec2<f32>(1.0);
    }
    return vec2<f32>(cache_f32(cut.factors + entry), cache_f32(cut.factors + cut.count + entry));
}

// What the entry is expected to bring, by channel, over what it weighs, both without the factors of cubes.
// twin: crates/light-cache/src/adaptive/row.rs Expected
fn entry_expected(cut: Cut, entry: u32) -> vec3<f32> {
    if cut.expected == NO_FACTORS || entry >= cut.count {
        return vec3<f32>(0.0);
    }
    return bitcast<vec4<f32>>(cache[(cut.expected >> 2u) + entry]).xyz;
}

fn entry_branch(cut: Cut, entry: u32) -> u32 {
    return cache[cut.entries + 4u * entry + 3u].z;
}

// Where the part after a running sum ends in an interval of `width`: (sum / total) x width, rounded up, by long division of the two
// significands, so that it never falls as the sum grows and ends at the width.
// Differs: the CPU works in double precision; boundaries agree to about 2^-50 of the width.
// twin: crates/light-cache/src/adaptive/cut.rs end
fn boundary(sum: f32, total: f32, width: vec2<u32>) -> vec2<u32> {
    if sum >= total {
        return width;
    }
    if !(sum > 0.0) {
        return vec2<u32>(0u);
    }
    let sum_bits = bitcast<u32>(sum);
    let total_bits = bitcast<u32>(total);
    let shift = (total_bits >> 23u) - (sum_bits >> 23u);
    let divisor = (total_bits & 0x7fffffu) | 0x800000u;
    var rest = (sum_bits & 0x7fffffu) | 0x800000u;
    // 1 bit before the point, 56 after it.
    var whole = rest / divisor;
    rest -= whole * divisor;
    var high = whole;
    var low = 0u;
    for (var digit = 0u; digit < 3u; digit++) {
        let shifted = rest << 8u;
        high = (high << 8u) | (shifted / divisor);
        rest = shifted % divisor;
    }
    for (var digit = 0u; digit < 4u; digit++) {
        let shifted = rest << 8u;
        low = (low << 8u) | (shifted / divisor);
        rest = shifted % divisor;
    }
    // `high` has 24 bits after the point and `low` 32 more: ratio = (high 2^32 + low) 2^-56. Down by the difference of the exponents.
    if shift >= 56u {
        return vec2<u32>(1u, 0u);
    }
    var ratio = wide_shift_left(vec2<u32>(low, high), 7u);
    if shift >= 32u {
        ratio = vec2<u32>(ratio.y, 0u);
    }
    if (shift & 31u) != 0u {
        ratio = wide_shift_right(ratio, shift & 31u);
    }
    // ratio is in units of 2^-63 now; the product's upper part, times two.
    let cross1 = wide_mul(ratio.x, width.y);
    let cross2 = wide_mul(ratio.y, width.x);
    let middle = wide_add(cross1, vec2<u32>(wide_mul(ratio.x, width.x).y, 0u));
    let both = wide_add(middle, cross2);
    let carry = select(0u, 1u, wide_less(both, middle));
    let upper = wide_add(wide_mul(ratio.y, width.y), vec2<u32>(both.y, carry));
    let product = wide_add(wide_shift_left(upper, 1u), vec2<u32>(both.x >> 31u, 0u));
    return wide_min(wide_add(product, vec2<u32>(1u, 0u)), width);
}

// Running sums in the order in which the CPU adds them: groups of four side by side, then the groups.
// twin: crates/light-cache/src/adaptive/cut.rs new
fn running_sums(weights: array<f32, LANES>) -> array<f32, LANES> {
    var sums = weights;
    for (var i = 1u; i < 4u; i++) {
        for (var group = 0u; group < LANES; group += 4u) {
            sums[group + i] += sums[group + i - 1u];
        }
    }
    var before = 0.0;
    for (var group = 0u; group < LANES; group += 4u) {
        for (var i = 0u; i < 4u; i++) {
            sums[group + i] += before;
        }
        before = sums[group + 3u];
    }
    return sums;
}

// By halves, as the CPU adds them.
// twin: crates/light-cache/src/adaptive/weights.rs sum
fn sum_of_lanes(lanes: array<vec3<f32>, LANES>) -> vec3<f32> {
    var sums = lanes;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        for (var i = 0u; i < half; i++) {
            sums[i] += sums[i + half];
        }
    }
    return sums[0];
}

struct Slice {
    index: u32,
    start: vec2<u32>,
    width: vec2<u32>,
}

// The part that holds `x`, or part `index` where that is asked for.
fn slice_of(sums: array<f32, LANES>, by_index: bool, index: u32, x: vec2<u32>, width: vec2<u32>) -> Slice {
    var each = sums;
    let total = each[LANES - 1u];
    var low = index;
    if !by_index {
        low = 0u;
        var high = LANES - 1u;
        while low < high {
            let middle = (low + high) / 2u;
            // A boundary that `x` has passed.
            if each[middle] < total && !wide_less(x, boundary(each[middle], total, width)) {
                low = middle + 1u;
            } else {
                high = middle;
            }
        }
    }
    var start = vec2<u32>(0u);
    if low > 0u {
        start = boundary(each[low - 1u], total, width);
    }
    return Slice(low, start, wide_sub(boundary(each[low], total, width), start));
}

// The entry at position `x` of an interval of `width`, or entry `entry` where that is asked for, and its part.
// twin: crates/light-cache/src/adaptive/weights.rs part
fn cut_part(cut: Cut, at: Receiver, by_entry: bool, entry: u32, x: vec2<u32>, width: vec2<u32>) -> Part {
    var part: Part;
    var lane = Slice(entry / cut.rows, vec2<u32>(0u), width);
    var row = Slice(entry % cut.rows, vec2<u32>(0u), vec2<u32>(0u));
    var total_weight = 0.0;
    var lanes_expected: array<vec3<f32>, LANES>;
    // First the lanes, then the rows of one lane: the same work on sums of rows and on single entries.
    for (var level = 0u; level < 2u; level++) {
        var weights: array<f32, LANES>;
        for (var k = 0u; k < LANES; k++) {
            let first = select((lane.index * cut.rows) + k, k * cut.rows, level == 0u);
            let count = select(select(0u, 1u, k < cut.rows), cut.rows, level == 0u);
            var sum = 0.0;
            var expected = vec3<f32>(0.0);
            for (var entry = first; entry < first + count; entry++) {
                let importance = entry_importance(cut, entry, at);
                let factors = entry_factors(cut, entry);
                sum += importance * factors.x;
                expected += (importance * factors.y) * entry_expected(cut, entry);
            }
            weights[k] = sum;
            if level == 0u {
                lanes_expected[k] = expected;
            }
        }
        let sums = running_sums(weights);
        var total = sums;
        if !(total[LANES - 1u] > 0.0) {
            if level == 0u {
                return part;
            }
            break;
        }
        if level == 0u {
            total_weight = total[LANES - 1u];
        }
        if level == 0u {
            lane = slice_of(sums, by_entry, lane.index, x, width);
        } else {
            row = slice_of(sums, by_entry, row.index, wide_sub(x, lane.start), lane.width);
        }
    }
    let found = lane.index * cut.rows + row.index;
    let factors = entry_factors(cut, found);
    part.found = true;
    part.branch = entry_branch(cut, min(found, cut.count - 1u));
    part.expected_total = sum_of_lanes(lanes_expected);
    // The entry's share of the interval is its share of all weights.
    part.expected_own = entry_expected(cut, found) * (total_weight * factors.y / factors.x);
    part.start = wide_add(lane.start, row.start);
    part.width = row.width;
    return part;
}
