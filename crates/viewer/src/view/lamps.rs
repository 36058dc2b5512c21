//! The lights of a scene as people see them: lamps, which are all lights of one node.

use glam::Vec3;
use scene::{LightKind, Scene, luminance};
use std::collections::BTreeMap;

/// A lamp that is off still shines with this share of its light: a lamp without any would be no light at all, and the
/// scenes before and after would not have the same lights.
const OFF: f32 = 1e-4;

/// All lights of one node.
#[derive(Clone, Debug)]
pub(super) struct Lamp {
    pub(super) name: String,
    pub(super) lights: Vec<u32>,
    pub(super) kind: LightKind,
    /// Watts or lumens, as the scene has it.
    pub(super) power: f64,
    /// Mean of its lights' centres; `None` if infinitely far away.
    pub(super) position_ws: Option<Vec3>,
    /// Its colour, the largest channel 1.
    pub(super) color: Vec3,
    /// What the user has made of it: factor per channel, 0 for off.
    pub(super) factor: Vec3,
    /// Its share of all draws; `None` if not known.
    pub(super) importance: Option<f64>,
}

/// The lamps of `scene`, the most powerful first.
pub(super) fn lamps(scene: &Scene) -> Vec<Lamp> {
    let mut by_name: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for light in 0..scene.lights.len() as u32 {
        by_name.entry(scene.light_source(light).node).or_default().push(light);
    }
    let mut lamps: Vec<Lamp> = by_name
        .into_iter()
        .map(|(name, lights)| lamp(scene, name, lights))
        .collect();
    lamps.sort_by(|a, b| b.power.total_cmp(&a.power));
    lamps
}

fn lamp(scene: &Scene, name: String, lights: Vec<u32>) -> Lamp {
    let records = lights.iter().map(|&light| &scene.lights[light as usize]);
    let near = records.clone().filter(|light| light.kind != LightKind::Directional);
    let count = near.clone().count();
    let center = near.map(|light| light.center_ws()).sum::<Vec3>() / count.max(1) as f32;
    let intensity: Vec3 = records.clone().map(|light| light.intensity).sum();
    Lamp {
        name,
        kind: scene.lights[lights[0] as usize].kind,
        power: records.map(|light| f64::from(light.power)).sum(),
        position_ws: (count > 0).then_some(center),
        color: intensity / intensity.max_element(),
        factor: Vec3::ONE,
        importance: None,
        lights,
    }
}

impl Lamp {
    /// Whether the user has changed it.
    pub(super) fn is_changed(&self) -> bool {
        self.factor != Vec3::ONE
    }

    /// Whether it shines.
    pub(super) fn is_on(&self) -> bool {
        luminance(self.factor) > 0.0
    }
}

/// What the user has changed, light by light.
pub(super) fn factors(lamps: &[Lamp]) -> Vec<(u32, Vec3)> {
    let changed = lamps.iter().filter(|lamp| lamp.is_changed());
    let lights = changed.flat_map(|lamp| {
        lamp.lights
            .iter()
            .map(|&light| (light, lamp.factor.max(Vec3::splat(OFF))))
    });
    lights.collect()
}

/// Enters what is known of the probability of each light.
pub(super) fn set_importance(lamps: &mut [Lamp], probabilities: &[f64]) {
    for lamp in lamps {
        let known = lamp.lights.iter().map(|&light| probabilities.get(light as usize));
        lamp.importance = known.sum::<Option<f64>>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::generate;

    #[test]
    fn every_light_belongs_to_one_lamp_and_changes_with_it() {
        for name in ["rooms:64", "points:64", "sun-outside:64"] {
            let scene = Scene::new(generate::demo(name).expect("a known scene")).expect("valid");
            let mut lamps = lamps(&scene);
            let mut seen: Vec<u32> = lamps.iter().flat_map(|lamp| lamp.lights.clone()).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..scene.lights.len() as u32), "{name}");
            assert!(lamps.is_sorted_by(|a, b| a.power >= b.power));
            assert!(factors(&lamps).is_empty());
            lamps[1].factor = Vec3::ZERO;
            let factors = factors(&lamps);
            assert_eq!(factors.len(), lamps[1].lights.len());
            assert!(factors.iter().all(|(_, factor)| factor.min_element() > 0.0));
            let uniform = vec![1.0 / scene.lights.len() as f64; scene.lights.len()];
            set_importance(&mut lamps, &uniform);
            let sum: f64 = lamps.iter().filter_map(|lamp| lamp.importance).sum();
            assert!((sum - 1.0).abs() < 1e-9);
            set_importance(&mut lamps, &[]);
            assert!(lamps.iter().all(|lamp| lamp.importance.is_none()));
        }
    }
}
