//! A million lights load, build and render. Times are printed, not judged.

use light_cache::SamplerKind;
use render::{Settings, renderer};
use std::time::Instant;
use tests::compare::sampled;

#[test]
fn a_million_lights_render() {
    let start = Instant::now();
    let scene = scene::load("demo:rooms:1000000").expect("the scene is known");
    println!("1,000,000 lights: loaded in {:.2} s", start.elapsed().as_secs_f64());
    assert_eq!(scene.lights.len(), 1_000_000);
    for kind in [SamplerKind::Uniform, SamplerKind::TreeVisible, SamplerKind::Table] {
        let start = Instant::now();
        let settings = Settings {
            width: 32,
            height: 24,
            method: sampled(kind),
            ..Settings::default()
        };
        let mut rendering = renderer(&scene, &scene.parts.cameras[0], &settings).expect("the settings are valid");
        rendering.render_frame();
        rendering.render_frame();
        println!(
            "{}: light structures and two small frames in {:.2} s",
            kind.name(),
            start.elapsed().as_secs_f64()
        );
        let stats = rendering.stats();
        assert_eq!(stats.nonfinite_samples, 0);
        let image = rendering.film().image();
        assert!(image.pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        let least = stats.sampler.expect("a sampler was asked for").min_probability;
        assert!(
            (0.0..=1e-6).contains(&least),
            "no guarantee can exceed 1 / 1,000,000: {least}"
        );
    }
}
