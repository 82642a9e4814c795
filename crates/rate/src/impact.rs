//! Impact force that stops a fall (Sect. 4.3, Eq. 2): the momentum m v vanishes within Δt.

/// Standard acceleration of gravity, mm/s².
const GRAVITY_MM_S2: f64 = 9806.65;
/// Duration of the impact, s.
const IMPACT_S: f64 = 1.0 / 300.0;

/// Force on a body of `mass_t` that has fallen by `drop_mm`, N: `m v / Δt` with `v = √(2 g h)`.
pub fn impact_n(mass_t: f64, drop_mm: f64) -> f64 {
    mass_t * (2.0 * GRAVITY_MM_S2 * drop_mm).sqrt() / IMPACT_S
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impact_takes_the_momentum_of_the_fall() {
        // 100 g from 1.275 m, the paper's 5 m/s: 0.5 N s in 1/300 s.
        assert!((impact_n(1e-4, 1275.0) - 150.0).abs() < 0.1);
        assert!((impact_n(2e-4, 1275.0) - 2.0 * impact_n(1e-4, 1275.0)).abs() < 1e-12);
        assert!((impact_n(1e-4, 5100.0) - 2.0 * impact_n(1e-4, 1275.0)).abs() < 1e-12);
    }
}
