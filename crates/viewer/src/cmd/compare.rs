//! `compare`: how far one image is from another.

use crate::exit::Status;
use crate::{output, table};
use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use render::{ImageError, image, metric};
use std::path::PathBuf;

/// Options of `compare`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  manylight compare new.exr reference.exr
  manylight compare new.exr reference.exr --threshold 0.01 && echo good enough
  manylight compare new.exr reference.exr --metric smape -o difference.png

In the difference image black is equal, blue to white is too dark, red to yellow too bright, magenta not finite.
Exits with 1 above the threshold.")]
pub(crate) struct CompareArgs {
    /// The image to judge (.exr)
    image: PathBuf,
    /// The reference (.exr)
    reference: PathBuf,
    /// Exit with 1 if the error is above this, or not a number
    #[arg(long, value_name = "ERROR")]
    threshold: Option<f64>,
    /// Which error the threshold is for
    #[arg(long, value_enum, default_value_t = Metric::Relmse)]
    metric: Metric,
    /// Write the difference in false colours (.png)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write the figures as JSON
    #[arg(long)]
    json: bool,
}

/// The errors a threshold can be for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Metric {
    /// mean squared error
    Mse,
    /// mean squared relative error
    Relmse,
    /// the same without the worst 0.1 % of the pixels
    RelmseTrimmed,
    /// symmetric mean absolute percentage error
    Smape,
    /// |mean of image / mean of reference - 1|
    MeanRatio,
}

/// Runs the command.
///
/// # Errors
/// Unreadable images, images of different sizes, an unwritable difference.
pub(crate) fn run(args: &CompareArgs) -> Result<Status> {
    if let Some(path) = &args.output {
        if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
            bail!(
                "{}: the difference is written as PNG; give a file name that ends in .png",
                path.display()
            );
        }
        output::check_writable(path)?;
    }
    let image = image::read_exr(&args.image)?;
    let reference = image::read_exr(&args.reference)?;
    let Some(error) = ImageError::between(&image, &reference) else {
        bail!(
            "the images differ in size: {} is {} x {}, {} is {} x {}",
            args.image.display(),
            image.width,
            image.height,
            args.reference.display(),
            reference.width,
            reference.height
        );
    };
    if let (Some(path), Some(difference)) = (&args.output, metric::false_color_difference(&image, &reference)) {
        image::write_png_as_is(path, &difference)?;
    }
    let judged = match args.metric {
        Metric::Mse => error.mse,
        Metric::Relmse => error.relmse,
        Metric::RelmseTrimmed => error.relmse_trimmed,
        Metric::Smape => error.smape,
        Metric::MeanRatio => (error.mean_ratio - 1.0).abs(),
    };
    // Not "above": an error that is not a number must fail too.
    let failed = args
        .threshold
        .is_some_and(|threshold| judged.is_nan() || judged > threshold);
    if args.json {
        let mut json = serde_json::to_value(error)?;
        json["threshold"] = args.threshold.into();
        json["passed"] = (!failed).into();
        output::print(&(serde_json::to_string_pretty(&json)? + "\n"))?;
    } else {
        let rows = [
            ("MSE", error.mse),
            ("relMSE", error.relmse),
            ("relMSE trimmed 0.1 %", error.relmse_trimmed),
            ("SMAPE", error.smape),
            ("mean ratio", error.mean_ratio),
        ];
        let rows = rows.map(|(name, value)| vec![name.to_string(), table::number(value)]);
        output::print(&table::align(&["metric", "value"], &rows, 1))?;
    }
    Ok(if failed { Status::Failed } else { Status::Done })
}
