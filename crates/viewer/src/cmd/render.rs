//! `render`: an image to a file.

pub(crate) mod parts;
mod sequence;
mod stats;

#[cfg(unix)]
use crate::allocator;
use crate::cli::{Backend, BudgetArgs, LightArgs, SizeArgs, any_method, bytes, default_method};
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::output::is_stdout;
use crate::session::{self, BackEnd, Budget, Origin};
use crate::tev::Display;
use crate::{machine, message, output, table};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use glam::Vec3;
use parts::{Header, Shard};
use render::image::{self, Channel};
use render::{Film, Method, RenderStats, Settings};
use scene::Scene;
use sequence::SequenceArgs;
use stats::Stats;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often the file of --resume is brought up to date. Higher values write less; lower values lose less if the machine stops.
const STATE_INTERVAL: Duration = Duration::from_secs(60);

/// Options of `render`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  manylight render demo:rooms -o rooms.png
  manylight render demo:plaza:100000 -o plaza.exr --time 30 --stats plaza.json
  manylight render hall.glb -o hall.exr --spp 256 --max-bounces 4 --camera 1 --aov albedo,normal,variance
  manylight render hall.glb --camera-path path.json --frames 0..90 --spp 32 -o walk_####.png
  manylight render hall.glb -o hall.exr --display-server localhost:14158    (watch it in tev)
  manylight render hall.glb -o hall.exr --spp 4096 --resume hall.state      (stop it, and run it again to go on)

EXR files are linear, float32, in the scene's own units, with all settings in their metadata; PNG files are tone-mapped.
Ctrl-C writes what is there and exits with 130.")]
pub(crate) struct RenderArgs {
    /// A .gltf or .glb file, or demo:NAME[:LIGHTS[:SEED]] (`manylight info` lists them)
    scene: String,
    /// The image: .exr or .png; or .part, the state of the rendering, for `merge`
    #[arg(short, long, value_name = "FILE", alias = "outfile")]
    output: PathBuf,
    #[command(flatten)]
    budget: BudgetArgs,
    /// Stop when the estimated relMSE of the image is below this with 95 % confidence, at the latest after --spp or --time
    ///
    /// Pixels take samples where the error is, one per frame on average; --spp then counts frames. What no sample has met yet, such as rare
    /// slivers of lamps, is in no estimate: the true error may be half as much again.
    #[arg(long, value_name = "ERROR", value_parser = error_bound)]
    target_error: Option<f64>,
    /// Go on where FILE ends, to the bit as if nothing had happened; FILE is made if it is missing, and kept up to date
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Render the I-th of N equal shares of the samples, to be joined by `merge`
    ///
    /// Samplers that do not learn draw the samples that the whole would; the others learn in each share by themselves.
    #[arg(long, value_name = "I/N", value_parser = Shard::parse, requires = "spp", conflicts_with_all = ["time", "target_error"])]
    shard: Option<Shard>,
    #[command(flatten)]
    size: SizeArgs,
    /// How lights are chosen
    #[arg(long, value_name = "NAME", default_value = default_method(), value_parser = any_method())]
    sampler: Method,
    #[command(flatten)]
    light: LightArgs,
    /// Exposure of a PNG in stops; default: by the image's brightness
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    exposure: Option<f32>,
    /// Further layers of an EXR
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_enum)]
    aov: Vec<Aov>,
    /// Write all figures of the run as JSON ("-" for stdout)
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Build everything before the first frame, also what no ray will touch: for measurements, the image is the same
    #[arg(long)]
    build_all: bool,
    /// Bytes that may be taken by what is made when a ray first needs it: trees of instanced meshes, textures, meshes left in the file
    ///
    /// What was not used for longest is dropped, and made again when a ray needs it: the image is the same. Higher values save time; lower
    /// values save memory. Lights, lamps, what is placed once and the image itself do not count and stay.
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true, value_parser = bytes, conflicts_with = "build_all")]
    memory_budget: Option<u64>,
    #[command(flatten)]
    sequence: SequenceArgs,
    /// Show the image while it is made in tev, which listens at localhost:14158
    #[arg(long, value_name = "HOST:PORT")]
    display_server: Option<String>,
}

/// Layers besides the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Aov {
    /// diffuse albedo plus specular reflectance (albedo.R .G .B)
    Albedo,
    /// shading normal, world space (normal.X .Y .Z)
    Normal,
    /// distance from the camera in metres (depth.Z)
    Depth,
    /// world position in metres (position.X .Y .Z)
    Position,
    /// index of the light chosen by the last sample, -1 for none (light.V)
    Light,
    /// variance of the pixel's mean luminance (variance.V)
    Variance,
    /// samples that the pixel has taken (samples.V)
    Samples,
}

/// The file formats of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Linear.
    Exr,
    /// Tone-mapped.
    Png,
    /// The state of the rendering.
    Part,
}

impl Format {
    /// By the ending of a file's name.
    ///
    /// # Errors
    /// Other endings.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        match path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            Some("part") => Ok(Self::Part),
            _ => bail!(
                "{}: unknown image format; give a file name that ends in .exr or .png",
                path.display()
            ),
        }
    }
}

/// Reads an error to stop at.
fn error_bound(text: &str) -> Result<f64, String> {
    let value = text
        .parse::<f64>()
        .ok()
        .filter(|value| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "must be a number above 0, such as 0.01".into())
}

/// Runs the command.
///
/// # Errors
/// Bad input; files that cannot be written.
pub(crate) fn run(args: &RenderArgs) -> Result<Status> {
    const DEFAULT_SPP: u64 = 64;
    if args.memory_budget.is_some() {
        if args.light.one_backend()? == Backend::Gpu {
            bail!("--memory-budget: the GPU holds the whole scene; leave it away, or use --backend cpu");
        }
        if let Method::Oracle | Method::Restir = args.sampler {
            let name = args.sampler.name();
            bail!("--memory-budget: `{name}` looks at the whole image at a time; use another --sampler");
        }
        #[cfg(unix)]
        allocator::give_back_what_is_freed();
    }
    let format = Format::of(&args.output)?;
    if format == Format::Png && !args.aov.is_empty() {
        bail!("a PNG has no layers for --aov; write an .exr");
    }
    if args.exposure.is_some_and(|stops| !stops.is_finite()) {
        bail!("--exposure must be a finite number of stops");
    }
    if format == Format::Exr && args.exposure.is_some() {
        message::warn("--exposure is for PNG only: an EXR holds the radiance as it is");
    }
    let sequence = args.sequence.frames(&args.output)?;
    output::check_writable(&args.output)?;
    if let Some(path) = args.stats.as_deref().filter(|path| !is_stdout(path)) {
        output::check_writable(path)?;
    }
    if let Some(path) = &args.resume {
        output::check_writable(path)?;
    }
    let mut settings = args.light.settings(args.sampler, args.size.or((1280, 720)));
    // The film knows the others in any case.
    settings.aovs = args.aov.iter().any(|aov| ![Aov::Variance, Aov::Samples].contains(aov));
    settings.adaptive_pixels = args.target_error.is_some();
    if settings.adaptive_pixels && format == Format::Part {
        bail!(
            "parts of renderings with --target-error cannot be joined: give an .exr or .png, or leave out --target-error"
        );
    }
    settings.check()?;
    if settings.method == Method::Restir {
        refuse_dependent_frames(args, format)?;
    }
    if settings.light.ignore_below > 0.0 {
        message::warn("--ignore-below drops lights: the image is biased, and marked so in its metadata and statistics");
    }

    session::use_threads(args.light.threads)?;
    let mut loaded = session::load_with_warnings(&args.scene)?;
    if args.build_all {
        loaded.build_all();
    }
    if let Some(budget) = args.memory_budget {
        loaded.scene.set_memory_budget(budget);
    }
    if let Some(sequence) = &sequence {
        return sequence::run(args, format, &settings, loaded, sequence);
    }
    let camera = &session::camera(&loaded.scene, args.light.camera.as_deref())?.clone();
    let (scene, origin) = loaded.give();
    let watch = Watch::rendering();
    let back_end = BackEnd::open(args.light.one_backend()?)?;
    let mut frames = back_end.start(scene, camera, &settings)?;
    if args.stats.is_some() && matches!(back_end, BackEnd::Gpu(_)) && !frames.time_passes() {
        message::note("the adapter has no timestamps: no times of passes in the statistics");
    }
    let title = format!("manylight {}", frames.scene().parts.name);
    let mut display = args
        .display_server
        .as_ref()
        .map(|address| Display::connect(address, &title, settings.width, settings.height));
    let mut budget = Budget::new(&args.budget, DEFAULT_SPP).until(args.target_error, &args.budget);
    let mut shard = None;
    if let (Some(part), Some(all)) = (args.shard, budget.frames) {
        let share = part.frames(all);
        if share.is_empty() {
            bail!(
                "--shard {}/{}: only {all} samples to share; give a larger --spp",
                part.index,
                part.count
            );
        }
        let first = u32::try_from(share.start).context("--spp is too large to be shared")?;
        frames.skip_frames(first)?;
        budget.frames = Some(share.end - share.start);
        shard = Some((part, all));
    }
    let header = Header::new(&origin.what, frames.scene(), camera, &settings, shard);
    if let Some(path) = &args.resume {
        parts::resume(path, &header, frames.as_mut())?;
    }
    let done = frames.film().spp();
    budget.frames = budget.frames.map(|all| all.saturating_sub(done));
    let mut saved = Instant::now();
    if budget.frames != Some(0) && !budget.is_met(frames.film()) {
        session::render_frames(frames.as_mut(), budget, &watch, "rendering", |state| {
            if let Some(display) = &mut display {
                display.update(|| state.film().image());
            }
            if let Some(path) = args.resume.as_ref().filter(|_| saved.elapsed() > STATE_INTERVAL) {
                if let Err(error) = parts::write(path, &header, state) {
                    message::warn(format!("{error:#}"));
                }
                saved = Instant::now();
            }
        })?;
    }

    let interrupted = watch.writing();
    let image = frames.film().image();
    if let Some(display) = &mut display {
        display.finish(&image);
    }
    let run = frames.stats();
    let state = frames.as_ref();
    let mut stats = Stats::new(state, &run, &origin, &camera.name, &settings, interrupted, &back_end);
    // Measuring takes about as long as a frame: only where somebody will read the result.
    if args.stats.is_some() {
        stats.measure(frames.as_ref(), args.target_error);
    }
    match format {
        Format::Part => parts::write(&args.output, &header, frames.as_ref())?,
        _ => {
            let exposure = args.exposure.unwrap_or_else(|| image::auto_exposure(&image));
            let made = Made {
                film: frames.film(),
                scene: frames.scene(),
                stats: &stats,
                settings: &settings,
            };
            write(&args.output, format, &args.aov, exposure, &made)?;
        }
    }
    // After the image: what is finished is kept even if there is no room for this.
    if let Some(path) = args.resume.as_ref().filter(|_| frames.film().spp() > done) {
        parts::write(path, &header, frames.as_ref())?;
    }
    if let Some(path) = &args.stats {
        let json = serde_json::to_string_pretty(&stats)? + "\n";
        if is_stdout(path) {
            output::print(&json)?
        } else {
            output::write(path, json.as_bytes())?
        }
    }
    summary(args, frames.scene(), &origin, &settings, &run);
    if let Some(target) = args.target_error {
        message::note(report(frames.film(), target));
    }
    if run.nonfinite_samples > 0 {
        message::warn(format!(
            "{} samples were not finite and were left out: this is a bug",
            run.nonfinite_samples
        ));
    }
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}

/// Refuses what needs frames that do not depend on each other.
fn refuse_dependent_frames(args: &RenderArgs, format: Format) -> Result<()> {
    if args.resume.is_some() || args.shard.is_some() || format == Format::Part {
        bail!(
            "--resume, --shard and .part files cannot be had with --sampler restir: no file holds the samples that it keeps from frame to frame; \
             render with another sampler"
        );
    }
    if args.aov.contains(&Aov::Variance) {
        bail!(
            "--aov variance cannot be had with --sampler restir: its frames depend on each other, so that no variance can be estimated from them; \
             leave it out, or render with another sampler"
        );
    }
    Ok(())
}

/// A rendering that is to be written.
struct Made<'m> {
    film: &'m Film,
    scene: &'m Scene,
    stats: &'m Stats,
    settings: &'m Settings,
}

/// Writes the film's image: a PNG at that exposure, or an EXR with the layers asked for.
fn write(path: &Path, format: Format, aovs: &[Aov], exposure: f32, made: &Made<'_>) -> Result<()> {
    let image = made.film.image();
    if format == Format::Png {
        image::write_png(path, &image, exposure)?;
        return Ok(());
    }
    let mut channels = Channel::rgb("", &image).to_vec();
    layers(aovs, made.film, made.scene, &mut channels);
    let metadata = metadata(made.stats, made.settings)?;
    image::write_exr(path, image.width, image.height, &channels, &metadata)?;
    Ok(())
}

/// The layers asked for, as channels.
fn layers(wanted: &[Aov], film: &Film, scene: &Scene, channels: &mut Vec<Channel>) {
    let one = |name: &str, values: Vec<f32>| Channel {
        name: name.into(),
        values,
    };
    let vector = |layer: &str, image: &render::Image| {
        [("X", 0), ("Y", 1), ("Z", 2)].map(|(axis, c)| Channel {
            name: format!("{layer}.{axis}"),
            values: image.pixels.iter().map(|pixel| pixel[c]).collect(),
        })
    };
    if wanted.contains(&Aov::Variance) {
        channels.push(one("variance.V", film.variance()));
    }
    if wanted.contains(&Aov::Samples) {
        channels.push(one(
            "samples.V",
            film.samples().iter().map(|&count| count as f32).collect(),
        ));
    }
    let Some(mut aovs) = film.aovs() else { return };
    if wanted.contains(&Aov::Albedo) {
        channels.extend(Channel::rgb("albedo", &aovs.albedo));
    }
    if wanted.contains(&Aov::Normal) {
        channels.extend(vector("normal", &aovs.normal));
    }
    if wanted.contains(&Aov::Position) {
        let seen = aovs.position.pixels.iter_mut().zip(&aovs.depth);
        for (position, _) in seen.filter(|(_, depth)| depth.is_finite()) {
            *position = scene.parts.in_file(Vec3::from(*position)).as_vec3().to_array();
        }
        channels.extend(vector("position", &aovs.position));
    }
    if wanted.contains(&Aov::Depth) {
        channels.push(one("depth.Z", aovs.depth));
    }
    if wanted.contains(&Aov::Light) {
        channels.push(one("light.V", aovs.light));
    }
}

/// What an EXR tells about itself: one attribute per figure, and all settings as JSON.
fn metadata(stats: &Stats, settings: &Settings) -> Result<Vec<(String, String)>> {
    let entry = |name: &str, value: String| (format!("manylight.{name}"), value);
    Ok(vec![
        entry("version", machine::VERSION.into()),
        entry("scene", stats.scene.clone()),
        entry("camera", stats.camera.clone()),
        entry("sampler", stats.sampler.into()),
        entry("spp", stats.spp.to_string()),
        entry("seed", stats.seed.to_string()),
        entry("render_s", stats.render_s.to_string()),
        entry("research", stats.research.unwrap_or("no").into()),
        entry("biased", stats.biased.clone().unwrap_or_else(|| "no".into())),
        entry("settings", serde_json::to_string(settings)?),
    ])
}

/// What an EXR that was joined from parts tells about itself.
///
/// # Errors
/// None that can be expected.
pub(crate) fn metadata_of(header: &Header, spp: u64) -> Result<Vec<(String, String)>> {
    let entry = |name: &str, value: String| (format!("manylight.{name}"), value);
    Ok(vec![
        entry("version", machine::VERSION.into()),
        entry("scene", header.scene.clone()),
        entry("camera", header.camera.clone()),
        entry("sampler", header.settings.method.name().into()),
        entry("spp", spp.to_string()),
        entry("settings", serde_json::to_string(&header.settings)?),
    ])
}

/// How good an image has become that was to have an error of `target`.
fn report(film: &Film, target: f64) -> String {
    let counts = film.sample_counts();
    let samples = format!(
        "{:.1} samples per pixel, {} to {}, median {}; skipped {:.0} % of the times",
        counts.mean,
        counts.least,
        counts.most,
        counts.median,
        100.0 * counts.skipped
    );
    let Some(error) = film.estimated_error() else {
        return format!("too few samples to tell the error; {samples}");
    };
    let converged = 100.0 * film.converged(target);
    format!(
        "estimated relMSE {:.2e}, with 95 % confidence {:.2e} to {:.2e} ({} {target}), but for rare light that no sample has met; \
         by itself below that, as sure: {converged:.0} % of the pixels; {samples}",
        error.relmse,
        error.low,
        error.high,
        if error.high <= target { "asked for" } else { "NOT the" },
    )
}

/// What was done, for people.
fn summary(args: &RenderArgs, scene: &Scene, origin: &Origin, settings: &Settings, run: &RenderStats) {
    let samples = u64::from(settings.width) * u64::from(settings.height) * run.frames;
    message::note(format!(
        "{}: {} x {}, {} spp in {:.2} s, {:.2} Msamples/s, sampler {}, {} lights, {} triangles \
         (load {:.2} s, BVH {:.2} s, lights {:.2} s)",
        args.output.display(),
        settings.width,
        settings.height,
        run.frames,
        run.render_s,
        samples as f64 / run.render_s.max(1e-9) * 1e-6,
        settings.method.name(),
        table::thousands(scene.lights.len() as u64),
        table::thousands(scene.triangle_count()),
        origin.load_s,
        scene.build_s,
        run.light_build_s,
    ));
    if let Some(note) = settings.method.research_note() {
        message::note(format!(
            "{}: {note} ({:.2} s here)",
            settings.method.name(),
            run.prepare_s
        ));
    }
    let memory = scene.memory().used();
    if let Some(budget) = memory.budget_bytes {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        message::note(format!(
            "memory budget {:.1} MiB: at most {:.1} MiB were made on demand, {:.1} MiB are there; made {} times, of these {} again",
            mib(budget),
            mib(memory.peak_bytes),
            mib(memory.resident_bytes),
            table::thousands(memory.made),
            table::thousands(memory.made_again),
        ));
    }
    for skipped in stats::skipped(scene, run) {
        message::detail(format!("skipped: {skipped}"));
    }
}
