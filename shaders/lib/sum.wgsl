// Sums in pairs of single precision: the rounded sum, and what rounding lost.

struct TwoSum {
    sum: vec4<f32>,
    error: vec4<f32>,
}

// twin: crates/sampling/src/sum.rs two_sum
fn two_sum(a: vec4<f32>, b: vec4<f32>) -> TwoSum {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    return TwoSum(sum, (a - a_part) + (b - b_part));
}

// The sum of a pair and a value, as a pair.
fn add_to_pair(pair: TwoSum, value: vec4<f32>) -> TwoSum {
    let first = two_sum(pair.sum, value);
    return two_sum(first.sum, first.error + pair.error);
}
