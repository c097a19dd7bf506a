//! The results of a rig: which rows are compared with which truth.

use std::collections::hash_map::Entry;
use std::collections::{BTreeSet, HashMap};

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
/// first head's picture, and another head's if that one has none, but an epoch is one row of the truth. A late head
/// gives a second epoch near that row, so the epoch with the most heads is kept, and the nearest one of several.
/// Returns the number of the others, which are removed.
///
/// # Errors
/// The truth has no times.
pub fn name_by_time(rows: &mut Vec<Row>, truth: &[Truth]) -> Result<usize, &'static str> {
    if truth.iter().any(|row| !row.time_s.is_finite()) {
        return Err("time_s: this column is missing; joint answers are paired by time");
    }
    let mut times: Vec<(f64, &str)> = truth.iter().map(|t| (t.time_s, t.file.as_str())).collect();
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    times.dedup_by(|a, b| a.0 == b.0);
    let step_s = times.windows(2).map(|w| w[1].0 - w[0].0).fold(f64::INFINITY, f64::min);
    let mut kept: HashMap<(String, String), ((usize, f64), usize)> = HashMap::new();
    let mut is_kept = vec![true; rows.len()];
    for (i, row) in rows.iter_mut().enumerate() {
        let Some(time_s) = row.time_s else { continue };
        let after = times.partition_point(|(t, _)| *t < time_s);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| times.get(i));
        let nearest = near.min_by(|a, b| (a.0 - time_s).abs().total_cmp(&(b.0 - time_s).abs()));
        let Some((t, file)) = nearest.filter(|(t, _)| (t - time_s).abs() < 0.5 * step_s) else { continue };
        row.file = (*file).to_owned();
        let heads = row.heads_used.as_deref().map_or(0, |names| names.split(' ').count());
        // More heads first, then a smaller distance.
        let rank = (heads, -(t - time_s).abs());
        let removed = match kept.entry((row.file.clone(), row.body.clone())) {
            Entry::Vacant(place) => {
                place.insert((rank, i));
                continue;
            }
            Entry::Occupied(mut place) if place.get().0 < rank => place.insert((rank, i)).1,
            Entry::Occupied(_) => i,
        };
        if let Some(is_kept) = is_kept.get_mut(removed) {
            *is_kept = false;
        }
    }
    let before = rows.len();
    let mut is_kept = is_kept.into_iter();
    rows.retain(|_| is_kept.next().unwrap_or(true));
    Ok(before - rows.len())
}

/// Returns what to tell the user about epochs that [`name_by_time`] removed; `None` if there are none.
pub fn describe_removed(removed: usize) -> Option<String> {
    let epochs = if removed == 1 { "1 epoch was" } else { &format!("{removed} epochs were") };
    (removed > 0).then(|| {
        format!(
            "{epochs} left out of the comparison, because another epoch near the same row of the truth has more heads \
             or is nearer in time: is a head late?"
        )
    })
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
        let mut rows = vec![row(Some("rig"), "right-1", 1.04), row(Some("rig"), "left-2", 2.6)];
        let truth = [truth("left-0", 0.0), truth("left-1", 1.0), truth("left-2", 2.0)];
        assert_eq!(name_by_time(&mut rows, &truth).unwrap(), 0);
        assert_eq!(rows.iter().map(|row| row.file.as_str()).collect::<Vec<_>>(), ["left-1", "left-2"]);
        // A late head is an epoch of its own, before or after the one with the other heads.
        let with = |heads: &str, time_s| Row { heads_used: Some(heads.into()), ..row(Some("rig"), "a", time_s) };
        let mut rows = vec![
            with("a b c", 0.0),
            with("d", 0.3),
            with("d", 1.0),
            with("a b c", 1.1),
            with("a", 2.2),
            with("b", 2.1),
            row(Some("rig"), "a", 2.0),
        ];
        assert_eq!(name_by_time(&mut rows, &truth).unwrap(), 4);
        let left: Vec<_> = rows.iter().map(|row| (row.file.as_str(), row.time_s)).collect();
        assert_eq!(left, [("left-0", Some(0.0)), ("left-1", Some(1.1)), ("left-2", Some(2.1))]);
        assert!(describe_removed(4).is_some_and(|text| text.starts_with("4 epochs were left out")));
        assert_eq!(describe_removed(0), None);
    }
}
