//! The choice of a light: what is drawn is what is reported, and nobody falls below the guaranteed minimum.

use super::bench::{Bench, NEVER};
use anyhow::Result;
use glam::Vec3;
use light_cache::{LightSampler, Observation, SamplerKind, Settings, ShadingPoint, Visitor};
use rayon::prelude::*;
use sampling::discrete::TOTAL;
use sampling::hemisphere::uniform_sphere;
use sampling::statistics::{chi_square_p, pooled_chi_square};
use sampling::{Discrete, Random};
use scene::assemble::{Builder, point};
use scene::{Material, Scene};

/// Groups of lights whose frequencies are compared.
const GROUPS: usize = 1024;
/// Least probability with which frequencies may be as far from the reported ones as they are: a right program stays above it but for
/// once in 10,000 checks, and all numbers are fixed.
const P_VALUE: (&str, f64) = ("-log10 of the p-value", 5.0);

/// Checks the family.
pub(super) fn check(bench: &mut Bench) -> Result<()> {
    distributions(bench)?;
    updates(bench)?;
    let counts: &[usize] = bench.pick(
        &[1, 2, 100],
        &[1, 2, 3, 10, 1_000, 100_000],
        &[1, 2, 3, 10, 1_000, 100_000, 1_000_000],
    );
    for &count in counts {
        let scene = lights(count)?;
        for kind in SamplerKind::ALL {
            bench.now(format_args!("{count} lights over 24 decades, {}", kind.name()))?;
            let judge = Judge {
                scene: &scene,
                draws: bench.pick(1 << 16, 1 << 18, 1 << 22),
            };
            let found = light_cache::build(&scene, &Settings::default(), kind, judge);
            for (state, found) in ["fresh", "taught"].into_iter().zip(found) {
                let hazard = format!("{count} lights over 24 decades, {state}");
                bench.check(&hazard, kind.name(), P_VALUE, found.surprise);
                bench.check(&hazard, kind.name(), ("sum less 1", 2e-5), found.off_one);
                bench.check(&hazard, kind.name(), NEVER, found.faults as f64);
            }
        }
    }
    Ok(())
}

/// Integer distributions of up to a million entries over sixty decades.
fn distributions(bench: &mut Bench) -> Result<()> {
    for count in [1_u32, 2, 3, 1_000, 1_000_000] {
        let random = Random::new(3, count, 0);
        let weights: Vec<f64> = (0..count)
            .map(|i| 10_f64.powf(60.0 * f64::from(random.f32(i)) - 30.0))
            .collect();
        for floor in [0.0, 0.005] {
            let hazard = format!("{count} weights over 60 decades, floor {floor}");
            bench.now(&hazard)?;
            let distribution = Discrete::new(&weights, floor).expect("there are entries");
            let masses: Vec<u64> = (0..count).map(|i| distribution.mass(i)).collect();
            let least = (distribution.floor() * TOTAL as f64) as u64;
            bench.check(
                &hazard,
                "masses less 2^32",
                NEVER,
                masses.iter().sum::<u64>().abs_diff(TOTAL) as f64,
            );
            let below = masses.iter().filter(|&&mass| mass < least.max(1)).count();
            bench.check(&hazard, "entries below the floor", NEVER, below as f64);
            // The first and the last number of every entry draw it: nothing is lost between entries.
            let mut first = 0;
            let mut lost = 0;
            for (index, &mass) in (0_u32..).zip(&masses) {
                let ends = [first, first + mass - 1].map(|u| distribution.sample(u as u32));
                lost += ends
                    .iter()
                    .filter(|draw| draw.index != index || draw.mass != mass)
                    .count();
                first += mass;
            }
            bench.check(&hazard, "bins that are missed", NEVER, lost as f64);
        }
    }
    Ok(())
}

/// Millions of weights set anew in place, with zeros, denormals and giants among them.
fn updates(bench: &mut Bench) -> Result<()> {
    let count = 1_000;
    let updates = bench.pick(100, 10_000, 100_000_u32);
    let hazard = format!("{} weights updated", u64::from(updates) * count as u64);
    bench.now(&hazard)?;
    let mut distribution = Discrete::new(&vec![1.0; count], 0.005).expect("there are entries");
    let mut weights = vec![1.0; count];
    let (mut off, mut below) = (0_u32, 0_u32);
    for update in 0..updates {
        let random = Random::new(4, update, 0);
        for (i, weight) in (0_u32..).zip(&mut weights) {
            *weight = match random.u32(2 * i) % 16 {
                0 => 0.0,
                1 => f64::from_bits(u64::from(random.u32(2 * i + 1))),
                2 => f64::MAX,
                _ => *weight * (0.5 + f64::from(random.f32(2 * i + 1))),
            };
        }
        distribution.set(&weights, 0.005);
        let masses = (0..count as u32).map(|i| distribution.mass(i));
        off += u32::from(masses.clone().sum::<u64>() != TOTAL);
        below += u32::from(
            masses
                .clone()
                .any(|mass| (mass as f64) < distribution.floor() * TOTAL as f64),
        );
    }
    bench.check(&hazard, "totals that are not 2^32", NEVER, f64::from(off));
    bench.check(&hazard, "minima that are broken", NEVER, f64::from(below));
    Ok(())
}

/// `count` triangle and point lights in a cube of 10 m over a floor, over twenty-four decades of strength.
fn lights(count: usize) -> Result<Scene> {
    let mut builder = Builder::default();
    let floor = builder.material(Material::lambert("floor", Vec3::ONE));
    builder.quad(Vec3::ZERO, Vec3::Z * 10.0, Vec3::X * 10.0, floor);
    let materials: Vec<u32> = (0..25)
        .map(|decade| builder.material(Material::emitter("lamp", Vec3::splat(10_f32.powi(decade - 12)))))
        .collect();
    for i in 0..count as u32 {
        let random = Random::new(5, i, 0);
        let at = Vec3::new(random.f32(0), 0.1 + random.f32(1), random.f32(2)) * 9.0;
        let decade = random.u32(3) % 25;
        if i % 2 == 0 {
            builder.light(point(at, Vec3::splat(10_f32.powi(decade as i32 - 12))));
        } else {
            let [a, b] = [4, 6].map(|dimension| uniform_sphere(random.vec2(dimension)) * 0.1);
            builder.triangle([at, at + a, at + b], materials[decade as usize]);
        }
    }
    Ok(builder.build()?)
}

/// Judges a sampler, fresh and after some lessons.
struct Judge<'s> {
    scene: &'s Scene,
    draws: u32,
}

/// What was found.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// -log10 of the smallest p-value.
    surprise: f64,
    /// How far a sum of probabilities is from 1 at most.
    off_one: f64,
    /// Lights that can contribute and are below the guaranteed minimum, draws whose probability is not the reported one, numbers that
    /// are no probabilities.
    faults: u64,
}

impl Visitor for Judge<'_> {
    type Output = [Found; 2];

    fn visit<S: LightSampler + 'static>(self, mut sampler: S) -> Self::Output {
        let fresh = self.judge(&sampler);
        for frame in 0..8 {
            let logs = self.lesson(&sampler, frame);
            sampler.end_frame(self.scene, &logs);
        }
        [fresh, self.judge(&sampler)]
    }
}

impl Judge<'_> {
    fn points() -> Vec<ShadingPoint> {
        let point = |i: u32| {
            let random = Random::new(6, i, 0);
            ShadingPoint {
                position_ws: Vec3::new(random.f32(0), 0.0, random.f32(1)) * 10.0,
                normal_ws: Vec3::Y,
                primary: i != 2,
            }
        };
        (0..3).map(point).collect()
    }

    fn judge<S: LightSampler>(&self, sampler: &S) -> Found {
        let mut found = Found::default();
        let least = sampler.stats().min_probability;
        let lights = &self.scene.lights;
        for (index, point) in (0_u32..).zip(Self::points()) {
            let local = sampler.local(self.scene, &point);
            let mut pmfs = vec![0.0; lights.len()];
            sampler.add_pmfs(&local, &mut pmfs);
            let sum: f64 = pmfs.iter().sum();
            found.off_one = found.off_one.max((sum - 1.0).abs());
            for (light, &pmf) in lights.iter().zip(&pmfs) {
                let due = light.unshadowed_irradiance(point.position_ws, point.normal_ws) > 0.0;
                let fault = !(0.0..=1.000_001).contains(&pmf) || due && (pmf <= 0.0 || pmf < least * 0.999_999);
                found.faults += u64::from(fault);
            }
            let group = |light: usize| light * GROUPS.min(lights.len()) / lights.len();
            let batches = (0..64_u32).into_par_iter().map(|batch| {
                let mut counts = vec![0_u64; GROUPS.min(lights.len())];
                let mut faults = 0;
                let local = sampler.local(self.scene, &point);
                for draw in 0..self.draws / 64 {
                    let u = Random::new(7, index * 64 + batch, draw).u32(0);
                    match sampler.sample(&local, u) {
                        Some(choice) => {
                            counts[group(choice.light as usize)] += 1;
                            let reported = pmfs[choice.light as usize] as f32;
                            faults += u64::from(choice.pmf <= 0.0 || choice.pmf != reported);
                        }
                        None => faults += 1,
                    }
                }
                (counts, faults)
            });
            let (counts, faults) = batches.reduce(
                || (vec![0; GROUPS.min(lights.len())], 0),
                |(mut a, x), (b, y)| {
                    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                    (a, x + y)
                },
            );
            found.faults += faults;
            let mut expected = vec![0.0; counts.len()];
            for (light, pmf) in pmfs.iter().enumerate() {
                expected[group(light)] += pmf * f64::from(self.draws / 64 * 64);
            }
            let (statistic, dof) = pooled_chi_square(&counts, &expected, 5.0);
            let p = chi_square_p(statistic, dof);
            found.surprise = found.surprise.max(-p.max(1e-300).log10());
        }
        found
    }

    /// What a frame would report if every third light were visible.
    fn lesson<S: LightSampler>(&self, sampler: &S, frame: u32) -> Vec<Vec<Observation>> {
        let log = (0..4_000_u32).filter_map(|i| {
            let random = Random::new(8, i, frame);
            let point = ShadingPoint {
                position_ws: Vec3::new(random.f32(0), 0.0, random.f32(1)) * 10.0,
                normal_ws: Vec3::Y,
                primary: i % 5 != 0,
            };
            let choice = sampler.sample(&sampler.local(self.scene, &point), random.u32(2))?;
            let light = &self.scene.lights[choice.light as usize];
            let unshadowed = light.unshadowed_irradiance(point.position_ws, point.normal_ws);
            Some(Observation {
                point,
                light: choice.light,
                unshadowed,
                irradiance: unshadowed,
                pmf: choice.pmf,
                visible: choice.light.is_multiple_of(3),
                weight: 1,
                bounce: None,
            })
        });
        vec![log.collect()]
    }
}
