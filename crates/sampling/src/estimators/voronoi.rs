//! Areas of Voronoi cells in the unit square.

/// Sites per cell of the search grid, in the mean.
const SITES_PER_BUCKET: f64 = 2.0;

/// For each site in the unit square the area of the points of the square that are nearer to it than to any other. They sum to 1; a site
/// that stands where another does may get the area of both.
///
/// Each cell is the square cut by the bisectors with the sites around, ring by ring of a grid, until no site farther out can cut
/// any more: expected linear time for sites that are spread evenly.
pub(super) fn voronoi_areas(sites: &[[f64; 2]]) -> Vec<f64> {
    let grid = Grid::new(sites);
    (0..sites.len()).map(|site| grid.cell_area(site)).collect()
}

/// The sites by square buckets.
struct Grid<'s> {
    sites: &'s [[f64; 2]],
    side: usize,
    /// The sites of bucket `row * side + column`.
    buckets: Vec<Vec<u32>>,
}

impl<'s> Grid<'s> {
    fn new(sites: &'s [[f64; 2]]) -> Self {
        let side = ((sites.len() as f64 / SITES_PER_BUCKET).sqrt() as usize).max(1);
        let mut grid = Self {
            sites,
            side,
            buckets: vec![Vec::new(); side * side],
        };
        for (index, site) in sites.iter().enumerate() {
            let [column, row] = grid.bucket_of(site);
            grid.buckets[row * side + column].push(index as u32);
        }
        grid
    }

    fn bucket_of(&self, site: &[f64; 2]) -> [usize; 2] {
        site.map(|x| ((x * self.side as f64) as usize).min(self.side - 1))
    }

    fn cell_area(&self, index: usize) -> f64 {
        let site = self.sites[index];
        let [column, row] = self.bucket_of(&site);
        let mut cell = Polygon::unit_square();
        for ring in 0..self.side {
            // Sites of this ring are at least ring - 1 buckets away, and cut only what is half as far.
            let nearest = (ring as f64 - 1.0).max(0.0) / self.side as f64;
            if nearest > 2.0 * cell.reach(site) {
                break;
            }
            for [column, row] in self.ring(column, row, ring) {
                for &other in &self.buckets[row * self.side + column] {
                    if self.sites[other as usize] != site {
                        cell.keep_nearer_to(site, self.sites[other as usize]);
                    }
                }
            }
        }
        cell.area()
    }

    /// The buckets at Chebyshev distance `ring`, within the square.
    fn ring(&self, column: usize, row: usize, ring: usize) -> impl Iterator<Item = [usize; 2]> {
        let side = self.side;
        let rows = row.saturating_sub(ring)..=(row + ring).min(side - 1);
        rows.flat_map(move |r| {
            let full = r.abs_diff(row) == ring;
            let step = if full || ring == 0 { 1 } else { 2 * ring };
            let low = column as isize - ring as isize;
            (0..=2 * ring)
                .step_by(step)
                .map(move |k| low + k as isize)
                .filter(move |&c| (0..side as isize).contains(&c))
                .map(move |c| [c as usize, r])
        })
    }
}

/// A convex polygon, corners in order.
struct Polygon {
    corners: Vec<[f64; 2]>,
}

impl Polygon {
    fn unit_square() -> Self {
        Self {
            corners: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        }
    }

    /// Distance from `site` to the farthest corner.
    fn reach(&self, site: [f64; 2]) -> f64 {
        let distances = self.corners.iter().map(|c| (c[0] - site[0]).hypot(c[1] - site[1]));
        distances.fold(0.0, f64::max)
    }

    /// Cuts away what is nearer to `other` than to `site`.
    fn keep_nearer_to(&mut self, site: [f64; 2], other: [f64; 2]) {
        let normal = [other[0] - site[0], other[1] - site[1]];
        let middle = [0.5 * (other[0] + site[0]), 0.5 * (other[1] + site[1])];
        let beyond = |c: &[f64; 2]| (c[0] - middle[0]) * normal[0] + (c[1] - middle[1]) * normal[1];
        if self.corners.iter().all(|corner| beyond(corner) <= 0.0) {
            return;
        }
        let mut kept = Vec::with_capacity(self.corners.len() + 1);
        for (i, corner) in self.corners.iter().enumerate() {
            let next = self.corners[(i + 1) % self.corners.len()];
            let (here, there) = (beyond(corner), beyond(&next));
            if here <= 0.0 {
                kept.push(*corner);
            }
            if (here < 0.0) != (there < 0.0) && here != there {
                let t = here / (here - there);
                kept.push([
                    corner[0] + t * (next[0] - corner[0]),
                    corner[1] + t * (next[1] - corner[1]),
                ]);
            }
        }
        self.corners = kept;
    }

    fn area(&self) -> f64 {
        let next = self.corners.iter().cycle().skip(1);
        0.5 * self
            .corners
            .iter()
            .zip(next)
            .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
            .sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn areas_agree_with_counting() {
        let mut stream = Stream::new(4, 0);
        for n in [1, 2, 5, 40] {
            let sites: Vec<[f64; 2]> = (0..n).map(|_| [stream.number(), stream.number()]).collect();
            let areas = voronoi_areas(&sites);
            let m = 400;
            let mut counts = vec![0.0; n];
            for i in 0..m * m {
                let p = [i % m, i / m].map(|k| (f64::from(k) + 0.5) / f64::from(m));
                let to = |s: &[f64; 2]| (s[0] - p[0]).hypot(s[1] - p[1]);
                let nearest = (0..n).min_by(|&a, &b| to(&sites[a]).total_cmp(&to(&sites[b]))).unwrap();
                counts[nearest] += 1.0 / f64::from(m * m);
            }
            for (area, count) in areas.iter().zip(counts) {
                assert!((area - count).abs() < 2e-3, "{n}: {area} {count}");
            }
        }
    }

    #[test]
    fn areas_fill_the_square() {
        let mut stream = Stream::new(6, 0);
        // Evenly spread, and crowded into a corner with one site far away.
        for crowd in [1.0, 0.01] {
            let mut sites: Vec<[f64; 2]> = (0..3000)
                .map(|_| [crowd * stream.number(), crowd * stream.number()])
                .collect();
            sites.push([0.9, 0.95]);
            let sum: f64 = voronoi_areas(&sites).iter().sum();
            assert!((sum - 1.0).abs() < 1e-9, "{crowd}: {sum}");
        }
    }
}
