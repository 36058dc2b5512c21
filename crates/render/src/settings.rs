//! Every knob of rendering, once.

use crate::{RenderError, RestirSettings};
use light_cache::SamplerKind;
use sampling::PixelSampler;
use sampling::mis::Heuristic;
use serde::{Deserialize, Serialize};

/// How direct light is found. Written and read by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "&'static str", try_from = "String")]
pub enum Method {
    /// One light per path vertex, chosen by this sampler.
    Sampled(SamplerKind),
    /// One light per path vertex; those of first hits are kept from frame to frame and shared by neighbours. Each frame has the right mean, but
    /// frames depend on each other: a preview.
    Restir,
    /// All lights at every path vertex: the judge. No cache, no choice.
    Exact,
    /// Research: one light per pixel, chosen with the best possible probabilities, which are worked out beforehand and not
    /// counted as time. Direct light at the first hit only.
    Oracle,
}

impl Method {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sampled(kind) => kind.name(),
            Self::Restir => "restir",
            Self::Exact => "exact",
            Self::Oracle => "oracle",
        }
    }

    /// All that render anything, whatever the other settings.
    pub fn all() -> impl Iterator<Item = Self> {
        SamplerKind::ALL
            .into_iter()
            .map(Self::Sampled)
            .chain([Self::Restir, Self::Exact])
    }

    /// [`Method::all`], and those that serve research only.
    pub fn all_and_research() -> impl Iterator<Item = Self> {
        Self::all().chain([Self::Oracle])
    }

    /// What has to be said wherever results of this method are shown; `None` for methods that anyone may use.
    pub fn research_note(self) -> Option<&'static str> {
        match self {
            Self::Oracle => {
                Some("research: knows the lights that each pixel sees, and finding out is not counted as time")
            }
            Self::Sampled(_) | Self::Restir | Self::Exact => None,
        }
    }
}

impl From<Method> for &'static str {
    fn from(method: Method) -> Self {
        method.name()
    }
}

impl TryFrom<String> for Method {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::all_and_research().find(|m| m.name() == name).ok_or_else(|| {
            let names: Vec<_> = Self::all_and_research().map(Self::name).collect();
            format!("no method '{name}'; try one of: {}", names.join(", "))
        })
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

/// How light sampling and BSDF sampling share what both can find.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mis {
    /// In proportion to the densities.
    #[default]
    Balance,
    /// In proportion to their squares.
    Power,
    /// As balance, but nothing for densities below a tenth of the other.
    Cutoff,
    /// The larger density takes all.
    Maximum,
    /// Lights are found by light sampling only.
    None,
}

impl Mis {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Balance, Self::Power, Self::Cutoff, Self::Maximum, Self::None];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        self.heuristic().map_or("none", Heuristic::name)
    }

    /// The heuristic; `None` where there is nothing to share.
    pub(crate) fn heuristic(self) -> Option<Heuristic> {
        match self {
            Self::Balance => Some(Heuristic::Balance),
            Self::Power => Some(Heuristic::Power),
            Self::Cutoff => Some(Heuristic::Cutoff),
            Self::Maximum => Some(Heuristic::Maximum),
            Self::None => None,
        }
    }
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
    /// Lights drawn at the first surface of every path, 1..=[`MAX_LIGHT_SAMPLES`]. Higher values spend more on light where
    /// eye rays are dear; lower values make more frames. `exact` draws none, `restir` always one.
    #[serde(default = "default_light_samples")]
    pub light_samples: u32,
    /// Lights compared for each one that is drawn at a glossy surface, 1..=[`MAX_CANDIDATES`]: one of them is kept in proportion to how it is
    /// reflected. Higher values find the lights that are mirrored; lower values are faster; 1 compares none.
    #[serde(default = "default_candidates")]
    pub candidates: u32,
    /// Seed of all random numbers: same seed, same image, on any number of threads.
    pub seed: u64,
    /// `oracle`: times that it looks at all lights from every pixel, 1..=65,536. Higher values come closer to the best
    /// choice; lower values are prepared sooner. 16.
    #[serde(default = "default_oracle_passes")]
    pub oracle_passes: u32,
    /// `restir`: what is kept and shared.
    #[serde(default)]
    pub restir: RestirSettings,
    /// Pixel filter.
    pub pixel_filter: PixelFilter,
    /// How samples are spread over the area of a pixel, the lights and the points on them, by the name of a [`PixelSampler`]. After the
    /// first hit it is always Owen-scrambled Sobol'.
    #[serde(default, with = "pixel_sampler_name")]
    pub pixel_sampler: PixelSampler,
    /// How light sampling and BSDF sampling share what both can find.
    #[serde(default)]
    pub mis: Mis,
    /// Light choice.
    pub light: light_cache::Settings,
    /// Whether auxiliary images (albedo, normal, depth, position, chosen light) are kept. Costs time.
    pub aovs: bool,
    /// Whether what is found out about each light is kept for [`crate::FrameLoop::light_records`], whatever the sampler
    /// (`dump`). Costs time; changes no image.
    #[serde(default)]
    pub record_lights: bool,
    /// Whether pixels take samples where the error is, one per frame on average, instead of one each. Unbiased either way.
    #[serde(default)]
    pub adaptive_pixels: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            method: Method::Sampled(SamplerKind::Adaptive),
            max_bounces: 0,
            light_samples: default_light_samples(),
            candidates: default_candidates(),
            seed: 0,
            oracle_passes: default_oracle_passes(),
            restir: RestirSettings::default(),
            pixel_filter: PixelFilter::Box,
            pixel_sampler: PixelSampler::default(),
            mis: Mis::default(),
            light: light_cache::Settings::default(),
            aovs: false,
            record_lights: false,
            adaptive_pixels: false,
        }
    }
}

/// [`PixelSampler`] written and read by its name.
mod pixel_sampler_name {
    use sampling::PixelSampler;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(sampler: &PixelSampler, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(sampler.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PixelSampler, D::Error> {
        let name = String::deserialize(deserializer)?;
        let found = PixelSampler::ALL.into_iter().find(|sampler| sampler.name() == name);
        found.ok_or_else(|| {
            let names = PixelSampler::ALL.map(PixelSampler::name).join(", ");
            D::Error::custom(format!("no pixel sampler '{name}'; try one of: {names}"))
        })
    }
}

/// Most lights drawn at one surface.
pub const MAX_LIGHT_SAMPLES: u32 = 8;

/// Most lights compared for one that is drawn.
pub const MAX_CANDIDATES: u32 = 8;

fn default_candidates() -> u32 {
    4
}

fn default_light_samples() -> u32 {
    1
}

fn default_oracle_passes() -> u32 {
    16
}

impl Settings {
    /// # Errors
    /// [`RenderError::Setting`] for a setting out of its range, with the range.
    pub fn check(&self) -> Result<(), RenderError> {
        check_size(self.width, self.height)?;
        let share = 0.0..=1.0;
        let refuse = |what: String, remedy: &str| {
            Err(RenderError::Setting {
                what,
                remedy: remedy.into(),
            })
        };
        if self.method == Method::Oracle && self.max_bounces > 0 {
            return refuse(
                format!("oracle with max_bounces = {}", self.max_bounces),
                "it knows what is best for direct light at the first hit only: max_bounces must be 0",
            );
        }
        if self.method == Method::Oracle && self.adaptive_pixels {
            return refuse(
                "oracle with adaptive_pixels (--target-error)".into(),
                "it takes one sample per pixel and frame: adaptive_pixels must be false",
            );
        }
        if self.method == Method::Restir && self.adaptive_pixels {
            return refuse(
                "restir with adaptive_pixels (--target-error)".into(),
                "its frames depend on each other, so that no error can be estimated from them: adaptive_pixels must be false",
            );
        }
        if !(1..=MAX_LIGHT_SAMPLES).contains(&self.light_samples) {
            return refuse(format!("light_samples = {}", self.light_samples), "must be 1 to 8");
        }
        if !(1..=MAX_CANDIDATES).contains(&self.candidates) {
            return refuse(format!("candidates = {}", self.candidates), "must be 1 to 8");
        }
        if !(1..=65_536).contains(&self.oracle_passes) {
            return refuse(
                format!("oracle_passes = {}", self.oracle_passes),
                "it must be 1 to 65,536; 16 is usual",
            );
        }
        self.restir.check()?;
        let mass = self.light.min_probability_mass;
        if !share.contains(&mass) {
            return refuse(
                format!("min_probability_mass = {mass}"),
                "it must be 0 to 1; 0.005 is usual",
            );
        }
        let decay = self.light.table_decay;
        if !(decay > 0.0 && decay <= 1.0) {
            return refuse(
                format!("table_decay = {decay}"),
                "it must be above 0 and at most 1; 0.9 is usual",
            );
        }
        let ignored = self.light.ignore_below;
        if !(0.0..f32::INFINITY).contains(&ignored) {
            return refuse(
                format!("ignore_below = {ignored}"),
                "it must be at least 0; 0 ignores no light",
            );
        }
        Ok(())
    }
}

/// # Errors
/// [`RenderError::Setting`] for an image that is too large, or empty.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), RenderError> {
    const SIZES: std::ops::RangeInclusive<u32> = 1..=32_768;
    if SIZES.contains(&width) && SIZES.contains(&height) {
        return Ok(());
    }
    Err(RenderError::Setting {
        what: format!("image of {width} x {height} pixels"),
        remedy: "width and height must be 1 to 32,768".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_out_of_range_are_refused_with_the_range() {
        Settings::default().check().expect("the default is valid");
        type Spoil = fn(&mut Settings);
        let odd: [(&str, Spoil); 17] = [
            ("0 x 720", |s| s.width = 0),
            ("1280 x 40000", |s| s.height = 40_000),
            ("max_bounces = 2", |s| (s.method, s.max_bounces) = (Method::Oracle, 2)),
            ("adaptive_pixels", |s| {
                (s.method, s.adaptive_pixels) = (Method::Oracle, true)
            }),
            ("adaptive_pixels", |s| {
                (s.method, s.adaptive_pixels) = (Method::Restir, true)
            }),
            ("restir.candidates", |s| s.restir.candidates = 0),
            ("restir.neighbors", |s| s.restir.neighbors = 33),
            ("restir.radius", |s| s.restir.radius = f32::NAN),
            ("restir.history", |s| s.restir.history = 1001),
            ("light_samples", |s| s.light_samples = 9),
            ("candidates", |s| s.candidates = 0),
            ("oracle_passes", |s| s.oracle_passes = 0),
            ("min_probability_mass", |s| s.light.min_probability_mass = 1.5),
            ("min_probability_mass", |s| s.light.min_probability_mass = f32::NAN),
            ("table_decay", |s| s.light.table_decay = 0.0),
            ("ignore_below", |s| s.light.ignore_below = -1.0),
            ("ignore_below", |s| s.light.ignore_below = f32::INFINITY),
        ];
        for (name, spoil) in odd {
            let mut settings = Settings::default();
            spoil(&mut settings);
            let message = settings.check().expect_err(name).to_string();
            assert!(message.contains(name) && message.contains("must be"), "{message}");
        }
    }

    #[test]
    fn methods_are_written_by_name() {
        for method in Method::all_and_research() {
            let json = serde_json::to_string(&method).expect("serialisable");
            assert_eq!(json, format!("\"{}\"", method.name()));
            assert_eq!(serde_json::from_str::<Method>(&json).expect("its own name"), method);
        }
        let message = serde_json::from_str::<Method>("\"exakt\"")
            .expect_err("misspelt")
            .to_string();
        assert!(
            message.contains("exakt") && message.contains("uniform, ") && message.contains("exact"),
            "{message}"
        );
    }
}
