//! Randomised low-discrepancy points: Owen-scrambled Sobol points in four dimensions.

/// Points in one scrambled sequence. `sobol_burley` has up to 2^16. Shorter sequences make the first round shorter, which is enough for
/// coarse errors, and stay in the processor's cache; fine errors take up to a quarter more rays (docs/measurements.md).
pub const SEQUENCE_LENGTH: u32 = 1 << 14;

/// Point `index` of the sequence `seed`, each coordinate uniform in [0, 1).
///
/// Owen, *Randomly permuted (t, m, s)-nets and (t, s)-sequences*, 1995; Burley, *Practical
/// Hash-based Owen Scrambling*, JCGT 9(4), 2020. Different seeds are independent. A sequence of
/// 2^14 points fixes 14 bits and the scrambling makes all further ones random; the crate stops
/// at 23, so the next 16 are drawn here.
pub fn sobol_4d(index: u32, seed: u32) -> [f64; 4] {
    let leading = sobol_burley::sample_4d(index, 0, seed);
    let trailing = split_mix(u64::from(seed) << 32 | u64::from(index));
    const BITS_39: f64 = (1u64 << 39) as f64;
    std::array::from_fn(|axis| {
        let low = (trailing >> (16 * axis)) & 0xffff;
        f64::from(leading[axis]) + (low as f64 + 0.5) / BITS_39
    })
}

/// All points of the sequence `seed` with their indices, in the order of their first coordinates: what they choose by it is chosen
/// in order, so that neighbours find the same data in caches.
fn along_first_axis(seed: u32) -> impl Iterator<Item = (u32, [f64; 4])> {
    let mut points = vec![(0, [0.0; 4]); SEQUENCE_LENGTH as usize];
    for index in 0..SEQUENCE_LENGTH {
        let point = sobol_4d(index, seed);
        // Every interval of this length holds one point.
        points[(point[0] * f64::from(SEQUENCE_LENGTH)) as usize] = (index, point);
    }
    points.into_iter()
}

/// The points of [`along_first_axis`], of which the first coordinates cover part `stratum` of `strata` of [0, 1), each with the random
/// numbers of its path.
pub fn stratified(
    seed: u32,
    stratum: u32,
    strata: u32,
) -> impl Iterator<Item = ([f64; 4], Choices)> {
    along_first_axis(seed).map(move |(index, [u0, u1, u2, u3])| {
        let u0 = (f64::from(stratum) + u0) / f64::from(strata);
        let choices = Choices::new(split_mix(u64::from(seed) << 32 | u64::from(index)));
        ([u0, u1, u2, u3], choices)
    })
}

/// 64 random bits from a counter: Steele, Lea, Flood, *Fast splittable pseudorandom number
/// generators*, OOPSLA 2014 (SplitMix64).
pub fn split_mix(counter: u64) -> u64 {
    let mut z = counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Random numbers of one path.
pub struct Choices {
    counter: u64,
}

impl Choices {
    pub fn new(seed: u64) -> Self {
        Self { counter: seed }
    }

    /// The next one, in [0, 1).
    pub fn next(&mut self) -> f64 {
        self.counter = split_mix(self.counter);
        (self.counter >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_interval_holds_its_share() {
        let mut counts = [[0; 256]; 4];
        for index in 0..SEQUENCE_LENGTH {
            for (axis, u) in sobol_4d(index, 7).into_iter().enumerate() {
                assert!((0.0..1.0).contains(&u));
                counts[axis][(u * 256.0) as usize] += 1;
            }
        }
        assert!(
            counts
                .iter()
                .flatten()
                .all(|&count| count == SEQUENCE_LENGTH / 256)
        );
    }

    #[test]
    fn order_along_the_first_axis_leaves_no_point_out() {
        let mut seen = vec![false; SEQUENCE_LENGTH as usize];
        let mut last = 0.0;
        for (index, point) in along_first_axis(7) {
            assert_eq!(point, sobol_4d(index, 7));
            assert!(point[0] >= last);
            last = point[0];
            assert!(!std::mem::replace(&mut seen[index as usize], true));
        }
        assert!(seen.into_iter().all(|seen| seen));
    }

    #[test]
    fn seeds_give_different_points() {
        assert_ne!(sobol_4d(3, 1), sobol_4d(3, 2));
    }
}
