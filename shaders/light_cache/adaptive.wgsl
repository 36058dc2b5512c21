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

// Where in the cut, or in the tree, a light is: its place and the width that is its own.
// twin: crates/light-cache/src/adaptive/mod.rs pmf
fn own_width(local: Local, place: u32) -> vec2<u32> {
    let rest = wide_sub(UNIT_WIDTH, table_width());
    if local.cut.count == 0u {
        return descent_width(local.descent, place, rest);
    }
    let entry = entry_of(local.cut, place);
    let part = cut_part(local.cut, local.receiver, true, entry, vec2<u32>(0u), wide_shift_right(rest, CELL_SHIFT));
    if !part.found {
        return vec2<u32>(0u);
    }
    let own = wide_shift_left(part.width, CELL_SHIFT);
    if is_one_light(part.branch) {
        return own;
    }
    if part.branch == DISTANT_BRANCH {
        return width_of_distant(0u, local.receiver, place, own);
    }
    return width_in_node(0u, local.receiver, part.branch, place, own);
}

// Whether anything arrives at the point at all: where nothing does nothing is drawn, not by the table either.
fn arrives(local: Local) -> bool {
    if local.cut.count == 0u {
        return !local.dead;
    }
    return cut_arrives(local.cut, local.receiver);
}

// twin: crates/light-cache/src/adaptive/mod.rs choice
fn choice_of(local: Local, light: u32, own: vec2<u32>) -> Choice {
    let of_table = distribution_pmf(local.table, light) * (f32(cache_word(TABLE_MASS)) / 4294967296.0);
    return Choice(light, probability(own) + of_table);
}

// twin: crates/light-cache/src/adaptive/mod.rs sample
fn sampler_draw(local: Local, u: u32) -> Choice {
    if local.dead {
        return Choice(0u, 0.0);
    }
    let position = position_in_unit(u, local.salt);
    let of_table = table_width();
    if wide_less(position, of_table) {
        let stretched = wide_div(wide_shift_left(position, 1u), cache_word(TABLE_MASS));
        let light = distribution_index(local.table, stretched);
        return Choice(light, sampler_pmf(local, light));
    }
    let x = wide_sub(position, of_table);
    let rest = wide_sub(UNIT_WIDTH, of_table);
    var drawn: Drawn;
    if local.cut.count == 0u {
        drawn = descent_draw(local.descent, x, rest);
    } else {
        let position_in_cut = wide_shift_right(x, CELL_SHIFT);
        let part = cut_part(local.cut, local.receiver, false, 0u, position_in_cut, wide_shift_right(rest, CELL_SHIFT));
        if !part.found {
            return Choice(0u, 0.0);
        }
        let own = wide_shift_left(part.width, CELL_SHIFT);
        let within = wide_sub(x, wide_shift_left(part.start, CELL_SHIFT));
        if is_one_light(part.branch) {
            drawn = Drawn(part.branch & ~LIGHT_BRANCH, own);
        } else if part.branch == DISTANT_BRANCH {
            drawn = draw_distant(0u, local.receiver, within, own);
        } else {
            drawn = draw_in_node(0u, local.receiver, part.branch, within, own);
        }
    }
    return choice_of(local, light_at(0u, drawn.place), drawn.width);
}

// twin: crates/light-cache/src/adaptive/mod.rs pmf
fn sampler_pmf(local: Local, light: u32) -> f32 {
    if !arrives(local) {
        return 0.0;
    }
    return choice_of(local, light, own_width(local, place_of(0u, light))).pmf;
}
