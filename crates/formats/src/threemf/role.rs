//! Roles of parts: what is printed, what is cut out, and what only steers a slicer.

/// What a slicer does with a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    /// Prints it.
    Body,
    /// Cuts it out of the bodies of the same item.
    Negative,
    /// Prints what lies in it otherwise.
    Modifier,
    /// Supports the model there, or does not.
    Support,
    /// Does nothing: the file says that it is no part of the model.
    Other,
}

impl Role {
    /// The role that PrusaSlicer, Bambu Studio, OrcaSlicer and their kin mean by the type of a volume.
    pub(super) fn of_volume(kind: &str) -> Self {
        match kind {
            // Bambu Studio and its kin read no type as that of a normal part.
            "" | "ModelPart" | "normal_part" => Self::Body,
            "NegativeVolume" | "negative_part" => Self::Negative,
            "SupportEnforcer" | "SupportBlocker" | "support_enforcer" | "support_blocker" => Self::Support,
            _ => Self::Modifier,
        }
    }

    /// The role that Cura means by a mark of a mesh, without its prefix; `None` where it is no such mark.
    pub(super) fn of_cura(mark: &str) -> Option<Self> {
        match mark {
            "support_mesh" | "anti_overhang_mesh" => Some(Self::Support),
            "infill_mesh" | "cutting_mesh" => Some(Self::Modifier),
            _ => None,
        }
    }

    /// The role that the type of an object gives it (core specification 1.3, section 4).
    pub(super) fn of_type(kind: &str) -> Option<Self> {
        match kind {
            "" | "model" => Some(Self::Body),
            "support" | "solidsupport" => Some(Self::Support),
            "surface" | "other" => Some(Self::Other),
            _ => None,
        }
    }

    /// What parts of this role are, for messages: "left out as …".
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

/// How a part is used where it occurs: said of an object, of a component in it, of an item of the build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Usage<'a> {
    pub(super) role: Role,
    /// Which extruder or filament prints it, from 1; `None` where nothing is said.
    pub(super) extruder: Option<u32>,
    /// The item of the build that it belongs to, from 0.
    pub(super) item: u32,
    /// What it is called.
    pub(super) name: Option<&'a str>,
}

impl Usage<'_> {
    /// A body of which nothing else is said.
    pub(super) const PLAIN: Self = Self {
        role: Role::Body,
        extruder: None,
        item: 0,
        name: None,
    };
}

impl<'a> Usage<'a> {
    /// How a part is used that is used as `inner` within what is used as `self`: what is around decides
    /// whether it is printed, the part itself by which extruder.
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

/// Whether the text of a setting means yes.
pub(super) fn is_yes(text: &str) -> bool {
    matches!(text.trim().to_ascii_lowercase().as_str(), "true" | "1" | "yes")
}
