//! What is at a pixel: surface, material, and the lights that matter there.

use super::renderer::shading_point;
use glam::{Vec2, Vec3};
use light_cache::ShadingPoint;
use render::FrameLoop;
use scene::{Camera, LightKind, PrimitiveId, Ray, Scene, Surface};

/// Lights that are listed.
const TOP: usize = 10;

/// A pixel and what is there.
#[derive(Clone, Debug)]
pub(super) struct Inspection {
    /// Metres from the camera.
    pub(super) distance: f32,
    pub(super) position_ws: Vec3,
    pub(super) normal_ws: Vec3,
    pub(super) material: String,
    pub(super) albedo: Vec3,
    pub(super) roughness: f32,
    /// Radiance that it emits itself.
    pub(super) emitted: Vec3,
    /// The light that it is, if it is one.
    pub(super) light: Option<u32>,
    /// The most probable lights; empty where lights are not chosen.
    pub(super) lights: Vec<LightHere>,
    /// Lights that take half of the samples here, at least.
    pub(super) half_of_samples: usize,
    /// The cell that serves the point, if one does.
    pub(super) cell: Option<CellHere>,
}

/// What the cell of a point is like.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellHere {
    pub(super) number: u64,
    /// Edge, metres.
    pub(super) size_m: f32,
    /// Where its normals point, such as "+y".
    pub(super) normal: &'static str,
    /// Lights and clusters of lights that it tells apart.
    pub(super) entries: usize,
    /// Observations that it rests on.
    pub(super) samples: u64,
    /// Frames since it was made.
    pub(super) age: u64,
}

impl CellHere {
    fn at(point: &ShadingPoint, frames: &dyn FrameLoop<'_>) -> Option<Self> {
        let number = frames.cells_at(&[*point]).into_iter().flatten().next()?;
        let entries: Vec<_> = frames
            .cells()
            .into_iter()
            .filter(|entry| entry.cell == number)
            .collect();
        entries.first().map(|first| Self {
            number,
            size_m: first.size_m,
            normal: first.normal,
            entries: entries.len(),
            samples: entries.iter().map(|entry| entry.samples).sum(),
            age: first.age,
        })
    }
}

/// A light as a point sees it.
#[derive(Clone, Debug)]
pub(super) struct LightHere {
    pub(super) light: u32,
    pub(super) name: String,
    /// With which it is drawn here.
    pub(super) probability: f64,
    /// Whether its centre is in sight.
    pub(super) visible: bool,
    /// A point that stands for it; `None` if it is infinitely far away.
    pub(super) position_ws: Option<Vec3>,
}

/// Looks through the pixel at the share `at` of a window of `window` pixels; `None` if nothing is there.
pub(super) fn inspect(
    scene: &Scene,
    camera: &Camera,
    window: (u32, u32),
    at: Vec2,
    frames: &dyn FrameLoop<'_>,
) -> Option<Inspection> {
    let rays = camera.rays(window.0.max(1), window.1.max(1));
    let ray = Ray {
        origin_ws: rays.origin_ws,
        direction_ws: rays.direction_ws(at * Vec2::new(window.0 as f32, window.1 as f32)),
        t_max: f32::INFINITY,
    };
    let hit = scene.nearest(&ray, PrimitiveId::NONE)?;
    let surface = scene.surface(&ray, &hit);
    let point = shading_point(scene, &ray, &hit);
    let mut probabilities: Vec<(u32, f64)> = (0..)
        .zip(frames.light_probabilities(&[point]))
        .filter(|(_, probability)| *probability > 0.0)
        .collect();
    probabilities.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let mut sum = 0.0;
    let before_half = probabilities.iter().take_while(|(_, probability)| {
        sum += probability;
        sum < 0.5
    });
    let half_of_samples = (before_half.count() + 1).min(probabilities.len());
    let lights = probabilities.iter().take(TOP);
    Some(Inspection {
        distance: hit.t,
        position_ws: surface.position_ws,
        normal_ws: surface.bsdf.normal_ws,
        material: scene.parts.materials[surface.material as usize].name.clone(),
        albedo: surface.bsdf.diffuse + surface.bsdf.f0,
        roughness: surface.bsdf.alpha.sqrt(),
        emitted: surface.emitted,
        light: (surface.light != scene::surface::NO_LIGHT).then_some(surface.light),
        lights: lights
            .map(|&(light, p)| light_here(scene, &surface, light, p))
            .collect(),
        half_of_samples,
        cell: CellHere::at(&point, frames),
    })
}

fn light_here(scene: &Scene, surface: &Surface, light: u32, probability: f64) -> LightHere {
    let record = &scene.lights[light as usize];
    let source = scene.light_source(light);
    let far = record.kind == LightKind::Directional;
    let towards = if far {
        -record.normal_ws
    } else {
        record.center_ws() - surface.position_ws
    };
    let distance = if far {
        f32::INFINITY
    } else {
        towards.length() * (1.0 - 1e-4)
    };
    let visible = towards.try_normalize().is_some_and(|wi_ws| {
        let ray = scene.ray_from(surface, wi_ws, distance);
        surface.geometric_normal_ws.dot(wi_ws) > 0.0 && !scene.occluded(&ray, surface.id, record.primitive)
    });
    LightHere {
        light,
        name: source.node,
        probability,
        visible,
        position_ws: (!far).then(|| record.center_ws()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use render::{Settings, renderer};
    use scene::generate;

    #[test]
    fn a_pixel_tells_its_surface_and_the_lights_that_matter_there() {
        let scene = Scene::new(generate::demo("rooms:64").expect("a known scene")).expect("valid");
        let camera = &scene.parts.cameras[0];
        let settings = Settings {
            width: 64,
            height: 48,
            ..Settings::default()
        };
        let mut frames = renderer(&scene, camera, &settings).expect("valid settings");
        (0..8).for_each(|_| frames.render_frame());
        let found = inspect(&scene, camera, (64, 48), Vec2::new(0.5, 0.9), frames.as_ref()).expect("a floor");
        assert!(found.distance > 0.0 && found.position_ws.is_finite() && !found.material.is_empty());
        assert!((found.normal_ws.length() - 1.0).abs() < 1e-4);
        assert_eq!(found.lights.len(), TOP);
        assert!(found.lights.is_sorted_by(|a, b| a.probability >= b.probability));
        let listed: f64 = found.lights.iter().map(|light| light.probability).sum();
        assert!(listed > 0.0 && listed <= 1.0 + 1e-6, "{listed}");
        assert!((1..=64).contains(&found.half_of_samples));
        let cell = found.cell.expect("eight frames make cells");
        assert!(
            cell.size_m > 0.0 && cell.entries > 0 && cell.samples > 0 && cell.normal == "+y",
            "{cell:?}"
        );
    }

    #[test]
    fn exact_chooses_no_lights_and_the_void_has_no_surface() {
        let scene = Scene::new(generate::demo("one-light").expect("a known scene")).expect("valid");
        let camera = &scene.parts.cameras[0];
        let settings = Settings {
            width: 8,
            height: 8,
            method: render::Method::Exact,
            ..Settings::default()
        };
        let frames = renderer(&scene, camera, &settings).expect("valid settings");
        let found = inspect(&scene, camera, (8, 8), Vec2::splat(0.5), frames.as_ref());
        assert!(found.is_none_or(|found| found.lights.is_empty()));
        let up = Camera::look_at("up", Vec3::Y * 1e4, Vec3::Y * 2e4, Vec3::X, 1.0);
        assert!(inspect(&scene, &up, (8, 8), Vec2::splat(0.5), frames.as_ref()).is_none());
    }
}
