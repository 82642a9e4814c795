//! Steps of the agenda, and the one table of how often each may be taken. The bounds of the user and of the
//! way to divide (`Rounds`) may allow fewer.

use super::CUT_KEYS;

/// A change of what is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::design) enum Step {
    /// Seeks another plan, since the last one could not be made: a piece could not take its wall along.
    Replan,
    /// Seeks another plan, since the connectors of the last one came out too short to hold a piece.
    Reconnect,
    /// Makes the kit of another plan, since the last kit failed.
    Remake,
    /// Enlarges connectors, since seams would open under a load.
    Enlarge,
    /// Lengthens the seams of pieces that rattle, part under a load, or have no room for connectors.
    Lengthen,
    /// Joins pieces that are predicted to rattle, or that have no room for connectors.
    JoinPredicted,
    /// Joins two pieces that part under a load.
    JoinWeak,
    /// Joins pieces that rattle in a kit which is sound otherwise.
    JoinRattling,
    /// Divides a piece that fails, or joins one that blocks every plan.
    Divide,
    /// Takes the next place for the key; the last one is a piece as it is.
    NextKey,
    /// Makes the wall thicker, since it gives way under a load.
    Thicken,
    /// Asks for no reserve, and makes the wall thin again.
    LowerLoad,
    /// Divides the model in the next way.
    NextWay,
}

/// Part of a trial. Each one lies within the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    Plan,
    Division,
    Key,
    Wall,
    Load,
    Way,
    Job,
}

/// Limit of one step.
pub(super) struct Row {
    pub step: Step,
    /// Level that the step begins anew.
    pub begins: Level,
    /// Level within which it is counted.
    pub within: Level,
    /// Most times with a key that is cut, and with a piece as the key. The user's [`Rounds`] may allow fewer.
    pub most: [usize; 2],
}

const fn row(step: Step, begins: Level, within: Level, most: [usize; 2]) -> Row {
    Row {
        step,
        begins,
        within,
        most,
    }
}

/// No limit but the user's.
pub(super) const ANY: usize = usize::MAX;

/// Limits of all steps. A plan that is given up costs seconds, a joining that is predicted costs a search,
/// and a kit costs most of a minute; one that is given up when its connectors are known costs half as much.
pub(super) const TABLE: [Row; 13] = [
    row(Step::Replan, Level::Plan, Level::Division, [7, 7]),
    row(Step::Reconnect, Level::Plan, Level::Division, [2, 2]),
    row(Step::Remake, Level::Plan, Level::Division, [1, ANY]),
    row(Step::Enlarge, Level::Division, Level::Key, [2, 2]),
    row(Step::Lengthen, Level::Division, Level::Key, [4, 4]),
    row(Step::JoinPredicted, Level::Division, Level::Key, [5, 5]),
    row(Step::JoinWeak, Level::Division, Level::Key, [1, 1]),
    row(Step::JoinRattling, Level::Division, Level::Key, [2, 2]),
    row(Step::Divide, Level::Division, Level::Key, [1, ANY]),
    row(Step::NextKey, Level::Key, Level::Wall, [CUT_KEYS, CUT_KEYS]),
    row(Step::Thicken, Level::Wall, Level::Load, [2, 2]),
    row(Step::LowerLoad, Level::Load, Level::Way, [1, 1]),
    row(Step::NextWay, Level::Way, Level::Job, [ANY, ANY]),
];

impl Step {
    /// Returns true if the step leaves the present key for another one, or for another wall since no kit
    /// passed.
    pub fn closes_key(self) -> bool {
        matches!(self, Self::NextKey | Self::LowerLoad | Self::NextWay)
    }

    /// Returns true if the step begins with another wall, whose keys are sought anew.
    pub fn begins_wall(self) -> bool {
        TABLE[self as usize].begins >= Level::Wall
    }

    /// The step in words that continue "no time is left to".
    pub fn words(self) -> &'static str {
        match self {
            Self::Replan => "try another plan, as a piece could not take its wall along",
            Self::Reconnect => "try another plan, as connectors came out too short",
            Self::Remake => "make the kit of another plan",
            Self::Enlarge => "try larger connectors where seams would open",
            Self::Lengthen => "lengthen seams of pieces that would come loose",
            Self::JoinPredicted => "join pieces that would come loose",
            Self::JoinWeak => "join pieces that part under a load",
            Self::JoinRattling => "join pieces that rattle",
            Self::Divide => "try other pieces",
            Self::NextKey => "try another key",
            Self::Thicken => "try thicker walls",
            Self::LowerLoad => "try walls as thin as a fall allows",
            Self::NextWay => "divide in another way",
        }
    }
}
