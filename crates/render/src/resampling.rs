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
        let Some((kept, pmf)) = keep(&choices, &connections, vertex.candidates, unit_f32(numbers.choice)) else {
            if S::LEARNS {
                log.observations.push(observation(vertex, *any, None, false));
            }
            continue;
        };
        let (Some(choice), Some(connection)) = (choices[kept], &connections[kept]) else {
            continue;
        };
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

/// Keeps one of `count` candidates in proportion to its reflected share, by the number `u`; with it, the probability by which what it adds is to be
/// divided. `None` if none is reflected.
fn keep(
    choices: &Candidates<Choice>,
    connections: &Candidates<Connection>,
    count: u32,
    u: f32,
) -> Option<(usize, f32)> {
    let shares = connections
        .each_ref()
        .map(|c| c.as_ref().map_or(0.0, Connection::reflected_share));
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
    let kept = kept?;
    Some((kept, choices[kept]?.pmf * (count as f32 * (shares[kept] / total))))
}
