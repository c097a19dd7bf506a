//! The results of a rig: which rows are compared with which truth.

use std::collections::BTreeSet;

use hzn_files::rig::JOINT;
use hzn_files::truth::Truth;
use hzn_mcap::Row;

/// Returns the rows of one head; without a name, those of the joint answer. Results of a single camera are unchanged.
///
/// # Errors
/// The results have no such head, or no heads at all.
pub fn select(rows: Vec<Row>, wanted: Option<&str>) -> Result<Vec<Row>, String> {
    let heads: BTreeSet<String> = rows.iter().filter_map(|row| row.head.clone()).collect();
    if heads.is_empty() && wanted.is_none() {
        return Ok(rows);
    }
    let name = wanted.unwrap_or(JOINT);
    if !heads.contains(name) {
        let all: Vec<String> = heads.into_iter().collect();
        let what =
            if all.is_empty() { "none, because they are those of one camera".to_owned() } else { all.join(", ") };
        return Err(format!("no rows of the results have the head {name}; their heads: {what}"));
    }
    Ok(rows.into_iter().filter(|row| row.head.as_deref() == Some(name)).collect())
}

/// Returns whether these are the rows of the joint answer.
pub fn are_joint(rows: &[Row]) -> bool {
    rows.iter().any(|row| row.head.as_deref() == Some(JOINT))
}

/// Gives the rows of the joint answer the names of the truth's rows that are nearest in time. A row has the name of its
/// first head's picture, and another head's if that one has none, but an epoch is one row of the truth.
pub fn name_by_time(rows: &mut [Row], truth: &[Truth]) {
    let mut times: Vec<(f64, &str)> = truth.iter().map(|t| (t.time_s, t.file.as_str())).collect();
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    times.dedup_by(|a, b| a.0 == b.0);
    let step_s = times.windows(2).map(|w| w[1].0 - w[0].0).fold(f64::INFINITY, f64::min);
    for row in rows {
        let Some(time_s) = row.time_s else { continue };
        let after = times.partition_point(|(t, _)| *t < time_s);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| times.get(i));
        let nearest = near.min_by(|a, b| (a.0 - time_s).abs().total_cmp(&(b.0 - time_s).abs()));
        if let Some((_, file)) = nearest.filter(|(t, _)| (t - time_s).abs() < 0.5 * step_s) {
            row.file = (*file).to_owned();
        }
    }
}

#[cfg(test)]
mod tests {
    use hzn_core::status::Status;
    use hzn_mcap::RowMeta;

    use super::*;

    fn row(head: Option<&str>, file: &str, time_s: f64) -> Row {
        let meta = RowMeta { file: file.into(), time_s: Some(time_s), ..RowMeta::default() };
        Row { head: head.map(str::to_owned), ..Row::unprocessed(&meta, Status::NoLimb, "") }
    }

    #[test]
    fn the_joint_answer_is_compared_unless_a_head_is_named() {
        let rows = || vec![row(Some("rig"), "a", 0.0), row(Some("left"), "a", 0.0)];
        assert!(are_joint(&select(rows(), None).unwrap()));
        assert_eq!(select(rows(), Some("left")).unwrap()[0].head.as_deref(), Some("left"));
        assert!(select(rows(), Some("lft")).is_err());
        assert_eq!(select(vec![row(None, "a", 0.0)], None).unwrap().len(), 1);
        assert!(select(vec![row(None, "a", 0.0)], Some("left")).is_err());
    }

    #[test]
    fn an_epoch_has_the_name_of_the_truth_at_its_time() {
        let truth = |file: &str, time_s: f64| Truth { file: file.into(), time_s, ..Truth::default() };
        let mut rows = [row(Some("rig"), "right-1", 1.04), row(Some("rig"), "left-2", 2.6)];
        name_by_time(&mut rows, &[truth("left-0", 0.0), truth("left-1", 1.0), truth("left-2", 2.0)]);
        assert_eq!(rows.map(|row| row.file), ["left-1".to_owned(), "left-2".to_owned()]);
    }
}
