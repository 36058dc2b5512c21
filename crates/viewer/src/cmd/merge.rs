//! `merge`: parts of an image, rendered apart, joined to one.

use crate::cmd::render::{Format, metadata_of, parts};
use crate::exit::Status;
use crate::{message, output, table};
use anyhow::{Result, bail};
use clap::Args;
use parts::Header;
use render::image::{self, Channel};
use std::path::PathBuf;

/// Options of `merge`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  for i in 1 2 3 4; do manylight render hall.glb --spp 1024 --shard $i/4 -o hall-$i.part; done
  manylight merge hall-*.part -o hall.exr

Joins states of renderings (render -o NAME.part, or render --resume FILE) of the same scene, camera and settings: the mean of all samples,
each weighed as in its part. Parts may be the shards of one image, or have seeds of their own; the same samples twice are an error.
An EXR has the variance of the mean (variance.V) besides.")]
pub(crate) struct MergeArgs {
    /// States of renderings
    #[arg(required = true, value_name = "PARTS")]
    parts: Vec<PathBuf>,
    /// The image: .exr or .png
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Exposure of a PNG in stops; default: by the image's brightness
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    exposure: Option<f32>,
}

/// Runs the command.
///
/// # Errors
/// Parts that cannot be read or do not belong together; files that cannot be written.
pub(crate) fn run(args: &MergeArgs) -> Result<Status> {
    let format = Format::of(&args.output)?;
    if format == Format::Part {
        bail!("{}: give a file name that ends in .exr or .png", args.output.display());
    }
    output::check_writable(&args.output)?;
    let mut headers: Vec<Header> = Vec::new();
    let mut film: Option<render::Film> = None;
    for path in &args.parts {
        let (header, state) = parts::read(path)?;
        if let Some(difference) = headers.first().and_then(|first| first.difference(&header)) {
            bail!(
                "{}: was rendered with another {difference} than {}",
                path.display(),
                args.parts[0].display()
            );
        }
        if let Some(same) = headers.iter().position(|other| other.same_samples(&header)) {
            let same = args.parts[same].display();
            bail!("{} and {same} have the same samples: give each once", path.display());
        }
        let part = render::frame::film_of(&state)?;
        match &mut film {
            Some(film) => film.merge(&part)?,
            None => film = Some(part),
        }
        headers.push(header);
    }
    let Some(film) = film else { bail!("no parts are given") };
    tell_missing(&headers);
    let joined = film.image();
    match format {
        Format::Png => {
            let exposure = args.exposure.unwrap_or_else(|| image::auto_exposure(&joined));
            image::write_png(&args.output, &joined, exposure)?;
        }
        Format::Exr | Format::Part => {
            let mut channels = Channel::rgb("", &joined).to_vec();
            channels.push(Channel {
                name: "variance.V".into(),
                values: film.variance(),
            });
            let metadata = metadata_of(&headers[0], film.spp())?;
            image::write_exr(&args.output, joined.width, joined.height, &channels, &metadata)?;
        }
    }
    message::note(format!(
        "{}: {} x {}, {} spp of {} parts",
        args.output.display(),
        joined.width,
        joined.height,
        table::thousands(film.spp()),
        headers.len()
    ));
    Ok(Status::Done)
}

/// Warns of shards that are not there.
fn tell_missing(headers: &[Header]) {
    let Some((first, _)) = headers[0].shard else { return };
    let missing: Vec<String> = (1..=first.count)
        .filter(|&index| {
            !headers
                .iter()
                .any(|h| h.shard.is_some_and(|(shard, _)| shard.index == index))
        })
        .map(|index| format!("{index}/{}", first.count))
        .collect();
    if !missing.is_empty() {
        message::warn(format!(
            "parts that are missing: {}; the image is right without them, but noisier",
            missing.join(", ")
        ));
    }
}
