// Where a point belongs: world-space cells, hashed. See crates/light-cache/src/adaptive/grid.rs.
#import "lib/hash.wgsl"
#import "lib/wide.wgsl"
#import "light_cache/bindings.wgsl"

// Words of the header.
const GRID_SLOTS: u32 = 11u;
const GRID_SLOT_BITS: u32 = 12u;
const GRID_EYE: u32 = 13u;
const GRID_CENTER: u32 = 16u;
const GRID_MIN_SIZE: u32 = 19u;
const GRID_INVERSE_MIN_SIZE: u32 = 20u;

const NO_CELL: u32 = 0xffffffffu;
// twin: crates/light-cache/src/adaptive/grid.rs CELL_ANGLE
const CELL_ANGLE: f32 = 0.5;
// twin: crates/light-cache/src/adaptive/grid.rs SECONDARY_SCALE
const SECONDARY_SCALE: f32 = 4.0;
// twin: crates/light-cache/src/adaptive/grid.rs MAX_LEVEL
const MAX_LEVEL: u32 = 31u;
// twin: crates/light-cache/src/adaptive/cube.rs LEVELS
const LEVELS: u32 = 5u;

struct Spot {
    key: vec2<u32>,
    // Which of the smallest cubes of the cell.
    cube: vec3<u32>,
}

fn header_vec3(at: u32) -> vec3<f32> {
    return vec3<f32>(cache_f32(at), cache_f32(at + 1u), cache_f32(at + 2u));
}

// twin: crates/light-cache/src/adaptive/grid.rs dominant_axis
fn dominant_axis(normal: vec3<f32>) -> u32 {
    let a = abs(normal);
    var axis = 2u;
    if a.x >= a.y && a.x >= a.z {
        axis = 0u;
    } else if a.y >= a.z {
        axis = 1u;
    }
    return axis * 2u + select(0u, 1u, normal[axis] < 0.0);
}

// twin: crates/light-cache/src/adaptive/grid.rs locate
fn locate(point: ShadingPoint) -> Spot {
    let scale = select(SECONDARY_SCALE, 1.0, point.primary);
    let wanted = length(point.position_ws - header_vec3(GRID_EYE)) * CELL_ANGLE * scale;
    let bits = bitcast<u32>(max(wanted / cache_f32(GRID_MIN_SIZE), 1.0)) >> 23u;
    let level = clamp(max(bits, 127u) - 127u, LEVELS, MAX_LEVEL);
    let position = (point.position_ws - header_vec3(GRID_CENTER)) * cache_f32(GRID_INVERSE_MIN_SIZE);
    let whole = vec3<i32>(floor(position * bitcast<f32>((127u + LEVELS - level) << 23u)));
    let kind = (dominant_axis(point.normal_ws) << 1u) | select(0u, 1u, point.primary);
    let tag = mix_bits((level << 8u) | kind);
    let cell = vec3<u32>(whole >> vec3<u32>(LEVELS)) & vec3<u32>(0xfffffu);
    let key = vec2<u32>(cell.x | (cell.y << 20u), (cell.y >> 12u) | (cell.z << 8u));
    return Spot(key ^ vec2<u32>(tag), vec3<u32>(whole) & vec3<u32>((1u << LEVELS) - 1u));
}

// twin: crates/light-cache/src/adaptive/grid.rs find
fn find_cell(key: vec2<u32>) -> u32 {
    // The upper word of key x 0x9e3779b97f4a7c15.
    let upper = wide_mul(key.x, 0x7f4a7c15u).y + key.x * 0x9e3779b9u + key.y * 0x7f4a7c15u;
    let slots = cache_word(GRID_SLOTS) >> 2u;
    let bits = cache_word(GRID_SLOT_BITS);
    var at = upper >> (32u - bits);
    loop {
        let slot = cache[slots + at];
        if slot.z == NO_CELL || (slot.x == key.x && slot.y == key.y) {
            return slot.z;
        }
        at = (at + 1u) & ((1u << bits) - 1u);
    }
    return NO_CELL;
}
