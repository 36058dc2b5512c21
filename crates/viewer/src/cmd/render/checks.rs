//! What is refused before anything is loaded.

use super::RenderArgs;
use super::file::{Aov, Format};
#[cfg(unix)]
use crate::allocator;
use crate::cli::Backend;
use crate::message;
use anyhow::{Result, bail};
use render::{Method, Settings};

/// Prepares for a memory budget, if there is to be one.
///
/// # Errors
/// What cannot keep to one.
pub(super) fn memory_budget(args: &RenderArgs) -> Result<()> {
    if args.memory_budget.is_none() {
        return Ok(());
    }
    if args.light.one_backend()? == Backend::Gpu {
        bail!("--memory-budget: the GPU holds the whole scene; leave it away, or use --backend cpu");
    }
    if let Method::Oracle | Method::Restir = args.sampler {
        let name = args.sampler.name();
        bail!("--memory-budget: `{name}` looks at the whole image at a time; use another --sampler");
    }
    #[cfg(unix)]
    allocator::give_back_what_is_freed();
    Ok(())
}

/// The settings of the rendering.
///
/// # Errors
/// Those out of range, and what does not go together.
pub(super) fn settings(args: &RenderArgs, format: Format) -> Result<Settings> {
    if format == Format::Png && !args.aov.is_empty() {
        bail!("a PNG has no layers for --aov; write an .exr");
    }
    if args.exposure.is_some_and(|stops| !stops.is_finite()) {
        bail!("--exposure must be a finite number of stops");
    }
    if format == Format::Exr && args.exposure.is_some() {
        message::warn("--exposure is for PNG only: an EXR holds the radiance as it is");
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
    Ok(settings)
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
