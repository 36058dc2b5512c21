//! Which states of the scene and which cameras a scenario goes through.

use super::Scenario;
use crate::session;
use anyhow::{Result, bail};
use glam::Vec3;
use light_cache::SamplerKind;
use render::{Method, Settings};
use scene::{Camera, LightKind, LightSource, Scene, SceneParts};
use std::collections::BTreeMap;

/// A lamp that is off still shines with this share of its light: a lamp without any would be no light at all, and the
/// scenes before and after would not have the same lights.
const OFF: f32 = 1e-4;
/// Metres between two frames of a walk.
const STRIDE: f32 = 0.15;
/// The walker looks at a point so many metres ahead.
const LOOK_AHEAD: f32 = 1.5;
/// Frames of `adaptive` that tell which lamp gives the most light.
const PROBE_FRAMES: usize = 8;

/// A scenario on one scene.
pub(super) struct Plan {
    pub(super) states: Vec<Scene>,
    pub(super) views: Vec<Camera>,
    /// State and view of each frame.
    pub(super) frames: Vec<(usize, usize)>,
    /// Frames before the scene changes at once; 0 if it does not.
    pub(super) before: usize,
    /// What changes, for people.
    pub(super) change: String,
}

impl Plan {
    /// A walk along a camera path.
    ///
    /// # Errors
    /// Scenes that cannot be loaded.
    pub(super) fn along(what: &str, views: &[Camera]) -> Result<Self> {
        let eye = |view: &Camera| view.world_from_camera.translation;
        let length: f32 = views.windows(2).map(|step| eye(&step[0]).distance(eye(&step[1]))).sum();
        Ok(Self {
            states: vec![session::load_with_warnings(what)?.scene],
            frames: (0..views.len()).map(|view| (0, view)).collect(),
            before: 0,
            change: format!("{} frames of a camera path of {length:.1} m", views.len()),
            views: views.to_vec(),
        })
    }

    /// `frames` frames of a walk, or before and after a change each.
    ///
    /// # Errors
    /// Bad input; scenes that the scenario does not fit.
    pub(super) fn new(
        scenario: Scenario,
        what: &str,
        camera: Option<&str>,
        settings: &Settings,
        frames: usize,
    ) -> Result<Self> {
        let scene = session::load_with_warnings(what)?.scene;
        let camera = session::camera(&scene, camera)?.clone();
        let demo = what.strip_prefix("demo:").unwrap_or("none");
        if scenario == Scenario::Walk {
            let way = scene::generate::walk(demo)?;
            let views = walk(&way, &camera, frames);
            let length = STRIDE * views.len().saturating_sub(1) as f32;
            return Ok(Self {
                states: vec![scene],
                frames: (0..views.len()).map(|view| (0, view)).collect(),
                before: 0,
                change: format!("{} frames on a walk of {length:.1} m", views.len()),
                views,
            });
        }
        let (changed, change) = match scenario {
            Scenario::Door => (
                Scene::new(scene::generate::shut(demo)?)?,
                "a door is shut, then opened".to_string(),
            ),
            _ => {
                let lamp = brightest_lamp(&scene, &camera, settings)?;
                let name = scene.light_source(lamp[0]).node;
                let change = format!("{} lights of '{name}' are off, then switched on", lamp.len());
                (Scene::new(switched_off(&scene, &lamp))?, change)
            }
        };
        if changed.lights.len() != scene.lights.len() {
            bail!("{what}: the lights before and after the change are not the same; try another scene");
        }
        Ok(Self {
            states: vec![changed, scene],
            views: vec![camera],
            frames: [(0, 0), (1, 0)]
                .into_iter()
                .flat_map(|state| vec![state; frames])
                .collect(),
            before: frames,
            change,
        })
    }
}

/// Cameras at equal steps along `way`, as many as asked for or as it has room for; they look ahead along it. The angle of
/// view is that of `camera`.
fn walk(way: &[Vec3], camera: &Camera, frames: usize) -> Vec<Camera> {
    let length: f32 = way.windows(2).map(|step| step[0].distance(step[1])).sum();
    let places = (0..frames).map(|frame| frame as f32 * STRIDE);
    let places = places.take_while(|at| at + LOOK_AHEAD <= length);
    let camera = |at: f32| {
        let (eye, ahead) = (along(way, at), along(way, at + LOOK_AHEAD));
        Camera::look_at("walk", eye, ahead, Vec3::Y, camera.fov_y)
    };
    places.map(camera).collect()
}

/// The point `at` metres along `way`, its end if it is not that long.
fn along(way: &[Vec3], mut at: f32) -> Vec3 {
    for step in way.windows(2) {
        let length = step[0].distance(step[1]);
        if at < length {
            return step[0].lerp(step[1], at / length);
        }
        at -= length;
    }
    way.last().copied().unwrap_or_default()
}

/// The lights of the node that gives the image the most light.
fn brightest_lamp(scene: &Scene, camera: &Camera, settings: &Settings) -> Result<Vec<u32>> {
    let settings = Settings {
        method: Method::Sampled(SamplerKind::Adaptive),
        record_lights: true,
        max_bounces: 0,
        ..settings.clone()
    };
    let mut probe = session::start(scene, camera, &settings)?;
    (0..PROBE_FRAMES).for_each(|_| probe.render_frame());
    let mut lamps: BTreeMap<String, (f64, Vec<u32>)> = BTreeMap::new();
    for (light, record) in (0..).zip(probe.light_records()) {
        let LightSource { node, .. } = scene.light_source(light);
        let lamp = lamps.entry(node).or_default();
        lamp.0 += record.mean_contribution;
        lamp.1.push(light);
    }
    match lamps.into_values().max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, lights)) => Ok(lights),
        None => bail!("{}: no lights to switch", scene.parts.name),
    }
}

/// The scene with the lights `off` dimmed to [`OFF`].
fn switched_off(scene: &Scene, off: &[u32]) -> SceneParts {
    let mut parts = scene.parts.clone();
    // One dimmed copy of each material that is on.
    let mut dimmed: BTreeMap<u32, u32> = BTreeMap::new();
    for &light in off {
        let light = &scene.lights[light as usize];
        if light.kind == LightKind::Triangle {
            let mesh = parts.instances[light.primitive.instance as usize].mesh;
            let slot = &mut parts.meshes[mesh as usize].materials[light.primitive.triangle as usize];
            let materials = &mut parts.materials;
            *slot = *dimmed.entry(*slot).or_insert_with_key(|&material| {
                let mut copy = materials[material as usize].clone();
                copy.emission *= OFF;
                materials.push(copy);
                materials.len() as u32 - 1
            });
        } else {
            let same = |l: &scene::Light| l.kind == light.kind && l.position_ws == light.position_ws;
            for (light, _) in parts.punctual.iter_mut().filter(|(l, _)| same(l)) {
                light.intensity *= OFF;
                light.power *= OFF;
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_goes_in_equal_steps_and_stays_on_its_way() {
        let way = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 0.0, 5.05)];
        let camera = Camera::look_at("c", Vec3::ZERO, Vec3::X, Vec3::Y, 0.7);
        let views = walk(&way, &camera, 10_000);
        assert_eq!(views.len(), ((6.05 - LOOK_AHEAD) / STRIDE) as usize + 1);
        let eyes: Vec<Vec3> = views.iter().map(|v| v.world_from_camera.translation.into()).collect();
        assert!(eyes.windows(2).all(|step| step[0].distance(step[1]) <= STRIDE * 1.001));
        assert!(eyes.iter().all(|eye| eye.z == 0.0 || (eye.x - 1.0).abs() < 1e-5));
        assert_eq!(walk(&way, &camera, 3).len(), 3);
    }

    #[test]
    fn switching_changes_no_other_light() {
        for what in ["rooms:64", "points:64"] {
            let scene = scene::load(&format!("demo:{what}")).expect("a known scene");
            let off = [3, 7];
            let dark = Scene::new(switched_off(&scene, &off)).expect("still valid");
            assert_eq!(dark.lights.len(), scene.lights.len());
            for (index, (a, b)) in (0..).zip(scene.lights.iter().zip(&dark.lights)) {
                let share = b.power / a.power;
                let expected = if off.contains(&index) { OFF } else { 1.0 };
                assert!((share / expected - 1.0).abs() < 1e-3, "{what} {index}: {share}");
                assert_eq!(a.center_ws(), b.center_ws());
            }
        }
    }
}
