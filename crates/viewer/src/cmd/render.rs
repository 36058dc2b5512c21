//! `render`: an image to a file.

mod checks;
mod file;
pub(crate) mod parts;
mod report;
mod sequence;
mod stats;

use crate::cli::{BudgetArgs, LightArgs, SizeArgs, any_method, bytes, default_method};
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::output::is_stdout;
use crate::session::{self, BackEnd, Budget};
use crate::tev::Display;
use crate::{message, output};
use anyhow::{Context, Result, bail};
use clap::Args;
use file::{Aov, Made};
pub(crate) use file::{Format, metadata_of};
use parts::{Header, Shard};
use render::{Method, image};
use sequence::SequenceArgs;
use stats::Stats;
use std::path::PathBuf;
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
    checks::memory_budget(args)?;
    let format = Format::of(&args.output)?;
    let settings = checks::settings(args, format)?;
    let sequence = args.sequence.frames(&args.output)?;
    for path in [
        Some(&args.output),
        args.stats.as_ref().filter(|path| !is_stdout(path)),
        args.resume.as_ref(),
    ]
    .into_iter()
    .flatten()
    {
        output::check_writable(path)?;
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
            file::write(&args.output, format, &args.aov, exposure, &made)?;
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
    report::summary(args, frames.scene(), &origin, &settings, &run);
    if let Some(target) = args.target_error {
        message::note(report::report(frames.film(), target));
    }
    if run.nonfinite_samples > 0 {
        message::warn(format!(
            "{} samples were not finite and were left out: this is a bug",
            run.nonfinite_samples
        ));
    }
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}
