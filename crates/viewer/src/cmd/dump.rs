//! `dump`: what was learned about each light, as a table.

mod rows;
mod write;

use crate::cli::{BudgetArgs, LightArgs, SizeArgs, default_method, sampled_method};
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::output::is_stdout;
use crate::session::{self, Budget};
use crate::{message, output, table};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use render::Method;
use std::path::{Path, PathBuf};

/// Options of `dump`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  manylight dump demo:rooms -o lights.csv
  manylight dump hall.glb -o - --top 10
  manylight dump hall.glb -o lights.parquet --spp 64 --sampler table

One row per light. max_contribution and mean_contribution are luminances at the camera, visible_fraction is empty for a
light that was never drawn; probability is how likely the light is drawn now and totals 1 over all lights.")]
pub(crate) struct DumpArgs {
    /// A .gltf or .glb file, or demo:NAME[:LIGHTS[:SEED]]
    scene: String,
    /// The table: .csv, .jsonl or .parquet, or "-" for stdout
    #[arg(short, long, value_name = "FILE", default_value = "-", alias = "outfile")]
    output: PathBuf,
    /// Format; default: by the file name, CSV on stdout
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Only the N lights that are drawn most probably, those first
    #[arg(long, value_name = "N")]
    top: Option<usize>,
    #[command(flatten)]
    budget: BudgetArgs,
    #[command(flatten)]
    size: SizeArgs,
    /// How lights are chosen
    #[arg(long, value_name = "NAME", default_value = default_method(), value_parser = sampled_method())]
    sampler: Method,
    #[command(flatten)]
    light: LightArgs,
}

/// The file formats of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// comma-separated, with a header
    Csv,
    /// one JSON object a line
    Jsonl,
    /// Apache Parquet
    Parquet,
}

impl Format {
    fn of(path: &Path, wanted: Option<Self>) -> Result<Self> {
        match (
            wanted,
            path.extension()
                .and_then(|e| e.to_str())
                .map(str::to_ascii_lowercase)
                .as_deref(),
        ) {
            (Some(format), _) => Ok(format),
            (None, Some("csv")) => Ok(Self::Csv),
            (None, Some("jsonl" | "ndjson")) => Ok(Self::Jsonl),
            (None, Some("parquet")) => Ok(Self::Parquet),
            (None, None) if is_stdout(path) => Ok(Self::Csv),
            _ => bail!(
                "{}: unknown table format; give a file name that ends in .csv, .jsonl or .parquet, or --format",
                path.display()
            ),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input; files that cannot be written.
pub(crate) fn run(args: &DumpArgs) -> Result<Status> {
    const DEFAULT_SPP: u64 = 16;
    let format = Format::of(&args.output, args.format)?;
    let to_stdout = is_stdout(&args.output);
    if !to_stdout {
        output::check_writable(&args.output)?;
    }
    let mut settings = args.light.settings(args.sampler, args.size.or((640, 360)))?;
    settings.record_lights = true;
    settings.check()?;

    session::use_threads(args.light.threads)?;
    let loaded = session::load_with_warnings(&args.scene)?;
    let camera = session::camera(&loaded.scene, args.light.camera.as_deref())?;
    let watch = Watch::rendering();
    let mut frames = session::start(&loaded.scene, camera, &settings)?;
    let budget = Budget::new(&args.budget, DEFAULT_SPP);
    let seconds = session::render_frames(frames.as_mut(), budget, &watch, "learning", |_| {});

    let interrupted = watch.writing();
    let rows = rows::collect(&loaded.scene, &frames.light_records(), args.top);
    if to_stdout {
        write::rows(output::stdout(), format, &rows)?;
    } else {
        output::write_with(&args.output, |file| write::rows(file, format, &rows))?;
        message::note(format!(
            "{}: {} of {} lights after {} frames, {seconds:.2} s",
            args.output.display(),
            table::thousands(rows.len() as u64),
            table::thousands(loaded.scene.lights.len() as u64),
            frames.film().spp()
        ));
    }
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}
