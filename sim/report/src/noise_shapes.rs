//! The tables of `dermis noise --shapes` and `--unlike`.

use anyhow::Result;
use dermis_study::noise::coverage::Coverage;
use dermis_study::noise::outcome::Summary;
use dermis_study::noise::statistic::{ErrorSpread, Interval};
use dermis_study::noise::{SensitivityRow, ShapeRow, SlipRow, UnlikeRow};

use super::table::{aligned, percent};
use super::Format;

/// A fraction in percent.
fn of(value: f64) -> String {
    percent(Some(value))
}

/// A value with its interval in brackets.
fn with_interval(interval: &Interval) -> String {
    format!("{} ({:.3}–{:.3})", of(interval.value), 100.0 * interval.low, 100.0 * interval.high)
}

/// The rows as text, JSON or CSV.
///
/// # Errors
/// JSON that cannot be written.
pub fn shapes(rows: &[ShapeRow], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => csv(rows),
        Format::Markdown => text(rows),
    })
}

fn text(rows: &[ShapeRow]) -> String {
    let several = rows.iter().any(|row| row.summary.contact_tangential.is_some());
    let mut head =
        vec!["noise", "estimator", "e_t median", "e_t 90 %", "e_n median", "e_n 90 %", "flagged", "bound e_t", "90 %"];
    if several {
        head.extend(["e_t over Σ median", "90 %", "each contact's e_t median", "90 %"]);
    }
    let line = |row: &ShapeRow| {
        let Summary { tangential, normal, over_all, contact_tangential, flagged, .. } = &row.summary;
        let mut cells = vec![
            of(row.noise),
            row.estimator.clone(),
            with_interval(&tangential.median),
            with_interval(&tangential.ninety),
            of(normal.median.value),
            of(normal.ninety.value),
            of(flagged.value),
            of(row.bound.tangential[0]),
            of(row.bound.tangential[1]),
        ];
        if several {
            for spread in [over_all, contact_tangential] {
                let own =
                    |of: fn(&ErrorSpread) -> &Interval| spread.as_ref().map_or("-".into(), |e| with_interval(of(e)));
                cells.extend([own(|e| &e.median), own(|e| &e.ninety)]);
            }
        }
        cells
    };
    let mut text = aligned(2, &head, rows.iter().map(line).collect());
    text.push_str(&conditions(rows));
    text.push_str(
        "e_t, e_n: tangential and normal error of the resultant; (…): 95 % interval by the bootstrap, in percent; none: no \
         shear at all, Σ b·area for the normal force; flagged: share of frames with a flag; bound: Cramér–Rao, support \
         known, smooth pressure\n",
    );
    if several {
        text.push_str("over Σ: tangential error of the resultant over the sum of all contacts' tangential forces\n");
    }
    text
}

/// One line: what is the same in all rows.
fn conditions(rows: &[ShapeRow]) -> String {
    let Some(row) = rows.first() else { return "\n".to_owned() };
    format!(
        "\n{} frames of {} contact{}, {} averaged, gain spread {}, {}, noise {}\n",
        row.summary.draws,
        row.contacts,
        if row.contacts == 1 { "" } else { "s" },
        row.frames,
        of(row.gain_spread),
        if row.unipolar { "unipolar" } else { "bipolar" },
        if row.noise_stated { "stated in the scene" } else { "not stated" },
    )
}

/// Median and nine-of-ten errors: a line per noise level, a column per estimator, then the bound. With several contacts
/// they are those over the sum of all tangential forces, and the bound, which is of the resultant's shear, is left out.
pub fn shape_medians(rows: &[ShapeRow]) -> String {
    let bound = rows.iter().all(|row| row.contacts == 1);
    let lines: Vec<&[ShapeRow]> = rows.chunk_by(|a, b| a.noise == b.noise).collect();
    let names = lines.first().into_iter().flat_map(|line| line.iter()).map(|row| format!("`{}`", row.estimator));
    let head: Vec<String> =
        std::iter::once("noise".to_owned()).chain(names).chain(bound.then(|| "Cramér–Rao bound".to_owned())).collect();
    let pair = |median: f64, ninety: f64| format!("{} / {}", of(median), of(ninety));
    let line = |rows: &[ShapeRow]| {
        let own = |row: &ShapeRow| {
            let spread = row.summary.over_all.as_ref().unwrap_or(&row.summary.tangential);
            pair(spread.median.value, spread.ninety.value)
        };
        let [median, ninety] = rows[0].bound.tangential;
        let cells = rows.iter().map(own).chain(bound.then(|| pair(median, ninety)));
        std::iter::once(of(rows[0].noise)).chain(cells).collect()
    };
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    aligned(1, &head, lines.into_iter().map(line).collect())
}

/// How often the forces are within their standard deviations.
pub fn coverage(rows: &[ShapeRow]) -> String {
    let head = ["noise", "estimator", "shape", "frames", "1 σ", "2 σ", "normal 1 σ", "normal 2 σ", "beyond 3 σ"];
    let line = |row: &ShapeRow| {
        let coverage = row.summary.coverage.as_ref();
        let share = |of: fn(&Coverage) -> Option<&Interval>| coverage.and_then(of).map_or("-".into(), with_interval);
        vec![
            of(row.noise),
            row.estimator.clone(),
            row.shape.to_owned(),
            coverage.map_or("-".into(), |coverage| coverage.frames.to_string()),
            share(|c| Some(&c.within_1)),
            share(|c| Some(&c.within_2)),
            share(|c| c.normal_within_1.as_ref()),
            share(|c| c.normal_within_2.as_ref()),
            share(|c| Some(&c.beyond_3)),
        ]
    };
    let rows: Vec<&ShapeRow> = rows.iter().filter(|row| row.estimator != "none").collect();
    let mut text = aligned(3, &head, rows.iter().map(|row| line(row)).collect());
    let owned: Vec<ShapeRow> = rows.into_iter().cloned().collect();
    text.push_str(&conditions(&owned));
    text.push_str(
        "1 σ, 2 σ: share of the tangential components within one and two of their standard deviations; beyond 3 σ: share of \
         frames of which one is off by more; (…): 95 % interval; -: the estimator gives no standard deviation\n",
    );
    text
}

/// The table of sensitivities.
///
/// # Errors
/// JSON that cannot be written.
pub fn sensitivity(rows: &[SensitivityRow], level: f64, format: Format) -> Result<String> {
    let off = |row: &SensitivityRow| match row.off {
        None => "-".to_owned(),
        // A spread has no sign.
        Some(off) if row.what == "gain spread" => format!("{} %", 100.0 * off),
        Some(off) => format!("{:+} %", 100.0 * off),
    };
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => {
            let mut text = format!("what,off,medium,estimator,{}\n", summary_head());
            for row in rows {
                let off = row.off.map_or(String::new(), |off| off.to_string());
                let medium = row.medium.replace(',', ";");
                text.push_str(&format!(
                    "{},{off},{medium},{},{}\n",
                    row.what,
                    row.estimator,
                    summary_csv(&row.summary)
                ));
            }
            text
        }
        Format::Markdown => {
            let head =
                ["stated wrongly", "by", "true medium", "estimator", "e_t median", "e_t 90 %", "e_n median", "flagged"];
            let line = |row: &SensitivityRow| {
                let Summary { tangential, normal, flagged, .. } = &row.summary;
                vec![
                    row.what.to_owned(),
                    off(row),
                    row.medium.clone(),
                    row.estimator.clone(),
                    with_interval(&tangential.median),
                    with_interval(&tangential.ninety),
                    of(normal.median.value),
                    of(flagged.value),
                ]
            };
            let mut text = aligned(4, &head, rows.iter().map(line).collect());
            let draws = rows.first().map_or(0, |row| row.summary.draws);
            text.push_str(&format!("\n{draws} frames, noise {} of max |b|; (…): 95 % interval\n", of(level)));
            text
        }
    })
}

/// Name and text of one figure of [`SlipRow`].
type SlipFigure = (&'static str, fn(&SlipRow) -> String);

/// The table over the kinds of slip: a line per level, estimator and figure, a column per kind.
///
/// # Errors
/// JSON that cannot be written.
pub fn slips(rows: &[SlipRow], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => {
            let mut text = "noise,estimator,slip,draws,bias,et_median,et_90,within_1\n".to_owned();
            for row in rows {
                let SlipRow { noise, estimator, slip, draws, bias, tangential: [median, ninety], within_1 } = row;
                let within_1 = within_1.map_or(String::new(), |share| share.to_string());
                text.push_str(&format!("{noise},{estimator},{slip},{draws},{bias},{median},{ninety},{within_1}\n"));
            }
            text
        }
        Format::Markdown => {
            let groups: Vec<&[SlipRow]> =
                rows.chunk_by(|a, b| (a.noise, &a.estimator) == (b.noise, &b.estimator)).collect();
            let kinds = groups.first().into_iter().flat_map(|group| group.iter()).map(|row| row.slip.as_str());
            let head: Vec<&str> = ["noise", "estimator", "figure"].into_iter().chain(kinds).collect();
            let figures: [SlipFigure; 3] = [
                ("bias", |row| format!("{:+.1} %", 100.0 * row.bias)),
                ("e_t", |row| row.tangential.map(|share| format!("{:.1}", 100.0 * share)).join(" / ") + " %"),
                ("1 σ", |row| row.within_1.map_or("-".into(), |share| format!("{:.0} %", 100.0 * share))),
            ];
            let line = |group: &[SlipRow], (name, figure): SlipFigure| {
                let named = [of(group[0].noise), group[0].estimator.clone(), name.to_owned()];
                named.into_iter().chain(group.iter().map(figure)).collect()
            };
            let lines = groups.iter().flat_map(|group| figures.map(|figure| line(group, figure))).collect();
            let mut text = aligned(3, &head, lines);
            let draws = rows.first().map_or(0, |row| row.draws);
            text.push_str(&format!(
                "\n{draws} frames, the same contacts in every column. full: full slip; numbers: shear over the friction limit; even: \
                 the same shear everywhere.\nbias: median error along the true shear; e_t: median / nine of ten; 1 σ: share of the \
                 tangential components within one standard deviation\n"
            ));
            text
        }
    })
}

/// The table of frames like and unlike a network's training.
///
/// # Errors
/// JSON that cannot be written.
pub fn unlike(rows: &[UnlikeRow], format: Format) -> Result<String> {
    let shares = |row: &UnlikeRow| [row.flagged, row.flagged_if_stated, row.any];
    let misfit = |row: &UnlikeRow, none: &str| row.misfit.map_or(none.to_owned(), |misfit| format!("{misfit:.2}"));
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => {
            let shares_head = ["flagged", "flagged_if_stated", "any"].map(interval_head).join(",");
            let mut text = format!("frame,estimator,frames,misfit,{shares_head}\n");
            for row in rows {
                let shares = shares(row).map(|own| format!("{},{},{}", own.value, own.low, own.high)).join(",");
                let (frame, estimator, frames) = (&row.frame, &row.estimator, row.frames);
                text.push_str(&format!("{frame},{estimator},{frames},{},{shares}\n", misfit(row, "")));
            }
            text
        }
        Format::Markdown => {
            let head = ["frame", "estimator", "misfit median", "flag misfit", "noise stated", "any flag"];
            let line = |row: &UnlikeRow| {
                let [flagged, stated, any] = shares(row).map(|share| of(share.value));
                vec![row.frame.clone(), row.estimator.clone(), misfit(row, "-"), flagged, stated, any]
            };
            let mut text = aligned(2, &head, rows.iter().map(line).collect());
            let frames = rows.first().map_or(0, |row| row.frames);
            text.push_str(&format!(
                "\n{frames} frames of each kind; misfit: over its limit, noise not stated; flag misfit, any flag: share of \
                 frames with it; noise stated: share with the flag misfit, had the scene stated the noise\n"
            ));
            text
        }
    })
}

/// Columns of a value with its interval.
fn interval_head(name: &str) -> String {
    format!("{name},{name}_low,{name}_high")
}

/// Columns of [`summary_csv`].
fn summary_head() -> String {
    let coverage = ["within_1", "within_2", "normal_within_1", "normal_within_2", "beyond_3"];
    let names = [
        "et_median",
        "et_90",
        "en_median",
        "en_90",
        "over_all_median",
        "over_all_90",
        "contact_et_median",
        "contact_et_90",
        "flagged",
    ];
    let all: Vec<String> = names.iter().chain(&coverage).map(|name| interval_head(name)).collect();
    format!("draws,{}", all.join(","))
}

fn summary_csv(summary: &Summary) -> String {
    let Summary { draws, tangential, normal, over_all, contact_tangential: own, flagged, coverage } = summary;
    let intervals = [
        Some(tangential.median),
        Some(tangential.ninety),
        Some(normal.median),
        Some(normal.ninety),
        over_all.map(|over_all| over_all.median),
        over_all.map(|over_all| over_all.ninety),
        own.map(|own| own.median),
        own.map(|own| own.ninety),
        Some(*flagged),
        coverage.map(|c| c.within_1),
        coverage.map(|c| c.within_2),
        coverage.and_then(|c| c.normal_within_1),
        coverage.and_then(|c| c.normal_within_2),
        coverage.map(|c| c.beyond_3),
    ];
    let cell =
        |interval: &Option<Interval>| interval.map_or(",,".into(), |i| format!("{},{},{}", i.value, i.low, i.high));
    format!("{draws},{}", intervals.iter().map(cell).collect::<Vec<_>>().join(","))
}

fn csv(rows: &[ShapeRow]) -> String {
    let mut text = format!(
        "noise,frames,gain_spread,unipolar,told,contacts,shape,estimator,{},\
         bound_et_median,bound_et_90,bound_en_median,bound_en_90\n",
        summary_head()
    );
    for row in rows {
        let ([et, et_90], [en, en_90]) = (row.bound.tangential, row.bound.normal);
        text.push_str(&format!(
            "{},{},{},{},{},{},{},{},{},{et},{et_90},{en},{en_90}\n",
            row.noise,
            row.frames,
            row.gain_spread,
            row.unipolar,
            row.noise_stated,
            row.contacts,
            row.shape,
            row.estimator,
            summary_csv(&row.summary)
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::csv_reader;
    use super::*;
    use dermis_study::noise::BoundSpread;

    fn row(estimator: &str, noise: f64, covered: bool) -> ShapeRow {
        let interval = |value: f64| Interval { value, low: value / 2.0, high: value * 2.0 };
        let spread = |by: f64| ErrorSpread { median: interval(by), ninety: interval(3.0 * by) };
        let coverage = Coverage {
            frames: 7,
            within_1: interval(0.25),
            within_2: interval(0.5),
            normal_within_1: Some(interval(0.125)),
            normal_within_2: Some(interval(0.375)),
            beyond_3: interval(0.0625),
        };
        ShapeRow {
            noise,
            frames: 64,
            gain_spread: 0.01,
            unipolar: true,
            noise_stated: false,
            contacts: 2,
            shape: "ring",
            estimator: estimator.into(),
            summary: Summary {
                draws: 20,
                tangential: spread(0.03),
                normal: spread(0.01),
                over_all: Some(spread(0.04)),
                contact_tangential: Some(spread(0.05)),
                flagged: interval(0.1),
                coverage: covered.then_some(coverage),
            },
            bound: BoundSpread { tangential: [0.02, 0.04], normal: [0.001, 0.002], draws: 20 },
        }
    }

    #[test]
    fn csv_reads_back() {
        let rows = [row("none", 1e-4, false), row("search sparse", 1e-4, true)];
        let (head, records) = csv_reader::csv(&shapes(&rows, Format::Csv).unwrap());
        assert_eq!((head.len(), records.len()), (8 + 1 + 42 + 4, 2));
        let of = |record: &Vec<String>, name: &str| csv_reader::field(&head, record, name).to_owned();
        assert_eq!(of(&records[1], "estimator"), "search sparse");
        for (name, wanted) in [
            ("et_median", 0.03),
            ("et_90_low", 0.045),
            ("over_all_median", 0.04),
            ("contact_et_90", 0.15),
            ("bound_en_90", 0.002),
        ] {
            assert!((of(&records[0], name).parse::<f64>().unwrap() - wanted).abs() < 1e-12, "{name}");
        }
        assert_eq!((of(&records[0], "within_1").as_str(), of(&records[1], "beyond_3").as_str()), ("", "0.0625"));
    }

    #[test]
    fn json_has_the_summary_beside_the_conditions() {
        let json = shapes(&[row("evidence", 0.01, true)], Format::Json).unwrap();
        let read: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(read[0].pointer("/tangential/median/value").unwrap().as_f64(), Some(0.03));
        assert_eq!(read[0].pointer("/coverage/within_2/low").unwrap().as_f64(), Some(0.25));
        assert_eq!(read[0].pointer("/bound/tangential/1").unwrap().as_f64(), Some(0.04));
    }

    #[test]
    fn tables_by_hand() {
        let rows =
            [row("none", 1e-4, false), row("auto", 1e-4, true), row("none", 0.01, false), row("auto", 0.01, true)];
        let third = |rows: &[ShapeRow]| {
            let medians = shape_medians(rows);
            assert_eq!(medians.lines().count(), 4);
            medians.lines().nth(2).unwrap().split_whitespace().collect::<Vec<_>>().join(" ")
        };
        assert_eq!(third(&rows), "| 0.01 % | 4.00 % / 12.00 % | 4.00 % / 12.00 % |");
        let single = rows.clone().map(|row| {
            let summary = Summary { over_all: None, contact_tangential: None, ..row.summary };
            ShapeRow { contacts: 1, summary, ..row }
        });
        assert_eq!(third(&single), "| 0.01 % | 3.00 % / 9.00 % | 3.00 % / 9.00 % | 2.00 % / 4.00 % |");
        let covered = coverage(&rows);
        assert!(!covered.contains("none") && covered.contains("| 25.00 % (12.500–50.000) |"), "{covered}");
        assert!(
            covered.contains("20 frames of 2 contacts, 64 averaged, gain spread 1.00 %, unipolar, noise not stated")
        );
        let off = SensitivityRow {
            what: "pitch",
            off: Some(0.05),
            medium: "bonded-layer, poisson 0.48".into(),
            estimator: "auto".into(),
            summary: rows[0].summary.clone(),
        };
        let text = sensitivity(std::slice::from_ref(&off), 1e-3, Format::Markdown).unwrap();
        assert!(text.contains("| pitch          | +5 % | bonded-layer, poisson 0.48 |"), "{text}");
        let (head, records) = csv_reader::csv(&sensitivity(&[off], 1e-3, Format::Csv).unwrap());
        assert_eq!((head.len(), records[0].len()), (4 + 1 + 42, 47));
    }
}
