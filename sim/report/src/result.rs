//! One reconstruction as text: resultant, error, μ per subarray, flags, and a character map of fz.

use std::fmt::Write as _;

use dermis_golden::result::flags::Flag;
use dermis_golden::result::reconstruct::Reconstruction;
use dermis_golden::spec::sensor::Sensor;

use super::table::{percent, significant_digits};
use dermis_cosim::compare::Difference;

/// Characters from zero to the largest force.
const SHADES: [char; 8] = [' ', '.', ':', '-', '=', '+', '*', '#'];
/// Largest number of missing taxels that are named.
const SHOWN: usize = 8;
/// Largest width of the map in characters; for wider arrays a character shows the largest force of a group of taxels.
const PICTURE_COLUMNS: usize = 60;

/// Summary of one result. `full_scale_MPa` is the stress of the largest input code.
pub fn reconstruction(result: &Reconstruction, sensor: &Sensor, full_scale_MPa: f64) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = lines(&mut text, result, full_scale_MPa);
    picture(&mut text, sensor, &result.forces_N.fz);
    text
}

fn lines(text: &mut String, result: &Reconstruction, full_scale_MPa: f64) -> std::fmt::Result {
    let largest = result.resultant_N.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let sign = |x: f64| if x.is_sign_negative() { "" } else { "+" };
    let axes = |values: [f64; 3], largest: f64| {
        let [x, y, normal] = values.map(|x| sign(x).to_owned() + &significant_digits(x, largest));
        format!("x {x}   y {y}   normal {normal}")
    };
    writeln!(text, "{}, frame {}, engine {}", result.scene, result.frame, result.engine)?;
    writeln!(text, "full scale      {} MPa", significant_digits(full_scale_MPa, full_scale_MPa))?;
    if let Some(frames) = result.extra.mean_frames {
        let lag = result.extra.lag_frames.map_or(String::new(), |lag| format!(", forces behind by {lag:.0}"));
        writeln!(text, "sliding mean    {frames} frames{lag}")?;
    }
    if let Some(template) = result.extra.template {
        let holds = if template.held { "holds" } else { "does not hold" };
        writeln!(text, "pressure        remembered {holds}, residual {:.2}", template.residual)?;
    }
    writeln!(text, "resultant, N    {}", axes(result.resultant_N, largest))?;
    if let Some(wrench) = result.extra.wrench {
        let largest = wrench.moment_Nmm.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        writeln!(text, "moment, N mm    {}", axes(wrench.moment_Nmm, largest))?;
    }
    if let Some(e) = &result.error {
        let axes = [e.x1, e.x2, e.x3].map(percent);
        writeln!(text, "error           x {}   y {}   normal {}", axes[0], axes[1], axes[2])?;
        writeln!(text, "error, resultant   e_t {}   e_n {}", percent(e.tangential), percent(e.normal))?;
    }
    for s in &result.subarrays {
        let centroid = |c: Option<[f64; 2]>| c.map_or("-".to_owned(), |[x, y]| format!("({x:+.2}, {y:+.2}) mm"));
        let spread = |x: f64| significant_digits(x, largest);
        let shear = s.shear_sigma_N.map(|[x, y]| format!(", shear ± ({}, {}) N", spread(x), spread(y)));
        let normal = s.normal_sigma_N.map(|sigma| format!(", normal ± {} N", spread(sigma)));
        writeln!(
            text,
            "subarray {}x{} at row {}, column {}: condition {}, mu ({:+.4}, {:+.4}), compression at {}, tension at {}{}{}",
            s.rows,
            s.cols,
            s.row0,
            s.col0,
            if s.centroid_condition { "met" } else { "not met" },
            s.mu[0],
            s.mu[1],
            centroid(s.compression_centroid_mm),
            centroid(s.tension_centroid_mm),
            shear.unwrap_or_default(),
            normal.unwrap_or_default(),
        )?;
    }
    let mut contact = |centre_mm: Option<[f64; 2]>, force_N: [f64; 3], sigma_N: [Option<f64>; 3]| {
        let along = |axis: usize| {
            let force = sign(force_N[axis]).to_owned() + &significant_digits(force_N[axis], largest);
            force + &sigma_N[axis].map_or(String::new(), |sigma| format!(" ± {}", significant_digits(sigma, largest)))
        };
        let place = centre_mm.map_or("-".to_owned(), |[x, y]| format!("({x:+.2}, {y:+.2}) mm"));
        writeln!(text, "contact at {place}, N   x {}   y {}   normal {}", along(0), along(1), along(2))
    };
    for found in result.contacts().into_iter().flatten() {
        let [x, y] = found.shear_sigma_N.map_or([None; 2], |sigma| sigma.map(Some));
        contact(found.centre_mm, found.force_N, [x, y, found.normal_sigma_N])?;
    }
    if !result.extra.missing.is_empty() {
        let names: Vec<String> = result
            .extra
            .missing
            .iter()
            .take(SHOWN)
            .map(|taxel| format!("row {}, column {}", taxel.row, taxel.col))
            .collect();
        let more = result.extra.missing.len() - names.len();
        let more = if more > 0 { format!("; {more} more") } else { String::new() };
        writeln!(text, "missing         {}{more}", names.join("; "))?;
    }
    let flag = |flag: &Flag| {
        let name = flag.name();
        result.checks.figure(*flag).map_or(name.to_owned(), |figure| format!("{name} ({figure})"))
    };
    let flags: Vec<String> = result.flags.iter().map(flag).collect();
    writeln!(text, "flags           {}", if flags.is_empty() { "none".to_owned() } else { flags.join(", ") })
}

/// One line with the difference of a result from the golden model's.
pub fn difference(d: &Difference) -> String {
    format!(
        "against golden  at most {:.0} LSB = {} of the largest force, RMS {:.0} LSB = {}\n",
        d.max_lsb,
        percent(Some(d.max_share)),
        d.rms_lsb,
        percent(Some(d.rms_share)),
    )
}

/// fz as a character map, row 0 on top, two characters per taxel if they fit.
fn picture(text: &mut String, sensor: &Sensor, fz: &[f64]) {
    let peak = fz.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if peak == 0.0 {
        return;
    }
    let group = sensor.cols.max(sensor.rows).div_ceil(PICTURE_COLUMNS);
    let repeat = if 2 * sensor.cols <= PICTURE_COLUMNS { 2 } else { 1 };
    text.push_str(&format!("fz, darkest {} N per taxel, o is tension\n", significant_digits(peak, peak)));
    for row in (0..sensor.rows).step_by(group) {
        let shades = (0..sensor.cols).step_by(group).map(|col| {
            let rows = row..(row + group).min(sensor.rows);
            let cells = rows.flat_map(|r| (col..(col + group).min(sensor.cols)).map(move |c| r * sensor.cols + c));
            let force = cells.map(|index| fz[index]).fold(0.0, |m: f64, v| if v.abs() > m.abs() { v } else { m });
            let level = (force.abs() / peak * (SHADES.len() - 1) as f64).round() as usize;
            match (level, force < 0.0) {
                (0, _) | (_, false) => SHADES[level.min(SHADES.len() - 1)],
                (_, true) => 'o',
            }
        });
        let line: String = shades.flat_map(|shade| std::iter::repeat_n(shade, repeat)).collect();
        text.push_str(&format!("  |{line}|\n"));
    }
}
