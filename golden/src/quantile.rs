//! Quantiles of values: the element at index ⌊share · n⌋ in sorted order, at most the last.

/// Median; of an even number of values the larger of the two middle ones. `None` without values.
pub fn median(values: Vec<f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// Quantile `share` (0 … 1) of values in any order. `None` without values.
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    sorted_quantile(&values, share)
}

/// Quantile `share` (0 … 1) of sorted values. `None` without values.
pub fn sorted_quantile(values: &[f64], share: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    values.get(((share * values.len() as f64) as usize).min(last)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_by_hand() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0]), Some(4.0));
        assert_eq!(median(vec![]), None);
        let ten: Vec<f64> = (0..10).map(f64::from).collect();
        assert_eq!((quantile(ten.clone(), 0.9), sorted_quantile(&ten, 1.0)), (Some(9.0), Some(9.0)));
    }
}
