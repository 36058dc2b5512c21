// Learned cuts: the sampler that knows which lights matter where. See crates/light-cache/src/adaptive.
//
// Header: the tree's, then the words below.
#import "light_cache/cut.wgsl"
#import "light_cache/distribution.wgsl"
#import "light_cache/grid.wgsl"
#import "light_cache/light_tree.wgsl"

// Distributions of the global table for first and for later hits.
const TABLE_PRIMARY: u32 = 8u;
const TABLE_SECONDARY: u32 = 9u;
// The table's part of the 32-bit random numbers.
const TABLE_MASS: u32 = 10u;
// Luminance of the irradiance that is 1 in the units of weights.
const CUT_UNIT: u32 = 24u;

// twin: crates/light-cache/src/adaptive/mod.rs CELL_SHIFT
const CELL_SHIFT: u32 = 11u;

// twin: crates/light-cache/src/adaptive/mod.rs Local
struct Local {
    receiver: Receiver,
    // Of the cut; without one the tree draws.
    cut: Cut,
    descent: Descent,
    table: u32,
    salt: u32,
    // No light can contribute.
    dead: bool,
}

// What the table has of the range of random numbers.
fn table_width() -> vec2<u32> {
    return wide_shift_left(vec2<u32>(cache_word(TABLE_MASS), 0u), 31u);
}

// twin: crates/light-cache/src/adaptive/mod.rs local
fn sampler_local(point: ShadingPoint) -> Local {
    var local: Local;
    local.receiver = Receiver(point.position_ws, point.normal_ws);
    local.table = cache_word(select(TABLE_SECONDARY, TABLE_PRIMARY, point.primary));
    local.salt = salt_of(point);
    let spot = locate(point);
    local.cut = cut_at(find_cell(spot.key), spot.cube);
    if local.cut.count == 0u {
        local.descent = descent_at(0u, local.receiver);
        local.dead = !(local.descent.near > 0.0 || local.descent.far > 0.0);
    } else {
        local.descent = Descent(0u, local.receiver, 0.0, 0.0);
    }
    return local;
}

// A light at a point: the one at `place` in tree order if it `is_given`, or else the one that position `x` of what the table leaves draws.
// Nothing where nothing can arrive: nothing is drawn there, not by the table either.
// twin: crates/light-cache/src/adaptive/mod.rs chosen
// twin: crates/light-cache/src/adaptive/mod.rs controlled
fn choose(local: Local, is_given: bool, place: u32, x: vec2<u32>) -> Choice {
    let rest = wide_sub(UNIT_WIDTH, table_width());
    var drawn = Drawn(place, vec2<u32>(0u));
    var part: Part;
    if local.cut.count == 0u {
        if local.dead {
            return plain_choice(0u, 0.0);
        }
        if is_given {
            drawn.width = descent_width(local.descent, place, rest);
        } else {
            drawn = descent_draw(local.descent, x, rest);
        }
    } else {
        var entry = 0u;
        if is_given {
            entry = entry_of(local.cut, place);
        }
        let width = wide_shift_right(rest, CELL_SHIFT);
        part = cut_part(local.cut, local.receiver, is_given, entry, wide_shift_right(x, CELL_SHIFT), width);
        if !part.found {
            return plain_choice(0u, 0.0);
        }
        let own = wide_shift_left(part.width, CELL_SHIFT);
        let within = wide_sub(x, wide_shift_left(part.start, CELL_SHIFT));
        if is_one_light(part.branch) {
            drawn = Drawn(part.branch & ~LIGHT_BRANCH, own);
        } else if part.branch == DISTANT_BRANCH {
            if is_given {
                drawn.width = width_of_distant(0u, local.receiver, place, own);
            } else {
                drawn = draw_distant(0u, local.receiver, within, own);
            }
        } else if is_given {
            drawn.width = width_in_node(0u, local.receiver, part.branch, place, own);
        } else {
            drawn = draw_in_node(0u, local.receiver, part.branch, within, own);
        }
    }
    let light = light_at(0u, drawn.place);
    let of_table = distribution_pmf(local.table, light) * (f32(cache_word(TABLE_MASS)) / 4294967296.0);
    let pmf = probability(drawn.width) + of_table;
    var control = vec3<f32>(0.0);
    if local.cut.count != 0u && pmf > 0.0 {
        let share = probability(drawn.width) / (probability(rest) * pmf);
        control = cache_f32(CUT_UNIT) * (part.expected_total - part.expected_own * share);
    }
    return Choice(light, pmf, control);
}

// twin: crates/light-cache/src/adaptive/mod.rs sample
fn sampler_draw(local: Local, u: u32) -> Choice {
    let position = position_in_unit(u, local.salt);
    let of_table = table_width();
    let by_table = wide_less(position, of_table);
    var place = 0u;
    if by_table {
        let stretched = wide_div(wide_shift_left(position, 1u), cache_word(TABLE_MASS));
        place = place_of(0u, distribution_index(local.table, stretched));
    }
    return choose(local, by_table, place, wide_sub(position, of_table));
}

// twin: crates/light-cache/src/adaptive/mod.rs guide
fn sampler_guide(local: Local) -> u32 {
    return local.cut.guide;
}

// twin: crates/light-cache/src/adaptive/mod.rs pmf
fn sampler_pmf(local: Local, light: u32) -> f32 {
    return choose(local, true, place_of(0u, light), vec2<u32>(0u)).pmf;
}
