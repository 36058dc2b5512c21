//! `dump`: what was learned about each light, or in each cell, as a table.

mod cells;
mod rows;
mod write;

use crate::cli::{BudgetArgs, LightArgs, SizeArgs, default_method, sampled_method};
use crate::exit::Status;
use crate::interrupt::Watch;
use crate::output::is_stdout;
use crate::session::{self, BackEnd, Budget};
use crate::{message, output, table};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use glam::Vec3;
use light_cache::SamplerKind;
use render::Method;
use std::path::{Path, PathBuf};
use write::Row;

/// Options of `dump`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  manylight dump demo:rooms -o lights.csv
  manylight dump hall.glb -o - --top 10
  manylight dump hall.glb -o lights.parquet --spp 64 --sampler table
  manylight dump demo:rooms --cells -o cells.csv

One row per light. max_contribution and mean_contribution are luminances at the camera, visible_fraction is empty for a
light that was never drawn; probability is how likely the light is drawn now and totals 1 over all lights.
With --cells, one row per entry of each cell's cut: cell, its centre, size, normal and whether it is for first hits; the
light or cluster (its first light, and how many), its probability in the cell, visible fraction, samples, and the cell's age.")]
pub(crate) struct DumpArgs {
    /// A .gltf or .glb file, or demo:NAME[:LIGHTS[:SEED]]
    scene: String,
    /// The table: .csv, .jsonl or .parquet, or "-" for stdout
    #[arg(short, long, value_name = "FILE", default_value = "-", alias = "outfile")]
    output: PathBuf,
    /// Format; default: by the file name, CSV on stdout
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Write what was learned in each cell instead; `adaptive` only
    #[arg(long)]
    cells: bool,
    /// Only the N lights that are drawn most probably, those first
    #[arg(long, value_name = "N", conflicts_with = "cells")]
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
    if args.cells && args.sampler != Method::Sampled(SamplerKind::Adaptive) {
        bail!(
            "--cells: '{}' keeps no cells; give --sampler adaptive",
            args.sampler.name()
        );
    }
    let mut settings = args.light.settings(args.sampler, args.size.or((640, 360)));
    settings.record_lights = !args.cells;
    settings.check()?;

    session::use_threads(args.light.threads)?;
    let loaded = session::load_with_warnings(&args.scene)?;
    let camera = session::camera(&loaded.scene, args.light.camera.as_deref())?;
    let watch = Watch::rendering();
    let mut frames = BackEnd::open(args.light.one_backend()?)?.start(&loaded.scene, camera, &settings)?;
    let budget = Budget::new(&args.budget, DEFAULT_SPP);
    let seconds = session::render_frames(frames.as_mut(), budget, &watch, "learning", |_| {})?;

    let interrupted = watch.writing();
    let written = if args.cells {
        let mut rows = frames.cells();
        for row in &mut rows {
            let place = loaded.scene.parts.in_file(Vec3::new(row.x_m, row.y_m, row.z_m));
            [row.x_m, row.y_m, row.z_m] = place.as_vec3().to_array();
        }
        save(args, format, &rows)?;
        format!("{} entries of cells", table::thousands(rows.len() as u64))
    } else {
        let rows = rows::collect(&loaded.scene, &frames.light_records(), args.top);
        save(args, format, &rows)?;
        let [some, all] = [rows.len(), loaded.scene.lights.len()].map(|count| table::thousands(count as u64));
        format!("{some} of {all} lights")
    };
    if !to_stdout {
        message::note(format!(
            "{}: {written} after {} frames, {seconds:.2} s",
            args.output.display(),
            frames.film().spp()
        ));
    }
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}

/// Writes the table to where it was asked for.
fn save<R: Row>(args: &DumpArgs, format: Format, rows: &[R]) -> Result<()> {
    if is_stdout(&args.output) {
        write::rows(output::stdout(), format, rows)
    } else {
        output::write_with(&args.output, |file| write::rows(file, format, rows))
    }
}
