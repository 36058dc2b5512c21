//! Every knob of rendering, once.

use light_cache::SamplerKind;
use serde::{Deserialize, Serialize};

/// How direct light is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Method {
    /// One light per path vertex, chosen by this sampler.
    Sampled(SamplerKind),
    /// All lights at every path vertex: the judge. No cache, no choice.
    #[serde(rename = "exact")]
    Exact,
}

impl Method {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sampled(kind) => kind.name(),
            Self::Exact => "exact",
        }
    }

    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        SamplerKind::ALL.into_iter().map(Self::Sampled).chain([Self::Exact])
    }
}

/// Weight of a sample by its distance from the pixel centre. All are sampled in proportion (filter importance sampling,
/// Ernst et al. 2006), so a sample belongs to one pixel only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PixelFilter {
    /// The pixel's own area.
    #[default]
    Box,
    /// Gaussian, standard deviation 0.5 pixels, cut at 1.5 pixels.
    Gaussian,
    /// Blackman-Harris, 4 terms, 3 pixels wide.
    BlackmanHarris,
}

/// Knobs of rendering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Image width in pixels, 1..=32,768.
    pub width: u32,
    /// Image height in pixels, 1..=32,768.
    pub height: u32,
    /// How direct light is found.
    pub method: Method,
    /// Number of bounces after the first surface: 0 = emission and direct light only. Higher values add indirect
    /// light; lower values are faster.
    pub max_bounces: u32,
    /// Seed of all random numbers: same seed, same image, on any number of threads.
    pub seed: u64,
    /// Pixel filter.
    pub pixel_filter: PixelFilter,
    /// Light choice.
    pub light: light_cache::Settings,
    /// Whether auxiliary images (albedo, normal, depth, position, chosen light) are kept. Costs time.
    pub aovs: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            method: Method::Sampled(SamplerKind::TreeVisible),
            max_bounces: 0,
            seed: 0,
            pixel_filter: PixelFilter::Box,
            light: light_cache::Settings::default(),
            aovs: false,
        }
    }
}
