//! Parses regions to keep whole.

use shellock::segmentation::KeepWhole;

/// Parses a region to keep whole: `X,Y,Z,R` in mm with R above 0, or a label.
pub fn keep_whole(text: &str) -> Result<KeepWhole, String> {
    let wrong = || "give X,Y,Z,R in mm, such as 0,-30,120,25, or a label, such as 3".to_owned();
    if let Ok(label) = text.trim().parse() {
        return Ok(KeepWhole::Label(label));
    }
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z, radius_mm]) if radius_mm > 0.0 => Ok(KeepWhole::Sphere {
            center_mm: [x, y, z],
            radius_mm,
        }),
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_is_a_place_and_a_radius_or_a_label() {
        let ball = KeepWhole::Sphere {
            center_mm: [0.0, -30.0, 1.5],
            radius_mm: 25.0,
        };
        assert_eq!(keep_whole("0, -30,1.5,25"), Ok(ball));
        assert_eq!(keep_whole("-3"), Ok(KeepWhole::Label(-3)));
        for wrong in ["", "1,2,3", "1,2,3,0", "1,2,3,-4", "a", "1,2,3,4,5"] {
            assert!(keep_whole(wrong).is_err(), "{wrong}");
        }
    }
}
