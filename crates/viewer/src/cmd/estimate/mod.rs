//! `estimate`: the Monte Carlo estimators side by side on integrals with known answers.

mod measure;
mod points;
mod report;

use crate::exit::Status;
use crate::interrupt::Watch;
use crate::progress::Progress;
use crate::{message, output};
use anyhow::{Context, Result, bail};
use clap::Args;
use measure::{Curve, Plan};
use sampling::estimators::{self, Estimator, Family};
use sampling::integrands::{self, Integrand};
use std::path::{Path, PathBuf};

/// Options of `estimate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  manylight estimate --list                              integrands, methods, point sets
  manylight estimate smooth-2d edge-2d                   how fast does the error of each method fall?
  manylight estimate --methods points -o points-out      the point sets on all integrands, with plots and pictures
  manylight estimate planar-near-large --methods 'mis power,importance direction' --samples 64,256,1024

Errors are root mean squares over the seeds, relative to the integral. The rate is the exponent r of error ~ N^r, fitted over the
numbers of samples, with its 95 % confidence interval. Efficiency is 1 / (variance x cost) as a multiple of that of crude
Monte Carlo, at the largest number of samples; cost is counted in evaluations of the integrand, and in seconds of one thread.
Bias is the mean error over its standard error: beyond 3 or 4 it is real. Methods marked * are biased, by less and less with more samples.
With -o writes estimates.csv, rates.csv, discrepancy.csv and plots (SVG) to a folder.")]
pub(crate) struct EstimateArgs {
    /// Integrands by name; default: all
    integrands: Vec<String>,
    /// Methods, or families of them, by name; crude comes with them. Default: all
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    methods: Vec<String>,
    /// Numbers of samples
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "16,64,256,1024,4096", value_parser = sample_count)]
    samples: Vec<usize>,
    /// Estimates of each kind, each with another seed
    ///
    /// Higher values tell smaller differences apart; lower values are done sooner.
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u64).range(2..=1_000_000))]
    seeds: u64,
    /// The first of the seeds
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// List integrands, methods and point sets, and do nothing
    #[arg(long)]
    list: bool,
    /// Folder for tables, plots and pictures of the point sets
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// Reads a number of samples.
fn sample_count(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|count| (1..=1 << 24).contains(count));
    count.ok_or_else(|| "must be 1 to 16,777,216".into())
}

/// Runs the command.
///
/// # Errors
/// Names that do not exist; files that cannot be written.
pub(crate) fn run(args: &EstimateArgs) -> Result<Status> {
    let all = integrands::all();
    if args.list {
        output::print(&report::list(&all))?;
        return Ok(Status::Done);
    }
    let chosen = choose_integrands(&all, &args.integrands)?;
    check_methods(&chosen, &args.methods)?;
    if let Some(folder) = &args.output {
        prepare(folder)?;
    }
    let mut samples = args.samples.clone();
    samples.sort_unstable();
    samples.dedup();
    let plan = Plan {
        samples,
        seeds: args.seed..args.seed.saturating_add(args.seeds),
    };

    let watch = Watch::rendering();
    let mut progress = Progress::new("estimate");
    let mut curves: Vec<Curve> = Vec::new();
    for (done, integrand) in chosen.iter().enumerate() {
        for method in methods_for(*integrand, &args.methods) {
            if watch.stopped() {
                break;
            }
            curves.extend(measure::measure(*integrand, &*method, &plan));
        }
        progress.step((done + 1) as f64 / chosen.len() as f64, integrand.name());
    }
    drop(progress);

    let interrupted = watch.writing();
    output::print(&report::tables(&curves))?;
    if let Some(folder) = &args.output {
        report::write_all(folder, &curves)?;
        points::write_all(folder)?;
        message::note(format!("{}: tables, plots and pictures written", folder.display()));
    }
    Ok(if interrupted { Status::Interrupted } else { Status::Done })
}

/// Makes the folder and sees whether files can be made there.
fn prepare(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot make the output folder", folder.display()))?;
    output::check_writable(&folder.join(report::ESTIMATES))
}

/// The integrands of these names; all if there are none.
fn choose_integrands<'a>(all: &'a [Box<dyn Integrand>], names: &[String]) -> Result<Vec<&'a dyn Integrand>> {
    if names.is_empty() {
        return Ok(all.iter().map(|integrand| &**integrand).collect());
    }
    let find = |name: &String| {
        let found = all.iter().find(|integrand| integrand.name() == name);
        found.map(|integrand| &**integrand).with_context(|| {
            let known: Vec<&str> = all.iter().map(|integrand| integrand.name()).collect();
            format!("no integrand '{name}'; there are: {}", known.join(", "))
        })
    };
    names.iter().map(find).collect()
}

/// Makes sure that each name stands for a method of some integrand.
fn check_methods(integrands: &[&dyn Integrand], names: &[String]) -> Result<()> {
    for name in names {
        let known = |integrand: &&dyn Integrand| {
            estimators::all(*integrand)
                .iter()
                .any(|method| is_called(&**method, name))
        };
        if !integrands.iter().any(known) {
            bail!("no method '{name}' for these integrands; `manylight estimate --list` tells what there is");
        }
    }
    Ok(())
}

/// Whether `name` is that of the method or of its family.
fn is_called(method: &dyn Estimator, name: &str) -> bool {
    method.name() == name || method.family().name() == name
}

/// The methods of these names, crude first; all if there are none.
fn methods_for(integrand: &dyn Integrand, names: &[String]) -> Vec<Box<dyn Estimator>> {
    let all = estimators::all(integrand);
    let wanted = |index: usize, method: &dyn Estimator| {
        index == 0 || names.is_empty() || names.iter().any(|name| is_called(method, name))
    };
    let kept = all
        .into_iter()
        .enumerate()
        .filter(|(index, method)| wanted(*index, &**method));
    kept.map(|(_, method)| method).collect()
}

/// The name of a family, and what its methods know.
fn describe(family: Family) -> &'static str {
    match family {
        Family::Blind => "values of the integrand only",
        Family::Points => "the same with points that are placed better than at random",
        Family::Technique => "a density or a function like the integrand",
        Family::Combined => "several densities",
    }
}
