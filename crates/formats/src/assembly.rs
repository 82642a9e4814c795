//! Parts made of parts: meshes that occur several times, each time moved.

use glam::DAffine3;

use super::ReadError;

/// Occurrences of parts and triangles that are made at most; more is a file that multiplies itself.
const MAX_OCCURRENCES: u64 = 100_000;
/// Triangles of all occurrences.
const MAX_TRIANGLES: u64 = 20_000_000;

/// A part: triangles of its own, or others that are put together.
pub(super) struct Part {
    /// Its id in the file, for messages.
    pub(super) id: String,
    /// How many triangles it has of its own.
    pub(super) n_triangles: usize,
    /// Other parts, by index, and where they go.
    pub(super) children: Vec<(usize, DAffine3)>,
}

/// Where a part with triangles occurs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Occurrence {
    pub(super) part: usize,
    pub(super) placed: DAffine3,
}

/// All places of parts with triangles below `roots`, in file order.
///
/// Refuses parts that contain themselves, and more triangles or places than are made; the work is bounded by
/// that.
pub(super) fn occurrences(
    parts: &[Part],
    roots: &[(usize, DAffine3)],
    kind: &'static str,
) -> Result<Vec<Occurrence>, ReadError> {
    let sizes = sizes(parts, kind)?;
    let total = roots.iter().fold((0_u64, 0_u64), |sum, &(root, _)| {
        (
            sum.0.saturating_add(sizes[root].0),
            sum.1.saturating_add(sizes[root].1),
        )
    });
    check_limits(total.0, total.1)?;
    let mut found = Vec::new();
    let mut todo: Vec<(usize, DAffine3)> = roots.iter().rev().copied().collect();
    while let Some((part, placed)) = todo.pop() {
        if parts[part].n_triangles > 0 {
            found.push(Occurrence { part, placed });
        }
        todo.extend(
            parts[part]
                .children
                .iter()
                .rev()
                .map(|&(child, at)| (child, placed * at)),
        );
    }
    Ok(found)
}

/// Refuses more places of parts, or more triangles of all of them, than are made.
pub(super) fn check_limits(n_occurrences: u64, n_triangles: u64) -> Result<(), ReadError> {
    if n_occurrences > MAX_OCCURRENCES || n_triangles > MAX_TRIANGLES {
        return Err(ReadError::TooManyCopies {
            what: "putting its parts together",
            limit: MAX_TRIANGLES,
        });
    }
    Ok(())
}

/// For each part the number of parts and of triangles below it, itself included; refuses cycles.
fn sizes(parts: &[Part], kind: &'static str) -> Result<Vec<(u64, u64)>, ReadError> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Done,
    }
    let mut state = vec![State::New; parts.len()];
    let mut sizes = vec![(0_u64, 0_u64); parts.len()];
    for start in 0..parts.len() {
        // A part and how many of its children have been looked at.
        let mut path = vec![(start, 0)];
        while let Some((part, next)) = path.pop() {
            if next == 0 && state[part] == State::Done {
                continue;
            }
            if next == 0 && std::mem::replace(&mut state[part], State::Open) == State::Open {
                return Err(ReadError::Cycle {
                    kind,
                    id: parts[part].id.clone(),
                });
            }
            if let Some(&(child, _)) = parts[part].children.get(next) {
                path.push((part, next + 1));
                path.push((child, 0));
                continue;
            }
            state[part] = State::Done;
            let own = (1, parts[part].n_triangles as u64);
            sizes[part] = parts[part].children.iter().fold(own, |sum, &(child, _)| {
                (
                    sum.0.saturating_add(sizes[child].0),
                    sum.1.saturating_add(sizes[child].1),
                )
            });
        }
    }
    Ok(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn part(n_triangles: usize, children: &[(usize, f64)]) -> Part {
        let children = children
            .iter()
            .map(|&(c, x)| (c, DAffine3::from_translation(DVec3::X * x)))
            .collect();
        Part {
            id: String::new(),
            n_triangles,
            children,
        }
    }

    #[test]
    fn moves_add_up_along_the_way_and_order_is_that_of_the_file() {
        let parts = [
            part(2, &[]),
            part(0, &[(0, 1.0), (0, 10.0)]),
            part(1, &[(1, 100.0)]),
        ];
        let found = occurrences(&parts, &[(2, DAffine3::IDENTITY)], "object").unwrap();
        let places: Vec<_> = found.iter().map(|o| (o.part, o.placed.translation.x)).collect();
        assert_eq!(places, [(2, 0.0), (0, 101.0), (0, 110.0)]);
    }

    #[test]
    fn cycles_and_multiplication_are_refused_without_unrolling_them() {
        let cycle = [part(1, &[(1, 0.0)]), part(0, &[(0, 0.0)])];
        assert!(matches!(
            occurrences(&cycle, &[(0, DAffine3::IDENTITY)], "object"),
            Err(ReadError::Cycle { .. })
        ));
        // Ten times ten times …: 10³⁰ triangles.
        let laughs: Vec<Part> = (0..31)
            .map(|i| {
                if i == 0 {
                    part(1, &[])
                } else {
                    part(0, &[(i - 1, 0.0); 10])
                }
            })
            .collect();
        let refused = occurrences(&laughs, &[(30, DAffine3::IDENTITY)], "object");
        assert!(matches!(refused, Err(ReadError::TooManyCopies { .. })));
    }
}
