//! Tests of the program through its command line.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use shellock_formats::write_stl_binary;
use shellock_testkit::shapes::cuboid;

fn shellock(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_shellock"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

fn code(o: &Output) -> i32 {
    o.status.code().unwrap()
}

fn errors(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

/// Lists all files below `folder` with their content, sorted.
fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in fs::read_dir(at).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                files.push((name, fs::read(&path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

fn assert_same_files(one: &Path, two: &Path) {
    let (one, two) = (content(one), content(two));
    for (x, y) in one.iter().zip(&two) {
        assert_eq!(x.0, y.0);
        assert!(x.1 == y.1, "{} differs between one and two threads", x.0);
    }
    assert_eq!(one.len(), two.len());
}

fn assert_whole(kit: &Path, plan: &Value) {
    assert_eq!(
        plan["installation_order"].as_array().unwrap().last(),
        Some(&plan["key_piece"])
    );
    assert!(plan["key"]["rails"].as_f64().unwrap() > 5.0, "{}", plan["key"]);
    let pieces = plan["pieces"].as_array().unwrap();
    for piece in pieces {
        assert!(kit.join(piece["file"].as_str().unwrap()).is_file());
    }
    for name in [
        "assembly.3mf",
        "certificate.json",
        "report.html",
        "pieces.png",
        "segmentation.ply",
        "plates.3mf",
        "instructions.pdf",
    ] {
        assert!(kit.join(name).is_file(), "{name}");
    }
    let laid = plan["printing"]["laid"].as_array().unwrap();
    assert_eq!(laid.len(), pieces.len(), "every piece lies on a plate");
}

/// Slow test (some 20 s): makes two whole kits.
#[test]
fn a_kit_is_whole_verified_and_the_same_on_any_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| shellock(dir.path(), args);
    let job = |threads: &str, out: &str| {
        let job = "demo --figure vase --size 60 --pieces 4 --effort 20 --json --threads";
        run(&job.split(' ').chain([threads, "-o", out]).collect::<Vec<_>>())
    };
    let first = job("1", "one");
    let verdict = json(&first.stdout);
    assert_eq!(
        (code(&first), &verdict["status"]),
        (0, &"verified".into()),
        "{verdict:#}"
    );
    assert_eq!(code(&job("2", "two")), 0);
    let kit = dir.path().join("one");
    assert_same_files(&kit, &dir.path().join("two"));
    let plan = json(&fs::read(kit.join("plan.json")).unwrap());
    assert_whole(&kit, &plan);
    let n_folders = fs::read_dir(dir.path()).unwrap().count();
    assert_eq!(n_folders, 2, "something was left behind");

    // The kit can be verified again from its files, and a missing piece is noticed.
    assert_eq!(
        code(&run(&["figure", "vase", "--size", "60", "-o", "vase.stl"])),
        0
    );
    assert_eq!(code(&run(&["verify", "one", "vase.stl"])), 0);
    let savings = json(&run(&["report", "one", "vase.stl", "--closed-form", "--json"]).stdout);
    assert_eq!(savings, json(&fs::read(kit.join("savings.json")).unwrap()));
    let ratio = savings["volume_ratio"].as_f64().unwrap();
    assert!(
        (ratio - plan["volume_ratio"].as_f64().unwrap()).abs() < 1e-5,
        "{savings:#}"
    );
    assert_eq!(savings["print_time"]["sla"]["by"], "closed form");
    fs::copy(kit.join("pieces/piece-02.stl"), kit.join("pieces/piece-01.stl")).unwrap();
    assert_eq!(code(&run(&["verify", "one", "vase.stl"])), 1);
}

#[test]
fn a_time_that_is_over_before_any_kit_leaves_nothing_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let o = shellock(dir.path(), &["demo", "--time", "0.5", "-o", "kit"]);
    assert_eq!(code(&o), 3, "{}", errors(&o));
    assert!(
        errors(&o).contains("the time was over before a kit was made"),
        "{}",
        errors(&o)
    );
    assert!(!dir.path().join("kit").exists());
    let both = shellock(dir.path(), &["demo", "--time", "9", "--effort", "9", "-o", "kit"]);
    assert_eq!(code(&both), 2, "{}", errors(&both));
}

#[test]
fn an_open_surface_is_refused_with_its_place() {
    let dir = tempfile::tempdir().unwrap();
    // The surface is a box without a lid.
    let open = "v 0 0 0\nv 30 0 0\nv 30 30 0\nv 0 30 0\nv 0 0 30\nv 30 0 30\nv 30 30 30\nv 0 30 30\nf 1 4 3 \
                2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    fs::write(dir.path().join("open.obj"), open).unwrap();
    let o = shellock(dir.path(), &["build", "open.obj"]);
    assert_eq!(code(&o), 2);
    assert!(
        errors(&o).contains("open.obj") && errors(&o).contains("1 hole (4 open edges)"),
        "{}",
        errors(&o)
    );
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn all_bad_parameters_are_told_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let o = shellock(
        dir.path(),
        &[
            "demo",
            "--thickness",
            "99",
            "--clearance",
            "7",
            "--connector",
            "0",
        ],
    );
    assert_eq!(code(&o), 2);
    for word in ["thickness", "clearance", "connector size"] {
        assert!(errors(&o).contains(word), "{}", errors(&o));
    }
    for seconds in ["NaN", "-1", "-inf"] {
        let o = shellock(dir.path(), &["demo", &format!("--plan-time={seconds}")]);
        assert_eq!(code(&o), 2, "{seconds}");
        assert!(errors(&o).contains("plan time"), "{}", errors(&o));
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn the_configuration_file_stands_behind_the_command_line_and_is_named_where_it_is_wrong() {
    let dir = tempfile::tempdir().unwrap();
    let told = |config: &str, args: &[&str]| {
        fs::write(dir.path().join("shellock.toml"), config).unwrap();
        let o = shellock(dir.path(), args);
        assert_eq!(code(&o), 2, "{config}");
        errors(&o)
    };
    let both = "clearance = 7\nthickness = 99\npieces = 5\n";
    let e = told(both, &["demo"]);
    assert!(e.contains("clearance") && e.contains("thickness"), "{e}");
    let e = told(both, &["demo", "--clearance", "0.1"]);
    assert!(!e.contains("clearance") && e.contains("thickness"), "{e}");
    // A size on the command line overrides a height in the file.
    let e = told("height = 90\nthickness = 99\n", &["demo", "--size", "100"]);
    assert!(!e.contains("cannot be used") && e.contains("thickness"), "{e}");
    for (config, words) in [
        ("colour = \"red\"", ["shellock.toml", "colour"]),
        ("key-grip = 3", ["key-grip", "true or false"]),
        ("up = \"w\"", ["shellock.toml", "--up"]),
        ("clearance = ", ["shellock.toml", "line 1"]),
        ("printer = \"unicorn\"", ["unicorn", "fdm-petg"]),
        ("[printers.mine]\nbed = [1, 2, 3]", ["mine", "width of the bed"]),
        ("[printers.mine]\nlike = \"unicorn\"", ["mine", "unicorn"]),
        ("[printers.mine]\nwidth = 3", ["mine", "width"]),
    ] {
        let e = told(config, &["demo"]);
        assert!(words.iter().all(|w| e.contains(w)), "{config}: {e}");
    }
    // The printer's own minimum wall is used if none is given.
    let mine = "printer = \"mine\"\nclearance = 7\n[printers.mine]\nlike = \"fdm\"\nmin-wall = 1.9\n";
    assert!(told(mine, &["demo"]).contains("clearance"));
    let e = told("", &["demo", "--config", "nowhere.toml"]);
    assert!(e.contains("nowhere.toml"), "{e}");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn a_strangers_folder_is_never_replaced() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir(dir.path().join("mine")).unwrap();
    fs::write(dir.path().join("mine/thesis.txt"), "years of work").unwrap();
    let o = shellock(dir.path(), &["demo", "-o", "mine", "--force"]);
    assert_eq!(code(&o), 2);
    assert_eq!(
        fs::read(dir.path().join("mine/thesis.txt")).unwrap(),
        b"years of work"
    );
}

#[test]
fn a_kits_folder_with_a_strangers_file_is_not_replaced_even_by_force() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir_all(dir.path().join("kit/pieces")).unwrap();
    for own in ["plan.json", "pieces/piece-07.stl", "savings.json"] {
        fs::write(dir.path().join("kit").join(own), "{}").unwrap();
    }
    fs::write(dir.path().join("kit/pieces/mine.gcode"), "mine").unwrap();
    let before = content(dir.path());
    let o = shellock(dir.path(), &["demo", "-o", "kit", "--force"]);
    assert_eq!(code(&o), 2);
    assert!(errors(&o).contains("mine.gcode"), "{}", errors(&o));
    assert_eq!(content(dir.path()), before);
}

#[test]
fn completions_and_manual_pages_name_every_command_and_option() {
    let dir = tempfile::tempdir().unwrap();
    let completions = shellock(dir.path(), &["completions", "bash"]);
    let text = String::from_utf8(completions.stdout).unwrap();
    assert!(
        ["build", "verify", "report", "--key-ribs", "--quiet"]
            .iter()
            .all(|word| text.contains(word))
    );
    assert_eq!(code(&shellock(dir.path(), &["manual", "man"])), 0);
    let page = fs::read_to_string(dir.path().join("man/shellock-build.1")).unwrap();
    assert!(
        page.contains("key\\-ribs") && dir.path().join("man/shellock.1").is_file(),
        "{page}"
    );
}

#[test]
fn refusals_are_json_where_asked_for_and_sizes_have_limits() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        code(&shellock(dir.path(), &["figure", "torus", "-o", "t.stl"])),
        0
    );
    for words in [
        &["inspect", "t.stl", "--size", "1e9", "--json"][..],
        &["inspect", "t.stl", "--size", "1", "--json"],
        &["inspect", "none.stl", "--json"],
        &["bild", "--json"],
    ] {
        let o = shellock(dir.path(), words);
        assert_eq!(code(&o), 2);
        let told: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
        assert!(told["error"].as_str().is_some_and(|e| !e.is_empty()), "{told}");
        assert!(
            errors(&o)
                .lines()
                .all(|line| serde_json::from_str::<serde_json::Value>(line).is_ok()),
            "{}",
            errors(&o)
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_nobody_takes_is_no_panic() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        code(&shellock(dir.path(), &["figure", "torus", "-o", "t.stl"])),
        0
    );
    for words in [&["inspect", "t.stl"][..], &["completions", "bash"]] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_shellock"));
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let o = command
            .current_dir(dir.path())
            .args(words)
            .stdout(full)
            .output()
            .unwrap();
        assert_eq!(code(&o), 4, "{}", errors(&o));
        assert!(!errors(&o).contains("panicked"), "{}", errors(&o));
    }
}

#[test]
fn progress_is_lines_or_events_or_nothing() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(
        code(&shellock(dir.path(), &["figure", "torus", "-o", "t.stl"])),
        0
    );
    let segment = |more: &str| {
        let o = shellock(
            dir.path(),
            &["segment", "t.stl", "-o", "t.ply", "--pieces", "4", more],
        );
        assert_eq!(code(&o), 0, "{}", errors(&o));
        errors(&o)
    };
    assert_eq!(segment("--quiet"), "");
    let events = segment("--json");
    let names: Vec<String> = events
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
        .filter(|event| event["event"] == "stage" && event["seconds"].is_number())
        .map(|event| event["name"].as_str().unwrap().to_owned())
        .collect();
    assert!(!names.is_empty(), "{events}");
}

#[test]
fn what_is_not_there_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let o = shellock(dir.path(), &["build", "nowhere.stl"]);
    assert_eq!(code(&o), 2);
    assert!(errors(&o).contains("nowhere.stl"));
    let o = shellock(dir.path(), &["demo", "--figure", "unicorn"]);
    assert_eq!(code(&o), 2);
    assert!(errors(&o).contains("squirrel"));
}

/// Cube for the tests: closed, one body, with the labels `label` on its faces.
fn labelled_cube(label: [i32; 12]) -> String {
    let mut ply = String::from(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float \
         z\nelement face 12\nproperty list uchar int vertex_indices\nproperty int label\nend_header\n",
    );
    for i in 0..8 {
        ply += &format!("{} {} {}\n", 80 * (i & 1), 80 * (i >> 1 & 1), 80 * (i >> 2));
    }
    let sides = ["0 2 3 1", "4 5 7 6", "0 1 5 4", "2 6 7 3", "0 4 6 2", "1 3 7 5"];
    for (i, side) in sides.iter().enumerate() {
        let [a, b, c, d] = side.split(' ').collect::<Vec<_>>()[..] else {
            unreachable!("sides have four corners")
        };
        ply += &format!(
            "3 {a} {b} {c} {}\n3 {a} {c} {d} {}\n",
            label[2 * i],
            label[2 * i + 1]
        );
    }
    ply
}

/// Entries that `test` reads from a plan of two pieces.
const TWO_PIECES: &str = r#"{ "format": "shellock-plan", "version": 2,
    "pieces": [ { "id": 1, "installation_direction": [0, 0, 1] },
    { "id": 2, "installation_direction": [0, 0, -1] } ], "installation_order": [1, 2], "up": [0, 0, 1],
    "shell_thickness": 2, "connector_size": 2.5 }"#;

/// Adds the files of the pieces to a plan of two pieces.
fn with_files(plan: &str) -> String {
    plan.replace("\"id\": 1,", "\"id\": 1, \"file\": \"box.stl\",")
        .replace("\"id\": 2,", "\"id\": 2, \"file\": \"lid.stl\",")
}

#[test]
fn a_folder_that_is_no_kit_is_not_tested() {
    let dir = tempfile::tempdir().unwrap();
    let kit = dir.path().join("kit");
    let refused = |words: &[&str]| {
        let o = shellock(dir.path(), &["test", "kit"]);
        assert_eq!(code(&o), 2, "{}", errors(&o));
        for word in words {
            assert!(errors(&o).contains(word), "{word}: {}", errors(&o));
        }
        assert!(!kit.join("stress.json").exists() && !kit.join("stress.svg").exists());
    };
    refused(&["kit", "shellock build"]);
    fs::create_dir(&kit).unwrap();
    refused(&["kit", "shellock build"]);
    let plan = kit.join("plan.json");
    let twice = TWO_PIECES.replace("[1, 2], \"up\"", "[1, 1], \"up\"");
    let thick = TWO_PIECES.replace("\"shell_thickness\": 2", "\"shell_thickness\": -3");
    let unsaid = TWO_PIECES.replace("\"shell_thickness\": 2,", "");
    fs::write(&plan, "{ \"pieces\": [").unwrap();
    refused(&["plan.json", "not a plan"]);
    fs::write(&plan, "{}").unwrap();
    refused(&["plan.json", "build the kit again"]);
    fs::write(&plan, twice).unwrap();
    refused(&["plan.json", "names piece 1 twice"]);
    fs::write(&plan, TWO_PIECES).unwrap();
    refused(&["segmentation.ply"]);
    fs::write(kit.join("segmentation.ply"), labelled_cube([1; 12])).unwrap();
    refused(&["segmentation.ply", "no face"]);
    fs::write(
        kit.join("segmentation.ply"),
        labelled_cube([1, 1, 2, 2, 3, 1, 1, 1, 1, 1, 1, 1]),
    )
    .unwrap();
    refused(&["segmentation.ply", "label"]);
    fs::write(
        kit.join("segmentation.ply"),
        labelled_cube([1, 1, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1]),
    )
    .unwrap();
    fs::write(&plan, unsaid).unwrap();
    refused(&["plan.json", "shell_thickness"]);
    fs::write(&plan, thick).unwrap();
    refused(&["plan.json", "thickness"]);
    fs::write(&plan, TWO_PIECES).unwrap();
    refused(&["plan.json", "no file for piece 1"]);
    fs::write(&plan, with_files(TWO_PIECES)).unwrap();
    refused(&["box.stl", "missing"]);
    for file in ["box.stl", "lid.stl"] {
        fs::write(kit.join(file), "solid of nothing\nendsolid\n").unwrap();
    }
    refused(&["box.stl"]);
}

#[test]
fn blows_that_are_none_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for (option, value) in [
        ("--punch", "0N"),
        ("--punch", "-70N"),
        ("--punch", "70stone"),
        ("--drop", "-2m"),
        ("--drop", "0m"),
        ("--drop", "2km"),
        ("--material", "wood"),
    ] {
        let o = shellock(dir.path(), &["test", "kit", option, value]);
        assert_eq!(code(&o), 2, "{option} {value}");
        assert!(
            errors(&o).contains(option) && errors(&o).contains(value),
            "{}",
            errors(&o)
        );
    }
}

/// The kit is a lid that lies loosely on a box.
#[test]
fn a_test_says_how_it_ended_by_its_exit_code_and_leaves_figures_and_a_picture() {
    let dir = tempfile::tempdir().unwrap();
    let kit = dir.path().join("kit");
    fs::create_dir(&kit).unwrap();
    fs::write(kit.join("plan.json"), with_files(TWO_PIECES)).unwrap();
    let hollow = cuboid([0.0; 3], [80.0, 80.0, 78.0]).subtract(&cuboid([2.0; 3], [78.0, 78.0, 81.0]));
    let cover = cuboid([0.0, 0.0, 78.1], [80.0; 3]);
    for (file, volume) in [("box.stl", hollow), ("lid.stl", cover)] {
        fs::write(kit.join(file), write_stl_binary(&volume.to_mesh())).unwrap();
    }
    let lid = labelled_cube([1, 1, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1]);
    fs::write(kit.join("segmentation.ply"), lid).unwrap();
    let o = shellock(
        dir.path(),
        &["test", "kit", "--edges", "3", "--compare", "--json"],
    );
    let told: serde_json::Value = serde_json::from_slice(&o.stdout).unwrap();
    let written: serde_json::Value =
        serde_json::from_slice(&fs::read(kit.join("stress.json")).unwrap()).unwrap();
    assert_eq!(told, written);
    let mut is_held = true;
    for (of, friction) in written["report"]["printed"]
        .as_array()
        .unwrap()
        .iter()
        .zip([0.0, 0.2])
    {
        assert_eq!(of["friction"], friction);
        is_held &= ["punch", "drop"]
            .iter()
            .all(|test| of[test]["verdict"] == "holds");
    }
    assert_eq!(written["passed"], is_held);
    assert_eq!(code(&o), i32::from(!is_held), "{}", errors(&o));
    assert!(written["report"]["compared"]["kit"]["punch"]["verdict"].is_string());
    let svg = fs::read_to_string(kit.join("stress.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    let mut names: Vec<_> = fs::read_dir(&kit)
        .unwrap()
        .flatten()
        .map(|f| f.file_name())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "box.stl",
            "lid.stl",
            "plan.json",
            "segmentation.ply",
            "stress.json",
            "stress.svg"
        ]
    );
}

#[test]
fn a_fit_test_is_written_once_and_what_fits_becomes_a_printer() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| shellock(dir.path(), args);
    let json = |o: &Output| serde_json::from_slice::<serde_json::Value>(&o.stdout).unwrap();
    let made = run(&["coupon", "--printer", "fdm", "-o", "plate", "--json"]);
    assert_eq!(code(&made), 0, "{}", errors(&made));
    let told = json(&made);
    assert_eq!(
        (&told["parts"], &told["numbers"][2]["clearance"]),
        (&20.into(), &0.2.into())
    );
    let names: Vec<String> = content(dir.path()).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["plate/shellock-coupon.3mf", "plate/shellock-coupon.stl"]);
    let again = run(&["coupon", "--printer", "fdm", "-o", "plate"]);
    assert!(
        code(&again) == 2 && errors(&again).contains("--force"),
        "{}",
        errors(&again)
    );
    let forced = run(&["coupon", "--printer", "fdm", "-o", "plate", "--force", "-q"]);
    assert_eq!((code(&forced), forced.stdout.len()), (0, 0));

    let save = [
        "coupon",
        "--printer",
        "fdm",
        "--fits",
        "4",
        "--save",
        "workshop",
        "--config",
        "own.toml",
    ];
    assert_eq!(code(&run(&save)), 0);
    let next = run(&[
        "coupon",
        "--printer",
        "workshop",
        "--config",
        "own.toml",
        "-o",
        "next.3mf",
        "--json",
    ]);
    for gap in ["clearance", "key_clearance", "tolerance"] {
        assert_eq!(json(&next)["numbers"][2][gap], told["numbers"][3][gap]);
    }
}

#[test]
fn what_is_no_fit_or_no_file_leaves_the_configuration_as_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let text = "# mine\n[printers.workshop]\nlike = \"fdm\"\n";
    fs::write(dir.path().join("shellock.toml"), text).unwrap();
    fs::write(dir.path().join("broken.toml"), "size = [").unwrap();
    let refusals: [(&[&str], i32, &str); 7] = [
        (&["--fits", "6", "--save", "workshop"], 2, "1..=5"),
        (&["--fits", "2"], 2, "--save"),
        (&["--save", "workshop"], 2, "--fits"),
        (&["--fits", "2", "--save", "SLA"], 2, "comes with the program"),
        (
            &["--fits", "2", "--save", "workshop"],
            2,
            "is like \"fdm\", not \"sla\"",
        ),
        (
            &["--fits", "2", "--save", "other", "--config", "broken.toml"],
            2,
            "broken.toml",
        ),
        (
            &["--fits", "2", "--save", "other", "--config", "no/folder/own.toml"],
            4,
            "no/folder/own.toml",
        ),
    ];
    for (args, expected, word) in refusals {
        let refused = shellock(dir.path(), &[&["coupon"], args].concat());
        assert!(
            code(&refused) == expected && errors(&refused).contains(word),
            "{args:?}: {}",
            errors(&refused)
        );
    }
    assert_eq!(
        fs::read_to_string(dir.path().join("shellock.toml")).unwrap(),
        text
    );
    assert_eq!(
        fs::read_to_string(dir.path().join("broken.toml")).unwrap(),
        "size = ["
    );
    assert_eq!(content(dir.path()).len(), 2);
}

/// Stages that check for the interrupt end by themselves; during a boolean, the process is ended from
/// outside.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_job_anywhere_and_leaves_nothing() {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;
    for stage in ["thickness", "pieces"] {
        let dir = tempfile::tempdir().unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_shellock"))
            .current_dir(dir.path())
            .args([
                "--json", "demo", "--figure", "vase", "--size", "60", "--pieces", "5", "-o", "kit",
            ])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap())
            .lines()
            .map_while(Result::ok);
        let is_there = lines.any(|line| line.contains(&format!("\"name\":\"{stage}\"")));
        assert!(is_there, "{stage} never began");
        let interrupted = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status();
        assert!(interrupted.unwrap().success());
        lines.for_each(drop);
        assert_eq!(child.wait().unwrap().code(), Some(130), "{stage}");
        assert_eq!(content(dir.path()), [], "{stage}");
    }
}
