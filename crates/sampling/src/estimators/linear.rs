//! Small systems of linear equations.

/// Pivots below this share of the largest element count as 0.
const SINGULAR: f64 = 1e-12;

/// Solves `matrix x = right` by Gaussian elimination with partial pivoting. Unknowns that the equations do not settle are 0.
pub(super) fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    let largest = matrix.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut pivot_of_column = vec![None; n];
    let mut row = 0;
    for column in 0..n {
        let Some(best) = (row..n).max_by(|&a, &b| matrix[a][column].abs().total_cmp(&matrix[b][column].abs())) else {
            break;
        };
        if matrix[best][column].abs() <= SINGULAR * largest {
            continue;
        }
        matrix.swap(row, best);
        right.swap(row, best);
        let pivot = matrix[row].clone();
        for other in (0..n).filter(|&other| other != row) {
            let factor = matrix[other][column] / pivot[column];
            matrix[other]
                .iter_mut()
                .zip(&pivot)
                .for_each(|(value, p)| *value -= factor * p);
            right[other] -= factor * right[row];
        }
        pivot_of_column[column] = Some(row);
        row += 1;
    }
    let unknown = |(column, pivot): (usize, &Option<usize>)| pivot.map_or(0.0, |row| right[row] / matrix[row][column]);
    pivot_of_column.iter().enumerate().map(unknown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_can_be_solved() {
        let x = solve(vec![vec![0.0, 2.0], vec![3.0, 1.0]], vec![4.0, 5.0]);
        assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14);
        let x = solve(vec![vec![1.0, 1.0], vec![1.0, 1.0]], vec![2.0, 2.0]);
        assert_eq!(x, [2.0, 0.0]);
        assert_eq!(solve(vec![vec![0.0]], vec![0.0]), [0.0]);
    }
}
