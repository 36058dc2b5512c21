use super::*;
use crate::testing::{
    LIT_PART, check, check_each_light_is_drawn, check_saving, mixed_lights, observe, points, scene_of,
};
use glam::DVec3;
use sampling::Random;
use sampling::guide::{PARTS, part_of};

fn learned(scene: &Scene, frames: u32, visible: impl Fn(u32) -> bool) -> AdaptiveSampler {
    let mut sampler = AdaptiveSampler::new(scene, &Settings::default());
    for frame in 0..frames {
        let logs = observe(&sampler, scene, frame, &visible);
        sampler.end_frame(scene, &logs);
    }
    sampler
}

#[test]
fn keeps_the_promises_of_a_sampler() {
    for count in [1, 2, 5, 300] {
        let scene = scene_of(mixed_lights(count, 3));
        for frames in [0, 1, 6] {
            let sampler = learned(&scene, frames, |light| light.is_multiple_of(3));
            check(&sampler, &scene, &points(16, 5));
        }
        check_each_light_is_drawn(&learned(&scene, 4, |light| light.is_multiple_of(3)), &scene);
    }
}

#[test]
fn is_saved_and_restored() {
    let mut lights = mixed_lights(100, 3);
    // Sums that leave the range of `f32` if nothing is done against it.
    lights[10].intensity *= 1e20;
    lights[11].intensity *= 1e-20;
    let scene = scene_of(lights);
    let mut sampler = learned(&scene, 7, |light| light.is_multiple_of(3));
    let fresh = || AdaptiveSampler::new(&scene, &Settings::default());
    check_saving(&mut sampler, fresh, &scene, 24);
}

#[test]
fn every_light_keeps_the_guaranteed_minimum() {
    let scene = scene_of(mixed_lights(200, 3));
    let sampler = learned(&scene, 8, |light| light == 7);
    let least = sampler.stats().min_probability;
    assert!(least >= 0.9 * f64::from(Settings::default().min_probability_mass) / 200.0);
    let arrives = |light: u32, point: &ShadingPoint| {
        scene.lights[light as usize].unshadowed_irradiance(point.position_ws, point.normal_ws) > 0.0
    };
    for point in points(32, 9) {
        let local = sampler.local(&scene, &point);
        for light in (0..200).filter(|&l| arrives(l, &point)) {
            assert!(f64::from(sampler.pmf(&local, light)) >= 0.999 * least, "{light}");
        }
    }
}

#[test]
fn hidden_lights_lose_their_samples() {
    let scene = scene_of(mixed_lights(200, 3));
    let visible = |light: u32| light % 10 == 4;
    let share = |sampler: &AdaptiveSampler| {
        let records = sampler.records(&scene);
        (0..)
            .zip(records)
            .filter(|(light, _)| visible(*light))
            .map(|(_, r)| r.probability)
            .sum::<f64>()
    };
    let before = share(&learned(&scene, 0, visible));
    let after = share(&learned(&scene, 16, visible));
    assert!(before < 0.15 && after > 0.5, "{before} {after}");
}

/// Exactly, over all lights, and not because it is zero.
#[test]
fn the_control_variate_has_mean_zero() {
    let mut lights = mixed_lights(200, 3);
    for (i, light) in lights.iter_mut().enumerate() {
        light.intensity *= [Vec3::new(1.0, 0.2, 0.1), Vec3::ONE, Vec3::new(0.1, 0.3, 2.0)][i % 3];
    }
    let scene = scene_of(lights);
    let sampler = learned(&scene, 6, |light| light % 3 != 1);
    let mut controlled = 0;
    for point in points(64, 9) {
        let local = sampler.local(&scene, &point);
        let (mut sum, mut sizes) = (DVec3::ZERO, DVec3::ZERO);
        for choice in (0..200).filter_map(|light| sampler.chosen(&local, light)) {
            if choice.pmf > 0.0 {
                let weighed = choice.control.as_dvec3() * f64::from(choice.pmf);
                sum += weighed;
                sizes += weighed.abs();
            }
        }
        assert!((sum.abs() - 2e-5 * sizes).max_element() <= 0.0, "{sum} of {sizes}");
        controlled += u32::from(sizes.min_element() > 0.0);
    }
    assert!(controlled > 16, "{controlled}");
    let settings = Settings {
        control_variate: false,
        ..Settings::default()
    };
    let mut without = AdaptiveSampler::new(&scene, &settings);
    for frame in 0..6 {
        let logs = observe(&without, &scene, frame, |_| true);
        without.end_frame(&scene, &logs);
    }
    let at = points(1, 9)[0];
    let local = without.local(&scene, &at);
    assert!((0..64).all(|i| {
        without
            .sample(&local, i << 26)
            .is_none_or(|choice| choice.control == Vec3::ZERO)
    }));
}

#[test]
fn paths_go_on_to_where_light_was_found() {
    let scene = scene_of(mixed_lights(100, 3));
    let point = points(1, 9)[0];
    let mut sampler = AdaptiveSampler::new(&scene, &Settings::default());
    let lit = |sampler: &AdaptiveSampler| {
        let local = sampler.local(&scene, &point);
        let guide = sampler.guide(&local)?;
        let random = Random::new(3, 0, 0);
        let draws = (0..256).map(|i| guide.sample(point.normal_ws, random.vec2(2 * i)).0);
        let lit = draws.filter(|direction| part_of(point.normal_ws, *direction) == usize::from(LIT_PART));
        Some(lit.count() as f32 / 256.0)
    };
    assert_eq!(lit(&sampler), None);
    for frame in 0..4 {
        let mut logs = observe(&sampler, &scene, frame, |_| true);
        logs.iter_mut().flatten().for_each(|o| o.point = point);
        sampler.end_frame(&scene, &logs);
    }
    let share = lit(&sampler).expect("enough was seen");
    assert!(share > 5.0 / PARTS as f32, "{share}");
    let unguided = Settings {
        guided_bounces: false,
        ..Settings::default()
    };
    assert!(!AdaptiveSampler::new(&scene, &unguided).guides());
}

#[test]
fn learning_does_not_depend_on_the_number_of_threads() {
    let scene = scene_of(mixed_lights(300, 3));
    let pmfs = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads start");
        pool.install(|| {
            let sampler = learned(&scene, 5, |light| light % 3 == 1);
            let of = |p: &ShadingPoint| (0..300).map(|l| sampler.pmf(&sampler.local(&scene, p), l)).collect();
            points(16, 5).iter().map(of).collect::<Vec<Vec<f32>>>()
        })
    };
    assert_eq!(pmfs(1), pmfs(3));
}
