//! What the window can show besides the image: each view with a legend.

use glam::Vec3;
use light_cache::ShadingPoint;
use rayon::prelude::*;
use render::{Film, FrameLoop, Image};
use scene::luminance;
use serde::{Deserialize, Serialize};

/// What is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum View {
    #[default]
    Image,
    Albedo,
    Normal,
    Depth,
    Light,
    Error,
    Cells,
}

/// Texels ready for upload, and how to read them.
#[derive(Clone, Debug)]
pub(super) struct Shown {
    /// RGBA, row 0 at the top.
    pub(super) texels: Vec<[f32; 4]>,
    /// Radiance, to go through the tone curve; else values in 0..1 to be shown as they are.
    pub(super) tone_mapped: bool,
    /// Range and unit; empty for the image.
    pub(super) legend: String,
}

impl Shown {
    /// Radiance, to go through the tone curve.
    pub(super) fn radiance(texels: Vec<[f32; 4]>) -> Self {
        Self {
            texels,
            tone_mapped: true,
            legend: String::new(),
        }
    }
}

impl View {
    pub(super) const ALL: [Self; 7] = [
        Self::Image,
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Light,
        Self::Error,
        Self::Cells,
    ];

    /// In panels and scripts.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Image => "image",
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Light => "light",
            Self::Error => "error",
            Self::Cells => "cells",
        }
    }

    /// What it tells, for people.
    pub(super) fn description(self) -> &'static str {
        match self {
            Self::Image => "radiance through the tone curve",
            Self::Albedo => "diffuse albedo plus specular reflectance",
            Self::Normal => "shading normal, world space",
            Self::Depth => "distance from the camera",
            Self::Light => "light chosen by the last sample",
            Self::Error => "standard error of the pixel / its value",
            Self::Cells => "cells that know which lights matter there",
        }
    }

    /// Whether the film must keep auxiliary images for it, which costs time.
    pub(super) fn needs_aovs(self) -> bool {
        !matches!(self, Self::Image | Self::Error)
    }

    /// What was rendered as this view shows it. A view whose auxiliary images are not there is black.
    pub(super) fn of(self, frames: &dyn FrameLoop<'_>) -> Shown {
        let film = frames.film();
        let aovs = if self.needs_aovs() { film.aovs() } else { None };
        let as_is = |texels: Vec<[f32; 4]>, legend: &str| Shown {
            texels,
            tone_mapped: false,
            legend: legend.into(),
        };
        match (self, aovs) {
            (Self::Image, _) => Shown::radiance(texels(&film.image(), |pixel| pixel)),
            (Self::Error, _) => as_is(relative_error(film), "1 %  blue ... white  100 %, logarithmic"),
            (Self::Albedo, Some(aovs)) => as_is(texels(&aovs.albedo, |pixel| pixel), "0 ... 1 per channel"),
            (Self::Normal, Some(aovs)) => {
                let shown = texels(&aovs.normal, |normal| linear(normal * 0.5 + 0.5));
                as_is(shown, "-1 ... 1: x red, y green, z blue")
            }
            (Self::Depth, Some(aovs)) => {
                let far = percentile(&aovs.depth, 0.99);
                let shown = aovs.depth.par_iter().map(|&depth| {
                    let nearness = if depth.is_finite() {
                        1.0 - 0.95 * (depth / far).min(1.0)
                    } else {
                        0.0
                    };
                    linear(Vec3::splat(nearness)).extend(1.0).to_array()
                });
                as_is(
                    shown.collect(),
                    &format!("0 m  white ... dark  {far:.1} m; black: nothing"),
                )
            }
            (Self::Light, Some(aovs)) => {
                let shown = aovs
                    .light
                    .par_iter()
                    .map(|&light| light_color(light as i64).extend(1.0).to_array());
                as_is(shown.collect(), "one colour per light; black: none chosen")
            }
            (Self::Cells, Some(aovs)) => {
                let pixels = aovs.position.pixels.par_iter().zip(&aovs.normal.pixels);
                let points = pixels.map(|(&position, &normal)| ShadingPoint {
                    position_ws: position.into(),
                    normal_ws: normal.into(),
                    primary: true,
                });
                let cells = frames.cells_at(&points.collect::<Vec<_>>());
                let shown = cells.par_iter().zip(&aovs.depth).map(|(cell, depth)| {
                    let cell = cell.filter(|_| depth.is_finite());
                    cell_color(cell).extend(1.0).to_array()
                });
                as_is(shown.collect(), "one colour per cell; black: none yet")
            }
            (_, None) => as_is(vec![[0.0; 4]; (film.width() * film.height()) as usize], "not kept"),
        }
    }
}

fn texels(image: &Image, color: impl Fn(Vec3) -> Vec3 + Sync) -> Vec<[f32; 4]> {
    let pixels = image.pixels.par_iter();
    pixels
        .map(|&pixel| color(pixel.into()).extend(1.0).to_array())
        .collect()
}

/// The color of a light in the view of lights, and in the panels; black for none.
pub(super) fn light_color(light: i64) -> Vec3 {
    let Ok(light) = u32::try_from(light) else {
        return Vec3::ZERO;
    };
    let bits = sampling::hash::mix(light.wrapping_add(1));
    let hue = (bits & 0xffff) as f32 / 65_536.0;
    let value = 0.45 + 0.55 * (bits >> 16 & 0xff) as f32 / 255.0;
    let channel = |shift: f32| (((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
    linear(Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)) * 0.75 * value + 0.2 * value)
}

/// The color of a cell in the view of cells; black for none.
fn cell_color(cell: Option<u64>) -> Vec3 {
    cell.map_or(Vec3::ZERO, |cell| light_color((cell & 0xffff_ffff) as i64))
}

/// Standard error of each pixel's luminance over its value, by a logarithmic colour scale.
fn relative_error(film: &Film) -> Vec<[f32; 4]> {
    const LEAST: f32 = 0.01;
    let image = film.image();
    let pixels = image.pixels.par_iter().zip(film.variance());
    let shown = pixels.map(|(&pixel, variance)| {
        let value = luminance(pixel.into());
        let error = if value > 0.0 { variance.sqrt() / value } else { 0.0 };
        let decades = (error.max(LEAST) / LEAST).log10() / -LEAST.log10();
        linear(heat(decades.min(1.0))).extend(1.0).to_array()
    });
    shown.collect()
}

/// A colour scale whose lightness grows steadily: black, blue, magenta, orange, white.
fn heat(share: f32) -> Vec3 {
    const STOPS: [Vec3; 5] = [
        Vec3::new(0.01, 0.01, 0.04),
        Vec3::new(0.16, 0.13, 0.55),
        Vec3::new(0.71, 0.20, 0.48),
        Vec3::new(0.98, 0.62, 0.22),
        Vec3::new(1.0, 1.0, 0.92),
    ];
    let at = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let below = (at as usize).min(STOPS.len() - 2);
    STOPS[below].lerp(STOPS[below + 1], at - below as f32)
}

/// About what encoding for the display undoes: values meant as grey levels.
fn linear(encoded: Vec3) -> Vec3 {
    encoded.max(Vec3::ZERO).powf(2.2)
}

/// Of the finite values; 1 if there are none.
fn percentile(values: &[f32], share: f32) -> f32 {
    let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if finite.is_empty() {
        return 1.0;
    }
    let at = ((finite.len() - 1) as f32 * share) as usize;
    *finite.select_nth_unstable_by(at, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use render::{Settings, renderer};
    use scene::{Scene, generate};

    #[test]
    fn every_view_fills_the_picture_with_finite_values_and_says_how_to_read_them() {
        let scene = Scene::new(generate::demo("rooms:64").expect("a known scene")).expect("valid");
        let settings = Settings {
            width: 40,
            height: 30,
            aovs: true,
            ..Settings::default()
        };
        let mut frames = renderer(&scene, &scene.parts.cameras[0], &settings).expect("valid settings");
        (0..3).for_each(|_| frames.render_frame());
        for view in View::ALL {
            let shown = view.of(frames.as_ref());
            assert_eq!(shown.texels.len(), 40 * 30, "{}", view.name());
            assert!(shown.texels.iter().flatten().all(|v| v.is_finite()), "{}", view.name());
            assert!(
                shown.texels.iter().any(|texel| texel[1] > 0.0),
                "{} is black",
                view.name()
            );
            assert_eq!(shown.legend.is_empty(), view == View::Image);
            if !shown.tone_mapped {
                assert!(
                    shown.texels.iter().flatten().all(|v| (0.0..=1.01).contains(v)),
                    "{}",
                    view.name()
                );
            }
        }
    }

    #[test]
    fn lights_differ_in_colour_and_none_is_black() {
        assert_eq!(light_color(-1), Vec3::ZERO);
        let colors: Vec<Vec3> = (0..50).map(light_color).collect();
        for (i, a) in colors.iter().enumerate() {
            assert!(a.is_finite() && a.min_element() >= 0.0 && a.max_element() > 0.0);
            assert!(colors[..i].iter().all(|b| a != b));
        }
    }
}
