//! Scenes with many lights, made from (name, number of lights, seed): the same bits on every machine.
//!
//! A light is a light record: an emissive triangle or a point light. A rectangular lamp is two; where the number asked
//! for is odd, one rectangle is cut in three. Every scene has exactly as many lights as asked for.

mod builder;
mod building;
mod city;
mod city_house;
mod city_street;
mod dice;
mod fixtures;
mod furnish;
mod furniture;
mod keyhole;
mod lamps;
mod one_light;
mod plaza;
mod plaza_town;
mod rooms;
mod spheres;

use crate::{SceneError, SceneParts};
use glam::Vec3;
use lamps::Source;
use std::ops::RangeInclusive;

/// A family of generated scenes.
struct Family {
    name: &'static str,
    shows: &'static str,
    lights: RangeInclusive<usize>,
    default: usize,
    make: fn(usize, u32) -> SceneParts,
    /// The same with a door shut, where there is one.
    shut: Option<fn(usize, u32) -> SceneParts>,
    /// Where the eye of a walker passes, where there is something to walk through.
    walk: Option<fn(usize, u32) -> Vec<Vec3>>,
}

const MANY: RangeInclusive<usize> = 16..=1_000_000;

const FAMILIES: &[Family] = &[
    Family {
        name: "rooms",
        shows: "a building of many rooms with ceiling lamps and furniture; most lights are hidden",
        lights: MANY,
        default: 2048,
        make: |lights, seed| rooms::rooms("rooms", lights, seed, Source::Panels),
        shut: Some(|lights, seed| rooms::rooms_shut("rooms", lights, seed, Source::Panels)),
        walk: Some(rooms::walk),
    },
    Family {
        name: "points",
        shows: "the same building, lit by point lights",
        lights: MANY,
        default: 2048,
        make: |lights, seed| rooms::rooms("points", lights, seed, Source::Points),
        shut: Some(|lights, seed| rooms::rooms_shut("points", lights, seed, Source::Points)),
        walk: Some(rooms::walk),
    },
    Family {
        name: "plaza",
        shows: "a night market: thousands of small lights over three decades of power",
        lights: MANY,
        default: 4096,
        make: plaza::plaza,
        shut: None,
        walk: None,
    },
    Family {
        name: "sun-outside",
        shows: "rooms, and one light a thousand times stronger that never reaches the image",
        lights: MANY,
        default: 2048,
        make: rooms::sun_outside,
        shut: None,
        walk: Some(|lights, seed| rooms::walk(lights - 1, seed)),
    },
    Family {
        name: "city",
        shows: "a town at night, house after house, from inside one room or from above; most of it never seen",
        lights: MANY,
        default: 4096,
        make: city::city,
        shut: None,
        walk: None,
    },
    Family {
        name: "keyhole",
        shows: "a room lit only through a narrow gap",
        lights: MANY,
        default: 1024,
        make: keyhole::keyhole,
        shut: Some(keyhole::keyhole_shut),
        walk: None,
    },
    Family {
        name: "spheres",
        shows: "glossy materials under many lights",
        lights: MANY,
        default: 1024,
        make: spheres::spheres,
        shut: None,
        walk: None,
    },
    Family {
        name: "one-light",
        shows: "a single light, for checks",
        lights: 1..=1,
        default: 1,
        make: |_, seed| one_light::one_light(seed),
        shut: None,
        walk: None,
    },
];

/// The names of the generated scenes, in the order in which they are worth looking at.
pub fn names() -> impl Iterator<Item = &'static str> {
    FAMILIES.iter().map(|family| family.name)
}

/// The names of the generated scenes, each with a line that tells what it shows.
pub fn families() -> impl Iterator<Item = (&'static str, &'static str)> {
    FAMILIES.iter().map(|family| (family.name, family.shows))
}

/// Makes the scene named by `what` = `NAME[:LIGHTS[:SEED]]`. It has exactly LIGHTS lights; without LIGHTS, a number
/// that suits the scene; without SEED, seed 0.
///
/// # Errors
/// [`SceneError::Demo`] for an unknown name or a number of lights outside 16..=1,000,000 (1 for `one-light`).
pub fn demo(what: &str) -> Result<SceneParts, SceneError> {
    let (family, lights, seed) = parse(what)?;
    Ok((family.make)(lights, seed))
}

/// The scene of [`demo`] with a door shut through which the camera gets light: the same lights in the same order.
///
/// # Errors
/// Those of [`demo`], and [`SceneError::Demo`] for a scene without such a door.
pub fn shut(what: &str) -> Result<SceneParts, SceneError> {
    let (family, lights, seed) = parse(what)?;
    let shut = family.shut.ok_or_else(|| {
        let known = FAMILIES.iter().filter(|family| family.shut.is_some());
        error(what, "there is no door to shut".into(), known)
    })?;
    Ok(shut(lights, seed))
}

/// A walk through the scene of [`demo`], from its camera's place on: points at the height of the eye, joined by straight
/// lines.
///
/// # Errors
/// Those of [`demo`], and [`SceneError::Demo`] for a scene without rooms to walk through.
pub fn walk(what: &str) -> Result<Vec<Vec3>, SceneError> {
    let (family, lights, seed) = parse(what)?;
    let walk = family.walk.ok_or_else(|| {
        let known = FAMILIES.iter().filter(|family| family.walk.is_some());
        error(what, "there are no rooms to walk through".into(), known)
    })?;
    Ok(walk(lights, seed))
}

fn error<'f>(what: &str, problem: String, known: impl Iterator<Item = &'f Family>) -> SceneError {
    SceneError::Demo {
        name: what.into(),
        problem,
        known: known.map(|family| family.name).collect::<Vec<_>>().join(", "),
    }
}

/// Family, number of lights and seed.
fn parse(what: &str) -> Result<(&'static Family, usize, u32), SceneError> {
    let mut fields = what.split(':');
    let name = fields.next().unwrap_or_default();
    let error = |problem: String| error(what, problem, FAMILIES.iter());
    let family = FAMILIES
        .iter()
        .find(|family| family.name == name)
        .ok_or_else(|| error(format!("there is no generated scene '{name}'")))?;
    let lights = match fields.next() {
        None => family.default,
        Some(field) => field
            .parse()
            .map_err(|_| error(format!("'{field}' is no number of lights")))?,
    };
    if !family.lights.contains(&lights) {
        let (least, most) = (family.lights.start(), family.lights.end());
        return Err(error(format!(
            "{lights} lights asked for, {least} to {most} can be made"
        )));
    }
    let seed = match fields.next() {
        None => 0,
        Some(field) => field
            .parse()
            .map_err(|_| error(format!("'{field}' is no seed (0 to 4294967295)")))?,
    };
    if let Some(rest) = fields.next() {
        return Err(error(format!(
            "'{rest}' is one field too many, NAME[:LIGHTS[:SEED]] is read"
        )));
    }
    Ok((family, lights, seed))
}

#[cfg(test)]
mod tests;
