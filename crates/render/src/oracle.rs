//! `oracle`: the best possible choice of one light per pixel, for research. It looks at everything before the first frame,
//! which is not counted as time: a yardstick for samplers that have to learn what it knows.
//!
//! One light drawn with probability p_i adds f_i / p_i, whose second moment is the sum of E[f_i^2] / p_i. It is least
//! where p_i is proportional to sqrt(E[f_i^2]), the expectation running over the pixel's area and the points on the light,
//! visibility included. The expectation is estimated by passes that look at all lights, as `exact` does.
//!
//! For direct light at the first hit only: farther along a path there are no pixels to remember anything by. Where
//! drawing from the BSDF finds lights too, f_i is weighed as if light i had been chosen for certain, so there the
//! choice is nearly the best only.

use crate::direct::{Connection, Direct, DirectLight, LightNumbers, OneLight, Vertex};
use crate::exact::AllLights;
use crate::film::{AovSample, Tile};
use crate::frame::{Eye, Frames};
use crate::path::{Counters, FrameView, Probe, Start, TileLog, path};
use crate::{Film, Settings};
use glam::{Vec2, Vec3};
use light_cache::{Choice, LightRecord, LightSampler, Observation, SamplerStats, ShadingPoint};
use rayon::prelude::*;
use sampling::hash::hash2;
use sampling::{Discrete, unit_f32};
use scene::{Scene, luminance};
use std::ops::Add;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Memory for what is known about all pixels, bytes. Beyond it the weakest lights of each pixel are drawn alike.
const MAX_BYTES: usize = 1 << 30;
/// About what one light of one pixel takes: its number, and two words of [`Discrete`].
const BYTES_PER_LIGHT: usize = 16;
/// Seeds of the passes differ from those of all frames: what is known must not depend on the frames' random numbers.
const SEED: u64 = 0x6F72_6163_6C65;
/// Least probability of drawing any light alike, so that each keeps its chance in whole units of 2^-32.
const LEAST_REST: f64 = 1.0 / 4096.0;

/// What is known about every pixel.
pub(crate) struct Oracle {
    passes: u32,
    /// Least probability shared by all lights alike.
    rest: f64,
    /// Tile by tile, row by row.
    tiles: Vec<Vec<Pixel>>,
    prepare_s: f64,
}

impl Oracle {
    /// Knows nothing before [`Frames::look`].
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            passes: settings.oracle_passes,
            rest: f64::from(settings.light.min_probability_mass).max(LEAST_REST),
            tiles: Vec::new(),
            prepare_s: 0.0,
        }
    }
}

impl Frames for Oracle {
    /// Looks at all lights from all pixels.
    fn look(&mut self, eye: &Eye<'_>, film: &mut Film) {
        let start = Instant::now();
        let lights = AllLights::new(&eye.scene.lights);
        let light_count = eye.scene.lights.len() as u32;
        let pixels = eye.image_width as usize * eye.image_height as usize;
        let most = (MAX_BYTES / BYTES_PER_LIGHT / pixels).max(16);
        let tiles = film.tiles_mut().par_iter().map(|tile| {
            let known = pixels_of(tile).map(|(x, y)| {
                let sums = survey(eye, &lights, self.passes, x, y);
                Pixel::new(sums, light_count, self.rest, most)
            });
            known.collect()
        });
        self.tiles = tiles.collect();
        self.prepare_s += start.elapsed().as_secs_f64();
    }

    fn render<const AOVS: bool>(&mut self, eye: &mut Eye<'_>, film: &mut Film, stop: &AtomicBool) -> (Counters, bool) {
        let tiles = film.tiles_mut().par_iter_mut().zip(&self.tiles);
        let counters = tiles.map(|(tile, known)| {
            let mut log = TileLog {
                observations: &mut Vec::new(),
                controls: &mut [],
                counters: Counters::default(),
            };
            if stop.load(Ordering::Relaxed) {
                return log.counters;
            }
            for ((index, (x, y)), pixel) in pixels_of(tile).enumerate().zip(known) {
                let direct = OneLight(pixel);
                let view = eye.view(&direct);
                let start = Start::new(&view, x, y);
                let found = if AOVS {
                    let mut aovs = AovSample::NONE;
                    let found = path(&view, &start, &mut log, &mut aovs);
                    tile.add_aovs(index, &aovs);
                    found
                } else {
                    path(&view, &start, &mut log, &mut ())
                };
                if !tile.add(index, found.radiance) {
                    log.counters.nonfinite += 1;
                }
            }
            log.counters
        });
        let counters = counters.reduce(Counters::default, Counters::add);
        (counters, !stop.load(Ordering::Relaxed))
    }

    /// Everything is looked at anew in any case.
    fn scene_changed(&mut self, _scene: &Scene) {}

    fn prepare_s(&self) -> f64 {
        self.prepare_s
    }

    /// What it knows is worked out anew from scene and settings.
    fn save(&self) -> Option<(u32, Vec<u8>)> {
        Some((0, Vec::new()))
    }

    fn restore(&mut self, first_frame: u32, learned: &[u8]) -> bool {
        first_frame == 0 && learned.is_empty()
    }

    fn sampler_stats(&self) -> Option<SamplerStats> {
        Some(SamplerStats {
            bytes: self.tiles.iter().flatten().map(Pixel::bytes).sum(),
            ..SamplerStats::default()
        })
    }
}

/// Columns and rows of a tile's pixels, row by row.
fn pixels_of(tile: &Tile) -> impl Iterator<Item = (u32, u32)> + use<> {
    let (x0, y0, width, height) = (tile.x0, tile.y0, tile.width, tile.height);
    (y0..y0 + height).flat_map(move |y| (x0..x0 + width).map(move |x| (x, y)))
}

/// The sums of the squares of what each light adds to a pixel, over all passes, in the order of the lights.
fn survey(eye: &Eye<'_>, lights: &AllLights, passes: u32, x: u32, y: u32) -> Vec<(u32, f64)> {
    let direct = Survey {
        lights,
        found: Mutex::default(),
    };
    let mut log = TileLog {
        observations: &mut Vec::new(),
        controls: &mut [],
        counters: Counters::default(),
    };
    for pass in 0..passes {
        let view = FrameView {
            seed: eye.seed ^ SEED,
            frame: pass,
            ..eye.view(&direct)
        };
        path(&view, &Start::new(&view, x, y), &mut log, &mut ());
    }
    let mut found = direct.found.into_inner().unwrap_or_default();
    found.sort_unstable_by_key(|(light, _)| *light);
    found.dedup_by(|(light, square), (kept, sum)| {
        let same = light == kept;
        if same {
            *sum += *square;
        }
        same
    });
    found
}

/// Looks at all lights, and notes the square of what each of them adds.
struct Survey<'l> {
    lights: &'l AllLights,
    /// For one pixel, which one thread looks at.
    found: Mutex<Vec<(u32, f64)>>,
}

impl DirectLight for Survey<'_> {
    type Local<'a>
        = ()
    where
        Self: 'a;

    fn local(&self, _scene: &Scene, _point: &ShadingPoint) {}

    fn estimate(
        &self,
        scene: &Scene,
        (): &(),
        vertex: &Vertex<'_>,
        numbers: &[LightNumbers],
        log: &mut TileLog<'_>,
        probe: &mut impl Probe,
    ) -> Direct {
        let [u0, u1] = numbers[0].point;
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        for light in self.lights.reaching(vertex) {
            let u = Vec2::new(unit_f32(u0 ^ hash2(light, 0)), unit_f32(u1 ^ hash2(light, 1)));
            if let Some(connection) = Connection::new(scene, vertex, light, 1.0, u)
                && connection.is_visible(scene, vertex, log, probe)
            {
                found.push((light, f64::from(luminance(connection.contribution(1.0))).powi(2)));
            }
        }
        Direct {
            radiance: Vec3::ZERO,
            control: Vec3::ZERO,
            light: None,
        }
    }

    fn pmf(&self, (): &(), _light: u32) -> f32 {
        1.0
    }
}

/// What is known about one pixel: the lights that were seen there, in their order, and the rest, which stands for all
/// lights alike, seen or not.
#[derive(Debug)]
struct Pixel {
    lights: Box<[u32]>,
    /// One entry for each of `lights`, then one for the rest.
    chosen: Discrete,
    light_count: u32,
}

impl Pixel {
    /// From the sums of squares by light. `rest` is the probability of drawing any light alike; lights beyond the `most`
    /// strongest go there too.
    fn new(mut sums: Vec<(u32, f64)>, light_count: u32, rest: f64, most: usize) -> Self {
        sums.iter_mut().for_each(|(_, sum)| *sum = sum.sqrt());
        sums.retain(|(_, weight)| *weight > 0.0 && weight.is_finite());
        let all: f64 = sums.iter().map(|(_, weight)| weight).sum();
        if sums.len() > most {
            sums.select_nth_unstable_by(most, |(_, a), (_, b)| b.total_cmp(a));
            sums.truncate(most);
            sums.sort_unstable_by_key(|(light, _)| *light);
        }
        let kept: f64 = sums.iter().map(|(_, weight)| weight).sum();
        let rest = (rest.min(1.0) * all + (1.0 - rest.min(1.0)) * (all - kept)).max(all * LEAST_REST);
        // Weights total `all` before the rest takes its part of what is kept.
        let share = if kept > 0.0 { (all - rest).max(0.0) / kept } else { 0.0 };
        let weights: Vec<f64> = sums
            .iter()
            .map(|(_, weight)| weight * share)
            .chain([if all > 0.0 { rest } else { 1.0 }])
            .collect();
        Self {
            lights: sums.iter().map(|(light, _)| *light).collect(),
            chosen: Discrete::new(&weights, 0.0).expect("the rest is an entry"),
            light_count,
        }
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(&*self.lights) + self.chosen.bytes()
    }

    /// The entry of the rest, and how many of the 2^32 random numbers draw it: the last ones.
    fn rest(&self) -> (u32, u64) {
        let entry = self.lights.len() as u32;
        (entry, self.chosen.mass(entry))
    }

    /// How many random numbers draw `light`.
    fn mass(&self, light: u32) -> u64 {
        let own = self
            .lights
            .binary_search(&light)
            .map_or(0, |j| self.chosen.mass(j as u32));
        let (_, rest) = self.rest();
        // Number k of the rest draws light floor(k n / rest).
        let first = |light: u32| (u64::from(light) * rest).div_ceil(u64::from(self.light_count));
        own + first(light + 1) - first(light)
    }
}

impl LightSampler for &Pixel {
    type Local<'a>
        = ()
    where
        Self: 'a;
    const LEARNS: bool = false;

    fn local(&self, _scene: &Scene, _point: &ShadingPoint) {}

    fn sample(&self, (): &(), u: u32) -> Option<Choice> {
        if self.light_count == 0 {
            return None;
        }
        let (entry, rest) = self.rest();
        let drawn = self.chosen.sample(u).index;
        let light = if drawn == entry {
            let k = u64::from(u) + rest - (1 << 32);
            (k * u64::from(self.light_count) / rest) as u32
        } else {
            self.lights[drawn as usize]
        };
        Some(Choice::new(light, self.pmf(&(), light)))
    }

    fn pmf(&self, (): &(), light: u32) -> f32 {
        (self.mass(light) as f64 / 4_294_967_296.0) as f32
    }

    fn end_frame(&mut self, _scene: &Scene, _logs: &[Vec<Observation>]) {}

    fn stats(&self) -> SamplerStats {
        SamplerStats::default()
    }

    fn records(&self, _scene: &Scene) -> Vec<LightRecord> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_are_those_of_the_draws() {
        let sums = vec![(2, 4.0), (5, 1.0), (6, 0.0), (7, 9.0)];
        for (most, kept) in [(10, 3), (2, 2), (0, 0)] {
            let pixel = Pixel::new(sums.clone(), 9, 0.01, most);
            assert_eq!(pixel.lights.len(), kept);
            let total: u64 = (0..9).map(|light| pixel.mass(light)).sum();
            assert_eq!(total, 1 << 32);
            // Draws are monotone within the kept lights and within the rest, so every 2^12th number tells the masses.
            let mut drawn = [0u64; 9];
            for u in (0..1u64 << 32).step_by(1 << 12) {
                let choice = (&pixel).sample(&(), u as u32).expect("there are lights");
                assert_eq!(choice.pmf, (&pixel).pmf(&(), choice.light));
                drawn[choice.light as usize] += 1 << 12;
            }
            for (light, drawn) in (0..).zip(drawn) {
                let mass = pixel.mass(light);
                assert!(mass > 0 && mass.abs_diff(drawn) <= 2 << 12, "{light}: {mass} {drawn}");
            }
        }
    }

    #[test]
    fn probabilities_go_with_root_second_moments() {
        let pixel = Pixel::new(vec![(0, 4.0), (3, 9.0)], 4, 0.01, 10);
        let p = [0, 1, 3].map(|light| f64::from((&pixel).pmf(&(), light)));
        assert!((p[0] - (0.99 * 0.4 + 0.0025)).abs() < 1e-6, "{p:?}");
        assert!((p[1] - 0.0025).abs() < 1e-6, "{p:?}");
        assert!((p[2] - (0.99 * 0.6 + 0.0025)).abs() < 1e-6, "{p:?}");
        let dark = Pixel::new(Vec::new(), 4, 0.01, 10);
        assert!((0..4).all(|light| dark.mass(light) == 1 << 30));
    }
}
