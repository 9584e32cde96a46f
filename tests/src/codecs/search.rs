//! Search: the bytes that a codec takes to be as good as something else. Measurements come from running the codec, one quality step at a
//! time; what is found goes to the codec table.

use anyhow::Result;

/// What a codec made of one quality step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Bytes of the whole clip.
    pub bytes: f64,
    /// How good it is; more is better.
    pub score: f64,
}

/// What a codec takes to be as good as asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Match {
    /// Bytes at just that score, between two neighbouring steps: the logarithm of the bytes goes straight with the score.
    Equal(f64),
    /// Bytes of the coarsest step, which is better than asked already.
    Coarsest(Point),
    /// The finest step is not good enough; this is what it reaches.
    Short(Point),
}

/// Finds `score` among `steps` quality steps, numbered from the coarsest on, of which `measure` runs about log2(`steps`).
///
/// # Errors
/// Those of `measure`.
pub fn equal(steps: usize, score: f64, mut measure: impl FnMut(usize) -> Result<Point>) -> Result<Option<Match>> {
    // Steps before `low` are too coarse, those from `high` on good enough.
    let (mut low, mut high) = (0, steps);
    let (mut coarse, mut fine): (Option<Point>, Option<Point>) = (None, None);
    while low < high {
        let middle = low + (high - low) / 2;
        let point = measure(middle)?;
        if point.score >= score {
            (high, fine) = (middle, Some(point));
        } else {
            (low, coarse) = (middle + 1, Some(point));
        }
    }
    Ok(match (coarse, fine) {
        (Some(coarse), Some(fine)) => {
            let share = (score - coarse.score) / (fine.score - coarse.score);
            Some(Match::Equal(coarse.bytes * (fine.bytes / coarse.bytes).powf(share)))
        }
        (None, fine) => fine.map(Match::Coarsest),
        (coarse, None) => coarse.map(Match::Short),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 50 steps of 1 dB from 10 dB on, bytes doubling every 5.
    fn codec(step: usize) -> Point {
        Point { bytes: 100.0 * 2f64.powf(step as f64 / 5.0), score: 10.0 + step as f64 }
    }

    fn find(score: f64) -> (Match, usize) {
        let mut runs = 0;
        let found = equal(50, score, |step| {
            runs += 1;
            Ok(codec(step))
        });
        (found.unwrap().unwrap(), runs)
    }

    #[test]
    fn bytes_are_those_of_the_score_asked_for() {
        for (score, bytes) in [(20.0, 400.0), (22.5, 100.0 * 2f64.powf(2.5)), (58.9, 100.0 * 2f64.powf(9.78))] {
            let (found, runs) = find(score);
            assert!(matches!(found, Match::Equal(found) if (found / bytes - 1.0).abs() < 1e-9), "{score}: {found:?}, not {bytes}");
            assert!(runs <= 6, "{runs} runs");
        }
    }

    #[test]
    fn scores_out_of_reach_are_told() {
        assert_eq!(find(9.0).0, Match::Coarsest(codec(0)));
        assert_eq!(find(59.1).0, Match::Short(codec(49)));
        assert_eq!(equal(0, 1.0, |step| Ok(codec(step))).unwrap(), None);
    }

    #[test]
    fn a_codec_that_fails_ends_the_search() {
        assert!(equal(50, 20.0, |_| anyhow::bail!("no such codec")).is_err());
    }
}
