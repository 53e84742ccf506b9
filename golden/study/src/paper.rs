//! Paper: published results, for comparison.
//!
//! Table 2: errors by Eq. 3 in % per sensor and case; the reference is a finite-element model for sensors 1 and 2, case
//! 0 for 3 and 4. Run times: Fig. 7 and section 4, and a later paper of the same authors.

use dermis_golden::spec::partition::Case;

/// A published run time.
#[derive(Clone, Debug, PartialEq)]
pub struct RunTime {
    /// The system that computed the frame.
    pub system: String,
    /// The sensor as printed.
    pub sensor: String,
    /// The paper's case; `None` if the time is no measurement of a case.
    pub case: Option<Case>,
    /// Time per frame in s.
    pub seconds: f64,
    /// Source of the figure.
    pub source: String,
}

const RUN_TIMES: &str = include_str!("../../data/paper/run_times.csv");

/// All published run times, in the file's order.
pub fn run_times() -> Vec<RunTime> {
    let time = |line: &str| {
        let mut fields = line.splitn(5, ',');
        let mut text = || fields.next().map(|field| field.trim_matches('"').to_owned());
        let (system, sensor, case, seconds, source) = (text()?, text()?, text()?, text()?, text()?);
        let case = case.parse().ok().and_then(Case::numbered);
        Some(RunTime { system, sensor, case, seconds: seconds.parse().ok()?, source })
    };
    RUN_TIMES.lines().skip(1).filter_map(time).collect()
}

/// A published power.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedPower {
    /// The system.
    pub system: String,
    /// The sensor as printed.
    pub sensor: String,
    /// Power, W.
    pub power_W: f64,
    /// Source of the figure.
    pub source: String,
}

const POWER: &str = include_str!("../../data/paper/power.csv");

/// All published figures of power, in the file's order.
pub fn powers() -> Vec<PublishedPower> {
    let power = |line: &str| {
        let mut fields = line.splitn(4, ',').map(str::to_owned);
        let (system, sensor, power_W) = (fields.next()?, fields.next()?, fields.next()?.parse().ok()?);
        Some(PublishedPower { system, sensor, power_W, source: fields.next()? })
    };
    POWER.lines().skip(1).filter_map(power).collect()
}

/// A conclusion of the paper about a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Conclusion {
    /// Number of the sensor, 1 to 4.
    pub sensor: u32,
    /// The case that the paper calls best.
    pub best: Case,
    /// Quotation and source.
    pub text: String,
}

const CONCLUSIONS: &str = include_str!("../../data/paper/conclusions.csv");

/// The paper's conclusions, by sensor.
pub fn conclusions() -> Vec<Conclusion> {
    let conclusion = |line: &str| {
        let mut fields = line.splitn(3, ',');
        let sensor = fields.next()?.parse().ok()?;
        let best = Case::numbered(fields.next()?.parse().ok()?)?;
        Some(Conclusion { sensor, best, text: fields.next()?.trim_matches('"').to_owned() })
    };
    CONCLUSIONS.lines().skip(1).filter_map(conclusion).collect()
}

const TABLE_2: &str = include_str!("../../data/paper/table2_errors_percent.csv");

/// The errors X1, X2, X3 of Table 2 for sensor 1 to 4 and a case, as fractions; `None` if the table has no such row.
pub fn table_2(sensor: u32, case: Case) -> Option<[f64; 3]> {
    TABLE_2.lines().skip(1).find_map(|line| {
        let mut fields = line.split(',');
        let mut number = || fields.next()?.parse::<f64>().ok();
        let (of_sensor, of_case) = (number()?, number()?);
        let (_rows, _cols) = (number()?, number()?);
        let errors = [number()? / 100.0, number()? / 100.0, number()? / 100.0];
        let same = of_sensor == f64::from(sensor) && Case::numbered(of_case as i64) == Some(case);
        same.then_some(errors)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dermis_golden::spec::partition::Grid;

    #[test]
    fn run_times_of_the_file() {
        let times = run_times();
        assert_eq!(times.len(), RUN_TIMES.lines().count() - 1);
        assert_eq!((times[0].seconds, times[0].case), (2705.33, Some(Case::WHOLE)));
        assert_eq!((&*times[4].sensor, times[4].seconds), ("8x8", 16.43));
        assert!(times[6].source.ends_with("maximum 14.7 %") && times[7].case.is_none());
    }

    #[test]
    fn powers_of_the_file() {
        let powers = powers();
        assert_eq!(powers.len(), POWER.lines().count() - 1);
        assert_eq!((&*powers[0].sensor, powers[0].power_W), ("10x10", 0.871));
    }

    #[test]
    fn a_conclusion_per_sensor() {
        let best = conclusions().into_iter().map(|c| (c.sensor, c.best.to_string())).collect::<Vec<_>>();
        assert_eq!(best, [(1, "0".into()), (2, "3".into()), (3, "2".into()), (4, "3".into())]);
    }

    #[test]
    fn rows_of_the_table() {
        assert_eq!(table_2(1, Case::WHOLE), Some([0.1284, 0.1293, 0.0754]));
        assert_eq!(table_2(2, Case::Grid(Grid { rows: 2, cols: 1 })), Some([0.42, -0.01, -0.07]));
        assert_eq!(table_2(4, Case::Grid(Grid { rows: 3, cols: 1 })), None);
        assert!((1..=4).all(|sensor| (0..4).all(|case| table_2(sensor, Case::numbered(case).unwrap()).is_some())));
    }
}
