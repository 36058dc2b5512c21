//! Random numbers, point sets, discrete distributions, Monte Carlo weights and the statistics of errors.
//!
//! Everything here is a pure function of its arguments: random numbers come from counters, not from state, so any
//! thread can ask for any number in any order and gets the same answer. Directions are unit vectors; local frames have
//! `+z` along the normal; solid angles are in steradians; uniform numbers lie in `[0, 1)`.
//!
//! Absent from this crate: scenes, meshes, files. The lights of [`integrands::direct_light`] are formulas to test estimators with.

pub mod convergence;
pub mod discrepancy;
pub mod discrete;
pub mod estimators;
pub mod ggx;
pub mod guide;
pub mod hash;
pub mod hemisphere;
pub mod integrands;
pub mod mis;
pub mod pixel;
pub mod points;
pub mod random;
pub mod rectangle;
pub mod sequence;
pub mod sobol;
pub mod statistics;
pub mod sum;
pub mod triangle;

pub use discrete::{Discrete, Draw};
pub use guide::HemisphereGuide;
pub use hemisphere::Frame;
pub use pixel::PixelSampler;
pub use random::{Random, Stream, unit_f32, unit_f64};
pub use rectangle::SphericalRectangle;
pub use sequence::{PixelSequence, VertexSequence, first_vertices};
pub use statistics::Moments;
pub use sum::PairSum;
pub use triangle::SphericalTriangle;
