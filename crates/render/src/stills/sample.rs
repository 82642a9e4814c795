//! Samples of the renderer: the surface points that it sees.

/// Surface point visible at a sample.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Position towards the viewer, in units of a sample.
    pub depth: f32,
    /// Normal in view space, about unit length.
    pub normal: [f32; 3],
    /// Index of the mesh plus 1; 0 for nothing.
    pub mesh: u16,
    /// Unlit colour, in linear light.
    pub color: [f32; 3],
}

/// Sample at which no surface is seen.
pub(super) const NOTHING: Sample = Sample {
    depth: f32::NEG_INFINITY,
    normal: [0.0; 3],
    mesh: 0,
    color: [0.0; 3],
};
