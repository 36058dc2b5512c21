//! The command line: commands, and the options that several of them share.

use crate::{cmd, machine, view};
use anyhow::{Result, bail};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use light_cache::SamplerKind;
use render::{Method, Mis, PixelFilter, RestirSettings};
use sampling::PixelSampler;

/// Renders scenes with very many lights, and learns which of them matter.
#[derive(Debug, Parser)]
#[command(
    name = "manylight",
    version = machine::VERSION,
    arg_required_else_help = true,
    subcommand_required = true,
    after_help = "\
Examples:
  manylight demo:rooms                                walk through a building with 2,048 lights, in a window
  manylight render demo:rooms -o rooms.png            an image of it, nothing to download
  manylight render hall.glb -o hall.exr --time 60     your own glTF, one minute
  manylight info hall.glb                             what was loaded, what was ignored and why
  manylight dump hall.glb -o - --top 10               the ten lights that matter most, as CSV
  manylight bench demo:rooms --samplers power,table   how fast does the error fall?

Exit codes: 0 done, 1 a comparison or check failed, 2 bad usage or input, 3 no suitable GPU,
4 out of memory or GPU lost, 130 interrupted (what is there is written first)."
)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// No progress and no summary; warnings and errors only
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Also tell what the scene does not need and is skipped (`info` and --stats always tell)
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Walk through a scene in a window
    View(Box<view::ViewArgs>),
    /// Render an image to a file
    Render(Box<cmd::render::RenderArgs>),
    /// Join parts of an image that were rendered apart
    Merge(cmd::merge::MergeArgs),
    /// Compare samplers: frame times, and how fast the error falls
    Bench(cmd::bench::BenchArgs),
    /// Write what was learned about each light as a table
    Dump(cmd::dump::DumpArgs),
    /// Measure how far one image is from another
    Compare(cmd::compare::CompareArgs),
    /// Tell what was loaded from a scene and what was ignored, or what this program and machine can do
    Info(cmd::info::InfoArgs),
    /// Compare Monte Carlo estimators on integrals with known answers
    Estimate(cmd::estimate::EstimateArgs),
}

/// Options of everything that renders.
#[derive(Clone, Debug, Args)]
pub(crate) struct LightArgs {
    /// Bounces after the first surface: 0 = emission and direct light only
    ///
    /// Higher values add indirect light; lower values are faster.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=1000))]
    pub(crate) max_bounces: u32,
    /// Lights drawn at the first surface of every path, 1 to 8
    ///
    /// Higher values spend more on light where eye rays are dear; lower values make more frames.
    #[arg(long, value_name = "N", default_value_t = render::Settings::default().light_samples,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(render::MAX_LIGHT_SAMPLES)))]
    pub(crate) light_samples: u32,
    /// Lights compared for each one that is drawn at a glossy surface, 1 to 8: one is kept, by how it is reflected
    ///
    /// Higher values find the lights that are mirrored; lower values are faster; 1 compares none.
    #[arg(long, value_name = "N", default_value_t = render::Settings::default().candidates,
          value_parser = clap::value_parser!(u32).range(1..=i64::from(render::MAX_CANDIDATES)))]
    pub(crate) candidates: u32,
    /// Seed of all random numbers: same seed, same image, on any number of threads
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Threads that render; default: RAYON_NUM_THREADS, or all processors
    #[arg(long, value_name = "N", alias = "nthreads", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// What renders; the GPU has the samplers uniform, power, table, tree and adaptive. `bench` compares several: cpu,gpu
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "BACKEND",
        default_value = "cpu"
    )]
    pub(crate) backend: Vec<Backend>,
    /// Camera of the scene, by name or by index
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) camera: Option<String>,
    /// How samples are spread around a pixel's centre
    #[arg(long, value_enum, default_value_t = Filter::Box)]
    pub(crate) pixel_filter: Filter,
    /// How samples are spread over a pixel's area, over the lights at the first hit and over each light
    #[arg(long, value_name = "NAME", default_value = PixelSampler::default().name(), value_parser = pixel_sampler())]
    pub(crate) pixel_sampler: PixelSampler,
    /// How drawing a light and meeting one by chance share what both can find; none = draw only
    #[arg(long, value_name = "HEURISTIC", default_value = Mis::default().name(), value_parser = mis())]
    pub(crate) mis: Mis,
    /// Probability shared equally by all lights, whatever was learned, 0 to 1
    ///
    /// Higher values find overlooked lights sooner; lower values waste fewer samples.
    #[arg(long, value_name = "MASS", default_value_t = light_cache::Settings::default().min_probability_mass,
          value_parser = share)]
    pub(crate) min_probability_mass: f32,
    /// `adaptive`: draw lights without a control variate
    ///
    /// With it there is less noise, and pixels may come out below zero; without there is less work at every point.
    #[arg(long)]
    pub(crate) no_control_variate: bool,
    /// `adaptive`: bounces leave as the surface reflects, whatever earlier ones found
    ///
    /// Guided, paths go more often to where light was found, on the CPU; without there is no memory for directions.
    #[arg(long)]
    pub(crate) no_guided_bounces: bool,
    /// `oracle`: times that it looks at all lights from every pixel before it starts
    ///
    /// Higher values come closer to the best choice; lower values are prepared sooner.
    #[arg(long, value_name = "N", default_value_t = render::Settings::default().oracle_passes,
          value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) oracle_passes: u32,
    #[command(flatten)]
    pub(crate) restir: RestirArgs,
    /// BIASED: ignore lights whose learned importance is below this share of the mean; 0 = off
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, default_value_t = 0.0, value_parser = not_negative)]
    pub(crate) ignore_below: f32,
}

/// What `restir` keeps and shares.
#[derive(Clone, Debug, Args)]
pub(crate) struct RestirArgs {
    /// `restir`: lights compared in each pixel and frame
    ///
    /// Higher values begin with better lights; lower values make more frames.
    #[arg(long, value_name = "N", default_value_t = RestirSettings::default().candidates)]
    pub(crate) restir_candidates: u32,
    /// `restir`: pixels nearby that each pixel takes a sample from
    ///
    /// Higher values have less noise in each frame; lower values are faster (two shadow rays each).
    #[arg(long, value_name = "N", default_value_t = RestirSettings::default().neighbors)]
    pub(crate) restir_neighbors: u32,
    /// `restir`: how far away those are at most, in pixels
    ///
    /// Higher values find what no pixel nearby has found; lower values find surfaces that see the same lights.
    #[arg(long, value_name = "PIXELS", default_value_t = RestirSettings::default().radius)]
    pub(crate) restir_radius: f32,
    /// `restir`: frames that a kept sample counts as, at most; 0 keeps none
    ///
    /// Higher values have less noise in each frame; lower values make frames depend less on each other, so that their mean converges faster.
    #[arg(long, value_name = "FRAMES", default_value_t = RestirSettings::default().history)]
    pub(crate) restir_history: u32,
}

impl RestirArgs {
    fn settings(&self) -> RestirSettings {
        RestirSettings {
            candidates: self.restir_candidates,
            neighbors: self.restir_neighbors,
            radius: self.restir_radius,
            history: self.restir_history,
        }
    }
}

/// How much work to do; with both, whichever comes first.
#[derive(Clone, Debug, Args)]
pub(crate) struct BudgetArgs {
    /// Samples per pixel (frames)
    #[arg(long, value_name = "N", alias = "samples", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) spp: Option<u64>,
    /// Seconds of rendering; loading and building come on top and are reported
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, aliases = ["time-limit"], value_parser = seconds)]
    pub(crate) time: Option<f64>,
}

/// The size of the image. With one of the two, the other follows from 16:9.
#[derive(Clone, Debug, Args)]
pub(crate) struct SizeArgs {
    /// Width in pixels
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=32_768))]
    pub(crate) width: Option<u32>,
    /// Height in pixels
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=32_768))]
    pub(crate) height: Option<u32>,
}

impl SizeArgs {
    /// Width and height, `default` where neither is given.
    pub(crate) fn or(&self, default: (u32, u32)) -> (u32, u32) {
        let scale = |size: u32, up: u32, down: u32| (size * up / down).clamp(1, 32_768);
        match (self.width, self.height) {
            (Some(width), Some(height)) => (width, height),
            (Some(width), None) => (width, scale(width, default.1, default.0)),
            (None, Some(height)) => (scale(height, default.0, default.1), height),
            (None, None) => default,
        }
    }
}

impl LightArgs {
    /// The back end, in a command that renders on one.
    ///
    /// # Errors
    /// If there are several.
    pub(crate) fn one_backend(&self) -> Result<Backend> {
        match self.backend[..] {
            [backend] => Ok(backend),
            _ => bail!("--backend: one is enough here; `bench` compares several"),
        }
    }

    /// The settings of rendering that these options stand for.
    pub(crate) fn settings(&self, method: Method, (width, height): (u32, u32)) -> render::Settings {
        render::Settings {
            width,
            height,
            method,
            max_bounces: self.max_bounces,
            light_samples: self.light_samples,
            candidates: self.candidates,
            seed: self.seed,
            oracle_passes: self.oracle_passes,
            restir: self.restir.settings(),
            pixel_filter: self.pixel_filter.into(),
            pixel_sampler: self.pixel_sampler,
            mis: self.mis,
            light: light_cache::Settings {
                min_probability_mass: self.min_probability_mass,
                control_variate: !self.no_control_variate,
                guided_bounces: !self.no_guided_bounces,
                ignore_below: self.ignore_below,
                ..Default::default()
            },
            ..Default::default()
        }
    }
}

/// What renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Backend {
    /// the processor
    Cpu,
    /// the graphics card, or any adapter that wgpu finds
    Gpu,
}

/// [`PixelFilter`] on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Filter {
    /// the pixel's own area
    Box,
    /// standard deviation 0.5 pixels
    Gaussian,
    /// 4 terms, 3 pixels wide
    BlackmanHarris,
}

impl From<Filter> for PixelFilter {
    fn from(filter: Filter) -> Self {
        match filter {
            Filter::Box => Self::Box,
            Filter::Gaussian => Self::Gaussian,
            Filter::BlackmanHarris => Self::BlackmanHarris,
        }
    }
}

/// The name of the sampler that is used where none is asked for.
pub(crate) fn default_method() -> &'static str {
    render::Settings::default().method.name()
}

/// What a method does, in a few words.
pub(crate) fn describe(method: Method) -> &'static str {
    match method {
        Method::Restir => {
            "preview: samples are kept from frame to frame and shared by neighbours; few frames look good, many do not average well"
        }
        Method::Exact => "all lights at every point: the judge, slow",
        Method::Oracle => "research: the best possible choice at first hits, whose preparation is not counted as time",
        Method::Sampled(kind) => match kind {
            SamplerKind::Uniform => "every light alike",
            SamplerKind::Power => "in proportion to emitted power",
            SamplerKind::Octree => "contributions learned per cell of a fixed subdivision of space",
            SamplerKind::Tree => "light tree with bounding cones, visibility unknown",
            SamplerKind::TreeVisible => "light tree, leaf flux times learned visibility",
            SamplerKind::Table => "global running-maximum importance table",
            SamplerKind::Adaptive => "learned cuts: cells that know which lights matter where",
        },
    }
}

/// Accepts the names of all methods.
pub(crate) fn any_method() -> impl TypedValueParser<Value = Method> {
    methods(Method::all_and_research().collect())
}

/// Accepts the names of the methods that choose lights.
pub(crate) fn sampled_method() -> impl TypedValueParser<Value = Method> {
    methods(SamplerKind::ALL.map(Method::Sampled).to_vec())
}

fn methods(accepted: Vec<Method>) -> impl TypedValueParser<Value = Method> {
    let values = accepted.iter().map(|&m| PossibleValue::new(m.name()).help(describe(m)));
    PossibleValuesParser::new(values.collect::<Vec<_>>()).try_map(move |name| {
        let found = accepted.iter().copied().find(|m| m.name() == name);
        found.ok_or("no such sampler")
    })
}

/// Accepts the names of all pixel samplers.
fn pixel_sampler() -> impl TypedValueParser<Value = PixelSampler> {
    let all = PixelSampler::ALL;
    PossibleValuesParser::new(all.map(PixelSampler::name)).try_map(move |name| {
        let found = all.into_iter().find(|sampler| sampler.name() == name);
        found.ok_or("no such pixel sampler")
    })
}

/// Accepts the names of all ways to share.
fn mis() -> impl TypedValueParser<Value = Mis> {
    PossibleValuesParser::new(Mis::ALL.map(Mis::name)).try_map(|name| {
        let found = Mis::ALL.into_iter().find(|mis| mis.name() == name);
        found.ok_or("no such heuristic")
    })
}

/// Reads a positive number of seconds.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('s').parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a positive number of seconds, such as 10 or 0.5".into()),
    }
}

/// Reads a number of bytes.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "K" | "KIB" => 1_u64 << 10,
        "M" | "MIB" => 1 << 20,
        "G" | "GIB" => 1 << 30,
        "T" | "TIB" => 1 << 40,
        _ => return Err(BYTES.into()),
    };
    let value = digits.parse::<f64>().map_err(|_| BYTES)? * unit as f64;
    // Beyond it, an f64 counts bytes no more.
    let countable = value >= 1.0 && value <= (1_u64 << 53) as f64;
    countable.then_some(value as u64).ok_or_else(|| BYTES.into())
}

const BYTES: &str = "must be a size above 0 with its unit, K, M, G or T (of 1024), such as 512M or 1.5G";

fn share(text: &str) -> Result<f32, String> {
    let value = text.parse::<f32>().ok().filter(|value| (0.0..=1.0).contains(value));
    value.ok_or_else(|| "must be a number from 0 to 1".into())
}

fn not_negative(text: &str) -> Result<f32, String> {
    let value = text
        .parse::<f32>()
        .ok()
        .filter(|value| *value >= 0.0 && value.is_finite());
    value.ok_or_else(|| "must be a number of at least 0".into())
}

#[cfg(test)]
mod tests {
    use super::{Cli, SizeArgs, bytes};
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn sizes_have_units() {
        assert_eq!(bytes("512M"), Ok(512 << 20));
        assert_eq!(bytes("1.5g"), Ok(3 << 29));
        assert_eq!(bytes("16KiB"), Ok(16 << 10));
        for odd in [
            "", "M", "512", "-1G", "0K", "nanG", "infG", "1e30G", "5X", "5 GB", "5MM", "\u{b5}G",
        ] {
            let problem = bytes(odd).expect_err(odd);
            assert!(problem.contains("512M"), "{odd}: {problem}");
        }
    }

    #[test]
    fn the_other_side_follows() {
        let size = |width, height| SizeArgs { width, height }.or((1280, 720));
        assert_eq!(size(None, None), (1280, 720));
        assert_eq!(size(Some(640), None), (640, 360));
        assert_eq!(size(None, Some(1080)), (1920, 1080));
        assert_eq!(size(Some(1), None), (1, 1));
        assert_eq!(size(None, Some(32_768)), (32_768, 32_768));
    }
}
