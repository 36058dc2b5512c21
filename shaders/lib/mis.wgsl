// Multiple importance sampling weights, as ratios: squares of densities would overflow.
#import "record/frame.wgsl"

// Which heuristic: its number in crates/sampling/src/mis.rs Heuristic::ALL; 4 for none.
override HEURISTIC: u32 = 1u;
const NO_HEURISTIC: u32 = 4u;

// The weight of a sample drawn with density `a` where the other technique has density `b`.
// twin: crates/sampling/src/mis.rs of_two
fn mis_weight(a: f32, b: f32) -> f32 {
    if !(a > 0.0) {
        return 0.0;
    }
    if !(b > 0.0) {
        return 1.0;
    }
    if a == b {
        return 0.5;
    }
    let ratio = b / a;
    var shape = ratio;
    switch HEURISTIC {
        case 1u: { shape = ratio * ratio; }
        case 2u: {
            if ratio < 0.1 {
                return 1.0;
            }
            if ratio * 0.1 > 1.0 {
                return 0.0;
            }
        }
        case 3u: { return select(0.0, 1.0, ratio < 1.0); }
        default: {}
    }
    return 1.0 / (1.0 + shape);
}
