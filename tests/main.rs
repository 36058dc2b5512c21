//! The cross-crate tests, one binary.

/// What is made on demand under a memory budget.
mod budget;
/// The program as people and scripts meet it.
mod cli;
/// Scenes whose image is known in closed form.
mod closed_form;
/// Meshes that stay in their file until a ray comes near them.
mod deferred;
/// The GPU back end against the CPU.
mod gpu;
/// Its auxiliary images.
mod gpu_aovs;
/// Pictures for the eyes that it makes of its film.
mod gpu_clean;
/// Its guided bounces.
mod gpu_guides;
/// Records that Rust and the shaders share.
mod layout;
/// Placed meshes and holes on the GPU back end.
mod placed;
/// What must hold for any scene: invariances, degenerate inputs, threads, probabilities.
mod properties;
/// Light samples that are kept from frame to frame.
mod restir;
/// A million lights.
mod scale;
/// Functions that Rust and the shaders share.
mod twins;
/// Every sampler against `exact`.
mod unbiased;
/// The window, driven by scripts.
mod window;
