//! Ways to divide a model, in the order in which kits are made of them.

use shellock_geom::Solid;

use super::{KeySource, Params};
use crate::segmentation::{Method, usual_n_pieces};

/// Input of a job.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    pub params: &'a Params,
    pub model: &'a Solid,
    /// Labels of the triangles, if the user gives the division.
    pub labels: Option<&'a [i64]>,
}

impl<'a> Input<'a> {
    pub fn new(params: &'a Params, model: &'a Solid, labels: Option<&'a [i64]>) -> Self {
        Self {
            params,
            model,
            labels,
        }
    }
}

/// One way to divide a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Way {
    pub method: Method,
    pub n_pieces: Option<usize>,
    pub walls: Walls,
}

impl Way {
    /// Describes the pieces for people.
    pub fn words(self) -> String {
        let n = self.n_pieces.map_or_else(String::new, |n| format!("about {n} "));
        let walls = if self.walls == Walls::Thin {
            ", thin walls"
        } else {
            ""
        };
        let how = match self.method {
            Method::Creases => "of similar size",
            _ => "cut where a person would",
        };
        format!("{n}pieces {how}{walls}")
    }
}

/// Thickness of walls: that a kit locks comes before what it withstands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Walls {
    /// Thickness that a fall asks for, or a thicker wall for the sake of use, if such a kit passes.
    ForUse,
    /// Thickness that a fall asks for.
    ForFalls,
    /// Least thickness of walls, so that connectors have the most room.
    Thin,
}

/// Coarser divisions if the user asks for no number of pieces: share of the usual number, and walls. Fewer
/// pieces have longer seams, and thin bars are held by few seams.
const COARSER: [(f64, Walls); 2] = [(0.7, Walls::ForFalls), (0.35, Walls::Thin)];

/// Lists the ways to divide, in order: where a person would cut, coarser, still coarser with thin walls, and
/// pieces of similar size with thin walls. There is one way only if the user gives labels, a method or the
/// number of the key's piece.
pub(super) fn ways(input: &Input<'_>) -> Vec<Way> {
    let params = input.params;
    let first = Way {
        method: params.method,
        n_pieces: params.n_pieces,
        walls: Walls::ForUse,
    };
    // The number of a piece holds in this division alone.
    let has_named_key = matches!(params.key, KeySource::Piece(_));
    if params.method != Method::Auto || input.labels.is_some() || has_named_key {
        return vec![first];
    }
    let usual = usual_n_pieces(input.model.mesh().area()) as f64;
    let coarser = COARSER.map(|(share, walls)| Way {
        n_pieces: Some(((share * usual).round() as usize).max(2)),
        walls,
        ..first
    });
    let similar = Way {
        method: Method::Creases,
        walls: Walls::Thin,
        ..first
    };
    let coarser = coarser.into_iter().filter(|_| params.n_pieces.is_none());
    [first].into_iter().chain(coarser).chain([similar]).collect()
}

#[cfg(test)]
mod tests {
    use shellock_geom::Vec3;
    use shellock_test_surfaces::sphere;

    use super::*;

    fn ways_with(change: impl Fn(&mut Params), labels: Option<&[i64]>) -> Vec<Way> {
        let model = Solid::new(sphere(3, Vec3::splat(50.0))).expect("closed");
        let mut params = Params::default();
        params.method = Method::Auto;
        change(&mut params);
        ways(&Input {
            params: &params,
            model: &model,
            labels,
        })
    }

    #[test]
    fn fewer_pieces_come_second_and_third_and_pieces_of_similar_size_last() {
        let ways = ways_with(|_| (), None);
        let methods: Vec<Method> = ways.iter().map(|w| w.method).collect();
        assert_eq!(
            methods,
            [Method::Auto, Method::Auto, Method::Auto, Method::Creases]
        );
        let usual = usual_n_pieces(4.0 * std::f64::consts::PI * 50.0 * 50.0);
        assert_eq!(ways[0].n_pieces, None);
        let n = |i: usize| ways[i].n_pieces.unwrap();
        assert!(n(1) < usual && n(2) < n(1) && n(2) >= 2);
        let walls: Vec<Walls> = ways.iter().map(|w| w.walls).collect();
        assert_eq!(walls, [Walls::ForUse, Walls::ForFalls, Walls::Thin, Walls::Thin]);
    }

    #[test]
    fn every_way_keeps_the_number_of_pieces_that_the_user_asks_for() {
        let ways = ways_with(|p| p.n_pieces = Some(7), None);
        assert_eq!(ways.len(), 2);
        assert!(ways.iter().all(|w| w.n_pieces == Some(7)));
    }

    #[test]
    fn a_division_that_the_user_gives_is_the_only_way() {
        assert_eq!(ways_with(|p| p.method = Method::Creases, None).len(), 1);
        assert_eq!(ways_with(|p| p.key = KeySource::Piece(2), None).len(), 1);
        assert_eq!(ways_with(|_| (), Some(&[0; 1280])).len(), 1);
    }
}
