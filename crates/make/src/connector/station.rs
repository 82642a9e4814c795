//! Stations of a run, with the kinds of their cross-sections.

use shellock_geom::Vec3;
use shellock_report::PatchId;

/// A place on a run, with the frame of its cross-section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunStation {
    /// Point on the edge between the wall and the inner surface.
    pub point: Vec3,
    /// Unit tangent `u` of the seam.
    pub tangent: Vec3,
    /// Unit vector from male to female, perpendicular to `u` and ŝ.
    pub n: Vec3,
    /// ŝ: unit direction in which the male leaves the female.
    pub s: Vec3,
    /// Angle T from the outward normal to ŝ, seen along the seam, positive towards the female; rad in [−π/2,
    /// π/2].
    pub theta: f64,
    /// Length of ŝ projected across the seam, in (0, 1].
    pub depth: f64,
    /// Distance along the curve, mm.
    pub arc_mm: f64,
    /// Connector size D, mm.
    pub size_mm: f64,
    /// Gap between the two halves, mm.
    pub clearance_mm: f64,
    /// Kind of the cross-section.
    pub shape: RunShape,
}

/// The kinds of cross-sections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunShape {
    /// Pin and channel of a seam that the piece leaves across.
    Seam,
    /// Closed end of such a channel, beyond the pin.
    Stop,
    /// Tongue and groove of a seam that a key slides along; `n` points to the key, ŝ out of the surface.
    Rail(RailPart),
}

/// Position of a section on a rail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RailPart {
    /// The tongue in full width.
    Full,
    /// The tip of the tongue, narrower so that the groove finds it.
    LeadIn,
    /// The end of the groove beyond the tongue, which stops the key.
    Stop,
}

/// One stretch of connector: a pin of `male` in a channel of `female`.
#[derive(Clone, Debug)]
pub struct Run {
    /// The piece with the pin.
    pub male: PatchId,
    /// The piece with the channel.
    pub female: PatchId,
    /// Sections to sweep through, in order; two or more.
    pub stations: Vec<RunStation>,
}

impl RunStation {
    /// The point at coordinates along `n` and ŝ, mm.
    pub fn place(&self, n: f64, s: f64) -> Vec3 {
        self.point + n * self.n + s * self.s
    }
}

impl Run {
    /// Returns true if the run closes on itself: its last station is its first.
    pub fn is_loop(&self) -> bool {
        self.stations.len() > 2 && self.stations[0].point == self.stations[self.stations.len() - 1].point
    }

    /// Length along the seam, mm.
    pub fn length(&self) -> f64 {
        self.stations
            .windows(2)
            .map(|w| w[0].point.distance(w[1].point))
            .sum()
    }

    /// Returns true if the run is a rail of the key.
    pub fn is_rail(&self) -> bool {
        matches!(self.stations[0].shape, RunShape::Rail(_))
    }

    /// The station at a place of the run, in stations from the first, between its neighbours. Places beyond
    /// the last station of a closed run go round it once more.
    pub fn station_at(&self, at: f64) -> RunStation {
        let last = self.stations.len() - 1;
        let (at, turns) = if at > last as f64 {
            (at - last as f64, 1.0)
        } else {
            (at, 0.0)
        };
        let turn_mm = self.stations[last].arc_mm - self.stations[0].arc_mm;
        let i = (at.floor() as usize).min(last - 1);
        let (a, b, t) = (&self.stations[i], &self.stations[i + 1], at - i as f64);
        if t == 0.0 && turns == 0.0 {
            return *a;
        }
        let between = |from: f64, to: f64| from + (to - from) * t;
        let tangent = a.tangent.lerp(b.tangent, t).normalize_or_zero();
        let s = a.s.lerp(b.s, t).normalize_or_zero();
        RunStation {
            point: a.point.lerp(b.point, t),
            tangent,
            n: a.n.lerp(b.n, t).reject_from_normalized(s).normalize_or_zero(),
            s,
            theta: between(a.theta, b.theta),
            depth: between(a.depth, b.depth),
            arc_mm: between(a.arc_mm, b.arc_mm) + turns * turn_mm,
            size_mm: between(a.size_mm, b.size_mm),
            ..*a
        }
    }

    /// Gap between the two halves, mm.
    pub fn clearance_mm(&self) -> f64 {
        self.stations[0].clearance_mm
    }

    /// Point of the middle station.
    pub fn middle(&self) -> Vec3 {
        self.stations[self.stations.len() / 2].point
    }
}
