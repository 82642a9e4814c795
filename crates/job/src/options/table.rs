//! Declaration of every option of a job: its name, its help, its values, and how a text becomes one.
//!
//! The command line, the page of the studio and Python offer the options of this table.

use shellock::design::WallChoice;
use shellock::segmentation::Method;

use super::keep_whole::keep_whole;
use super::units::{length_mm, metres, seconds};
use super::values::{
    Axis, InsideOutMeans, LabelsFrom, PaperSize, Unit, Word, Words, connector_size, material, number, word,
};
use super::{Options, Take};

const PRINTER: &str = "Printer";
const SIZE: &str = "Size";
const SURFACE: &str = "Surface";
const PIECES: &str = "Pieces";
const MAKE: &str = "Make";

/// Kind of an option, and how its value is taken.
#[derive(Clone, Copy)]
pub enum Kind {
    /// An option without a value, which is set or not.
    Flag(fn(&mut Options)),
    /// A value in a syntax of its own.
    Text(Take),
    /// One of a few words.
    Choice(Take, fn() -> Words),
    /// The path of a file.
    Path(fn(&mut Options, std::path::PathBuf)),
}

/// Declaration of one option.
#[derive(Clone, Copy)]
pub struct Declared {
    /// Name, with `-` between its words.
    pub name: &'static str,
    /// Heading that the option stands under.
    pub group: &'static str,
    /// Help in a few words.
    pub short_help: &'static str,
    /// Help in full, where the short help leaves something out.
    pub full_help: Option<&'static str>,
    /// Name of the value in the help; empty for a flag.
    pub value_name: &'static str,
    /// Kind of the option.
    pub kind: Kind,
    /// Text of the value that the option has if it is not given.
    pub default: Option<&'static str>,
    /// True if the option may be given several times.
    pub is_many: bool,
    /// True if few people need the option.
    pub is_advanced: bool,
    /// True if a value may begin with `-`, as negative numbers do.
    pub may_be_negative: bool,
    /// Names of options that exclude this one.
    pub excluded_by: &'static [&'static str],
    /// Earlier name of the option.
    pub alias: Option<&'static str>,
}

impl Declared {
    const fn new(group: &'static str, name: &'static str, value_name: &'static str, kind: Kind) -> Self {
        Self {
            name,
            group,
            short_help: "",
            full_help: None,
            value_name,
            kind,
            default: None,
            is_many: false,
            is_advanced: false,
            may_be_negative: false,
            excluded_by: &[],
            alias: None,
        }
    }

    const fn help(self, short: &'static str, full: &'static str) -> Self {
        Self {
            short_help: short,
            full_help: Some(full),
            ..self
        }
    }

    const fn short_help(self, short: &'static str) -> Self {
        Self {
            short_help: short,
            ..self
        }
    }

    const fn default(self, text: &'static str) -> Self {
        Self {
            default: Some(text),
            ..self
        }
    }

    const fn many(self) -> Self {
        Self {
            is_many: true,
            ..self
        }
    }

    const fn mark_advanced(self) -> Self {
        Self {
            is_advanced: true,
            ..self
        }
    }

    const fn with_hyphens(self) -> Self {
        Self {
            may_be_negative: true,
            ..self
        }
    }

    const fn not_with(self, others: &'static [&'static str]) -> Self {
        Self {
            excluded_by: others,
            ..self
        }
    }

    const fn alias(self, name: &'static str) -> Self {
        Self {
            alias: Some(name),
            ..self
        }
    }

    /// Returns true if a value follows the name.
    pub fn takes_value(&self) -> bool {
        !matches!(self.kind, Kind::Flag(_))
    }

    /// Words that the option can be, each with its help; empty if its values have a syntax of their own.
    pub fn words(&self) -> Words {
        match self.kind {
            Kind::Choice(_, words) => words(),
            _ => Vec::new(),
        }
    }

    /// Help in two paragraphs, the short one first; `None` if there is only a short one.
    pub fn long_help(&self) -> Option<String> {
        self.full_help
            .map(|full| format!("{}\n\n{full}", self.short_help))
    }

    /// Name and value as one gives them, such as `--size <MM>`.
    pub fn usage(&self) -> String {
        let Self { name, value_name, .. } = self;
        if self.takes_value() {
            format!("--{name} <{value_name}>")
        } else {
            format!("--{name}")
        }
    }

    /// Sets the option to the value that `text` says; fails with the reason if it says none.
    pub fn take(&self, options: &mut Options, text: &str) -> Result<(), String> {
        match self.kind {
            Kind::Flag(set) => set(options),
            Kind::Path(set) => set(options, text.into()),
            Kind::Text(take) | Kind::Choice(take, _) => take(options, text)?,
        }
        Ok(())
    }

    /// Returns true if one of the two options excludes the other.
    pub fn excludes(&self, other: &Self) -> bool {
        self.excluded_by.contains(&other.name) || other.excluded_by.contains(&self.name)
    }
}

const fn flag(group: &'static str, name: &'static str, set: fn(&mut Options)) -> Declared {
    Declared::new(group, name, "", Kind::Flag(set))
}

const fn text(group: &'static str, name: &'static str, value_name: &'static str, take: Take) -> Declared {
    Declared::new(group, name, value_name, Kind::Text(take))
}

const fn choice<T: Word>(
    group: &'static str,
    name: &'static str,
    value_name: &'static str,
    take: Take,
) -> Declared {
    Declared::new(group, name, value_name, Kind::Choice(take, T::words))
}

const fn path(
    group: &'static str,
    name: &'static str,
    value_name: &'static str,
    set: fn(&mut Options, std::path::PathBuf),
) -> Declared {
    Declared::new(group, name, value_name, Kind::Path(set))
}

/// Finds the declaration of the option `name`.
pub fn declaration(name: &str) -> Option<&'static Declared> {
    DECLARED.iter().find(|option| option.name == name)
}

/// All options, in the order in which people see them.
pub const DECLARED: &[Declared] = &[
    text(PRINTER, "printer", "NAME", |o, t| {
        o.printer = t.to_owned();
        Ok(())
    })
    .help(
        "sla, fdm, bambu-a1 or another: see shellock printers",
        "Printer that the kit is made for: sla, fdm, fdm-petg, sls, a common printer such as bambu-a1 \
         (shellock printers lists them), or a printer from the configuration file; its bed, clearances, \
         walls and material are the defaults",
    )
    .default("sla"),
    text(SIZE, "size", "MM", |o, t| length_mm(t).map(|v| o.size = Some(v)))
        .help(
            "Longest side of the kit",
            "Longest side of the kit, mm [default: the file's own size if that is 20 to 1000, else 150]",
        )
        .with_hyphens()
        .not_with(&["height", "scale"]),
    text(SIZE, "height", "MM", |o, t| {
        length_mm(t).map(|v| o.height = Some(v))
    })
    .help(
        "Height of the kit along its up axis",
        "Height of the kit along its up axis, mm",
    )
    .with_hyphens()
    .not_with(&["scale"]),
    text(SIZE, "scale", "F", |o, t| number(t).map(|v| o.scale = Some(v)))
        .help("Millimetres per file unit", "Millimetres per file unit")
        .with_hyphens()
        .mark_advanced(),
    choice::<Unit>(SIZE, "unit", "UNIT", |o, t| word(t).map(|v| o.unit = Some(v)))
        .help(
            "Unit of the file: micron, mm, cm, inch, foot or m",
            "Unit of the file's lengths [default: the file's own if it has one, as 3MF does, else mm if that \
             gives a sensible size]",
        )
        .not_with(&["size", "height", "scale"]),
    choice::<Axis>(SIZE, "up", "UP", |o, t| word(t).map(|v| o.up = v))
        .help(
            "Axis of the file that points up: x, y or z",
            "Axis of the file that points up",
        )
        .default("z"),
    text(SURFACE, "object", "NAME", |o, t| {
        o.object = Some(t.to_owned());
        Ok(())
    })
    .help(
        "Use one object of the file, by its name",
        "Object of the file to use, if it has several: its name, or \"object 2\" if it has no name",
    ),
    text(SURFACE, "plate", "N|NAME", |o, t| {
        o.plate = Some(t.to_owned());
        Ok(())
    })
    .help(
        "Use one plate of a slicer's project",
        "Plate of a slicer's project to use, by its number or name",
    )
    .mark_advanced(),
    flag(SURFACE, "no-repair", |o| o.no_repair = true)
        .help(
            "Refuse a surface that needs repair",
            "Refuse a surface that needs repair instead of repairing it",
        )
        .mark_advanced()
        .not_with(&["largest"]),
    flag(SURFACE, "largest", |o| o.largest = true).help(
        "Use only the largest of several bodies",
        "Use only the largest of several separate bodies",
    ),
    flag(SURFACE, "fill", |o| o.fill = true)
        .help(
            "Close a hollow model's openings and make it solid",
            "Close the openings of a model that is already hollow, such as one hollowed by a resin slicer, \
             and use its solid shape",
        )
        .mark_advanced(),
    choice::<InsideOutMeans>(SURFACE, "inside-out", "ask|cut|unite", |o, t| {
        word(t).map(|v| o.inside_out = v)
    })
    .help(
        "Inside-out body overlapping another: ask, cut or unite",
        "Meaning of an inside-out body that overlaps another: ask refuses the model and names the place of \
         the body; cut makes it a hole; unite makes it a part",
    )
    .default("ask")
    .mark_advanced(),
    text(SURFACE, "resolution", "MM", |o, t| {
        length_mm(t).map(|v| o.resolution = v)
    })
    .help(
        "Detail to keep if there are very many triangles",
        "Detail to keep of a surface with more than 100 000 triangles, mm, 0 to 0.1: the surface is \
         simplified within this distance; 0 keeps all triangles, as `segment` does",
    )
    .default("0.015")
    .with_hyphens()
    .mark_advanced(),
    path(PIECES, "labels", "FILE", |o, path| o.labels = Some(path)).help(
        "One label per face: a .seg or .ply file",
        "One label per face: a .seg file (one integer per line) or a .ply with a face property; each label \
         is a piece",
    ),
    choice::<LabelsFrom>(PIECES, "labels-from", "WHAT", |o, t| {
        word(t).map(|v| o.labels_from = v)
    })
    .help(
        "Source of the division: labels, paint, colors …",
        "Data in the model's own file that define the pieces",
    )
    .default("auto")
    .not_with(&["labels"]),
    choice::<Method>(PIECES, "method", "METHOD", |o, t| word(t).map(|v| o.method = v))
        .help(
            "auto, creases, random-cuts, sdf, primitives or kmeans",
            "How to find pieces if there are no labels: creases, pieces of similar size with seams in \
             creases; auto, the best cuts of the other methods, close to where people would cut; \
             random-cuts, cuts that most of many random divisions share; sdf, by thickness; primitives, by \
             fitted planes, spheres and cylinders; kmeans, by distance and surface direction",
        )
        .default("auto"),
    text(PIECES, "pieces", "auto|N|fits-bed", |o, t| {
        t.parse().map(|v| o.pieces = v)
    })
    .help(
        "Approximate number of pieces",
        "Approximate number of pieces if there are no labels: auto, the number that the method finds, about \
         10 for a 150 mm figure; a number; or fits-bed, as few as fit the printer",
    )
    .default("auto"),
    choice::<bool>(PIECES, "symmetric", "on|off", |o, t| {
        word(t).map(|v| o.symmetric = v)
    })
    .help(
        "Divide both sides of a symmetric model alike",
        "Divide both sides of a symmetric model alike, if the method is auto or random-cuts",
    )
    .default("off"),
    text(PIECES, "keep-whole", "X,Y,Z,R|LABEL", |o, t| {
        keep_whole(t).map(|v| o.keep_whole.push(v))
    })
    .help(
        "A region without seams, such as a face",
        "A region that no seam may divide, such as a face: the surface within R mm of a place in the kit's \
         coordinates, or the faces with a label if there are labels; may be given several times",
    )
    .many()
    .with_hyphens(),
    text(PIECES, "key", "auto|piece|N|X,Y,Z", |o, t| {
        t.parse().map(|v| o.key = v)
    })
    .help(
        "The last piece: cut, the flattest piece, or piece N",
        "The key, which goes in last and can be taken out again: auto, a key on rails, cut where it slides \
         best; X,Y,Z, the same near that place in the kit's coordinates; piece, the flattest suitable piece, \
         unchanged; or a piece, by its label or by the number that `segment` gives it",
    )
    .default("auto")
    .with_hyphens(),
    text(PIECES, "time", "SECONDS", |o, t| seconds(t).map(|v| o.time = v))
        .help(
            "Limit for the whole job; 0: no limit",
            "Time limit for the whole job, s: when it is over, the best kit so far is finished; 0 sets no \
             limit",
        )
        .default("60")
        .with_hyphens(),
    text(PIECES, "effort", "SECONDS", |o, t| {
        seconds(t).map(|v| o.effort = Some(v))
    })
    .help(
        "Work instead of time: the same kit on any machine",
        "Limit of work for the whole job instead of time, in the seconds it takes on an ordinary computer \
         with two cores: the kit is the same on any machine",
    )
    .not_with(&["time"])
    .with_hyphens(),
    text(PIECES, "plan-time", "SECONDS", |o, t| {
        seconds(t).map(|v| o.plan_time = v)
    })
    .help(
        "Work spent on proving that no plan is better",
        "Work spent on proving that no plan is better, in seconds on an ordinary computer; a slower computer \
         stops after twice that time",
    )
    .default("10")
    .with_hyphens()
    .mark_advanced(),
    text(MAKE, "thickness", "auto|MM", |o, t| {
        t.parse().map(|v| o.thickness = v)
    })
    .help(
        "Wall thickness, 0.8 to 10 mm",
        "Wall thickness, mm, 0.8 to 10, or auto: the least from 1.6 (or four times the thinnest wall that \
         the printer can make, if that is more) to 3 mm that survives a fall",
    )
    .default("auto")
    .with_hyphens(),
    choice::<WallChoice>(MAKE, "wall", "KIND", |o, t| word(t).map(|v| o.wall = v))
        .help(
            "light, standard or sturdy",
            "Kind of wall, if its thickness is auto: light, as thin as seams allow; standard, thick enough \
             for a fall and for what people do with the kit by hand; sturdy, at least half as thick again \
             as a light one, with a reserve",
        )
        .default("standard"),
    text(MAKE, "material", "NAME", |o, t| {
        material(t).map(|v| o.material = Some(v))
    })
    .help(
        "sla-resin, pla, petg or pa12 [default: printer's]",
        "Print material: its strength decides how thick walls must be [default: the printer's]",
    ),
    text(MAKE, "drop", "HEIGHT", |o, t| metres(t).map(|v| o.drop = v))
        .help(
            "Fall that walls must survive",
            "Height of the fall that walls must survive, 0.01 to 20 m",
        )
        .default("1.275")
        .with_hyphens()
        .mark_advanced(),
    text(MAKE, "connector", "auto|MM", |o, t| {
        connector_size(t).map(|v| o.connector = v)
    })
    .help(
        "Size of connectors, 1.5 to 6 mm",
        "Connector size: 1.5 to 6 mm for all seams, or \"auto\": 2 to 4 mm, by the stress and the room at \
         each seam",
    )
    .default("auto")
    .with_hyphens(),
    text(MAKE, "clearance", "MM", |o, t| {
        length_mm(t).map(|v| o.clearance = Some(v))
    })
    .help(
        "Gap of connectors, mm [default: printer's]",
        "Gap between mating faces of connectors, mm, 0.03 to 0.6: 0.05 to 0.15 for resin, 0.15 to 0.3 for \
         filament [default: the printer's]",
    )
    .with_hyphens(),
    text(MAKE, "key-clearance", "MM", |o, t| {
        length_mm(t).map(|v| o.key_clearance = Some(v))
    })
    .help(
        "Gap on the key's rails, mm [default: printer's]",
        "Gap between mating faces of the key's rails, mm, 0.03 to 0.8 [default: the printer's]",
    )
    .with_hyphens()
    .mark_advanced(),
    text(MAKE, "detent", "MM", |o, t| length_mm(t).map(|v| o.detent = v))
        .help(
            "Bump that the key snaps past, 0 to 0.4 mm",
            "Height of a bump on each rail that the key snaps past, mm, 0 to 0.4; 0 makes none",
        )
        .default("0")
        .with_hyphens()
        .mark_advanced(),
    text(MAKE, "key-ribs", "MM", |o, t| {
        length_mm(t).map(|v| o.key_ribs = v)
    })
    .help(
        "Interference of ribs on a key without rails, mm",
        "Interference between ribs on a key without rails and the pieces around it, mm, 0 to 0.3; 0 makes \
         none",
    )
    .default("0.08")
    .with_hyphens()
    .mark_advanced(),
    flag(MAKE, "play-together", |o| o.play_together = true)
        .help(
            "Also prove the play of all pieces together",
            "Also search for a proof of how far each piece can move when all others but one move too; \
             succeeds for small kits only, and takes from a few seconds to a minute",
        )
        .mark_advanced(),
    flag(MAKE, "allow-thin", |o| o.allow_thin = true).help(
        "Make pieces even if almost nothing can be hollow",
        "Make pieces even if almost nothing of the model can be hollow; they are mostly solid, with few \
         connectors",
    ),
    flag(MAKE, "key-grip", |o| o.key_grip = true).help(
        "Cut a notch for a fingernail into the key",
        "Cut a notch for a fingernail into the key, 0.45 mm deep",
    ),
    flag(MAKE, "no-labels", |o| o.no_labels = true).help(
        "Leave the numbers off the pieces' inner sides",
        "Leave the pieces' numbers off their inner sides",
    ),
    choice::<PaperSize>(MAKE, "paper", "a4|letter", |o, t| word(t).map(|v| o.paper = v))
        .short_help("Paper size of the booklet")
        .default("a4"),
    flag(MAKE, "no-booklet", |o| o.no_booklet = true).help(
        "Leave out instructions.pdf",
        "Leave out instructions.pdf, which takes about a second",
    ),
    text(MAKE, "seam-gap", "MM", |o, t| {
        length_mm(t).map(|v| o.seam_gap = Some(v))
    })
    .help(
        "Distance that each side of a seam stays back, mm",
        "Distance that each side of a seam stays back, mm, 0 to 0.4; use less if you sand the seams \
         [default: the printer's tolerance]",
    )
    .with_hyphens()
    .mark_advanced()
    .alias("wall-gap"),
    text(MAKE, "min-wall", "MM", |o, t| {
        length_mm(t).map(|v| o.min_wall = Some(v))
    })
    .help(
        "Thinnest wall that the printer can make, mm",
        "Thinnest wall that the printer can make, mm, 0.1 to 2; thinner parts are reported [default: the \
         printer's]",
    )
    .with_hyphens()
    .mark_advanced(),
    text(MAKE, "grid", "MM", |o, t| length_mm(t).map(|v| o.grid = Some(v)))
        .help(
            "Spacing of the grid behind the walls, mm",
            "Spacing of the grid behind the walls, mm [default: thickness / 2.5]",
        )
        .with_hyphens()
        .mark_advanced(),
    text(MAKE, "seed", "N", |o, t| number(t).map(|v| o.seed = v))
        .help(
            "Seed of all random choices",
            "Seed of all random choices: the same seed gives the same kit",
        )
        .default("0"),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_text_of_every_default_gives_the_default() {
        let mut options = Options::default();
        let mut n_defaults = 0;
        for option in DECLARED {
            if let Some(text) = option.default {
                option.take(&mut options, text).expect(option.name);
                n_defaults += 1;
            }
        }
        assert!(options == Options::default() && n_defaults > 10);
    }

    #[test]
    fn names_are_unique_and_options_exclude_others_that_exist() {
        let names: BTreeSet<&str> = DECLARED.iter().map(|option| option.name).collect();
        assert_eq!(names.len(), DECLARED.len());
        for option in DECLARED {
            assert!(option.excluded_by.iter().all(|other| names.contains(other)));
            assert!(option.alias.is_none_or(|alias| !names.contains(alias)));
            let is_text = |c: char| c.is_ascii_lowercase() || c == '-';
            assert!(option.name.chars().all(is_text), "{}", option.name);
        }
    }

    #[test]
    fn every_word_of_a_choice_is_taken_and_no_other() {
        for option in DECLARED.iter().filter(|option| !option.words().is_empty()) {
            for (word, _) in option.words() {
                assert!(option.take(&mut Options::default(), word).is_ok(), "{word}");
                let other = format!("{word}x");
                assert!(option.take(&mut Options::default(), &other).is_err(), "{other}");
            }
        }
    }
}
