//! Cost of a draw of each kind, in ns: `cargo bench -p sampling`.
//!
//! Plain timing of loops whose results are summed; the best of several repetitions, since noise only ever adds.

use glam::{Vec2, Vec3};
use sampling::points::PointSet;
use sampling::{
    Discrete, Frame, PixelSampler, PixelSequence, Random, SphericalRectangle, SphericalTriangle, ggx, hemisphere,
    unit_f32,
};
use std::hint::black_box;
use std::time::Instant;

/// Prints the ns per call of `draw(i)`; its result is consumed.
fn measure<T>(name: &str, draw: impl Fn(u32) -> T) {
    let calls = 1 << 20;
    let best = (0..7)
        .map(|_| {
            let start = Instant::now();
            for i in 0..calls {
                black_box(draw(i));
            }
            start.elapsed().as_secs_f64() * 1e9 / f64::from(calls)
        })
        .fold(f64::INFINITY, f64::min);
    println!("{name:48} {best:8.2} ns");
}

/// Weights over six decades.
fn weights(entries: u32) -> Vec<f64> {
    let random = Random::new(1, 2, 3);
    let weight = |i| 10_f64.powf(6.0 * f64::from(random.f32(i)));
    (0..entries).map(weight).collect()
}

fn distribution(entries: u32) -> Discrete {
    Discrete::new(&weights(entries), 0.005).expect("there are entries")
}

/// M. D. Vose's alias method (1991) in `f32`, as many renderers have it: what the integer distribution is compared with. One number chooses both
/// the entry and which of its two owners is drawn.
struct AliasTable {
    entries: Vec<(f32, u32)>,
}

impl AliasTable {
    fn new(weights: &[f64]) -> Self {
        let scale = weights.len() as f64 / weights.iter().sum::<f64>();
        let mut shares: Vec<f64> = weights.iter().map(|w| w * scale).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..weights.len()).partition(|&i| shares[i] < 1.0);
        let mut entries = vec![(1.0, 0); weights.len()];
        while let (Some(&poor), Some(&rich)) = (small.last(), large.last()) {
            small.pop();
            entries[poor] = (shares[poor] as f32, rich as u32);
            shares[rich] -= 1.0 - shares[poor];
            if shares[rich] < 1.0 {
                small.extend(large.pop());
            }
        }
        Self { entries }
    }

    fn sample(&self, u: f32) -> u32 {
        let scaled = u * self.entries.len() as f32;
        let index = (scaled as usize).min(self.entries.len() - 1);
        let (share, alias) = self.entries[index];
        if scaled - (index as f32) < share {
            index as u32
        } else {
            alias
        }
    }
}

/// Prints the ns per point of each set in two and six dimensions, made many at a time.
fn measure_point_sets() {
    for dimensions in [2, 6] {
        for set in PointSet::ALL {
            let count = 4096;
            let make = || set.points(black_box(count), dimensions, Some(1));
            let Some(points) = make() else { continue };
            let best = (0..7)
                .map(|_| {
                    let start = Instant::now();
                    black_box(make());
                    start.elapsed().as_secs_f64() * 1e9 / points.len() as f64
                })
                .fold(f64::INFINITY, f64::min);
            println!(
                "{:48} {best:8.2} ns",
                format!("point of {} in {dimensions}-D", set.name())
            );
        }
    }
}

fn main() {
    let seed = black_box(7);
    measure_point_sets();
    for sampler in PixelSampler::ALL {
        measure(
            &format!(
                "place in the pixel, choice and point on the light for 8 pixels, {}",
                sampler.name()
            ),
            |i| {
                let pixels = std::array::from_fn(|k| [(i & 1023) + k as u32, 5]);
                sampler.numbers::<5, 8>(u64::from(i & 1), &pixels, 1024, i >> 10, 0)
            },
        );
    }
    measure("counter-based number", |i| Random::new(seed, i >> 6, i & 63).u32(3));
    measure("first vertex: pixel 2, choice 1, point 2", |i| {
        let v = PixelSequence::new(seed, i >> 6, i & 63).vertex(0);
        (v.vec2(0), v.u32(2), v.vec2(3))
    });
    measure("the same from independent numbers", |i| {
        let v = Random::new(seed, i >> 6, i & 63);
        (v.vec2(0), v.u32(2), v.vec2(3))
    });
    measure("later vertex: choice 1, point 2, BSDF 3", |i| {
        let v = PixelSequence::new(seed, i >> 6, i & 63).vertex(2);
        (v.u32(2), v.vec2(3), v.f32(5), v.vec2(6))
    });
    measure("one Sobol' number", |i| {
        PixelSequence::new(seed, 3, i & 63).vertex(0).u32(2)
    });

    for entries in [1, 64, 1000, 30_000, 1_000_000] {
        let distribution = distribution(entries);
        let random = Random::new(seed, 0, 0);
        measure(&format!("number and draw among {entries}"), |i| {
            distribution.sample(random.u32(i))
        });
        let table = AliasTable::new(&weights(entries));
        measure(&format!("number and draw from an alias table of {entries}"), |i| {
            table.sample(random.f32(i))
        });
    }
    let weights: Vec<f64> = (0..1_000_000).map(f64::from).collect();
    let mut distribution = distribution(1_000_000);
    let start = Instant::now();
    assert!(distribution.set(black_box(&weights), 0.005));
    println!(
        "{:48} {:8.2} ms",
        "rebuild of 1000000 entries",
        start.elapsed().as_secs_f64() * 1e3
    );

    let unit = |i: u32| {
        Vec2::new(
            unit_f32(i.wrapping_mul(0x9e37_79b9)),
            unit_f32(i.wrapping_mul(0x6a09_e667)),
        )
    };
    measure("two cheap numbers (part of those below)", unit);
    let at = |i: u32| Vec3::new(1.0, 2.0, 3.0) + unit(i).extend(0.0);
    measure("spherical triangle, solid angle", |i| {
        SphericalTriangle::new(at(i), at(i) + Vec3::X, at(i) + Vec3::Y)
    });
    measure("spherical triangle, with a sample", |i| {
        SphericalTriangle::new(at(i), at(i) + Vec3::X, at(i) + Vec3::Y).map(|t| t.sample(unit(i)))
    });
    measure("spherical rectangle, with a sample", |i| {
        SphericalRectangle::new(at(i), Vec3::X, Vec3::Y).map(|r| r.sample(unit(i)))
    });
    let wo = Vec3::new(0.6, 0.0, 0.8);
    measure("cosine hemisphere in a frame", |i| {
        let normal = Vec3::new(0.0, 0.6, 0.8);
        Frame::new(black_box(normal)).to_world(hemisphere::cosine_hemisphere(unit(i)))
    });
    measure("GGX visible normal and its density", |i| {
        let h = ggx::sample_vndf(wo, 0.2, unit(i));
        (h, ggx::pdf_vndf(wo, h, 0.2))
    });
}
