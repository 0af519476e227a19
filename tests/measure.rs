//! Metrics from truth and prediction: computed by hand, by brute force, and by other programs.
//!
//! Rationale: nobody questions a wrong score. Expected: hand-made matrices and maps give the values computed beside
//! them; random maps give the values of scikit-learn and SciPy within 1e-12; boundaries match a search over all pairs
//! of pixels; a 95 % interval covers the truth in about 95 % of simulated sets. Source: the definitions in
//! `crates/train/src/measure`, the programs named in `tests/requirements.txt`.

use crate::common::python::python;
use furrow_base::sampling::rng::{Purpose, Stream};
use furrow_report::{Cell, Table};
use furrow_train::baseline::{Baseline, Cut, Example, Kind, SizeRule};
use furrow_train::measure::bootstrap;
use furrow_train::measure::boundary::{Boundary, TOLERANCE};
use furrow_train::measure::components::Components;
use furrow_train::measure::report::Report;
use furrow_train::measure::size::{SizeBin, Sizes};
use furrow_train::measure::{Confusion, Evaluation, Prediction, Scores};
use proptest::prelude::*;
use std::path::Path;
use std::process::Command;

const PLANTS: [bool; 3] = [false, true, true];
const NAMES: [&str; 3] = ["soil", "crop", "weed"];

fn close(a: Option<f64>, b: f64) -> bool {
    a.is_some_and(|a| (a - b).abs() < 1e-12)
}

/// Parses pixels from rows of digits; `x` is unlabelled.
fn map(rows: &[&str]) -> Vec<u8> {
    rows.concat().bytes().map(|c| if c == b'x' { 255 } else { c - b'0' }).collect()
}

fn answer<'a>(width: u32, truth: &'a [u8], predicted: &'a [u8]) -> Prediction<'a> {
    let height = truth.len() as u32 / width;
    Prediction { name: "a", width, height, truth, predicted, plants: None, separated: None, seconds: None }
}

/// Builds a random map of three classes in blobs, partly unlabelled.
fn random_map(stream: &mut Stream, width: usize, height: usize, ignore: bool) -> Vec<u8> {
    let mut map = vec![0; width * height];
    for _ in 0..stream.index(12) {
        let (x, y) = (stream.range(0.0, width as f64), stream.range(0.0, height as f64));
        let radius = stream.range(0.5, width as f64 / 4.0);
        let class = if ignore && stream.chance(0.2) { 255 } else { 1 + stream.index(2) as u8 };
        for (at, pixel) in map.iter_mut().enumerate() {
            if ((at % width) as f64 - x).hypot((at / width) as f64 - y) < radius {
                *pixel = class;
            }
        }
    }
    map
}

/// Builds a prediction that deviates from the truth in some pixels.
fn random_answer(stream: &mut Stream, truth: &[u8]) -> Vec<u8> {
    truth.iter().map(|t| if *t > 2 || stream.chance(0.15) { stream.index(3) as u8 } else { *t }).collect()
}

#[test]
fn scores_of_a_matrix_are_those_worked_out_by_hand() {
    // Rows are true soil, crop and weed; columns are the predicted classes.
    let matrix = Confusion::from_rows(&[vec![80, 3, 1], vec![2, 8, 2], vec![1, 2, 1]]).unwrap();
    let s = Scores::of(&matrix, &PLANTS);
    assert!(close(s.global_accuracy, 89.0 / 100.0));
    assert!(close(s.class_accuracy, (80.0 / 84.0 + 8.0 / 12.0 + 1.0 / 4.0) / 3.0));
    // Unions: 84 + 83 − 80, 12 + 13 − 8, 4 + 4 − 1.
    assert!(close(s.mean_iou, (80.0 / 87.0 + 8.0 / 17.0 + 1.0 / 7.0) / 3.0));
    let crop = &s.classes[1];
    assert!(close(crop.iou, 8.0 / 17.0) && close(crop.precision, 8.0 / 13.0) && close(crop.recall, 8.0 / 12.0));
    assert!(close(crop.f1, 16.0 / 25.0));
    // Crop predicted as weed is still vegetation: 8 + 2 + 2 + 1 hits, 4 false positives, 3 missed.
    assert!(close(s.vegetation.precision, 13.0 / 17.0) && close(s.vegetation.recall, 13.0 / 16.0));
    assert!(close(s.vegetation.iou, 13.0 / 20.0));
}

#[test]
fn what_is_of_nothing_is_unknown_and_left_out_of_means() {
    // No weed in truth or prediction.
    let s = Scores::of(&Confusion::from_rows(&[vec![6, 2, 0], vec![1, 1, 0], vec![0, 0, 0]]).unwrap(), &PLANTS);
    let weed = &s.classes[2];
    assert_eq!((weed.iou, weed.precision, weed.recall, weed.f1), (None, None, None, None));
    assert!(
        close(s.mean_iou, f64::midpoint(6.0 / 9.0, 1.0 / 4.0))
            && close(s.class_accuracy, f64::midpoint(6.0 / 8.0, 0.5))
    );
    // No weed in the truth, but in the prediction: this reduces IoU, not accuracy.
    let s = Scores::of(&Confusion::from_rows(&[vec![8, 0, 2], vec![0, 5, 0], vec![0, 0, 0]]).unwrap(), &PLANTS);
    assert_eq!((s.classes[2].iou, s.classes[2].recall, s.classes[2].precision), (Some(0.0), None, Some(0.0)));
    assert!(close(s.mean_iou, (0.8 + 1.0 + 0.0) / 3.0) && close(s.class_accuracy, f64::midpoint(0.8, 1.0)));
    let s = Scores::of(&Confusion::new(3), &PLANTS);
    assert!(s.values().all(Option::is_none));
    let json = serde_json::to_value(&s).unwrap();
    assert!(json["mean_iou"].is_null() && json["classes"][0]["iou"].is_null());
}

#[test]
fn faults_of_maps_are_reported_and_nothing_is_counted() {
    let mut matrix = Confusion::new(3);
    for (truth, predicted, words) in [
        (&[0, 1][..], &[0][..], "2 pixels, the prediction 1"),
        (&[0, 3], &[0, 0], "pixel 1 of the truth has the class 3"),
        (&[0, 1], &[0, 255], "pixel 1 of the prediction has the class 255"),
    ] {
        let error = matrix.add(truth, predicted).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
    assert_eq!(matrix, Confusion::new(3));
    matrix.add(&[255, 1], &[9, 1]).unwrap();
    assert_eq!((matrix.total(), matrix.at(1, 1)), (1, 1));
    assert!(Confusion::from_rows(&[vec![1, 2], vec![3]]).is_err());
    assert!(serde_json::from_str::<Confusion>("[[1,2],[3]]").is_err());
    let mut evaluation = Evaluation::new(NAMES);
    let error = evaluation.add(&Prediction { height: 2, ..answer(2, &[0, 1], &[0, 1]) }).unwrap_err().to_string();
    assert!(error.contains("a: the truth has 2 pixels") && error.contains("2 × 2 has 4"), "{error}");
    assert!(evaluation.is_empty());
}

proptest! {
    #[test]
    fn matrices_merge_in_any_order(seed in any::<u64>(), n in 1_usize..6) {
        let mut stream = Stream::of(seed, 0, Purpose::Test, 0);
        let images: Vec<(Vec<u8>, Vec<u8>)> = (0..n).map(|_| {
            let truth = random_map(&mut stream, 9, 7, true);
            let predicted = random_answer(&mut stream, &truth);
            (truth, predicted)
        }).collect();
        let of = |images: &[(Vec<u8>, Vec<u8>)]| {
            let mut matrix = Confusion::new(3);
            for (truth, predicted) in images {
                matrix.add(truth, predicted).unwrap();
            }
            matrix
        };
        let mut backwards = Confusion::new(3);
        images.iter().rev().for_each(|image| backwards.merge(&of(std::slice::from_ref(image))));
        prop_assert_eq!(&backwards, &of(&images));
        prop_assert_eq!(backwards.total(), images.iter().flat_map(|i| &i.0).filter(|t| **t != 255).count() as u64);
    }

    #[test]
    fn sizes_add_up_to_the_scores_of_the_class(seed in any::<u64>(), numbered in any::<bool>()) {
        let mut stream = Stream::of(seed, 0, Purpose::Test, 1);
        let (w, h) = (23, 17);
        let truth = random_map(&mut stream, w, h, true);
        let predicted = random_answer(&mut stream, &truth);
        let numbers: Vec<u32> = (0..w * h).map(|at| (at % w / 6) as u32).collect();
        let sizes = Sizes::of(&PLANTS, (w, h), &truth, &predicted, numbered.then_some(&numbers[..]));
        let mut matrix = Confusion::new(3);
        matrix.add(&truth, &predicted).unwrap();
        for class in 1..3 {
            let bins = sizes.bins(class);
            let sum = |of: fn(&SizeBin) -> u64| bins.iter().map(of).sum::<u64>();
            prop_assert_eq!(sum(|b| b.found), matrix.at(class, class));
            prop_assert_eq!(sum(|b| b.pixels), matrix.truth(class));
            prop_assert_eq!(sum(|b| b.false_positives), matrix.predicted(class) - matrix.at(class, class));
            for b in &bins {
                prop_assert!(b.plants == 0 || (b.from_pixels..=b.to_pixels).contains(&(b.pixels / b.plants)), "{:?}", b);
                prop_assert!(b.detected <= b.plants && b.found <= b.pixels);
            }
        }
        prop_assert!(sizes.bins(0).is_empty());
    }

    #[test]
    fn outlines_match_what_a_search_over_all_pairs_finds(seed in any::<u64>()) {
        let mut stream = Stream::of(seed, 0, Purpose::Test, 2);
        // The tolerance is 0.9 to 3.2 pixels, so a search over too few columns or rows is detected.
        let (w, h) = (20 + stream.index(200), 12 + stream.index(20));
        let (w, h) = if stream.chance(0.5) { (w, h) } else { (h, w) };
        let truth = random_map(&mut stream, w, h, true);
        let predicted = random_answer(&mut stream, &random_map(&mut Stream::of(seed, 0, Purpose::Test, 2), w, h, false));
        let reach = TOLERANCE * (w as f64).hypot(h as f64);
        for (class, found) in Boundary::of(3, w, h, &truth, &predicted).iter().enumerate() {
            let outline = |map: &[u8]| -> Vec<(i64, i64)> {
                let at = |x: i64, y: i64| {
                    let inside = x >= 0 && y >= 0 && x < w as i64 && y < h as i64;
                    let k = (y * w as i64 + x) as usize;
                    (inside && truth[k] != 255).then(|| map[k])
                };
                let all = (0..h as i64).flat_map(|y| (0..w as i64).map(move |x| (x, y)));
                all.filter(|&(x, y)| {
                    at(x, y) == Some(class as u8)
                        && [(1, 0), (-1, 0), (0, 1), (0, -1)].iter().any(|(dx, dy)| at(x + dx, y + dy).is_some_and(|c| c != class as u8))
                }).collect()
            };
            let (of_truth, of_answer) = (outline(&truth), outline(&predicted));
            let near = |of: &[(i64, i64)], by: &[(i64, i64)]| {
                let close = |a: &(i64, i64), b: &(i64, i64)| ((a.0 - b.0) as f64).powi(2) + ((a.1 - b.1) as f64).powi(2) <= reach * reach;
                of.iter().filter(|a| by.iter().any(|b| close(a, b))).count() as u64
            };
            let expected = Boundary {
                truth: of_truth.len() as u64,
                truth_matched: near(&of_truth, &of_answer),
                predicted: of_answer.len() as u64,
                predicted_matched: near(&of_answer, &of_truth),
            };
            prop_assert_eq!(*found, expected, "class {} of {} × {}", class, w, h);
        }
    }
}

#[test]
fn an_outline_that_is_off_by_less_than_the_tolerance_is_right() {
    // 400 × 300 pixels: a diagonal of 500, tolerance 3.75.
    let (w, h) = (400, 300);
    let square = |shift: usize| -> Vec<u8> {
        (0..w * h)
            .map(|at| u8::from((100 + shift..200 + shift).contains(&(at % w)) && (100..200).contains(&(at / w))))
            .collect()
    };
    let score = |shift| Boundary::of(3, w, h, &square(0), &square(shift))[1];
    assert_eq!((score(0).truth, score(0).f_score()), (396, Some(1.0)));
    assert_eq!(score(3).f_score(), Some(1.0));
    // Shifted by six pixels: the upper and lower sides still match except for their ends; the other two do not.
    let far = score(6);
    assert!(far.truth_matched > 180 && far.truth_matched < 210, "{far:?}");
    let none = Boundary::of(3, w, h, &square(0), &vec![0; w * h]);
    assert_eq!((none[1].f_score(), none[2].f_score()), (Some(0.0), None));
}

#[test]
fn small_and_large_plants_are_scored_separately() {
    // A crop plant of 16 pixels with a frayed edge, a missed weed of 3, and a speck of predicted weed on bare soil.
    let truth = map(&["0000000000", "0111100000", "0111100220", "0111100200", "0111100000", "0000000000"]);
    let answer = map(&["0000000000", "0111110000", "0111110000", "0111100000", "0110000000", "0000000020"]);
    let sizes = Sizes::of(&PLANTS, (10, 6), &truth, &answer, None);
    let [crop] = &sizes.bins(1)[..] else { panic!("{:?}", sizes.bins(1)) };
    assert_eq!((crop.from_pixels, crop.to_pixels, crop.plants, crop.detected), (16, 63, 1, 1));
    assert_eq!((crop.pixels, crop.found, crop.false_positives), (16, 14, 2));
    assert!(close(crop.recall, 14.0 / 16.0) && close(crop.iou, 14.0 / 18.0));
    let [weed] = &sizes.bins(2)[..] else { panic!("{:?}", sizes.bins(2)) };
    assert_eq!((weed.from_pixels, weed.plants, weed.detected, weed.found, weed.false_positives), (1, 1, 0, 0, 1));
    assert_eq!((weed.recall, weed.iou), (Some(0.0), Some(0.0)));
}

#[test]
fn touching_plants_are_separated_by_their_numbers() {
    let truth = map(&["11111111", "11111111"]);
    let numbers: Vec<u32> = (0..16).map(|at| if at % 8 < 2 { 7 } else { 3 }).collect();
    // The small plant of 4 pixels is detected; of the one with 12, five pixels are found.
    let answer = map(&["11110000", "11111000"]);
    let bins = Sizes::of(&PLANTS, (8, 2), &truth, &answer, Some(&numbers)).bins(1);
    let [both] = &bins[..] else { panic!("{bins:?}") };
    assert_eq!((both.from_pixels, both.plants, both.detected, both.found, both.pixels), (4, 2, 1, 9, 16));
    // Without plant numbers they are one plant.
    let bins = Sizes::of(&PLANTS, (8, 2), &truth, &answer, None).bins(1);
    assert_eq!((bins[0].from_pixels, bins[0].plants, bins[0].detected), (16, 1, 1));
    // Pixels without a number form plants by connected components.
    let mixed: Vec<u32> = numbers.iter().map(|n| if *n == 7 { 7 } else { 0 }).collect();
    let bins = Sizes::of(&PLANTS, (8, 2), &truth, &answer, Some(&mixed)).bins(1);
    assert_eq!(bins[0].plants, 2);
}

#[test]
fn a_halo_counts_against_the_plant_it_surrounds() {
    // Two plants of 1 and 9 pixels under one predicted blob: the false positives count for the plant that it covers
    // most.
    let truth = map(&["1000000", "0000111", "0000111", "0000111"]);
    let answer = map(&["1100000", "1111111", "0000111", "0000111"]);
    let bins = Sizes::of(&PLANTS, (7, 4), &truth, &answer, None).bins(1);
    let [small, large] = &bins[..] else { panic!("{bins:?}") };
    assert_eq!((small.plants, small.found, small.false_positives), (1, 1, 0));
    assert_eq!((large.plants, large.found, large.false_positives), (1, 9, 5));
}

#[test]
fn regions_are_numbered_in_the_order_of_their_first_pixels() {
    let picture = map(&["0100010", "1000101", "0000010", "2200000"]);
    let found = Components::of(7, 4, |at| Some(picture[at]).filter(|c| *c > 0));
    assert_eq!(
        found.labels,
        map(&["0100020", "1000202", "0000020", "3300000"]).into_iter().map(u32::from).collect::<Vec<_>>()
    );
    assert_eq!(found.areas, [2, 4, 2]);
    let empty = Components::of(0, 0, |_| Some(1));
    assert!(empty.labels.is_empty() && empty.areas.is_empty());
    // A spiral, whose arms meet last.
    let spiral = map(&["1111111", "0000001", "1111101", "1000101", "1011101", "1000001", "1111111"]);
    let found = Components::of(7, 7, |at| Some(spiral[at]).filter(|c| *c > 0));
    assert_eq!(found.areas, [spiral.iter().map(|c| u32::from(*c)).sum::<u32>()]);
}

/// Simulates confusion matrices of images with soil and plants; the found fraction of the plants varies between images.
/// The true fraction over all images is 0.7: the mean of a uniform distribution from 0.5 to 0.9, independent of the
/// number of plant pixels.
fn simulated(stream: &mut Stream, images: usize) -> Vec<Confusion> {
    let one = |stream: &mut Stream| {
        let plants = 500.0 + 1000.0 * stream.uniform();
        let found = (plants * stream.range(0.5, 0.9)).round();
        Confusion::from_rows(&[vec![5000, 0], vec![(plants - found) as u64, found as u64]]).unwrap()
    };
    (0..images).map(|_| one(stream)).collect()
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    let recall = |matrix: &Confusion| vec![Scores::of(matrix, &[false, true]).classes[1].recall];
    let trials: u32 = 300;
    let covered = (0..trials)
        .filter(|trial| {
            let images = simulated(&mut Stream::of(5, u64::from(*trial), Purpose::Test, 3), 40);
            let interval = bootstrap::intervals(&images, 1, recall)[0].unwrap();
            interval.low <= 0.7 && 0.7 <= interval.high
        })
        .count();
    // Percentile intervals from 40 images cover about 94 %; four standard errors of 300 trials are 5.5 %.
    let share = covered as f64 / f64::from(trials);
    assert!((0.885..0.995).contains(&share), "{share} of the intervals contain the truth");
}

#[test]
fn intervals_are_the_same_every_time_and_narrow_with_more_images() {
    let score = |matrix: &Confusion| vec![Scores::of(matrix, &[false, true]).classes[1].recall];
    let images = simulated(&mut Stream::of(1, 0, Purpose::Test, 4), 200);
    let width = |n: usize| bootstrap::intervals(&images[..n], 0, score)[0].map(|i| i.high - i.low).unwrap();
    assert_eq!(bootstrap::intervals(&images, 3, score), bootstrap::intervals(&images, 3, score));
    assert_ne!(bootstrap::intervals(&images, 3, score), bootstrap::intervals(&images, 4, score));
    // By the square root of the number of images: a factor of four.
    let ratio = width(10) / width(160);
    assert!((2.0..8.0).contains(&ratio), "{ratio}");
    assert_eq!(bootstrap::intervals(&images[..1], 0, score), [None]);
    // A score that is undefined in most resamples has no interval.
    let mut rare = vec![Confusion::from_rows(&[vec![5, 0], vec![0, 0]]).unwrap(); 20];
    rare[0] = Confusion::from_rows(&[vec![5, 0], vec![1, 1]]).unwrap();
    assert!(bootstrap::intervals(&rare, 0, score)[0].is_some(), "one image in twenty is in 64 % of the resamples");
    rare[0] = rare[1].clone();
    assert_eq!(bootstrap::intervals(&rare, 0, score), [None]);
}

/// Evaluates some random images.
fn evaluated(order: impl Iterator<Item = u64>) -> Report {
    let mut evaluation = Evaluation::new(NAMES);
    for k in order {
        let mut stream = Stream::of(9, k, Purpose::Test, 5);
        let (w, h) = (30 + k as u32, 20);
        let truth = random_map(&mut stream, w as usize, h as usize, true);
        let predicted = random_answer(&mut stream, &truth);
        let name = format!("{k:03}");
        let answer = Prediction { name: &name, seconds: Some(0.1 * (k + 1) as f64), ..answer(w, &truth, &predicted) };
        evaluation.add(&answer).unwrap();
    }
    evaluation.finish()
}

#[test]
fn a_report_is_the_same_in_whatever_order_images_come_and_reads_back() {
    let report = evaluated(0..7);
    assert_eq!(report, evaluated((0..7).rev()));
    let json = serde_json::to_string(&report).unwrap();
    assert_eq!(serde_json::from_str::<Report>(&json).unwrap(), report);
    assert!(!json.contains("NaN"));
    let mut matrix = Confusion::new(3);
    for k in 0..7 {
        let mut stream = Stream::of(9, k, Purpose::Test, 5);
        let truth = random_map(&mut stream, 30 + k as usize, 20, true);
        matrix.add(&truth, &random_answer(&mut stream, &truth)).unwrap();
    }
    assert_eq!((report.confusion.clone(), report.pixels), (matrix.clone(), matrix.total()));
    assert_eq!(report.scores, Scores::of(&matrix, &PLANTS));
    let interval = report.intervals.mean_iou.unwrap();
    assert!(interval.low < report.scores.mean_iou.unwrap() && report.scores.mean_iou.unwrap() < interval.high);
    let seconds = report.seconds.unwrap();
    assert!(seconds.images == 7 && close(Some(seconds.mean), 0.4) && close(Some(seconds.median), 0.4));
    assert_eq!(report.sizes.iter().map(|s| s.class.as_str()).collect::<Vec<_>>(), ["crop", "weed"]);
}

#[test]
fn a_report_of_nothing_knows_nothing() {
    let report = Evaluation::new(NAMES).finish();
    assert!(report.scores.values().all(Option::is_none) && report.intervals.values().all(Option::is_none));
    assert!(report.seconds.is_none() && report.images.is_empty());
    assert!(report.tables().iter().all(|table| !table.markdown().contains("NaN")));
}

#[test]
fn a_table_is_read_back_from_each_of_its_forms() {
    let mut table = Table::new("A \"title\"", ["name", "a, b", "n"]);
    table.push([Cell::text("x|y"), Cell::percent(Some(0.12345), 1), Cell::Count(3)]);
    table.push([Cell::text("two\nlines, \"quoted\""), Cell::number(Some(f64::NAN), 2), Cell::Count(0)]);
    table.push([Cell::text(""), Cell::number(Some(-0.001), 2), Cell::Count(1_000_000)]);
    let markdown = table.markdown();
    let lines: Vec<&str> = markdown.lines().collect();
    assert_eq!((lines[0], lines[1], lines.len()), ("**A \"title\"**", "", 7));
    assert!(lines[3].starts_with("| ---") && lines[3].ends_with("---: |"), "{markdown}");
    assert!(lines[4].starts_with("| x\\|y ") && lines[4].contains(" 12.3 |"), "{markdown}");
    assert!(lines[5].contains("two lines, \"quoted\"") && lines[5].contains(" – |"), "{markdown}");
    assert!(lines[6].contains(" 0.00 |"), "{markdown}");
    let expected = "name,\"a, b\",n\r\nx|y,12.345,3\r\n\"two\nlines, \"\"quoted\"\"\",,0\r\n,-0.001,1000000\r\n";
    assert_eq!(table.csv(), expected);
    let json: serde_json::Value = serde_json::from_str(&table.json()).unwrap();
    assert_eq!(json["rows"][0], serde_json::json!(["x|y", 12.345, 3]));
    assert!(json["rows"][1][1].is_null());
    assert_eq!(json["columns"][1], "a, b");
}

/// Truth maps, predictions and our metrics, for another program to check.
fn cases() -> serde_json::Value {
    let case = |k: u64| {
        let mut stream = Stream::of(11, k, Purpose::Test, 6);
        let (w, h) = (20 + stream.index(40), 15 + stream.index(30));
        let truth = random_map(&mut stream, w, h, k.is_multiple_of(2));
        let predicted = random_answer(&mut stream, &truth);
        let mut matrix = Confusion::new(3);
        matrix.add(&truth, &predicted).unwrap();
        let regions = Components::of(w, h, |at| Some(predicted[at]).filter(|c| *c == 1));
        serde_json::json!({
            "width": w, "height": h, "truth": truth, "predicted": predicted,
            "confusion": matrix, "scores": Scores::of(&matrix, &PLANTS), "regions": regions.labels, "areas": regions.areas,
        })
    };
    serde_json::Value::Array((0..40).map(case).collect())
}

#[test]
fn scikit_learn_and_scipy_find_the_same_numbers() {
    let Some(python) = python("import sklearn, scipy") else { return };
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("measure-cases.json");
    std::fs::write(&file, serde_json::to_vec(&cases()).unwrap()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/train/check_metrics.py");
    let output = Command::new(python).arg(script).arg(&file).env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    let (message, faults) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{message}{faults}");
    assert!(message.contains("40 cases agree"), "{message}");
}

/// Image of brown soil and green plants by their classes, with normal noise of standard deviation `noise` (8-bit
/// levels).
fn field(stream: &mut Stream, truth: &[u8], noise: f64) -> Vec<[u8; 3]> {
    truth
        .iter()
        .map(|class| {
            let colour = if *class == 1 || *class == 2 { [60.0, 120.0, 50.0] } else { [120.0, 95.0, 70.0] };
            colour.map(|v| (v + noise * stream.normal()).round().clamp(0.0, 255.0) as u8)
        })
        .collect()
}

/// Fields of 80 × 60 pixels with crop squares 12 pixels wide and weed squares 4 pixels wide.
fn fields(seed: u64, noise: f64) -> Vec<Example> {
    let one = |k: u64| {
        let mut stream = Stream::of(seed, k, Purpose::Test, 7);
        let mut truth = vec![0; 80 * 60];
        for row in 0..3 {
            for column in 0..4 {
                let (class, side) = if stream.chance(0.5) { (1, 12) } else { (2, 4) };
                let (x, y) = (column * 20 + stream.index(8), row * 20 + stream.index(8));
                for at in (0..side * side).map(|i| (y + i / side) * 80 + x + i % side) {
                    truth[at] = class;
                }
            }
        }
        truth[stream.index(80)] = 255;
        let rgb = field(&mut stream, &truth, noise);
        Example { width: 80, height: 60, rgb, truth }
    };
    (0..6).map(one).collect()
}

fn fit(kind: Kind, cut: Cut, images: &[Example]) -> Baseline {
    Baseline::fit(kind, cut, || images.iter().cloned().map(Ok)).unwrap()
}

/// Returns the mean IoU and the IoU of the vegetation.
fn judged(baseline: &Baseline, images: &[Example]) -> (f64, f64) {
    let mut matrix = Confusion::new(3);
    for image in images {
        matrix.add(&image.truth, &baseline.predict(image.width, image.height, &image.rgb)).unwrap();
    }
    let scores = Scores::of(&matrix, &PLANTS);
    (scores.mean_iou.unwrap(), scores.vegetation.iou.unwrap())
}

#[test]
fn colour_and_size_separate_clean_squares() {
    let (train, test) = (fields(1, 0.0), fields(2, 0.0));
    for cut in [Cut::Otsu, Cut::Fitted] {
        let colour = fit(Kind::Exg, cut, &train);
        assert_eq!(judged(&colour, &test).1, 1.0, "{colour:?}");
        assert!(judged(&colour, &test).0 < 0.67, "without sizes, no weed can be found");
        let size = fit(Kind::ExgSize, cut, &train);
        assert_eq!(judged(&size, &test), (1.0, 1.0), "{size:?}");
        let rule = size.sizes.unwrap();
        assert!(rule.weed_from <= 16.0 / 4800.0 && (16.0 / 4800.0..=144.0 / 4800.0).contains(&rule.crop_from));
        let json = serde_json::to_string(&size).unwrap();
        assert_eq!(serde_json::from_str::<Baseline>(&json).unwrap(), size, "{json}");
    }
    assert_eq!(Kind::ALL.map(|kind| Kind::named(kind.name())), Kind::ALL.map(Some));
}

#[test]
fn what_is_fitted_beats_what_is_not_where_there_is_noise() {
    let (train, test) = (fields(3, 28.0), fields(4, 28.0));
    let [otsu, fitted] = [Cut::Otsu, Cut::Fitted].map(|cut| fit(Kind::Exg, cut, &train));
    assert!(fitted.blur > 0.0, "noise must be blurred: {fitted:?}");
    let (without, with) = (judged(&otsu, &test).1, judged(&fitted, &test).1);
    assert!(with > without + 0.05 && with > 0.6, "{with} against {without}");
    // On the training images, no other threshold with the same index and blur is better.
    let best = judged(&fitted, &train).1;
    for step in -20..20 {
        let threshold = fitted.threshold.map(|t| t + 0.01 * f64::from(step));
        let other = Baseline { threshold, ..fitted.clone() };
        assert!(judged(&other, &train).1 <= best + 1e-12, "{other:?}");
    }
    // Neither are other sizes.
    let size = fit(Kind::ExgSize, Cut::Fitted, &train);
    let best = judged(&size, &train).0;
    for factor in [0.3, 0.5, 0.8, 1.25, 2.0, 3.0] {
        let rule = size.sizes.unwrap();
        for rule in [
            SizeRule { crop_from: rule.crop_from * factor, ..rule },
            SizeRule { weed_from: rule.weed_from * factor, ..rule },
        ] {
            assert!(judged(&Baseline { sizes: Some(rule), ..size.clone() }, &train).0 <= best + 1e-12, "{rule:?}");
        }
    }
}

#[test]
fn baselines_say_what_they_cannot_learn_from() {
    let bare = Example { width: 2, height: 1, rgb: vec![[90; 3]; 2], truth: vec![0, 255] };
    let message = |kind, cut, images: &[Example]| {
        Baseline::fit(kind, cut, || images.iter().cloned().map(Ok)).unwrap_err().to_string()
    };
    assert!(
        message(Kind::Exg, Cut::Fitted, std::slice::from_ref(&bare))
            .contains("no pixel of the training images is a plant")
    );
    assert!(message(Kind::ExgSize, Cut::Otsu, &[]).contains("there is no training image"));
    let strange = Example { truth: vec![0, 3], ..bare.clone() };
    assert!(message(Kind::Exg, Cut::Fitted, &[strange]).contains("has the class 3"));
    let short = Example { truth: vec![0], ..bare.clone() };
    assert!(message(Kind::ExgSize, Cut::Otsu, &[short]).contains("2 × 1 pixels has 2 colours and 1 labels"));
    // A uniform image has no outliers, and Otsu's threshold uses no training images.
    let never = || -> Vec<furrow_base::Result<Example>> { panic!("no training image is needed") };
    let otsu = Baseline::fit(Kind::Exg, Cut::Otsu, never).unwrap();
    assert_eq!(otsu.predict(2, 1, &bare.rgb), [0, 0]);
}
