//! Counter-based random numbers (Salmon et al. 2011): a function of pixel, sample, seed and the number of the draw, so that no division into dispatches
//! changes them. The hash is pcg4d (Jarzynski and Olano 2020, "Hash functions for GPU rendering").

fn pcg4d(mut v: [u32; 4]) -> [u32; 4] {
    let mix = |v: &mut [u32; 4]| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
    };
    v = v.map(|n| n.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    mix(&mut v);
    v = v.map(|n| n ^ n >> 16);
    mix(&mut v);
    v
}

/// The random numbers of one path of light.
#[derive(Clone, Debug)]
pub struct Stream {
    key: [u32; 4],
}

impl Stream {
    pub fn new([x, y]: [usize; 2], sample: u32, seed: u32) -> Stream {
        Stream { key: [x as u32 | (y as u32) << 16, sample, seed, 0] }
    }

    /// Draws four numbers, uniform in 0..1 without 1, of 24 bits each.
    pub fn draw(&mut self) -> [f64; 4] {
        let drawn = pcg4d(self.key).map(|bits| f64::from(bits >> 8) / f64::from(1 << 24));
        self.key[3] = self.key[3].wrapping_add(1);
        drawn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the listing of Jarzynski and Olano in Python.
    #[test]
    fn the_hash_is_the_published_one() {
        assert_eq!(pcg4d([0, 0, 0, 0]), [251_852_841, 760_645_481, 850_445_371, 3_542_436_074]);
        assert_eq!(pcg4d([1, 2, 3, 4]), [908_250_390, 4_044_648_920, 3_775_961_919, 45_698_095]);
    }

    /// Mean, variance and correlations of neighbours in every coordinate of the key: within five standard errors of those of a uniform variable.
    #[test]
    fn numbers_are_uniform_and_neighbours_independent() {
        let count = 1 << 16;
        let at = |n: u32| Stream::new([n as usize % 64, n as usize / 64 % 64], n / 4096, 7).draw();
        let bound = 5.0 / f64::from(count).sqrt();
        for lane in 0..4 {
            let values: Vec<f64> = (0..count).map(|n| at(n)[lane] - 0.5).collect();
            let mean = values.iter().sum::<f64>() / f64::from(count);
            let variance = values.iter().map(|v| v * v).sum::<f64>() / f64::from(count);
            assert!(mean.abs() < bound * (1.0f64 / 12.0).sqrt(), "lane {lane}: {mean}");
            assert!((variance - 1.0 / 12.0).abs() < bound * (1.0f64 / 180.0).sqrt(), "lane {lane}: {variance}");
            for apart in [1, 64, 4096] {
                let together = values.iter().zip(&values[apart..]).map(|(a, b)| 12.0 * a * b).sum::<f64>();
                let correlation = together / f64::from(count);
                assert!(correlation.abs() < bound, "lane {lane}, {apart} apart: {correlation}");
            }
        }
        let mut stream = Stream::new([3, 5], 0, 0);
        let draws: Vec<[f64; 4]> = (0..count).map(|_| stream.draw()).collect();
        let mean = draws.iter().flatten().sum::<f64>() / f64::from(4 * count);
        assert!((mean - 0.5).abs() < bound, "{mean}");
        assert_eq!(Stream::new([3, 5], 0, 0).draw(), draws[0], "a function of its key");
        assert_ne!(Stream::new([3, 5], 0, 1).draw(), draws[0], "of the seed too");
    }
}
