//! The same scene under other light: lamps dimmed, brightened or coloured while somebody looks on.

use crate::shading::MaterialRecord;
use crate::{Light, LightKind, Scene, luminance};
use glam::Vec3;
use std::collections::HashMap;

/// A triangle as it is stored: mesh, and triangle of the mesh.
type Stored = (u32, u32);

impl Scene {
    /// The scene with some lights shining by a factor per channel of what they do here. Nothing is built anew: it has the
    /// same lights in the same order, and shares the acceleration structure.
    ///
    /// Factors must be finite and above 0: a lamp without any light would be no light. All placements of an instanced
    /// triangle change together, for they share its material.
    #[must_use]
    pub fn relit(&self, factors: &[(u32, Vec3)]) -> Self {
        let mut scene = self.clone();
        let mut of_triangle: HashMap<Stored, Vec3> = HashMap::new();
        for &(light, factor) in factors {
            match self.stored(light) {
                Some(stored) => {
                    of_triangle.insert(stored, factor);
                }
                None => {
                    scene.lights[light as usize].shine(factor);
                    let punctual = self.punctual_of_light[light as usize];
                    scene.parts.punctual[punctual as usize].0.shine(factor);
                }
            }
        }
        for light in 0..self.lights.len() as u32 {
            if let Some(factor) = self.stored(light).and_then(|stored| of_triangle.get(&stored)) {
                scene.lights[light as usize].shine(*factor);
            }
        }
        scene.use_dimmed_materials(&of_triangle);
        scene
    }

    /// Where the triangle of a light is stored; `None` for punctual lights.
    fn stored(&self, light: u32) -> Option<Stored> {
        let light = &self.lights[light as usize];
        let instance = self.parts.instances.get(light.primitive.instance as usize)?;
        (light.kind == LightKind::Triangle).then_some((instance.mesh, light.primitive.triangle))
    }

    /// Gives the triangles copies of their materials, one for each material and factor that occur.
    fn use_dimmed_materials(&mut self, factors: &HashMap<Stored, Vec3>) {
        let mut copies: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
        for (&(mesh, triangle), factor) in factors {
            let slot = &mut self.parts.meshes[mesh as usize].materials[triangle as usize];
            let materials = &mut self.parts.materials;
            let records = &mut self.shading.materials;
            *slot = *copies
                .entry((*slot, factor.to_array().map(f32::to_bits)))
                .or_insert_with_key(|&(material, _)| {
                    let mut copy = materials[material as usize].clone();
                    copy.emission *= *factor;
                    records.push(MaterialRecord::new(&copy));
                    materials.push(copy);
                    materials.len() as u32 - 1
                });
            // One that is not packed yet will be with its new material.
            if let Some(record) = self.shading.packed_mut(mesh, triangle) {
                record.set_material(*slot);
            }
        }
    }
}

impl Light {
    /// Emits `factor` times as much, per channel.
    fn shine(&mut self, factor: Vec3) {
        let before = luminance(self.intensity);
        self.intensity *= factor;
        self.power *= luminance(self.intensity) / before;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PrimitiveId, Ray, generate};

    fn scene(name: &str) -> Scene {
        Scene::new(generate::demo(name).expect("a known scene")).expect("valid")
    }

    #[test]
    fn lights_shine_by_the_factor_and_look_so() {
        for name in ["rooms:64", "points:64"] {
            let before = scene(name);
            let factor = Vec3::new(0.5, 2.0, 1e-4);
            let after = before.relit(&[(3, factor)]);
            assert_eq!(after.lights.len(), before.lights.len());
            for (index, (old, new)) in before.lights.iter().zip(&after.lights).enumerate() {
                let expected = if index == 3 {
                    old.intensity * factor
                } else {
                    old.intensity
                };
                assert_eq!(new.intensity, expected, "{name}: light {index}");
            }
            let ratio = luminance(after.lights[3].intensity) / luminance(before.lights[3].intensity);
            assert!((after.lights[3].power / before.lights[3].power / ratio - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn an_area_light_is_seen_with_its_new_emission() {
        let before = scene("rooms:64");
        let index = before
            .lights
            .iter()
            .position(|l| l.kind == LightKind::Triangle)
            .expect("quads") as u32;
        let after = before.relit(&[(index, Vec3::splat(0.25))]);
        let light = &before.lights[index as usize];
        let ray = Ray {
            origin_ws: light.center_ws() + light.normal_ws * 1e-3,
            direction_ws: -light.normal_ws,
            t_max: f32::INFINITY,
        };
        let emitted = |scene: &Scene| {
            let hit = scene.nearest(&ray, PrimitiveId::NONE).expect("the light itself");
            assert_eq!(hit.id, light.primitive);
            scene.surface(&ray, &hit).emitted
        };
        assert_eq!(emitted(&after), emitted(&before) * 0.25);
        assert_eq!(after.light_source(index).node, before.light_source(index).node);
    }

    #[test]
    fn what_is_relit_is_what_is_built_from_its_parts() {
        let relit = scene("rooms:64").relit(&[(0, Vec3::splat(0.5)), (5, Vec3::splat(3.0))]);
        let built = Scene::new(relit.parts.clone()).expect("valid");
        for (a, b) in relit.lights.iter().zip(&built.lights) {
            assert_eq!((a.intensity, a.primitive), (b.intensity, b.primitive));
            assert!((a.power / b.power - 1.0).abs() < 1e-5);
        }
    }
}
