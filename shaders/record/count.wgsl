// What the pixels of a film have counted, added up in words of 64 bits. Rust: crates/render/src/gpu/layout.rs

struct Count {
    rays_nearest: vec2<u32>,
    rays_occluded: vec2<u32>,
    nonfinite: vec2<u32>,
}
