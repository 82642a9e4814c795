//! Parts made of parts: meshes that occur several times, each time with another transform.

use glam::DAffine3;

use super::ReadError;

/// Largest number of occurrences of parts; a file with more multiplies itself.
const MAX_OCCURRENCES: u64 = 100_000;
/// Largest number of triangles in all occurrences.
const MAX_TRIANGLES: u64 = 20_000_000;

/// A part with triangles of its own, or with other parts as children, or both. `T` is an attribute of each
/// occurrence.
pub(super) struct Part<T> {
    /// Id of the part in the file, for messages.
    pub(super) id: String,
    /// Number of triangles of its own.
    pub(super) n_triangles: usize,
    /// Child parts with their transforms.
    pub(super) children: Vec<Occurrence<T>>,
}

/// A part with its transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Occurrence<T> {
    /// Index of the part.
    pub(super) part: usize,
    /// Transform from the part to its parent.
    pub(super) transform: DAffine3,
    /// Attribute of the occurrence.
    pub(super) attribute: T,
}

/// Lists all occurrences of parts with triangles below `roots`, in file order. `join` combines the attributes
/// of an occurrence and of one within it.
///
/// Errors for parts that contain themselves, and for more triangles or occurrences than the limits, before
/// the work is done.
pub(super) fn occurrences<T: Copy>(
    parts: &[Part<T>],
    roots: &[Occurrence<T>],
    kind: &'static str,
    join: impl Fn(T, T) -> T,
) -> Result<Vec<Occurrence<T>>, ReadError> {
    let sizes = sizes(parts, kind)?;
    let total = roots.iter().fold((0_u64, 0_u64), |sum, root| {
        (
            sum.0.saturating_add(sizes[root.part].0),
            sum.1.saturating_add(sizes[root.part].1),
        )
    });
    check_limits(total.0, total.1)?;
    let mut found = Vec::new();
    let mut todo: Vec<Occurrence<T>> = roots.iter().rev().copied().collect();
    while let Some(around) = todo.pop() {
        let part = &parts[around.part];
        if part.n_triangles > 0 {
            found.push(around);
        }
        todo.extend(part.children.iter().rev().map(|child| Occurrence {
            part: child.part,
            transform: around.transform * child.transform,
            attribute: join(around.attribute, child.attribute),
        }));
    }
    Ok(found)
}

/// Returns an error for more occurrences, or more triangles in all of them, than the limits.
pub(super) fn check_limits(n_occurrences: u64, n_triangles: u64) -> Result<(), ReadError> {
    if n_occurrences > MAX_OCCURRENCES || n_triangles > MAX_TRIANGLES {
        return Err(ReadError::TooManyCopies {
            what: "putting its parts together",
            limit: MAX_TRIANGLES,
        });
    }
    Ok(())
}

/// Counts the parts and the triangles below each part, itself included; an error for cycles.
fn sizes<T>(parts: &[Part<T>], kind: &'static str) -> Result<Vec<(u64, u64)>, ReadError> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Done,
    }
    let mut state = vec![State::New; parts.len()];
    let mut sizes = vec![(0_u64, 0_u64); parts.len()];
    for start in 0..parts.len() {
        // Stack of parts, each with the number of its children visited so far.
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
            if let Some(child) = parts[part].children.get(next) {
                path.push((part, next + 1));
                path.push((child.part, 0));
                continue;
            }
            state[part] = State::Done;
            let own = (1, parts[part].n_triangles as u64);
            sizes[part] = parts[part].children.iter().fold(own, |sum, child| {
                (
                    sum.0.saturating_add(sizes[child.part].0),
                    sum.1.saturating_add(sizes[child.part].1),
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

    /// A part whose children are moved along x; the attribute is the displacement.
    fn part(n_triangles: usize, children: &[(usize, f64)]) -> Part<f64> {
        let children = children.iter().map(|&(c, x)| place(c, x)).collect();
        Part {
            id: String::new(),
            n_triangles,
            children,
        }
    }

    fn place(part: usize, x: f64) -> Occurrence<f64> {
        Occurrence {
            part,
            transform: DAffine3::from_translation(DVec3::X * x),
            attribute: x,
        }
    }

    fn find(parts: &[Part<f64>], root: usize) -> Result<Vec<Occurrence<f64>>, ReadError> {
        occurrences(parts, &[place(root, 0.0)], "object", |around, own| {
            around + 2.0 * own
        })
    }

    #[test]
    fn moves_add_up_along_the_way_and_order_is_that_of_the_file() {
        let parts = [
            part(2, &[]),
            part(0, &[(0, 1.0), (0, 10.0)]),
            part(1, &[(1, 100.0)]),
        ];
        let found = find(&parts, 2).unwrap();
        let places: Vec<_> = found
            .iter()
            .map(|o| (o.part, o.transform.translation.x, o.attribute))
            .collect();
        assert_eq!(places, [(2, 0.0, 0.0), (0, 101.0, 202.0), (0, 110.0, 220.0)]);
    }

    #[test]
    fn cycles_and_multiplication_are_refused_without_unrolling_them() {
        let cycle = [part(1, &[(1, 0.0)]), part(0, &[(0, 0.0)])];
        assert!(matches!(find(&cycle, 0), Err(ReadError::Cycle { .. })));
        // Ten times ten times …: 10³⁰ triangles.
        let laughs: Vec<Part<f64>> = (0..31)
            .map(|i| {
                if i == 0 {
                    part(1, &[])
                } else {
                    part(0, &[(i - 1, 0.0); 10])
                }
            })
            .collect();
        assert!(matches!(find(&laughs, 30), Err(ReadError::TooManyCopies { .. })));
    }
}
