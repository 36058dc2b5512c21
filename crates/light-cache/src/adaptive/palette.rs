//! The colours of light: what each part of the light tree sends in red, green and blue for every unit of luminance.

use super::branch::Branch;
use crate::tree::{Tree, strength};
use glam::{DVec3, Vec3};
use scene::{Light, luminance};

/// Running sums over the lights in tree order, so that the colour of any branch is a difference of two.
#[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Palette {
    /// Strengths by channel of all lights before each place, and of all of them: one entry more than there are lights.
    sums: Vec<DVec3>,
}

impl Palette {
    /// Of `lights`, in the order of `tree`.
    pub(super) fn new(tree: &Tree, lights: &[Light]) -> Self {
        let mut sums = vec![DVec3::ZERO; lights.len() + 1];
        for place in 0..lights.len() {
            let light = &lights[tree.light_at(place as u32) as usize];
            let per_luminance = light.intensity.as_dvec3() / f64::from(luminance(light.intensity));
            let own = per_luminance * strength(light);
            sums[place + 1] = sums[place] + if own.is_finite() { own } else { DVec3::ZERO };
        }
        Self { sums }
    }

    /// Mean colour of the lights of `branch`, weighed by strength: at least 0, finite, of luminance 1 as far as rounding allows.
    /// White where the branch is lost beside the strength of all lights before it.
    pub(super) fn color(&self, tree: &Tree, branch: Branch) -> Vec3 {
        let first = branch.first(tree) as usize;
        let own = self.sums[first + branch.count(tree) as usize] - self.sums[first];
        let color = own.as_vec3() / luminance(own.as_vec3());
        if color.is_finite() { color } else { Vec3::ONE }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.sums[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{mixed_lights, point};

    #[test]
    fn a_branch_has_the_mean_colour_of_its_lights() {
        let mut lights = mixed_lights(40, 3);
        for (i, light) in lights.iter_mut().enumerate() {
            light.intensity *= [Vec3::X, Vec3::Y, Vec3::ONE][i % 3];
        }
        let tree = Tree::new(&lights);
        let palette = Palette::new(&tree, &lights);
        let mut branches = vec![Branch::DISTANT, Branch::ROOT];
        branches.extend((0..tree.nodes.len() as u32).map(|node| Branch::of_node(&tree, node)));
        // One node is there only to align siblings.
        for branch in branches.into_iter().filter(|branch| branch.count(&tree) > 0) {
            let first = branch.first(&tree);
            let mut expected = DVec3::ZERO;
            for place in first..first + branch.count(&tree) {
                let light = &lights[tree.light_at(place) as usize];
                expected += light.intensity.as_dvec3() * f64::from(if light.area > 0.0 { light.area } else { 1.0 });
            }
            let expected = expected.as_vec3() / luminance(expected.as_vec3());
            let color = palette.color(&tree, branch);
            assert!((color - expected).abs().max_element() < 1e-4, "{color} {expected}");
        }
    }

    #[test]
    fn colours_are_finite_whatever_the_strengths() {
        let lights: Vec<Light> = [1e30_f32, 1e-30, 1e20, 1e-38, 1e38]
            .map(|intensity| point(Vec3::splat(intensity.log10()), intensity))
            .into();
        let tree = Tree::new(&lights);
        let palette = Palette::new(&tree, &lights);
        for node in 0..tree.nodes.len() as u32 {
            let color = palette.color(&tree, Branch::of_node(&tree, node));
            assert!(color.is_finite() && color.min_element() >= 0.0, "{color}");
        }
    }
}
