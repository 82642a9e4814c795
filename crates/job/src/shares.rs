//! Label with the largest share of a file's face or of a triangle.

/// For each of `n` things, finds the label with the largest total area over the thing's parts; `None` for
/// things without parts.
///
/// A part is a thing, a label and an area. Ties go to the smallest label. O(k log k) for k parts.
pub fn largest_shares(n: usize, parts: impl Iterator<Item = (u32, u32, f64)>) -> Vec<Option<u32>> {
    let mut parts: Vec<(u32, u32, f64)> = parts.collect();
    // The sort is stable, so parts are always summed in the same order.
    parts.sort_by_key(|&(thing, label, _)| (thing, label));
    let mut largest: Vec<Option<(u32, f64)>> = vec![None; n];
    for of_label in parts.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (thing, label, _) = of_label[0];
        let area: f64 = of_label.iter().map(|part| part.2).sum();
        let largest = &mut largest[thing as usize];
        if largest.is_none_or(|(_, most)| area > most) {
            *largest = Some((label, area));
        }
    }
    largest
        .into_iter()
        .map(|most| most.map(|(label, _)| label))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_label_with_the_largest_sum_is_taken_in_any_order_of_parts() {
        // Thing 0: label 4 has the largest sum, by two parts; none has half. Thing 1: no part. Thing 2: no
        // area.
        let mut parts = vec![(0, 7, 4.0), (0, 4, 2.0), (0, 9, 4.5), (0, 4, 3.0), (2, 5, 0.0)];
        for _ in 0..parts.len() {
            parts.rotate_left(1);
            let found = largest_shares(3, parts.iter().copied());
            assert_eq!(found, [Some(4), None, Some(5)], "{parts:?}");
        }
        assert_eq!(
            largest_shares(1, [(0, 8, 1.0), (0, 3, 1.0)].into_iter()),
            [Some(3)]
        );
    }
}
