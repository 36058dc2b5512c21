//! `bench`: how fast the error falls, by scene and sampler.

mod contestants;
mod plot;
mod reference;
mod report;
mod run;
mod scenario;
mod skips;
mod stress;
mod summary;

use crate::camera_path;
use crate::cli::{Backend, LightArgs, SizeArgs, any_method, seconds};
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::machine::Machine;
use crate::session::BackEnd;
use crate::{message, output, session};
use anyhow::{Context, Result, bail};
use clap::Args;
use clap::builder::PossibleValuesParser;
use contestants::{Contestant, Knob};
use light_cache::SamplerKind;
use reference::Reference;
use render::Method;
use run::Run;
use scenario::Scenario;
use std::path::{Path, PathBuf};
use summary::SceneResult;

/// Options of `bench`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  manylight bench                                              all generated scenes, all samplers (a coffee long)
  manylight bench demo:rooms --samplers uniform,power,table --time 1,4
  manylight bench demo:rooms --samplers tree,adaptive,oracle   how far from the best possible choice?
  manylight bench demo:rooms --scenario walk --samplers tree,adaptive    errors of single frames on the move
  manylight bench demo:spheres --vary mis --samplers adaptive --time 4      which heuristic is best?
  manylight bench demo:rooms --samplers tree,adaptive --backend cpu,gpu --pass-times      what does the GPU gain?
  manylight bench hall.glb --seeds 5 --max-bounces 2 -o hall-bench
  manylight bench --stress -o stress-out                       is anything wrong at the limits?
  manylight bench --skips demo:rooms -o skips-out              what does it save to leave out what a scene does not need?

Every run learns from scratch. Errors are measured against `exact` (all lights at every point), rendered once and cached;
measuring is not counted as time, building the light structures and learning are. The runs of a scene take turns frame
by frame, so that a busy machine slows all of them alike.
The reference is two independent images a and b. The error of x is (x - a)(x - b) / (r^2 + 0.01 mean(r)^2), r = (a + b) / 2,
averaged over the pixels but for the 0.1 % where its magnitude is largest: noise of the reference widens its standard
error, and adds an offset only where it is so large that r is uncertain. With bounces it is, in all pixels: r is a third
image there, and the error the mean over the three ways to choose it. Efficiency is 1 / (error x seconds), at the latest
time at which the errors of all samplers stand out of the reference's noise.
oracle draws one light per pixel with the best possible probabilities; finding them is not counted as time, so compare it
at equal samples.
Writes frames.csv, summary.json, setup.md and plots (SVG) to the output folder, and a table to stdout.")]
pub(crate) struct BenchArgs {
    /// .gltf or .glb files, or demo:NAME[:LIGHTS[:SEED]]; default: all generated scenes
    scenes: Vec<String>,
    /// Samplers to compare; default: all but exact and oracle
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = any_method())]
    samplers: Vec<Method>,
    /// Compare all values of one knob
    #[arg(long, value_enum, value_name = "KNOB", conflicts_with = "scenario")]
    vary: Option<Knob>,
    /// Times at which errors are compared, in seconds; every run lasts as long as the last of them
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "0.1,1,10", value_parser = seconds)]
    time: Vec<f64>,
    /// Measure single frames while something changes, instead of errors over time
    #[arg(long, value_enum)]
    scenario: Option<Scenario>,
    /// Frames of a walk, or before and after a change each
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = frame_count, requires = "scenario")]
    frames: usize,
    /// Camera path that --scenario walk follows, as the window records it; default: one through the rooms
    #[arg(long, value_name = "FILE", requires = "scenario")]
    camera_path: Option<PathBuf>,
    /// Of every frame of a scenario also measure what the window would show: with history and denoiser, by relMSE and FLIP
    #[arg(long, requires = "scenario")]
    displayed: bool,
    /// Runs per sampler, each with another seed; tables show medians and the spread
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// Samples per pixel of the reference, shared by its two images (with bounces three)
    ///
    /// Higher values tell smaller errors apart; lower values are done sooner.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..))]
    reference_spp: u64,
    /// Use this image (.exr) as the reference, whose noise then counts as error; or several that are independent of each other (other seeds),
    /// whose noise does not: two for direct light, three with bounces. With one scene only
    #[arg(long, value_name = "FILE[,FILE...]", value_delimiter = ',')]
    reference: Vec<PathBuf>,
    /// Folder in which references are kept; default: the user's cache folder
    #[arg(long, value_name = "DIR")]
    reference_cache: Option<PathBuf>,
    /// After its run let every contestant on a GPU render a few more frames whose passes are timed by the device's clock
    #[arg(long, conflicts_with = "scenario")]
    pass_times: bool,
    #[command(flatten)]
    size: SizeArgs,
    #[command(flatten)]
    light: LightArgs,
    /// Instead, check what breaks renderers against answers known in closed form; exit code 1 if a check fails
    #[arg(long, value_enum, value_name = "EFFORT", num_args = 0..=1, require_equals = true, default_missing_value = "standard",
          conflicts_with_all = ["scenes", "samplers", "scenario", "reference"])]
    stress: Option<stress::Effort>,
    /// With --stress: only these families of checks
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "stress", value_parser = PossibleValuesParser::new(stress::families()))]
    families: Vec<String>,
    /// With --stress: this program as it was built otherwise, such as without optimisation; its images have to be the same to the bit
    #[arg(long, value_name = "PROGRAM", requires = "stress")]
    other_build: Option<PathBuf>,
    /// Instead, measure what the renderer saves by leaving out what a scene does not need; exit code 1 if an image changes by it
    #[arg(long, conflicts_with_all = ["stress", "scenario", "reference", "vary"])]
    skips: bool,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR", default_value = "bench-out")]
    output: PathBuf,
}

/// Makes the folder for the results, and makes sure that `file` can be written there.
fn make_output(folder: &Path, file: &str) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot make the output folder", folder.display()))?;
    output::check_writable(&folder.join(file))
}

/// Reads the number of frames of a scenario.
fn frame_count(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|count| (4..=100_000).contains(count));
    count.ok_or_else(|| "must be 4 to 100,000".into())
}

/// Runs the command.
///
/// # Errors
/// Bad input; files that cannot be written.
pub(crate) fn run(args: &BenchArgs) -> Result<Status> {
    if let Some(effort) = args.stress {
        return stress::run(args, effort);
    }
    if args.skips {
        return skips::run(args);
    }
    let methods: Vec<Method> = match args.samplers.as_slice() {
        [] => SamplerKind::ALL.map(Method::Sampled).to_vec(),
        some => Method::all_and_research()
            .filter(|method| some.contains(method))
            .collect(),
    };
    let scenes: Vec<String> = match args.scenes.as_slice() {
        [] if args.scenario.is_some() => vec!["demo:rooms".into()],
        [] => scene::generate::names().map(|name| format!("demo:{name}")).collect(),
        some => some.to_vec(),
    };
    if !args.reference.is_empty() && args.scenario.is_some() {
        bail!("--reference is one image, a scenario needs one for every state and camera: leave it away");
    }
    if args.camera_path.is_some() && args.scenario != Some(Scenario::Walk) {
        bail!("--camera-path is for --scenario walk: in the others the camera stays where it is");
    }
    let path = args.camera_path.as_deref().map(camera_path::read).transpose()?;
    if !args.reference.is_empty() && scenes.len() != 1 {
        bail!("--reference is for one scene, {} are given", scenes.len());
    }
    let mut times = args.time.clone();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let settings = args.light.settings(methods[0], args.size.or((256, 192)));
    settings.check()?;
    let own_reference = match args.reference.as_slice() {
        [] => None,
        own => Some(Reference::read(own, &settings)?),
    };
    make_output(&args.output, "summary.json")?;
    let cache = args
        .reference_cache
        .clone()
        .unwrap_or_else(|| reference::default_cache(&args.output));
    session::use_threads(args.light.threads)?;
    let mut backends = args.light.backend.clone();
    backends.dedup();
    if let Some(scenario) = args.scenario {
        if backends != [Backend::Cpu] {
            bail!("--scenario renders on the CPU only; leave --backend away");
        }
        return scenario::run(args, scenario, path.as_deref(), &scenes, &methods, &settings, &cache);
    }

    let back_ends: Vec<BackEnd> = backends.iter().map(|&b| BackEnd::open(b)).collect::<Result<_>>()?;
    for back_end in &back_ends {
        message::note(format!("back end: {back_end}"));
    }
    let contestants = Contestant::all(&settings, &methods, args.vary, &back_ends)?;
    let mut results = Vec::new();
    let mut interrupted = false;
    for what in &scenes {
        let loaded = session::load_with_warnings(what)?;
        let camera = session::camera(&loaded.scene, args.light.camera.as_deref())?;
        let watch = Watch::rendering();
        let reference = match &own_reference {
            Some(own) => Some(own.clone()),
            None => Reference::get(&loaded.scene, camera, &settings, args.reference_spp, &cache, &watch)?,
        };
        let Some(reference) = reference else {
            interrupted = true;
            break;
        };
        let mut runs = Vec::new();
        for seed in 0..args.seeds {
            let what = format!("{what}, run {} of {}", seed + 1, args.seeds);
            runs.extend(Run::all(
                &loaded.scene,
                camera,
                &contestants,
                u64::from(seed),
                &times,
                &reference,
                &watch,
                &what,
                args.pass_times,
            )?);
        }
        interrupted = watch.stopped();
        let result = SceneResult::new(&loaded, &contestants, &times, &reference, runs);
        output::print(&report::table(&result))?;
        results.push(result);
        if interrupted {
            break;
        }
    }
    let machine = Machine::detect();
    report::write_all(&args.output, &machine, &settings, &results)?;
    for result in &results {
        plot::write_all(&args.output, result)?;
    }
    message::note(format!(
        "{}: frames.csv, summary.json, setup.md and plots written",
        args.output.display()
    ));
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}
