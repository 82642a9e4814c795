//! Bars of a plan: which stations each of them joins.

use shellock_geom::Vec3;
use shellock_mechanics::{Meeting, SIDES};

use super::VolumeModel;
use super::connector::{Bar, Section, Sections, Spans, tets_between};

/// Computes the cross-sections of all stations for a plan.
pub(super) fn sections(model: &VolumeModel, plan: &[Meeting]) -> Sections {
    use rayon::prelude::*;
    (plan.par_iter().enumerate())
        .map(|(i, m)| {
            SIDES.map(|side| {
                m.joint
                    .as_ref()
                    .map(|joint| Section::new(model, i, side, joint, 0.0))
            })
        })
        .collect()
}

/// Lists the bars of both sides.
///
/// Every joint has two bars on each side. It shares one with a neighbour that is joined alike. Towards any
/// other neighbour, and at the end of the seam, it has a bar of its own, which ends halfway.
pub(super) fn bars(model: &VolumeModel, plan: &[Meeting], sections: &Sections) -> Vec<Bar> {
    let mut bars = Bars {
        model,
        plan,
        sections,
        all: Vec::new(),
    };
    let ways: Vec<[Way; 2]> = model
        .steps
        .iter()
        .map(|step| ways(model, step.map(|s| s as usize)))
        .collect();
    let mut has_way = vec![[false; 2]; plan.len()];
    ways.iter()
        .flatten()
        .for_each(|way| has_way[way.station][usize::from(way.is_forward)] = true);
    for [from, to] in ways {
        let to_ends = [from, to].map(|way| Way {
            is_forward: !way.is_forward,
            ..way
        });
        let ends =
            |way: &Way| !std::mem::replace(&mut has_way[way.station][usize::from(way.is_forward)], true);
        let is_end = to_ends.each_ref().map(ends);
        if is_end[0] {
            bars.push_own(&to_ends[0]);
        }
        if !bars.push_pair([from.station, to.station]) {
            bars.push_own(&from);
            bars.push_own(&to);
        }
        if is_end[1] {
            bars.push_own(&to_ends[1]);
        }
    }
    for (station, has_way) in has_way.into_iter().enumerate() {
        let half_mm = 0.5 * model.stations[station].length_mm;
        for is_forward in [false, true]
            .into_iter()
            .filter(|is_forward| !has_way[usize::from(*is_forward)])
        {
            bars.push_own(&Way {
                station,
                is_forward,
                half_mm,
            });
        }
    }
    bars.all
}

/// Half a step from a station to the next, along its tangent or against it.
#[derive(Clone, Copy)]
struct Way {
    station: usize,
    is_forward: bool,
    half_mm: f64,
}

/// Half steps from both ends of a step towards each other.
fn ways(model: &VolumeModel, [from, to]: [usize; 2]) -> [Way; 2] {
    let step = model.inner_edge[to][0] - model.inner_edge[from][0];
    let way = |station: usize, step: Vec3| Way {
        station,
        is_forward: step.dot(model.stations[station].tangent) >= 0.0,
        half_mm: 0.5 * step.length(),
    };
    [way(from, step), way(to, -step)]
}

/// List of bars under construction.
struct Bars<'a> {
    model: &'a VolumeModel,
    plan: &'a [Meeting],
    sections: &'a Sections,
    all: Vec<Bar>,
}

impl Bars<'_> {
    /// Adds the two bars between two stations, if both are joined alike. Returns false otherwise.
    fn push_pair(&mut self, [from, to]: [usize; 2]) -> bool {
        let males = [from, to].map(|s| self.plan[s].joint.map(|joint| joint.male));
        let tets = SIDES.map(|side| {
            let [first, second] = [from, to].map(|s| self.sections[s][side.index()].as_ref());
            tets_between([first?, second?])
        });
        let ([Some(a), Some(b)], true) = (tets, males[0] == males[1]) else {
            return false;
        };
        for (side, tets) in SIDES.into_iter().zip([a, b]) {
            self.all.push(Bar {
                index: self.all.len(),
                side,
                from,
                to: Ok(to),
                tets,
            });
        }
        true
    }

    /// Adds the two bars of a single station, if it is joined.
    fn push_own(&mut self, way: &Way) {
        let from = way.station;
        let Some(joint) = &self.plan[from].joint else {
            return;
        };
        let along_mm = if way.is_forward { way.half_mm } else { -way.half_mm };
        for side in SIDES {
            let end = Section::new(self.model, from, side, joint, along_mm);
            let tets = self.sections[from][side.index()]
                .as_ref()
                .and_then(|section| tets_between([section, &end]));
            if let Some(tets) = tets {
                self.all.push(Bar {
                    index: self.all.len(),
                    side,
                    from,
                    to: Err(end),
                    tets,
                });
            }
        }
    }
}

pub(super) fn spans(bars: &[&Bar], n_stations: usize) -> Spans {
    let mut spans = vec![[None; 2]; n_stations];
    for (i, bar) in bars.iter().enumerate() {
        for station in bar.stations() {
            let span: &mut Option<[usize; 2]> = &mut spans[station][bar.side.index()];
            *span = Some([span.map_or(i, |s| s[0]), i]);
        }
    }
    spans
}
