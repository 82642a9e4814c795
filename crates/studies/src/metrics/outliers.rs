//! Disagreement of two metrics: the plans whose ranks differ most, and the openings at their stations.

use shellock_mechanics::{Opening, Side};

use super::Subject;
use super::column::Column;
use crate::statistics::mean_ranks;
use crate::table::Table;

/// A plan that holds by both metrics.
pub struct Outlier {
    /// Number of the plan.
    pub plan: usize,
    /// Rank among the plans that hold, by each metric; 1 is the worst.
    pub ranks: [f64; 2],
    /// Weakest station of the plan by each metric.
    pub stations: Vec<Deciding>,
}

/// A station that determines a plan's quality.
pub struct Deciding {
    /// Number of the station.
    pub station: u32,
    /// Pieces that meet at the station.
    pub pieces: [u32; 2],
    /// Weighted opening by each metric, mm.
    pub weighted_mm: [f64; 2],
}

/// Plans that hold by both metrics, sorted by the difference of their ranks, largest first.
pub fn outliers(subject: &Subject, first: &Column, second: &Column) -> Vec<Outlier> {
    let both: Vec<(usize, [&Opening; 2])> = (first.scores.iter().zip(&second.scores).enumerate())
        .filter_map(|(i, (a, b))| Some((i, [a.opening()?, b.opening()?])))
        .collect();
    let ranks = [0, 1].map(|m| mean_ranks(&both.iter().map(|b| b.1[m].quality_mm).collect::<Vec<_>>()));
    let outlier = |(i, (plan, openings)): (usize, &(usize, [&Opening; 2]))| {
        let deciding = openings.iter().filter_map(|o| o.worst).map(|station| {
            let at = station as usize;
            let weight = subject.meetings[*plan][at].joint.map_or(0.0, |j| j.weight);
            let pieces = subject.model.pieces_at(at).map(|p| p.0);
            Deciding {
                station,
                pieces,
                weighted_mm: openings.map(|o| weight * o.opening_mm[at]),
            }
        });
        Outlier {
            plan: *plan,
            ranks: [ranks[0][i], ranks[1][i]],
            stations: deciding.collect(),
        }
    };
    let mut outliers: Vec<Outlier> = both.iter().enumerate().map(outlier).collect();
    let difference = |o: &Outlier| (o.ranks[0] - o.ranks[1]).abs();
    outliers.sort_by(|x, y| difference(y).total_cmp(&difference(x)));
    outliers
}

/// Weight, frame and openings at every joint of the plans that hold by both metrics.
pub fn stations(subject: &Subject, first: &Column, second: &Column) -> Table {
    let mut table = Table::default();
    let names = [
        "plan", "station", "a", "b", "length", "weight", "male", "fast", "leaves N", "leaves v", "first",
        "second",
    ];
    table.columns.extend(names.map(|n| (n.to_owned(), Vec::new())));
    for (plan, (a, b)) in first.scores.iter().zip(&second.scores).enumerate() {
        let (Some(a), Some(b)) = (a.opening(), b.opening()) else {
            continue;
        };
        for (i, (station, meeting)) in subject
            .model
            .assembly
            .stations
            .iter()
            .zip(&subject.meetings[plan])
            .enumerate()
        {
            let Some(joint) = meeting.joint else { continue };
            let pieces = subject.model.pieces_at(i).map(|p| f64::from(p.0));
            let (male, fast) = (
                f64::from(u8::from(joint.male == Side::B)),
                f64::from(u8::from(joint.is_fast)),
            );
            let leaves = [station.normal, station.across].map(|v| joint.leaves.dot(v));
            let row = [
                plan as f64,
                i as f64,
                pieces[0],
                pieces[1],
                station.length_mm,
                joint.weight,
                male,
                fast,
                leaves[0],
                leaves[1],
                a.opening_mm[i],
                b.opening_mm[i],
            ];
            table.columns.iter_mut().zip(row).for_each(|(c, v)| c.1.push(v));
        }
    }
    table
}
