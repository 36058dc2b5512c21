//! How far an image is from its reference.

use crate::Image;

/// Errors on luminance over all pixels, as the field reports them.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct ImageError {
    /// Mean squared error.
    pub mse: f64,
    /// mean((x - r)^2 / (r^2 + 0.01 mean(r)^2)): all pixels weigh alike, and the scale of the scene does not matter.
    pub relmse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
    /// Symmetric mean absolute percentage error, 2 |x - r| / (|x| + |r| + 0.01 mean(r)).
    pub smape: f64,
    /// mean(x) / mean(r).
    pub mean_ratio: f64,
}

impl ImageError {
    /// Compares `image` with `reference`; `None` if their sizes differ.
    pub fn between(image: &Image, reference: &Image) -> Option<Self> {
        let _ = (image, reference);
        unimplemented!("owner: render")
    }
}
