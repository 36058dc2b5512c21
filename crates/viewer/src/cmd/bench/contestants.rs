//! What `bench` compares: samplers, or the values of one knob.

use crate::message;
use crate::session::BackEnd;
use anyhow::{Result, bail};
use clap::ValueEnum;
use render::{Method, Mis, Settings};
use sampling::PixelSampler;

/// A knob whose values are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Knob {
    /// --pixel-sampler: all of them
    PixelSampler,
    /// --mis: all heuristics, and none
    Mis,
    /// --candidates: 1, 2, 4 and 8
    Candidates,
    /// --light-samples: 1, 2, 4 and 8
    LightSamples,
    /// with samples where the error is, as with `render --target-error`, and with one per pixel and frame
    AdaptivePixels,
    /// with directions that `adaptive` has learned for paths to go on in, and without
    GuidedBounces,
    /// with the control variate of `adaptive`, and without
    ControlVariate,
}

/// One way to render.
#[derive(Clone, Debug)]
pub(super) struct Contestant {
    /// What tables call it.
    pub(super) name: String,
    /// How it renders; the seed is that of the first run.
    pub(super) settings: Settings,
    /// What renders.
    pub(super) back_end: BackEnd,
}

impl Contestant {
    /// Every one of `methods` on each of `back_ends` that has it, with every value of `knob` if there is one. Otherwise as `settings` say.
    ///
    /// # Errors
    /// If no back end has any.
    pub(super) fn all(
        settings: &Settings,
        methods: &[Method],
        knob: Option<Knob>,
        back_ends: &[BackEnd],
    ) -> Result<Vec<Self>> {
        let of_method = |&method: &Method| {
            let settings = Settings {
                method,
                ..settings.clone()
            };
            let Some(knob) = knob else {
                let name = method.name().into();
                return vec![(name, settings)];
            };
            let named = |(value, settings)| match methods {
                [_] => (value, settings),
                _ => (format!("{} {value}", method.name()), settings),
            };
            knob.values(&settings).into_iter().map(named).collect()
        };
        let all: Vec<(String, Settings)> = methods.iter().flat_map(of_method).collect();
        let mut contestants = Vec::new();
        for back_end in back_ends {
            for (name, settings) in &all {
                let mut name = name.clone();
                if let BackEnd::Gpu(_) = back_end {
                    if let Err(error) = render::gpu::check(settings) {
                        message::warn(format!("{name}: {error}"));
                        continue;
                    }
                    // Beside the CPU's, whose names stay as they are.
                    if back_ends.len() > 1 {
                        name += " gpu";
                    }
                }
                contestants.push(Self {
                    name,
                    settings: settings.clone(),
                    back_end: back_end.clone(),
                });
            }
        }
        if contestants.is_empty() {
            bail!("nothing is left to be compared");
        }
        Ok(contestants)
    }
}

impl Knob {
    /// `settings` with all values, and what these are called.
    fn values(self, settings: &Settings) -> Vec<(String, Settings)> {
        let with = |name: &str, turn: &dyn Fn(&mut Settings)| {
            let mut settings = settings.clone();
            turn(&mut settings);
            (name.to_owned(), settings)
        };
        const COUNTS: [u32; 4] = [1, 2, 4, 8];
        match self {
            Self::PixelSampler => PixelSampler::ALL
                .map(|sampler| with(sampler.name(), &|s| s.pixel_sampler = sampler))
                .into(),
            Self::Mis => Mis::ALL.map(|mis| with(mis.name(), &|s| s.mis = mis)).into(),
            Self::Candidates => COUNTS
                .map(|count| with(&count.to_string(), &|s| s.candidates = count))
                .into(),
            Self::LightSamples => COUNTS
                .map(|count| with(&count.to_string(), &|s| s.light_samples = count))
                .into(),
            Self::AdaptivePixels => [("adaptive pixels", true), ("even pixels", false)]
                .map(|(name, on)| with(name, &|s| s.adaptive_pixels = on))
                .into(),
            Self::GuidedBounces => [("guided", true), ("unguided", false)]
                .map(|(name, on)| with(name, &|s| s.light.guided_bounces = on))
                .into(),
            Self::ControlVariate => [("on", true), ("off", false)]
                .map(|(name, on)| with(name, &|s| s.light.control_variate = on))
                .into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use light_cache::SamplerKind;

    #[test]
    fn contestants_differ_in_what_is_compared_and_have_names_of_their_own() {
        let methods = [SamplerKind::Tree, SamplerKind::Adaptive].map(Method::Sampled);
        let settings = Settings::default();
        for knob in Knob::value_variants().iter().copied().map(Some).chain([None]) {
            for methods in [&methods[..1], &methods[..]] {
                let all = Contestant::all(&settings, methods, knob, &[BackEnd::Cpu]).expect("the CPU has all");
                assert!(all.len() >= methods.len());
                for (i, a) in all.iter().enumerate() {
                    a.settings.check().expect("in range");
                    let others = all.iter().skip(i + 1);
                    assert!(others.clone().all(|b| a.name != b.name && a.settings != b.settings));
                }
            }
        }
    }
}
