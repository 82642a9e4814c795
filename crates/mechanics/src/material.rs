//! Material constants of common printing materials.

use serde::{Deserialize, Serialize};

/// A linear elastic, isotropic material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Young's modulus E, MPa. (0, 10⁶].
    pub youngs_modulus_mpa: f64,
    /// Poisson's ratio ν. [0, 0.45].
    pub poissons_ratio: f64,
    /// Strength: greatest stress that the material withstands, MPa.
    pub strength_mpa: f64,
    /// Density of the material, g/cm³.
    pub density_g_cm3: f64,
}

impl Material {
    /// The paper's SLA resin (Sect. 4.3 and 5.1): E = 2.0 GPa, ν = 0.35, 42 MPa.
    pub const SLA_RESIN: Self = Self {
        youngs_modulus_mpa: 2000.0,
        poissons_ratio: 0.35,
        strength_mpa: 42.0,
        density_g_cm3: 1.15,
    };
    /// PLA as printed by FDM, along the layers: typical data sheet values.
    pub const PLA: Self = Self {
        youngs_modulus_mpa: 2700.0,
        poissons_ratio: 0.35,
        strength_mpa: 45.0,
        density_g_cm3: 1.24,
    };
    /// PETG as printed by FDM, along the layers: typical data sheet values.
    pub const PETG: Self = Self {
        youngs_modulus_mpa: 1700.0,
        poissons_ratio: 0.38,
        strength_mpa: 40.0,
        density_g_cm3: 1.27,
    };
    /// Polyamide 12 as sintered: typical data sheet values.
    pub const PA12: Self = Self {
        youngs_modulus_mpa: 1650.0,
        poissons_ratio: 0.39,
        strength_mpa: 45.0,
        density_g_cm3: 1.01,
    };

    /// All presets with their names.
    pub const PRESETS: [(&'static str, Self); 4] = [
        ("sla-resin", Self::SLA_RESIN),
        ("pla", Self::PLA),
        ("petg", Self::PETG),
        ("pa12", Self::PA12),
    ];
}

impl Default for Material {
    fn default() -> Self {
        Self::SLA_RESIN
    }
}
