//! From a scene to an image: the integrators, the film, pictures for the eyes, image files and error metrics.
//!
//! [`renderer`] gives an object that renders one frame (one sample per pixel) at a time into its [`Film`]; the caller
//! decides when to stop. `exact` is a sibling of the samplers: it sums over all lights and uses no cache, and
//! everything is judged by it. `oracle` knows the best choice of one light per pixel: how far learning is from it.
//!
//! Absent from this crate: windows, the command line. Deterministic for a seed at any thread count.

mod bounces;
mod choosing;
mod clean;
mod control;
mod direct;
pub mod error;
mod exact;
pub mod film;
mod filter;
pub mod flip;
pub mod frame;
pub mod gpu;
pub mod image;
pub mod metric;
mod oracle;
mod path;
pub mod rays;
mod resampling;
mod restir;
pub mod settings;

pub use choosing::Choosing;
pub use clean::{Cleaned, Cleaner, Projection};
pub use error::{GpuFault, RenderError};
pub use film::{ErrorEstimate, Film, Image, SampleCounts};
pub use flip::flip;
pub use frame::{FrameLoop, RenderStats, SceneRef, renderer};
pub use metric::ImageError;
pub use restir::RestirSettings;
pub use settings::{MAX_CANDIDATES, MAX_LIGHT_SAMPLES, Method, Mis, PixelFilter, Settings};
