// How much of the picture before is kept.

// twin: crates/render/src/clean/row.rs LONGEST
const LONGEST: f32 = 4.0;
// twin: crates/render/src/clean/row.rs INDEPENDENT
const INDEPENDENT: f32 = 64.0;

// As how many samples a history of `samples` counts beside `spp` new ones.
// twin: crates/render/src/clean/row.rs kept
fn samples_kept(samples: f32, spp: f32) -> f32 {
    return min(samples, LONGEST) * max(1.0 - spp / INDEPENDENT, 0.0);
}
