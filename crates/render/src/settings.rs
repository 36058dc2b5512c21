//! Every knob of rendering, once.

use crate::RenderError;
use light_cache::SamplerKind;
use serde::{Deserialize, Serialize};

/// How direct light is found. Written and read by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "&'static str", try_from = "String")]
pub enum Method {
    /// One light per path vertex, chosen by this sampler.
    Sampled(SamplerKind),
    /// All lights at every path vertex: the judge. No cache, no choice.
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

impl From<Method> for &'static str {
    fn from(method: Method) -> Self {
        method.name()
    }
}

impl TryFrom<String> for Method {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::all().find(|m| m.name() == name).ok_or_else(|| {
            let names: Vec<_> = Self::all().map(Self::name).collect();
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
    /// Whether what is found out about each light is kept for [`crate::FrameLoop::light_records`], whatever the sampler
    /// (`dump`). Costs time; changes no image.
    #[serde(default)]
    pub record_lights: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            method: Method::Sampled(SamplerKind::Adaptive),
            max_bounces: 0,
            seed: 0,
            pixel_filter: PixelFilter::Box,
            light: light_cache::Settings::default(),
            aovs: false,
            record_lights: false,
        }
    }
}

impl Settings {
    /// Widest and tallest image.
    const MAX_SIZE: u32 = 32_768;

    /// # Errors
    /// [`RenderError::Setting`] for a setting out of its range, with the range.
    pub fn check(&self) -> Result<(), RenderError> {
        let sizes = 1..=Self::MAX_SIZE;
        let share = 0.0..=1.0;
        let refuse = |what: String, remedy: &str| {
            Err(RenderError::Setting {
                what,
                remedy: remedy.into(),
            })
        };
        if !sizes.contains(&self.width) || !sizes.contains(&self.height) {
            let what = format!("image of {} x {} pixels", self.width, self.height);
            return refuse(what, "width and height must be 1 to 32,768");
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_out_of_range_are_refused_with_the_range() {
        Settings::default().check().expect("the default is valid");
        type Spoil = fn(&mut Settings);
        let odd: [(&str, Spoil); 7] = [
            ("0 x 720", |s| s.width = 0),
            ("1280 x 40000", |s| s.height = 40_000),
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
        for method in Method::all() {
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
