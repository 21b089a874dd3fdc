//! Division of weighted points into cells by a k-d tree that always splits the cell with the largest weight × variance.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// A point in a space of N dimensions.
pub struct Point<const N: usize> {
    pub place: [f64; N],
    /// ≥ 0
    pub weight: f64,
}

/// Levels of cells over the same points, from coarse to fine.
pub struct Cells {
    /// Indices of points. The points of a cell are a range of this list.
    pub order: Vec<u32>,
    pub levels: Vec<Vec<Range<usize>>>,
}

impl Cells {
    pub fn points(&self, cell: &Range<usize>) -> impl Iterator<Item = usize> + Clone {
        self.order[cell.clone()].iter().map(|&index| index as usize)
    }
}

/// Total weight and, for each dimension, mean and variance of some points.
pub struct Moments<const N: usize> {
    pub weight: f64,
    pub mean: [f64; N],
    pub variance: [f64; N],
}

impl<const N: usize> Moments<N> {
    pub fn of<'a>(points: impl Iterator<Item = &'a Point<N>> + Clone) -> Self {
        let weight: f64 = points.clone().map(|point| point.weight).sum();
        let (mut mean, mut variance) = ([0.0; N], [0.0; N]);
        if weight > 0.0 {
            let shares = points.map(|point| (point.weight / weight, point.place));
            for (share, place) in shares.clone() {
                (0..N).for_each(|axis| mean[axis] += share * place[axis]);
            }
            for (share, place) in shares {
                (0..N)
                    .for_each(|axis| variance[axis] += share * (place[axis] - mean[axis]).powi(2));
            }
        }
        Self {
            weight,
            mean,
            variance,
        }
    }

    /// Sum of the variances along all dimensions.
    pub fn trace(&self) -> f64 {
        self.variance.iter().sum()
    }
}

struct Cell {
    priority: f64,
    range: Range<usize>,
    /// Dimension of the largest variance, and the mean in that dimension.
    axis: usize,
    mean: f64,
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Cell {}
impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cell {
    /// Cells of equal priority are ordered by position, so that the result is deterministic.
    fn cmp(&self, other: &Self) -> Ordering {
        (self.priority.total_cmp(&other.priority))
            .then_with(|| other.range.start.cmp(&self.range.start))
    }
}

/// Divides `points` into levels of `counts` cells (increasing), or as many as there are distinct points. Each of
/// `roots` is a cell of the coarsest level.
pub fn split<const N: usize>(
    points: &[Point<N>],
    roots: &[Range<usize>],
    counts: &[usize],
) -> Cells {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let cell = |order: &[u32], range: Range<usize>| {
        let inside = order[range.clone()].iter().map(|&i| &points[i as usize]);
        let moments = Moments::of(inside);
        let axis = (0..N)
            .max_by(|&a, &b| moments.variance[a].total_cmp(&moments.variance[b]))
            .unwrap_or(0);
        Cell {
            priority: moments.weight * moments.trace(),
            range,
            axis,
            mean: moments.mean[axis],
        }
    };
    let mut heap: BinaryHeap<Cell> = (roots.iter().filter(|root| !root.is_empty()))
        .map(|root| cell(&order, root.clone()))
        .collect();
    let mut unsplittable = Vec::new();
    let mut levels = Vec::new();
    for &count in counts {
        while heap.len() + unsplittable.len() < count {
            let Some(widest) = heap.pop() else { break };
            let inside = &mut order[widest.range.clone()];
            let above = |&index: &u32| points[index as usize].place[widest.axis] > widest.mean;
            inside.sort_by_key(above);
            let boundary = widest.range.start + inside.partition_point(|index| !above(index));
            if widest.priority <= 0.0
                || boundary == widest.range.end
                || boundary == widest.range.start
            {
                unsplittable.push(widest.range);
                continue;
            }
            heap.push(cell(&order, widest.range.start..boundary));
            heap.push(cell(&order, boundary..widest.range.end));
        }
        let mut cells: Vec<Range<usize>> = (heap.iter().map(|cell| cell.range.clone()))
            .chain(unsplittable.iter().cloned())
            .collect();
        cells.sort_by_key(|cell| cell.start);
        levels.push(cells);
    }
    Cells { order, levels }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every point is in one cell of each level, finer cells lie in coarser ones, and the heavy half is divided more
    /// finely.
    #[test]
    fn cells_follow_the_weight() {
        let points: Vec<Point<2>> = (0..1000)
            .map(|i| {
                let x = f64::from(i % 100) / 100.0;
                Point {
                    place: [x, f64::from(i / 100) / 10.0],
                    weight: if x < 0.5 { 50.0 } else { 1.0 },
                }
            })
            .collect();
        let cells = split(&points, &[0..300, 300..1000], &[2, 8, 64]);
        assert_eq!(cells.levels[0], [0..300, 300..1000]);
        for (count, level) in [2, 8, 64].into_iter().zip(&cells.levels) {
            assert_eq!(level.len(), count);
            let mut seen = vec![0; 1000];
            level
                .iter()
                .flat_map(|cell| cells.points(cell))
                .for_each(|i| seen[i] += 1);
            assert_eq!(seen, [1; 1000]);
        }
        for fine in &cells.levels[2] {
            let inside =
                |coarse: &Range<usize>| coarse.start <= fine.start && fine.end <= coarse.end;
            assert_eq!(cells.levels[1].iter().filter(|c| inside(c)).count(), 1);
        }
        let heavy = |cell: &&Range<usize>| points[cells.order[cell.start] as usize].weight > 1.0;
        assert!(cells.levels[2].iter().filter(heavy).count() > 48);
    }

    #[test]
    fn equal_points_are_one_cell() {
        let points: Vec<Point<1>> = (0..10)
            .map(|_| Point {
                place: [1.0],
                weight: 1.0,
            })
            .collect();
        let (all, none) = (vec![0..10; 1], vec![0..0; 1]);
        assert_eq!(split(&points, &all, &[4]).levels, [all]);
        assert!(split::<1>(&[], &none, &[4]).levels[0].is_empty());
    }
}
