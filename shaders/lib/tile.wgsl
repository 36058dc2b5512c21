// The pixels of a tile, row by row, dealt out to the threads of a workgroup.
#import "record/frame.wgsl"

// twin: crates/render/src/film.rs TILE_SIZE
const TILE_SIZE: u32 = 16u;
const TILE_THREADS: u32 = 64u;
// Consecutive pixels of each thread.
const TILE_SHARE: u32 = TILE_SIZE * TILE_SIZE / TILE_THREADS;
const NO_PIXEL: u32 = 0xffffffffu;

// The pixel at a place in a tile; NO_PIXEL outside the image.
// Tiles at the right edge are narrower: places past it hold nothing, and the order of the others is that of the CPU.
fn pixel_of_tile(tile: vec2<u32>, place: u32) -> u32 {
    let at = tile * TILE_SIZE + vec2<u32>(place % TILE_SIZE, place / TILE_SIZE);
    if at.x >= frame.width || at.y >= frame.height {
        return NO_PIXEL;
    }
    return at.y * frame.width + at.x;
}
