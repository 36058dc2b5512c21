//! Resampling at glossy surfaces: of a few lights drawn by the sampler one is kept, in proportion to how it is reflected.
//!
//! Talbot, Cline and Egbert 2005, "Importance Resampling for Global Illumination": candidates from a distribution that is easy to draw
//! from, kept in proportion to a target that is not. Samplers know what arrives at a point, visibility included, not how it is reflected.
//! The target is their probability times the reflected share, the multiple-importance weight included: the whole unshadowed
//! contribution in its place would bring back the strong hidden lights that the sampler has learned to leave alone (in rooms,
//! after 128 frames: four times the error). Only the one that is kept is worth a shadow ray.
//!
//! Differs: the candidates are stratified, one in each equal part of the sampler's range, and the number that would have drawn a light
//! keeps one of them. Where all are reflected alike it keeps the part that it lies in, so its stratification lasts. The estimate stays
//! unbiased: each part is drawn from by one candidate, and the parts make up the whole.

use crate::direct::{Connection, Direct, LightNumbers, Vertex, observation};
use crate::path::{Probe, TileLog};
use crate::settings::MAX_CANDIDATES;
use glam::{Vec2, Vec3};
use light_cache::{Choice, LightSampler};
use sampling::hash::{hash2, hash3};
use sampling::unit_f32;
use scene::Scene;

/// Candidates of one light sample; those past the number in use are `None`.
type Candidates<T> = [Option<T>; MAX_CANDIDATES as usize];

/// The direct light at `vertex`: the mean of as many samples as there are `numbers`, each one of several that were compared.
pub(crate) fn estimate<S: LightSampler>(
    sampler: &S,
    scene: &Scene,
    local: &S::Local<'_>,
    vertex: &Vertex<'_>,
    numbers: &[LightNumbers],
    log: &mut TileLog<'_>,
    probe: &mut impl Probe,
) -> Direct {
    let count = numbers.len() as f32;
    let mut direct = Direct {
        radiance: Vec3::ZERO,
        control: Vec3::ZERO,
        light: None,
    };
    for numbers in numbers {
        let choices = candidates(sampler, local, vertex.candidates, numbers);
        let Some(any) = choices.iter().flatten().next() else {
            continue;
        };
        let on_light = Vec2::from(numbers.point.map(unit_f32));
        let tried = count * vertex.candidates as f32;
        let connections: Candidates<Connection> =
            choices.map(|choice| choice.and_then(|c| Connection::new(scene, vertex, c.light, tried * c.pmf, on_light)));
        let shares = connections
            .each_ref()
            .map(|c| c.as_ref().map_or(0.0, Connection::reflected_share));
        let Some((kept, times_mean)) = keep(&shares, vertex.candidates, unit_f32(numbers.choice)) else {
            if S::LEARNS {
                log.observations.push(observation(vertex, *any, None, false));
            }
            continue;
        };
        let (Some(choice), Some(connection)) = (choices[kept], &connections[kept]) else {
            continue;
        };
        // The target is pmf x share: an estimate of the mean share, over the share of the one that is kept.
        let pmf = choice.pmf * times_mean;
        let visible = connection.is_visible(scene, vertex, log, probe);
        if S::LEARNS {
            let kept = Choice { pmf, ..choice };
            log.observations
                .push(observation(vertex, kept, Some(connection), visible));
        }
        if visible {
            direct.radiance += connection.contribution(count * pmf);
        }
        direct.light = direct.light.or(Some(choice.light));
    }
    direct
}

/// One light from each of `count` equal parts of the sampler's range.
fn candidates<S: LightSampler>(
    sampler: &S,
    local: &S::Local<'_>,
    count: u32,
    numbers: &LightNumbers,
) -> Candidates<Choice> {
    let mut us = [0; MAX_CANDIDATES as usize];
    let us = &mut us[..count as usize];
    // Of its own for every candidate, and fixed by the numbers of the sample.
    let salt = hash3(numbers.choice, numbers.point[0], numbers.point[1]);
    for (part, u) in (0..).zip(us.iter_mut()) {
        let within = hash2(salt, part);
        *u = ((u64::from(part) << 32 | u64::from(within)) / u64::from(count)) as u32;
    }
    let mut choices = [None; MAX_CANDIDATES as usize];
    sampler.sample_each(local, us, &mut choices[..count as usize]);
    choices
}

/// Keeps one of `count` candidates in proportion to its share, by the number `u`; with it, how many times its own share is of the mean.
/// `None` if all shares are zero.
fn keep(shares: &[f32; MAX_CANDIDATES as usize], count: u32, u: f32) -> Option<(usize, f32)> {
    let total: f32 = shares.iter().sum();
    if !(total > 0.0 && total < f32::INFINITY) {
        return None;
    }
    let mut rest = u * total;
    let mut kept = None;
    for (index, &share) in shares.iter().enumerate() {
        // The last one that is reflected takes what rounding leaves.
        if share > 0.0 {
            kept = Some(index);
            if rest < share {
                break;
            }
            rest -= share;
        }
    }
    kept.map(|index| (index, count as f32 * (shares[index] / total)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::Random;

    /// Drawn `1 << 16` times evenly: frequencies are off by less than 8 in 65,536.
    #[test]
    fn what_is_kept_and_weighed_is_the_mean_of_all() {
        for round in 0..200 {
            let random = Random::new(7, round, 0);
            let count = 1 + random.u32(0) % MAX_CANDIDATES;
            let mut shares = [0.0; MAX_CANDIDATES as usize];
            for (k, share) in (0..count).zip(&mut shares) {
                *share = (random.f32(1 + k) - 0.3).max(0.0) * 10.0_f32.powi(round as i32 % 7 - 3);
            }
            let mut kept = [0_u32; MAX_CANDIDATES as usize];
            for i in 0..1 << 16 {
                let Some((index, times_mean)) = keep(&shares, count, i as f32 / 65_536.0) else {
                    assert_eq!(shares.iter().sum::<f32>(), 0.0);
                    continue;
                };
                kept[index] += 1;
                let mean = shares.iter().sum::<f32>() / count as f32;
                assert!((times_mean - shares[index] / mean).abs() < 1e-4 * times_mean);
            }
            let total = shares.iter().sum::<f32>().max(f32::MIN_POSITIVE);
            for (share, kept) in shares.iter().zip(kept) {
                assert!(
                    (share / total * 65_536.0 - kept as f32).abs() < 8.0,
                    "{shares:?} {kept}"
                );
            }
        }
    }

    #[test]
    fn alike_candidates_keep_the_strata() {
        let shares = [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        for i in 0..64 {
            assert_eq!(keep(&shares, 4, i as f32 / 64.0), Some((i / 16, 1.0)));
        }
    }
}
