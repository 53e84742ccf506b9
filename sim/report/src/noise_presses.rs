//! The table of `dermis noise --time`.

use anyhow::Result;
use dermis_study::noise::PressRow;

use super::table::{aligned, percent};
use super::Format;

/// A line per level, engine and motion, a column per kind of mean; as CSV and JSON a row for each of them.
///
/// # Errors
/// JSON that cannot be written.
pub fn presses(rows: &[PressRow], format: Format) -> Result<String> {
    Ok(match format {
        Format::Json => serde_json::to_string(rows)? + "\n",
        Format::Csv => csv(rows),
        Format::Markdown => text(rows),
    })
}

fn csv(rows: &[PressRow]) -> String {
    let mut text =
        "noise,estimator,mean,motion,frames,et_median,et_90,lag_frames,held,within_1,bound_1,bound_127\n".to_owned();
    let optional = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    for row in rows {
        let PressRow { noise, estimator, mean, motion, frames, tangential: [median, ninety], .. } = row;
        let figures =
            [row.lag_frames, row.held, row.within_1, row.bound.map(|own| own[0]), row.bound.map(|own| own[1])];
        let figures = figures.map(optional).join(",");
        text.push_str(&format!("{noise},{estimator},{mean},{motion},{frames},{median},{ninety},{figures}\n"));
    }
    text
}

fn text(rows: &[PressRow]) -> String {
    let key = |row: &PressRow| (row.noise, row.estimator.clone());
    let groups: Vec<&[PressRow]> = rows.chunk_by(|a, b| key(a) == key(b)).collect();
    let means = |group: &[PressRow]| -> Vec<Vec<PressRow>> {
        group.chunk_by(|a, b| a.mean == b.mean).map(<[PressRow]>::to_vec).collect()
    };
    let names: Vec<String> =
        groups.first().map_or(Vec::new(), |group| means(group).iter().map(|by_mean| by_mean[0].mean.clone()).collect());
    let lags: Vec<String> = names.iter().skip(1).map(|name| format!("lag, {name}")).collect();
    let head = ["noise", "estimator", "motion"].into_iter().chain(names.iter().map(String::as_str));
    let head: Vec<&str> =
        head.chain(lags.iter().map(String::as_str)).chain(["held", "1 σ", "bound", "of 127"]).collect();
    let mut lines = Vec::new();
    for group in groups {
        let means = means(group);
        for motion in 0..means[0].len() {
            let by_mean: Vec<&PressRow> = means.iter().map(|rows| &rows[motion]).collect();
            let Some(last) = by_mean.last() else { continue };
            let share = |value: Option<f64>| value.map_or("-".to_string(), |value| format!("{:.0} %", 100.0 * value));
            let error =
                |row: &&PressRow| row.tangential.map(|share| format!("{:.1}", 100.0 * share)).join(" / ") + " %";
            let lag = |row: &&PressRow| row.lag_frames.map_or("-".to_string(), |lag| format!("{lag:.0}"));
            let mut line = vec![percent(Some(last.noise)), last.estimator.clone(), last.motion.to_string()];
            line.extend(by_mean.iter().map(error));
            line.extend(by_mean.iter().skip(1).map(lag));
            line.extend([share(last.held), share(last.within_1)]);
            line.extend([0, 1].map(|k| percent(last.bound.map(|bound| bound[k]))));
            lines.push(line);
        }
    }
    let mut text = aligned(3, &head, lines);
    text.push_str(
        "\ne_t: median / nine of ten of the frames whose shear is above a quarter of the press's largest; lag: frames by which the shear is \
         behind; of the last mean: held: frames in which the remembered pressure held, 1 σ: components of the shear within one standard \
         deviation; bound: Cramér–Rao median of a frame alone and of the mean of 127 equal frames, support known\n",
    );
    text
}
