//! Signal-to-noise and contrast-to-noise ratios of rectangles of a picture, to measure how a filter smooths and preserves contrast
//! (thesis 5.6).

use std::fmt::Write as _;
use std::str::FromStr;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Left column and upper row.
    pub at: [u32; 2],
    pub size: [u32; 2],
}

impl FromStr for Region {
    type Err = String;

    /// `X,Y,W,H` in pixels.
    fn from_str(text: &str) -> Result<Region, String> {
        let numbers: Result<Vec<u32>, _> = text.split(',').map(|n| n.trim().parse::<u32>()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, w, h]) if w > 0 && h > 0 && u64::from(w) * u64::from(h) > 1 => {
                Ok(Region { at: [x, y], size: [w, h] })
            }
            Ok(&[_, _, _, _]) => Err("holds fewer than two pixels".into()),
            _ => Err("must read X,Y,WIDTH,HEIGHT in pixels, as 10,20,64,64".into()),
        }
    }
}

/// Mean and population standard deviation of the pixels, 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    pub mean: f64,
    pub deviation: f64,
}

impl Region {
    /// Checks that the region is within a picture of `size` pixels.
    ///
    /// # Errors
    /// It is not.
    pub fn check(&self, size: [u32; 2]) -> Result<(), String> {
        let [right, lower] = [0, 1].map(|i| u64::from(self.at[i]) + u64::from(self.size[i]));
        match right <= u64::from(size[0]) && lower <= u64::from(size[1]) {
            true => Ok(()),
            false => Err(format!("reaches to {right},{lower}, the picture is {} x {} pixels", size[0], size[1])),
        }
    }

    /// Mean and deviation of the region in a picture `width` pixels wide, which must contain it.
    pub fn level(&self, values: &[f64], width: u32) -> Level {
        let row = |y: u32| {
            let from = (self.at[1] + y) as usize * width as usize + self.at[0] as usize;
            &values[from..from + self.size[0] as usize]
        };
        let pixels = || (0..self.size[1]).flat_map(|y| row(y).iter().copied());
        let count = f64::from(self.size[0]) * f64::from(self.size[1]);
        let mean = pixels().sum::<f64>() / count;
        let variance = pixels().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
        Level { mean, deviation: variance.sqrt() }
    }
}

impl Level {
    /// Signal-to-noise ratio: mean over standard deviation; None without noise.
    pub fn snr(&self) -> Option<f64> {
        (self.deviation > 0.0).then(|| self.mean / self.deviation)
    }

    /// Contrast-to-noise ratio against another region: |m1 - m2| / sqrt(s1^2 + s2^2); None without noise.
    pub fn cnr(&self, other: &Level) -> Option<f64> {
        let noise = self.deviation.hypot(other.deviation);
        (noise > 0.0).then(|| (self.mean - other.mean).abs() / noise)
    }
}

/// A table of the levels and ratios of a region and its background before and after a filter.
pub fn table(before: &[f64], after: &[f64], width: u32, region: &Region, background: Option<&Region>) -> String {
    let mut text = format!("{:<22} {:>8} {:>8} {:>8} {:>8}\n", "", "mean", "sd", "SNR", "CNR");
    let ratio = |r: Option<f64>| r.map_or("no noise".into(), |r| format!("{r:.3}"));
    for (when, values) in [("before", before), ("after", after)] {
        let level = region.level(values, width);
        let behind = background.map(|b| b.level(values, width));
        let cnr = behind.map_or("-".into(), |b| ratio(level.cnr(&b)));
        let mut line = |name: &str, level: &Level, cnr: &str| {
            let (mean, deviation, snr) = (level.mean, level.deviation, ratio(level.snr()));
            let _ = writeln!(text, "{:<22} {mean:>8.4} {deviation:>8.4} {snr:>8} {cnr:>8}", format!("{name} {when}"));
        };
        line("region", &level, &cnr);
        if let Some(behind) = behind {
            line("background", &behind, "-");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_follow_their_formulas() {
        // A checkerboard of 0.2 and 0.6 next to a plane of 0.9.
        let values: Vec<f64> = (0..8 * 4).map(|i| if i % 8 >= 4 { 0.9 } else { [0.2, 0.6][(i + i / 8) % 2] }).collect();
        let (board, plane): (Region, Region) = ("0,0,4,4".parse().unwrap(), "4, 1,4,3".parse().unwrap());
        let (a, b) = (board.level(&values, 8), plane.level(&values, 8));
        assert!((a.mean - 0.4).abs() < 1e-12 && (a.deviation - 0.2).abs() < 1e-12);
        assert!((a.snr().unwrap() - 2.0).abs() < 1e-12);
        assert!((a.cnr(&b).unwrap() - 2.5).abs() < 1e-9, "{:?}", a.cnr(&b));
        assert!(b.deviation < 1e-12);
        let text = table(&values, &[0.5; 32], 8, &board, Some(&plane));
        assert!(text.contains("2.500") && text.contains("no noise"), "{text}");
    }

    #[test]
    fn a_region_that_is_none_or_leaves_the_picture_is_refused() {
        for wrong in ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "0,0,0,5", "0,0,1,1", "-1,0,4,4", "0,0,99999999999,1"] {
            assert!(wrong.parse::<Region>().is_err(), "{wrong}");
        }
        let region: Region = "4,0,4294967295,2".parse().unwrap();
        assert!(region.check([8, 8]).is_err());
        assert!("4,6,4,2".parse::<Region>().unwrap().check([8, 8]).is_ok());
    }
}
