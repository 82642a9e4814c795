//! Tests that an unchanged kit is confirmed, and that any change to it is refuted.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use shellock::certificate::{Evidence, PieceFile, certify};
use shellock::play::{PlayParams, SLIDE_MM, measure};
use shellock::verify::clearance::kit_gaps;
use shellock::verify::{Assembly, VerifyParams, examine};
use shellock::{Ctx, Direction, IdVec, InstallationPlan, InstallationStep, PatchId};
use shellock_check::{Finding, Verdict, check};
use shellock_formats::write_stl_binary;
use shellock_geom::{Solid, TriMesh, Vec3, Volume};
use shellock_testkit::shapes::{ALL, PinnedLid, brick, room, rounded_mesh};

const CLEARANCE_MM: f64 = 0.1;
const RIM_MM: f64 = 1.0;

fn grown(x: [f64; 2], y: [f64; 2], z: [f64; 2]) -> Volume {
    room([x, y, z], CLEARANCE_MM)
}

/// Cube in three parts: a base with a T-shaped groove, a lid whose tongue slides in along −x, and a pin
/// through both.
fn parts() -> [Volume; 3] {
    parts_with_lips(4.0)
}

/// Parts as above, with lips that reach over the tongue's foot by `lip_mm`.
fn parts_with_lips(lip_mm: f64) -> [Volume; 3] {
    let lid = PinnedLid {
        gap_mm: CLEARANCE_MM,
        lip_mm,
        ..PinnedLid::default()
    };
    lid.parts()
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// Kit as made: the files of its pieces, its certificate and its plan.
struct Made {
    files: Vec<(String, Vec<u8>)>,
    certificate: Value,
    plan: Value,
}

/// Writes the files of the pieces to `folder`; returns the kit's certificate and plan.
fn made_kit(folder: &Path) -> (Value, Value) {
    static KIT: LazyLock<Made> = LazyLock::new(make);
    KIT.files
        .iter()
        .for_each(|(name, bytes)| fs::write(folder.join(name), bytes).unwrap());
    (KIT.certificate.clone(), KIT.plan.clone())
}

fn make() -> Made {
    made_of(&parts(), &[Vec3::X, Vec3::X, Vec3::Z])
}

/// Kit of three parts that leave along `ways`, in the order of their numbers; the last one is the key.
fn made_of(parts: &[Volume; 3], ways: &[Vec3; 3]) -> Made {
    let pieces: IdVec<PatchId, TriMesh> = parts.iter().map(rounded_mesh).collect();
    let steps = ways.iter().copied().enumerate();
    let steps = steps.map(|(i, d)| InstallationStep {
        piece: i.into(),
        separation: Direction::of(d).unwrap(),
    });
    let plan = InstallationPlan {
        steps: steps.collect(),
    };
    let (report, stop) = (|_: shellock::Progress<'_>| {}, AtomicBool::new(false));
    let model = Solid::new(brick(ALL, ALL, ALL).to_mesh()).unwrap();
    let params = VerifyParams {
        clearance_mm: CLEARANCE_MM,
        seed: 0,
    };
    let assembly = Assembly {
        model: Some(&model),
        pieces: &pieces,
        plan: &plan,
        press_fits: &[],
    };
    let (verdict, contacts) = examine(&Ctx::new(&report, &stop), &params, &assembly).unwrap();
    let files: Vec<(String, Vec<u8>)> = pieces
        .iter()
        .map(|(id, mesh)| (format!("{}.stl", usize::from(id)), write_stl_binary(mesh)))
        .collect();
    let named = pieces.ids().zip(&files);
    let named = named
        .map(|(id, (file, bytes))| PieceFile {
            id,
            file: file.clone(),
            sha256: sha256(bytes),
            play: None,
        })
        .collect();
    let gaps = kit_gaps(&Ctx::new(&report, &stop), Some(&model), &pieces, &plan, RIM_MM).unwrap();
    let ctx = Ctx::new(&report, &stop);
    let params = PlayParams {
        clearance_mm: CLEARANCE_MM,
        slide_mm: SLIDE_MM,
        is_together: false,
        seed: 0,
    };
    let play = measure(&ctx, &params, &pieces, &plan).unwrap();
    let evidence = Evidence {
        contacts: &contacts,
        verdict: &verdict,
        gaps: &gaps,
        play: Some(&play),
    };
    let certificate = certify(named, &pieces, &plan, &evidence, CLEARANCE_MM).unwrap();
    let pieces = plan.steps.iter().map(|s| {
        json!({ "file": format!("{}.stl", usize::from(s.piece)),
            "installation_direction": (-s.separation.unit() + 0.0).to_array() })
    });
    let plan = json!({ "version": 2, "key_piece": 3, "installation_order": [1, 2, 3],
                       "clearance": CLEARANCE_MM, "pieces": pieces.collect::<Vec<_>>() });
    let mut certificate = serde_json::to_value(certificate).unwrap();
    // Gaps are visible from outside, which does not matter here.
    certificate["failed"] = json!([]);
    Made {
        files,
        certificate,
        plan,
    }
}

/// Claims that are refuted after `change` has been applied to the kit.
fn refutations(change: impl FnOnce(&Path, &mut Value, &mut Value)) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let (mut certificate, mut plan) = made_kit(folder.path());
    change(folder.path(), &mut certificate, &mut plan);
    for (name, value) in [("certificate.json", certificate), ("plan.json", plan)] {
        fs::write(folder.path().join(name), serde_json::to_vec(&value).unwrap()).unwrap();
    }
    let findings: Vec<Finding> = check(folder.path()).unwrap();
    findings
        .into_iter()
        .filter(|f| f.verdict == Verdict::Refuted)
        .map(|f| f.claim)
        .collect()
}

/// Replaces a piece by `mesh`, and updates its hash.
fn replace(folder: &Path, certificate: &mut Value, piece: usize, mesh: &Volume) {
    let bytes = write_stl_binary(&rounded_mesh(mesh));
    fs::write(folder.join(format!("{piece}.stl")), &bytes).unwrap();
    certificate["pieces"][piece]["sha256"] = sha256(&bytes).into();
}

/// Multipliers of the lock with key and first piece held, and the index of the greatest.
fn multipliers(certificate: &mut Value) -> (&mut Vec<Value>, usize) {
    let list = certificate["claims"][0]["multipliers"].as_array_mut().unwrap();
    let value = |i: &usize| list[*i][1].as_f64().unwrap();
    let greatest = (0..list.len())
        .max_by(|i, k| value(i).total_cmp(&value(k)))
        .unwrap();
    (list, greatest)
}

const FILES: &str = "the files are those that were certified";
const CONTACTS: &str = "the contacts lie on both pieces' surfaces";
const BODIES: &str = "each piece is one closed surface around a volume";
const LOCK: &str = "nothing but the key, piece 3, moves while 1 is held";
const BEARINGS: &str = "the bearings lie on their pieces' surfaces";
const LID: &str = "piece 2 stays within its play";
const PLAN: &str = "the certificate speaks of this plan";
const COMPLETE: &str = "every claim that a kit needs is made";

#[test]
fn a_kit_as_it_was_made_is_confirmed() {
    assert_eq!(refutations(|_, _, _| {}), [""; 0]);
}

#[test]
fn a_changed_byte_of_a_piece_is_seen() {
    let change = |folder: &Path, _: &mut Value, _: &mut Value| {
        let path = folder.join("1.stl");
        let mut bytes = fs::read(&path).unwrap();
        // Flip the last bit of a coordinate.
        bytes[84 + 12] ^= 1;
        fs::write(path, bytes).unwrap();
    };
    assert!(refutations(change).contains(&FILES.to_owned()));
}

#[test]
fn a_piece_moved_by_less_than_a_clearance_or_two_is_off_its_contacts() {
    for step in [Vec3::X, Vec3::Y, Vec3::Z] {
        let lost = refutations(|folder, certificate, _| {
            replace(folder, certificate, 1, &parts()[1].translate(step * 0.2));
        });
        assert!(
            lost.contains(&CONTACTS.to_owned()) && lost.contains(&LOCK.to_owned()),
            "{step}: {lost:?}"
        );
        assert!(!lost.contains(&FILES.to_owned()));
    }
}

#[test]
fn a_piece_without_its_connector_is_off_its_contacts() {
    let lost = refutations(|folder, certificate, _| {
        let bare = parts()[1].intersect(&brick(
            [-1.0, 31.0],
            [-1.0, 31.0],
            [15.0 + 0.5 * CLEARANCE_MM, 31.0],
        ));
        replace(folder, certificate, 1, &bare);
    });
    assert!(
        lost.contains(&CONTACTS.to_owned()) && lost.contains(&LOCK.to_owned()),
        "{lost:?}"
    );
}

#[test]
fn a_changed_multiplier_or_a_dropped_contact_leaves_no_equilibrium() {
    let changed = refutations(|_, certificate, _| {
        let (list, greatest) = multipliers(certificate);
        list[greatest][1] = (1.001 * list[greatest][1].as_f64().unwrap()).into();
    });
    assert_eq!(changed, [LOCK]);
    let negative = refutations(|_, certificate, _| multipliers(certificate).0[0][1] = (-1.0).into());
    assert_eq!(negative, [LOCK]);
    let dropped = refutations(|_, certificate, _| {
        let (list, greatest) = multipliers(certificate);
        list.remove(greatest);
    });
    assert_eq!(dropped, [LOCK]);
}

#[test]
fn forces_in_equilibrium_along_one_line_hold_nothing_else() {
    // One pair of opposed contacts has multipliers without residual, but no rank.
    let lost = refutations(|_, certificate, _| {
        let of = |c: &Value, k: &str| c[k].clone();
        let mut back = certificate["contacts"][0].clone();
        (back["a"], back["b"]) = (of(&back, "b"), of(&back, "a"));
        let n = certificate["contacts"].as_array().unwrap().len();
        certificate["contacts"].as_array_mut().unwrap().push(back);
        certificate["claims"][0]["multipliers"] = json!([[0, 1.0], [n, 1.0]]);
    });
    assert!(lost.contains(&LOCK.to_owned()), "{lost:?}");
}

#[test]
fn a_turned_normal_is_not_that_of_the_piece() {
    let lost = refutations(|_, certificate, _| certificate["contacts"][0]["normal"] = json!([0.6, 0.0, 0.8]));
    assert_eq!(lost[0], CONTACTS);
}

#[test]
fn a_changed_direction_is_not_the_plans_and_not_free() {
    let turned = json!([0.0, 1.0, 0.0]);
    let is_lid = |c: &&mut Value| c["claim"] == "installs" && c["piece"] == 2;
    let turn = |certificate: &mut Value| {
        let claim = certificate["claims"]
            .as_array_mut()
            .unwrap()
            .iter_mut()
            .find(is_lid)
            .unwrap();
        claim["direction"] = turned.clone();
    };
    assert_eq!(refutations(|_, certificate, _| turn(certificate)), [PLAN]);
    let both = refutations(|_, certificate, plan| {
        turn(certificate);
        plan["pieces"][1]["installation_direction"] = turned.clone();
    });
    assert_eq!(both, ["piece 2 can be installed"]);
}

#[test]
fn a_missing_piece_or_claim_is_missed() {
    let lost = refutations(|folder, _, _| fs::remove_file(folder.join("1.stl")).unwrap());
    assert_eq!(lost, [FILES]);
    let unlisted = refutations(|_, certificate, _| {
        certificate["pieces"].as_array_mut().unwrap().remove(1);
    });
    assert!(unlisted.contains(&PLAN.to_owned()));
    for claim in 0..7 {
        let silent = refutations(|_, certificate, _| {
            certificate["claims"].as_array_mut().unwrap().remove(claim);
        });
        // A claim of play may be missing: play without a proof is reported as unproven.
        let is_play = (1..4).contains(&claim);
        assert_eq!(
            silent.contains(&COMPLETE.to_owned()),
            !is_play,
            "{claim}: {silent:?}"
        );
    }
    let more = refutations(|_, certificate, _| {
        let claims = certificate["claims"].as_array_mut().unwrap();
        let lock = claims[0].clone();
        claims.extend(vec![lock; 100]);
    });
    assert!(more.contains(&COMPLETE.to_owned()), "{more:?}");
}

#[test]
fn an_open_piece_and_overlapping_pieces_are_refuted() {
    let open = refutations(|folder, certificate, _| {
        let mut mesh = rounded_mesh(&parts()[2]);
        mesh.triangles.pop();
        let bytes = write_stl_binary(&mesh);
        fs::write(folder.join("2.stl"), &bytes).unwrap();
        certificate["pieces"][2]["sha256"] = sha256(&bytes).into();
    });
    assert!(open.contains(&BODIES.to_owned()));
    let thick = refutations(|folder, certificate, _| {
        replace(
            folder,
            certificate,
            2,
            &brick([16.0, 25.0], [12.0, 18.0], [1.0, 30.0]),
        );
    });
    assert!(
        thick.contains(&"the assembled pieces do not overlap".to_owned()),
        "{thick:?}"
    );
}

/// Both halves of a piece are closed, and their faces are unchanged except for the cut.
#[test]
fn a_piece_in_two_halves_or_with_something_inside_is_refuted() {
    let sawn = refutations(|folder, certificate, _| {
        let slab = brick([-1.0, 31.0], [24.0, 24.5], [-1.0, 31.0]);
        replace(folder, certificate, 0, &parts()[0].subtract(&slab));
    });
    assert_eq!(sawn, [BODIES]);
    let hollow = refutations(|folder, certificate, _| {
        replace(
            folder,
            certificate,
            0,
            &parts()[0].subtract(&brick([1.0, 5.0], [1.0, 5.0], [1.0, 4.0])),
        );
    });
    assert_eq!(hollow, [BODIES]);
}

#[test]
fn what_keeps_rays_from_being_cast_is_refuted() {
    let far = refutations(|folder, certificate, _| {
        let mut mesh = rounded_mesh(&parts()[1]);
        mesh.points.push(Vec3::new(1e30, 0.0, 0.0));
        let far = mesh.points.len() as u32 - 1;
        mesh.triangles.push([far; 3]);
        let bytes = write_stl_binary(&mesh);
        fs::write(folder.join("1.stl"), &bytes).unwrap();
        certificate["pieces"][1]["sha256"] = sha256(&bytes).into();
    });
    assert_eq!(far, [FILES]);
    let untold = refutations(|_, certificate, _| {
        let claims = certificate["claims"].as_array_mut().unwrap();
        claims
            .iter_mut()
            .filter(|c| c["claim"] == "apart")
            .for_each(|c| c["least"] = json!({}));
    });
    assert_eq!(untold, ["the assembled pieces do not overlap"]);
}

#[test]
fn a_kit_that_failed_or_has_wide_gaps_or_files_elsewhere_is_refuted() {
    let failed = refutations(|_, certificate, _| certificate["failed"] = json!(["outer surface kept: 92 %"]));
    assert_eq!(failed, ["the kit passed the tests of its maker"]);
    let wide = refutations(|_, certificate, plan| {
        (certificate["clearance_mm"], plan["clearance"]) = (5.0.into(), 5.0.into());
    });
    assert!(wide.contains(&PLAN.to_owned()), "{wide:?}");
    let outside = refutations(|folder, certificate, plan| {
        let name = format!("../{}/1.stl", folder.file_name().unwrap().to_str().unwrap());
        (certificate["pieces"][1]["file"], plan["pieces"][1]["file"]) = (name.as_str().into(), name.into());
    });
    assert_eq!(outside, [FILES]);
    let other = refutations(|folder, certificate, _| {
        fs::write(folder.join("assembly.3mf"), "junk").unwrap();
        certificate["files"] = json!([{ "file": "assembly.3mf", "sha256": sha256(b"as it was") }]);
    });
    assert_eq!(other, ["other files are those that were certified"]);
}

/// Peg in a cup as the key; the lid beside them lies loose, and is the first piece.
#[test]
fn a_first_piece_that_comes_off_is_not_certified() {
    let cup = brick([0.0, 20.0], [0.0, 20.0], [0.0, 20.0]);
    let peg = ([5.0, 15.0], [5.0, 15.0]);
    let pieces = [
        brick([30.0, 50.0], [0.0, 20.0], [0.0, 5.0]),
        cup.subtract(&grown(peg.0, peg.1, [2.0, 40.0])),
        brick(peg.0, peg.1, [2.0, 20.0]),
    ];
    let made = made_of(&pieces, &[Vec3::X, Vec3::X, Vec3::Z]);
    let folder = tempfile::tempdir().unwrap();
    made.files
        .iter()
        .for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
    fs::write(
        folder.path().join("certificate.json"),
        made.certificate.to_string(),
    )
    .unwrap();
    fs::write(folder.path().join("plan.json"), made.plan.to_string()).unwrap();
    let findings = check(folder.path()).unwrap();
    assert!(
        findings
            .iter()
            .any(|f| f.claim == COMPLETE && f.verdict == Verdict::Refuted),
        "{findings:?}"
    );
}

#[test]
fn a_gap_that_is_told_wrong_or_at_another_place_is_refuted() {
    let change = |claim: &'static str, with: &dyn Fn(&mut Value)| {
        refutations(|_, certificate, _| {
            let mut claims = certificate["claims"].as_array_mut().unwrap().iter_mut();
            with(&mut claims.find(|c| c["claim"] == claim).unwrap()["least"]["beneath_rim"]);
        })
    };
    for (claim, text) in [
        ("key-leaves", "the key, piece 3, can leave"),
        ("installs", "piece 2 can be installed"),
        ("apart", "the assembled pieces do not overlap"),
    ] {
        assert_eq!(
            change(claim, &|gap| gap["gap_mm"] =
                (gap["gap_mm"].as_f64().unwrap() + 0.03).into()),
            [text]
        );
        assert_eq!(
            change(claim, &|gap| gap["gap_mm"] =
                (gap["gap_mm"].as_f64().unwrap() - 0.01).into()),
            [text]
        );
        assert_eq!(
            change(claim, &|gap| gap["at"][2] =
                (gap["at"][2].as_f64().unwrap() + 50.0).into()),
            [text]
        );
        assert_eq!(change(claim, &|gap| gap["against"] = 9.into()), [text]);
    }
}

#[test]
fn what_is_no_certificate_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    assert!(check(folder.path()).is_err());
    let (mut certificate, plan) = made_kit(folder.path());
    fs::write(folder.path().join("plan.json"), plan.to_string()).unwrap();
    certificate["version"] = 2.into();
    fs::write(folder.path().join("certificate.json"), certificate.to_string()).unwrap();
    assert!(check(folder.path()).is_err_and(|why| why.contains("version 2")));
    fs::write(folder.path().join("certificate.json"), "{").unwrap();
    assert!(check(folder.path()).is_err());
}

/// Lid turned by 10° about its own axis, with its bottom filed, or with doubled gaps: after each change, its
/// play is no longer proven.
#[test]
fn what_is_done_to_a_piece_refutes_its_play() {
    let by = |change: &dyn Fn(&Volume) -> Volume| {
        refutations(|folder, certificate, _| replace(folder, certificate, 1, &change(&parts()[1])))
    };
    let turned = by(&|lid| {
        let (sin, cos) = 10f64.to_radians().sin_cos();
        let mut mesh = lid.to_mesh();
        for p in &mut mesh.points {
            let (x, y) = (p.x - 15.0, p.y - 15.0);
            (p.x, p.y) = (15.0 + cos * x - sin * y, 15.0 + sin * x + cos * y);
        }
        Volume::from_closed_mesh(&mesh).unwrap()
    });
    let filed = by(&|lid| {
        lid.intersect(&brick(
            [-1.0, 31.0],
            [-1.0, 31.0],
            [15.0 + 0.5 * CLEARANCE_MM, 31.0],
        ))
    });
    // Twice the gap on the tongue's sides.
    let slim = by(&|lid| {
        let sides = [[6.0, 7.0 + CLEARANCE_MM], [23.0 - CLEARANCE_MM, 24.0]];
        sides.iter().fold(lid.clone(), |lid, y| {
            lid.subtract(&brick([-1.0, 31.0], *y, [4.0, 9.5]))
        })
    });
    for lost in [turned, filed, slim] {
        assert!(
            lost.contains(&BEARINGS.to_owned()) && lost.contains(&LID.to_owned()),
            "{lost:?}"
        );
    }
}

#[test]
fn a_play_that_is_told_less_than_it_is_or_proven_by_less_is_refuted() {
    let claim = |certificate: &mut Value, with: &dyn Fn(&mut Value)| {
        let mut claims = certificate["claims"].as_array_mut().unwrap().iter_mut();
        with(
            claims
                .find(|c| c["claim"] == "bounded" && c["free"] == json!([2]))
                .unwrap(),
        );
    };
    let scaled = |value: &mut Value, by: f64| *value = (value.as_f64().unwrap() * by).into();
    let smaller = refutations(|_, c, _| claim(c, &|b| scaled(&mut b["quantities"][0]["most"][0][1], 0.9)));
    assert_eq!(smaller, [LID]);
    let lighter = refutations(|_, c, _| {
        claim(c, &|b| {
            let rows = b["multipliers"][1][0][1].as_array_mut().unwrap();
            rows.iter_mut().for_each(|row| scaled(&mut row[1], 0.9));
        });
    });
    assert_eq!(lighter, [LID]);
    let told = refutations(|_, c, _| scaled(&mut c["pieces"][1]["play"]["translation_mm"], 0.5));
    assert_eq!(told, [LID]);
}

/// Verdicts on the lid's play, and the names of the refuted claims.
fn of_lid(made: &Made, change: impl FnOnce(&Path, &mut Value)) -> (Vec<Verdict>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    made.files
        .iter()
        .for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
    let mut certificate = made.certificate.clone();
    change(folder.path(), &mut certificate);
    fs::write(
        folder.path().join("certificate.json"),
        serde_json::to_vec(&certificate).unwrap(),
    )
    .unwrap();
    fs::write(
        folder.path().join("plan.json"),
        serde_json::to_vec(&made.plan).unwrap(),
    )
    .unwrap();
    let findings = check(folder.path()).unwrap();
    let of_lid = findings
        .iter()
        .filter(|f| f.claim == LID)
        .map(|f| f.verdict)
        .collect();
    (
        of_lid,
        findings
            .into_iter()
            .filter(|f| f.verdict == Verdict::Refuted)
            .map(|f| f.claim)
            .collect(),
    )
}

/// Model of a printed tail that came off by hand: it hangs under two lips that reach over it by 0.2 mm each,
/// less a clearance of 0.1 mm.
#[test]
fn a_tail_on_two_short_connectors_has_no_proof_and_can_borrow_none() {
    let ways = [Vec3::X, Vec3::X, Vec3::Z];
    let (sound, loose) = (made_of(&parts(), &ways), made_of(&parts_with_lips(0.2), &ways));
    let verdicts = of_lid(&sound, |_, _| {});
    assert_eq!(verdicts.0, [Verdict::Confirmed], "{verdicts:?}");
    let verdicts = of_lid(&loose, |_, _| {});
    assert_eq!(verdicts.0, [Verdict::Unproven], "{verdicts:?}");
    let borrowed = of_lid(&loose, |_, certificate| {
        for part in ["claims", "bearings", "slide"] {
            certificate[part] = sound.certificate[part].clone();
        }
    });
    assert!(borrowed.1.contains(&LID.to_owned()), "{borrowed:?}");
    // The tongue of the sound lid is filed down to the loose lid's shape.
    let filed = of_lid(&sound, |folder, certificate| {
        replace(folder, certificate, 1, &parts_with_lips(0.2)[1])
    });
    assert!(filed.1.contains(&LID.to_owned()), "{filed:?}");
}
