//! The plain light tree as a sampler: no learning, no visibility.

use super::{Descent, Tree, UNIT, position, probability};
use crate::{Choice, LightRecord, LightSampler, Observation, Packed, SamplerStats, Scheme, ShadingPoint};
use crate::{packed, records};
use scene::{Light, Scene};
use std::time::Instant;

/// Light tree with bounding cones (Conty Estevez and Kulla 2018), visibility unknown.
#[derive(Debug)]
pub struct TreeSampler {
    tree: Tree,
    build_s: f64,
}

/// The tree as seen from one shading point.
#[derive(Clone, Copy, Debug)]
pub struct Local<'t> {
    descent: Descent<'t>,
    salt: u32,
}

impl TreeSampler {
    /// Builds the tree over `lights`.
    pub fn new(lights: &[Light]) -> Self {
        let start = Instant::now();
        let tree = Tree::new(lights);
        Self {
            tree,
            build_s: start.elapsed().as_secs_f64(),
        }
    }
}

impl LightSampler for TreeSampler {
    type Local<'a> = Local<'a>;
    const LEARNS: bool = false;

    #[inline]
    fn local(&self, _scene: &Scene, point: &ShadingPoint) -> Local<'_> {
        Local {
            descent: Descent::new(&self.tree, point.into()),
            salt: point.salt(),
        }
    }

    #[inline]
    fn sample(&self, local: &Local<'_>, u: u32) -> Option<Choice> {
        if !local.descent.alive() {
            return None;
        }
        let (place, width) = local.descent.draw(position(u, local.salt), UNIT);
        Some(Choice::new(self.tree.light_at(place), probability(width)))
    }

    #[inline]
    fn pmf(&self, local: &Local<'_>, light: u32) -> f32 {
        if !local.descent.alive() {
            return 0.0;
        }
        probability(local.descent.width_of(self.tree.rank[light as usize], UNIT))
    }

    fn add_pmfs(&self, local: &Local<'_>, sum: &mut [f64]) {
        if local.descent.alive() {
            local.descent.add_probabilities(0, UNIT, sum);
        }
    }

    fn end_frame(&mut self, _scene: &Scene, _logs: &[Vec<Observation>]) {}

    fn stats(&self) -> SamplerStats {
        SamplerStats {
            bytes: self.tree.bytes(),
            build_s: self.build_s,
            ..SamplerStats::default()
        }
    }

    fn records(&self, scene: &Scene) -> Vec<LightRecord> {
        records::of_sampler(self, scene, &[])
    }

    fn pack(&self) -> Option<Packed> {
        let mut words = vec![0; packed::TREE_HEADER];
        packed::pack_tree(&self.tree, 0, &mut words);
        Some(Packed {
            scheme: Scheme::Tree,
            words,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check, check_each_light_is_drawn, mixed_lights, point, points, scene_of, triangle};
    use glam::Vec3;

    #[test]
    fn keeps_the_promises_of_a_sampler() {
        for count in [1, 2, 3, 4, 5, 300, 5000] {
            let scene = scene_of(mixed_lights(count, 3));
            let sampler = TreeSampler::new(&scene.lights);
            check(&sampler, &scene, &points(24, 5));
        }
        let scene = scene_of(mixed_lights(100, 3));
        check_each_light_is_drawn(&TreeSampler::new(&scene.lights), &scene);
    }

    #[test]
    fn lights_in_one_place_and_in_a_row() {
        let at = |i: usize| Vec3::new(i as f32, 0.0, 0.0);
        for lights in [
            (0..1000).map(|_| point(at(3), 1.0)).collect(),
            (0..1000).map(|i| point(at(i), 1.0)).collect(),
            // Each ten times as far: splits cut off one light at a time.
            (0..26)
                .map(|i| triangle(Vec3::X * 10.0_f32.powi(i - 13), Vec3::NEG_X, 1e-3, 1.0))
                .collect::<Vec<_>>(),
        ] {
            let scene = scene_of(lights);
            check(&TreeSampler::new(&scene.lights), &scene, &points(8, 5));
        }
    }

    #[test]
    fn far_away_frequencies_follow_power() {
        let lights: Vec<_> = mixed_lights(64, 9)
            .into_iter()
            .filter(|light| light.normal_ws == Vec3::ZERO)
            .collect();
        let scene = scene_of(lights);
        let sampler = TreeSampler::new(&scene.lights);
        let far = ShadingPoint {
            position_ws: Vec3::new(1e4, 0.0, 0.0),
            normal_ws: Vec3::NEG_X,
            primary: true,
        };
        let local = sampler.local(&scene, &far);
        let total = scene.lights.iter().map(|light| light.power).sum::<f32>();
        for (index, light) in (0..).zip(&scene.lights) {
            let ratio = sampler.pmf(&local, index) / (light.power / total);
            assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
        }
    }

    #[test]
    fn nothing_is_drawn_below_the_horizon_or_without_lights() {
        let scene = scene_of((0..9).map(|i| point(Vec3::X * i as f32, 1.0)).collect());
        let sampler = TreeSampler::new(&scene.lights);
        let below = ShadingPoint {
            position_ws: 10.0 * Vec3::Y,
            normal_ws: Vec3::Y,
            primary: true,
        };
        let local = sampler.local(&scene, &below);
        assert!(sampler.sample(&local, 77).is_none());
        assert_eq!(sampler.pmf(&local, 3), 0.0);
        let empty = TreeSampler::new(&[]);
        assert!(empty.sample(&empty.local(&scene, &below), 77).is_none());
    }

    #[test]
    fn larger_numbers_draw_later_lights() {
        let scene = scene_of(mixed_lights(3000, 4));
        let sampler = TreeSampler::new(&scene.lights);
        for point in points(8, 2) {
            let local = sampler.local(&scene, &point);
            let ranks = (0..=u32::MAX)
                .step_by(1 << 20)
                .filter_map(|u| sampler.sample(&local, u));
            assert!(ranks.map(|choice| sampler.tree.rank[choice.light as usize]).is_sorted());
        }
    }

    #[test]
    fn importance_does_not_depend_on_the_unit_of_length() {
        let scene = scene_of(
            mixed_lights(500, 4)
                .into_iter()
                .filter(|l| l.range == f32::INFINITY)
                .skip(2)
                .collect(),
        );
        let mut scaled = scene.lights.clone();
        let factor = 1024.0;
        for light in &mut scaled {
            light.position_ws *= factor;
            light.edge1_ws *= factor;
            light.edge2_ws *= factor;
            light.area *= factor * factor;
            if light.area == 0.0 {
                light.intensity *= factor * factor;
            }
        }
        let (small, large) = (TreeSampler::new(&scene.lights), TreeSampler::new(&scaled));
        for point in points(8, 2) {
            let moved = ShadingPoint {
                position_ws: point.position_ws * factor,
                ..point
            };
            for light in 0..scaled.len() as u32 {
                let pmf = small.pmf(&small.local(&scene, &point), light);
                let other = large.pmf(&large.local(&scene, &moved), light);
                assert!((pmf - other).abs() <= 1e-3 * pmf + 1e-9, "{pmf} {other}");
            }
        }
    }

    #[test]
    fn a_million_lights_share_one_tree() {
        let sampler = TreeSampler::new(&mixed_lights(1_000_000, 1));
        let tree = &sampler.tree;
        assert!(tree.bytes() < 128 << 20);
        let mut order: Vec<u32> = (0..tree.len() as u32).map(|place| tree.light_at(place)).collect();
        order.sort_unstable();
        assert!(order.into_iter().eq(0..1_000_000), "every light has one place");
        for node in &tree.nodes {
            if node.child != super::super::LEAF {
                let [a, b] = [0, 1].map(|i| tree.nodes[node.child as usize + i]);
                assert_eq!((a.first, a.count + b.count), (node.first, node.count));
                assert_eq!(b.first, a.first + a.count);
            }
        }
    }
}
