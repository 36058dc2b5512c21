// How much of the control variate each pixel takes: crates/render/src/control.rs.
#import "lib/constants.wgsl"
#import "record/film.wgsl"

// twin: crates/render/src/control.rs FIRST_SHARE
const FIRST_SHARE: f32 = 0.5;
// twin: crates/render/src/control.rs LIKELY_SHARE
const LIKELY_SHARE: f32 = 1.0;
// twin: crates/render/src/control.rs MEMORY
const CONTROL_MEMORY: f32 = 0.5;
// twin: crates/render/src/control.rs FORGETTING_FROM
const FORGETTING_FROM: f32 = 4.0;
// twin: crates/render/src/control.rs LARGEST
const LARGEST_CONTROL: f32 = 1e15;

// twin: crates/render/src/control.rs NEW
fn new_control() -> PixelControl {
    return PixelControl(FIRST_SHARE, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
}

// twin: crates/render/src/control.rs inverse_power_of_two
fn inverse_power_of_two(x: f32) -> f32 {
    // The sum of the biased exponents of both is 254.
    let exponent = min(bitcast<u32>(x) & 0x7f800000u, 254u << 23u);
    return bitcast<f32>((254u << 23u) - exponent);
}

// Takes note of a sample and of the control variate that it came with.
// twin: crates/render/src/control.rs add
fn note_control(pixel: PixelControl, radiance: vec3<f32>, control: vec3<f32>) -> PixelControl {
    var noted = pixel;
    var by = luminance(control);
    if by == 0.0 || !is_finite(by) {
        return noted;
    }
    if noted.scale == 0.0 {
        noted.scale = inverse_power_of_two(by);
    }
    by *= noted.scale;
    let found = luminance(radiance) * noted.scale;
    if abs(found) < LARGEST_CONTROL && abs(by) < LARGEST_CONTROL {
        noted.count += 1.0;
        let off_found = found - noted.mean_found;
        let off_control = by - noted.mean_control;
        noted.mean_found += off_found / noted.count;
        noted.mean_control += off_control / noted.count;
        let control_after = by - noted.mean_control;
        noted.found_sq += off_found * (found - noted.mean_found);
        noted.control_sq += off_control * control_after;
        noted.mixed += off_found * control_after;
    }
    return noted;
}

// The share for the samples to come.
// twin: crates/render/src/control.rs learn
fn learn_control(pixel: PixelControl) -> PixelControl {
    var learned = pixel;
    if learned.count >= 2.0 && learned.control_sq > 0.0 {
        let residual_sq = max(learned.found_sq - learned.mixed * learned.mixed / learned.control_sq, 0.0);
        let noise =
            residual_sq / max(learned.count - 2.0, 1.0) + learned.found_sq / (learned.count * learned.count);
        let share = (noise * LIKELY_SHARE - learned.mixed) / (noise + learned.control_sq);
        learned.share = clamp(share, 0.0, 1.0);
    }
    if learned.count >= FORGETTING_FROM {
        learned.count *= CONTROL_MEMORY;
        learned.found_sq *= CONTROL_MEMORY;
        learned.control_sq *= CONTROL_MEMORY;
        learned.mixed *= CONTROL_MEMORY;
    }
    return learned;
}
