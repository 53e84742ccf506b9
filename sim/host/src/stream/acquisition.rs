//! When frames were acquired: by the times in their lines, else by their arrival.

use std::fmt;

use dermis_golden::data::text::is_date;

/// Frames from which on a step is compared with the mean step.
const STEADY_AFTER: u64 = 16;
/// Steps longer than so many mean steps are gaps.
const GAP: f64 = 2.0;

/// The times of a stream's frames in ns since 1970.
///
/// | the line states | time of the frame |
/// |---|---|
/// | a date, or a number since 1970 | that |
/// | another time, as `millis()` of a microcontroller | that since the first frame's, from the first frame's arrival on; anew where it falls |
/// | none | its arrival |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Acquisition {
    /// Time of the last line, and what is added to it; of times that are no dates.
    clock: Option<(i64, i64)>,
    first_ns: i64,
    last_ns: i64,
    /// Frames whose line states a time, and all.
    stated: u64,
    frames: u64,
    gaps: u64,
    largest_ns: i64,
    back: u64,
}

impl Acquisition {
    /// The time of the next frame: `stated` in its line, whose `arrival` is in ns since 1970.
    pub(crate) fn time_ns(&mut self, stated: Option<i64>, arrival: i64) -> i64 {
        let time_ns = match stated {
            Some(date) if is_date(date) => date,
            Some(own) => {
                let added =
                    self.clock.filter(|(last, _)| *last <= own).map_or(arrival.saturating_sub(own), |(_, added)| added);
                self.clock = Some((own, added));
                own.saturating_add(added)
            }
            None => arrival,
        };
        self.stated += u64::from(stated.is_some());
        self.count(time_ns);
        time_ns
    }

    fn count(&mut self, time_ns: i64) {
        let step = time_ns.saturating_sub(self.last_ns);
        match self.frames {
            0 => self.first_ns = time_ns,
            _ if step < 0 => self.back += 1,
            frames => {
                let mean = self.last_ns.saturating_sub(self.first_ns) as f64 / (frames - 1).max(1) as f64;
                self.gaps += u64::from(frames >= STEADY_AFTER && step as f64 > GAP * mean);
                self.largest_ns = self.largest_ns.max(step);
            }
        }
        (self.last_ns, self.frames) = (time_ns, self.frames + 1);
    }
}

impl fmt::Display for Acquisition {
    /// Rate and gaps; nothing of less than two frames.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let took_s = 1e-9 * self.last_ns.saturating_sub(self.first_ns) as f64;
        if self.frames < 2 || took_s <= 0.0 {
            return Ok(());
        }
        let (rate, largest_ms) = ((self.frames - 1) as f64 / took_s, 1e-6 * self.largest_ns as f64);
        let word = if self.stated > 0 { "acquired" } else { "arrived" };
        write!(f, "; {word} at {rate:.1} per second, {} gaps, the largest step {largest_ms:.1} ms", self.gaps)?;
        match self.back {
            0 => Ok(()),
            back => write!(f, ", {back} times earlier than the frame before"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    /// A moment in 2024 in ns.
    const DAY: i64 = 1_732_770_000_000 * MS;

    /// Times of frames whose lines state these, in ms, and arrive 7 ms apart.
    fn times(stated: &[Option<i64>]) -> (Vec<i64>, Acquisition) {
        let mut acquisition = Acquisition::default();
        let arrivals = (0..).map(|k| DAY + 7 * k * MS);
        let own = stated.iter().zip(arrivals).map(|(ms, arrival)| acquisition.time_ns(ms.map(|ms| ms * MS), arrival));
        (own.map(|ns| (ns - DAY) / MS).collect(), acquisition)
    }

    #[test]
    fn times_are_those_of_the_lines_else_of_the_arrival() {
        assert_eq!(times(&[None; 3]).0, [0, 7, 14]);
        assert_eq!(times(&[Some(DAY / MS + 100), Some(DAY / MS + 110)]).0, [100, 110]);
        assert_eq!(times(&[Some(500), Some(510), Some(520)]).0, [0, 10, 20]);
        // The microcontroller was reset before the third line: from its arrival on.
        assert_eq!(times(&[Some(500), Some(510), Some(0), Some(10)]).0, [0, 10, 14, 24]);
    }

    #[test]
    fn rate_and_gaps_are_reported() {
        let steady: Vec<_> = (0..20).map(|k| Some(DAY / MS + 10 * k + if k >= 18 { 40 } else { 0 })).collect();
        assert_eq!(times(&steady).1.to_string(), "; acquired at 82.6 per second, 1 gaps, the largest step 50.0 ms");
        let back = [0, 10, 5].map(|ms| Some(DAY / MS + ms));
        assert!(times(&back)
            .1
            .to_string()
            .ends_with("0 gaps, the largest step 10.0 ms, 1 times earlier than the frame before"));
        assert_eq!(times(&[None]).1.to_string(), "");
        // No time leaves the range of the numbers.
        let mut extreme = Acquisition::default();
        for stated in [i64::MIN, i64::MAX, 0, i64::MIN] {
            extreme.time_ns(Some(stated), DAY);
        }
        assert!(!extreme.to_string().contains("inf"));
    }
}
