//! Frames as the window shows them: with history and filter, by the window's own code.

use super::super::reference::Reference;
use super::super::summary::median;
use super::{Outcome, Step};
use crate::table::{align, number};
use render::Cleaner;
use render::{Film, Image, image};
use scene::Camera;
use serde::Serialize;
use std::time::Instant;

/// Errors of a frame in both ways.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    /// Milliseconds that history and filter took.
    pub(super) clean_ms: f64,
    pub(super) raw: Errors,
    pub(super) cleaned: Errors,
}

/// Errors of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Errors {
    /// Over all pixels.
    pub(super) relmse: f64,
    /// Without the worst 0.1 % of the pixels.
    pub(super) relmse_trimmed: f64,
    /// At the exposure that suits the reference. The reference's noise is part of it.
    pub(super) flip: f64,
}

/// Medians over frames and seeds.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Medians {
    frame_ms: f64,
    clean_ms: f64,
    raw: Errors,
    cleaned: Errors,
}

impl Shown {
    /// Cleans the film's picture and measures both.
    pub(super) fn measure(cleaner: &mut Cleaner, film: &Film, camera: &Camera, reference: &Reference) -> Self {
        let start = Instant::now();
        let pixels = cleaner.clean(film, camera).pixels;
        let clean_ms = start.elapsed().as_secs_f64() * 1e3;
        let cleaned = Image {
            width: film.width(),
            height: film.height(),
            pixels: pixels.into_iter().map(Into::into).collect(),
        };
        Self {
            clean_ms,
            raw: Errors::of(&film.image(), reference),
            cleaned: Errors::of(&cleaned, reference),
        }
    }
}

impl Errors {
    fn of(picture: &Image, reference: &Reference) -> Self {
        let whole = reference.whole();
        let error = reference.error(picture);
        Self {
            relmse: error.map_or(f64::NAN, |error| error.relmse),
            relmse_trimmed: error.map_or(f64::NAN, |error| error.relmse_trimmed),
            flip: render::flip(picture, &whole, image::auto_exposure(&whole)).unwrap_or(f64::NAN),
        }
    }
}

impl Medians {
    /// `None` where nothing was cleaned.
    pub(super) fn of(runs: &[(u64, Vec<Step>)]) -> Option<Self> {
        let steps = || runs.iter().flat_map(|(_, steps)| steps);
        let middle = |value: &dyn Fn(&Shown) -> f64| {
            let values = steps().filter_map(|step| step.shown.as_ref().map(value));
            median(values.collect())
        };
        let errors = |of: &dyn Fn(&Shown) -> Errors| {
            Some(Errors {
                relmse: middle(&|shown| of(shown).relmse)?,
                relmse_trimmed: middle(&|shown| of(shown).relmse_trimmed)?,
                flip: middle(&|shown| of(shown).flip)?,
            })
        };
        Some(Self {
            frame_ms: median(steps().map(|step| step.frame_ms).collect())?,
            clean_ms: middle(&|shown| shown.clean_ms)?,
            raw: errors(&|shown| shown.raw)?,
            cleaned: errors(&|shown| shown.cleaned)?,
        })
    }
}

/// The table of one scene, for people; nothing where nothing was cleaned.
pub(super) fn table(outcome: &Outcome) -> String {
    let row = |curve: &super::Curve| {
        let Medians {
            frame_ms,
            clean_ms,
            raw,
            cleaned,
        } = curve.displayed?;
        let mut row = vec![
            curve.sampler.to_string(),
            format!("{frame_ms:.1}"),
            format!("{clean_ms:.1}"),
        ];
        for [raw, cleaned] in [
            [raw.relmse, cleaned.relmse],
            [raw.relmse_trimmed, cleaned.relmse_trimmed],
            [raw.flip, cleaned.flip],
        ] {
            row.extend([number(raw), number(cleaned), format!("{:.1}x", raw / cleaned)]);
        }
        Some(row)
    };
    let rows: Vec<Vec<String>> = outcome.curves.iter().filter_map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let header = [
        "sampler", "frame ms", "clean ms", "relMSE", "shown", "gain", "trimmed", "shown", "gain", "FLIP", "shown",
        "gain",
    ];
    format!(
        "Medians over all frames, as rendered and as the window shows them, with history and filter:\n{}\n",
        align(&header, &rows, 1)
    )
}
