//! Functions that exist on both sides, run on both.

use crate::gpu::gpu;
use glam::{Vec2, Vec3};
use render::gpu::Kernel;
use sampling::triangle::{SphericalTriangle, uniform_triangle};
use sampling::{PixelSequence, Random, ggx, hash, hemisphere, unit_f32};

const COUNT: u32 = 4096;

#[test]
fn integers_agree_to_the_bit() {
    let Some(gpu) = gpu() else { return };
    let edges = [0, 1, 2, u32::MAX, 1 << 31, 0xffff, 0x1_0000];
    let input: Vec<[u32; 6]> = (0..COUNT)
        .map(|i| {
            let random = Random::new(4, i, 0);
            let mut words = [0, 1, 2, 3, 4, 5].map(|d| random.u32(d));
            if i < 200 {
                words = words.map(|word| edges[word as usize % edges.len()]);
            }
            // Vertices and dimensions as they occur.
            [words[0], words[1], words[2], words[3], words[4] % 8, words[5] % 8]
        })
        .collect();
    let kernel = Kernel {
        text: include_str!("kernels/integers.wgsl"),
        sampler: None,
        sobol: true,
        switches: &[],
    };
    let output = kernel
        .run(gpu, &input.concat(), COUNT, 8 * COUNT as usize)
        .expect("the kernel runs");
    for (words, found) in input.iter().zip(output.chunks(8)) {
        let [a, b, c, d, vertex, dimension] = *words;
        let numbers = PixelSequence::new(u64::from(b) << 32 | u64::from(a), c, d).vertex(vertex);
        let position = u64::from(a) << 31 | u64::from(hash::hash2(a, b) >> 1);
        let product = u64::from(a) * u64::from(b);
        let divisor = d.max(1);
        let dividend = u64::from(a % divisor) << 32 | u64::from(c);
        let halves = |wide: u64| [wide as u32, (wide >> 32) as u32];
        let [position, product] = [position, product].map(halves);
        let expected = [
            hash::hash3(a, b, c),
            numbers.u32(dimension),
            position[0],
            position[1],
            product[0],
            product[1],
            (dividend / u64::from(divisor)) as u32,
            unit_f32(a).to_bits(),
        ];
        assert_eq!(found, expected, "{words:?}");
    }
}

/// Within 4e-6, about 32 units in the last place of 1: divisions and roots need not be rounded correctly on a GPU.
#[test]
fn shapes_and_lobes_agree() {
    let Some(gpu) = gpu() else { return };
    let input: Vec<Vec2> = (0..COUNT).map(|i| Random::new(5, i, 0).vec2(0)).collect();
    let words: Vec<u32> = input.iter().flat_map(|u| u.to_array().map(f32::to_bits)).collect();
    let kernel = Kernel {
        text: include_str!("kernels/floats.wgsl"),
        sampler: None,
        sobol: false,
        switches: &[],
    };
    let output = kernel
        .run(gpu, &words, COUNT, 12 * COUNT as usize)
        .expect("the kernel runs");
    for (u, found) in input.into_iter().zip(output.chunks(12)) {
        let triangle = SphericalTriangle::new(
            Vec3::new(1.0, 0.2, -0.3) + u.extend(0.0),
            Vec3::new(-0.4, 1.5, 0.2),
            Vec3::new(0.3, -0.1, 0.8) * (0.5 + u.x),
        )
        .expect("it is large");
        let flat = uniform_triangle(u);
        let wo = Vec3::new(0.3, u.x - 0.5, 0.4).normalize();
        let vectors = [
            hemisphere::cosine_hemisphere(u),
            flat.extend(triangle.solid_angle),
            triangle.sample(u),
            ggx::sample_vndf(wo, 0.05 + u.y, u),
        ];
        let expected = vectors.iter().flat_map(|v| v.to_array());
        for (k, (expected, found)) in expected.zip(found).enumerate() {
            let found = f32::from_bits(*found);
            assert!(
                (expected - found).abs() <= 4e-6 * expected.abs().max(1.0),
                "{u} {k}: {expected} {found}"
            );
        }
    }
}
