// What is kept of a frame's observations for the lesson to come. Rust: crates/render/src/gpu/layout.rs

struct LessonParams {
    // Number of the frame, which decides what is kept.
    frame: u32,
    // One in so many is kept for every MAX_OBSERVATIONS that the frame has begun.
    stride: u32,
    pad0: u32,
    pad1: u32,
}

struct LessonCounters {
    // Observations of this frame.
    observed: atomic<u32>,
    // Observations kept since they were last read, and runs of them.
    kept: atomic<u32>,
    runs: atomic<u32>,
    pad: u32,
}

// Observations of one tile, in order; runs themselves lie in any order.
struct Run {
    frame: u32,
    tile: u32,
    first: u32,
    count: u32,
    // How many observations each one stands for that is OBSERVED_FOR_MANY.
    weight: u32,
}
