//! Roles of parts: printed, cut out, or only instructions to a slicer.

/// Role of a part for a slicer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    /// Part that is printed.
    Body,
    /// Part that is cut out of the bodies of the same item.
    Negative,
    /// Region whose content is printed with other settings.
    Modifier,
    /// Region in which supports are enforced or blocked.
    Support,
    /// Object that the file declares to be no part of the model.
    Other,
}

impl Role {
    /// Role of a volume by its type in PrusaSlicer, Bambu Studio, OrcaSlicer and their kin.
    pub(super) fn of_volume(kind: &str) -> Self {
        match kind {
            // Bambu Studio and its kin read no type as that of a normal part.
            "" | "ModelPart" | "normal_part" => Self::Body,
            "NegativeVolume" | "negative_part" => Self::Negative,
            "SupportEnforcer" | "SupportBlocker" | "support_enforcer" | "support_blocker" => Self::Support,
            _ => Self::Modifier,
        }
    }

    /// Role of a mesh by Cura's mark, without its prefix; `None` if it is no such mark.
    pub(super) fn of_cura(mark: &str) -> Option<Self> {
        match mark {
            "support_mesh" | "anti_overhang_mesh" => Some(Self::Support),
            "infill_mesh" | "cutting_mesh" => Some(Self::Modifier),
            _ => None,
        }
    }

    /// Role of an object by its type (core specification 1.3, section 4); `None` for an unknown type.
    pub(super) fn of_type(kind: &str) -> Option<Self> {
        match kind {
            "" | "model" => Some(Self::Body),
            "support" | "solidsupport" => Some(Self::Support),
            "surface" | "other" => Some(Self::Other),
            _ => None,
        }
    }

    /// Description of parts of this role, for messages: "left out as …".
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Body => "parts of the model",
            Self::Negative => "negative volumes",
            Self::Modifier => "modifiers of the slicer",
            Self::Support => "supports or support blockers",
            Self::Other => "objects of the type \"surface\" or \"other\"",
        }
    }
}

/// Usage of a part where it occurs, as given for an object, for a component in it, or for a build item.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Usage<'a> {
    pub(super) role: Role,
    /// Number of the extruder or filament that prints it, from 1; `None` if not given.
    pub(super) extruder: Option<u32>,
    /// Build item that it belongs to, from 0.
    pub(super) item: u32,
    /// Name of the part.
    pub(super) name: Option<&'a str>,
}

impl Usage<'_> {
    /// A body without any further attribute.
    pub(super) const PLAIN: Self = Self {
        role: Role::Body,
        extruder: None,
        item: 0,
        name: None,
    };
}

impl<'a> Usage<'a> {
    /// Combines the usage `inner` of a part with the usage `self` of what contains it. The outer role decides
    /// unless it is a body; extruder and name are the inner ones, if given.
    pub(super) fn with(self, inner: Self) -> Self {
        Self {
            role: if self.role == Role::Body {
                inner.role
            } else {
                self.role
            },
            extruder: inner.extruder.or(self.extruder),
            item: self.item,
            name: inner.name.or(self.name),
        }
    }
}

/// Returns true if the text of a setting means yes.
pub(super) fn is_yes(text: &str) -> bool {
    matches!(text.trim().to_ascii_lowercase().as_str(), "true" | "1" | "yes")
}
