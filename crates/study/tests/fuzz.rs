//! Answers and studies that nobody should have written: an error or figures, in bounded time and memory, and never a panic.

use cpu_time::ThreadTime;
use promenade_study::{Study, abx, abx_by_person, groups, paired, persons, ratings, read};
use promenade_testing::fuzz::{Counting, Input, Search};
use std::fmt::Write;
use std::path::Path;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const HEAD: &str = "study,version,person,time,trial,part,method,item,a,b,x,answer,rating,role,seconds,headphones\n";

/// Everything that a report has of files.
fn report(files: &[&Path]) -> Result<usize, String> {
    let material = read(files).map_err(|error| error.to_string())?;
    material.answers.clone().leave_out_failed();
    let list = material.answers.list();
    let (rated, _out) = ratings(list, false);
    let found = paired(&material.tables, list).map_err(|error| error.to_string())?;
    let items = found.iter().flat_map(|found| found.items.iter().chain(&found.all)).map(|item| {
        let strengths = item.strengths.iter().flat_map(|strengths| &strengths.of);
        assert!(strengths.flat_map(|s| [s.log, s.error]).all(f64::is_finite), "{item:?}");
        groups(&item.votes.scores(), item.least.least).len()
    });
    let guessed = [abx(list), abx_by_person(list)].concat();
    let shares =
        |p: promenade_study::Person| [p.with_self, p.with_others].into_iter().flatten().all(|s| (0.0..=1.0).contains(&s));
    assert!(persons(list).into_iter().all(shares), "shares");
    assert!(guessed.iter().all(|abx| abx.right <= abx.trials && (0.0..=1.0).contains(&abx.chance)), "{guessed:?}");
    let conditions = rated.iter().flat_map(|rated| &rated.conditions);
    assert!(conditions.clone().all(|c| (0.0..=100.0).contains(&c.mean)), "ratings beyond the scale");
    Ok(items.sum::<usize>() + guessed.len() + conditions.count() + material.answers.persons())
}

#[test]
fn answers_of_listeners() {
    let mut answers = HEAD.to_owned();
    for (person, (better, rating)) in [("p", ("Mix", 91)), ("q", ("Sal", 20)), ("r", ("Mix", 100))] {
        for (trial, item) in ["room", "hall"].iter().enumerate() {
            write!(
                answers,
                "s,v,{person},t,{trial},1,paired,{item},Mix,Sal,,{better},,,9.5,passed\n\
                 s,v,{person},t,{}0,2,abx,{item},Mix,Sal,Mix,{better},,,3,passed\n\
                 s,v,{person},t,{}1,3,rating,{item},Mix,,,,{rating},reference,2,passed\n\
                 s,v,{person},t,{}1,3,rating,{item},Sal,,,,{},,2,passed\n",
                trial + 1,
                trial + 1,
                trial + 1,
                rating / 2,
            )
            .unwrap();
        }
    }
    let tables = include_str!("harvey.csv");
    let seeds = vec![Input::new("answers.csv", answers), Input::new("tables.csv", tables)];
    Search { name: "answers", cases: 1500, most_bytes: 64 << 20 }.run(seeds, |_, path| report(&[path]).map(|_| ()));
}

#[test]
fn studies() {
    let study = r#"{ "study": "rooms", "title": "Rooms", "welcome": "Hello", "seed": 3, "parts": [
        { "method": "paired", "sequence": ["R", "A", "B"], "seconds": 2.5, "repeats": 2, "items": [
            { "name": "room", "reference": "a.wav", "conditions": { "Mix": "b.wav", "Sal": "c.wav", "Uni": "d.wav" } }] },
        { "method": "rating", "anchor": true, "listen_s": 1.0, "items": [
            { "name": "hall", "dry": "dry.wav", "reference": "a.promenade", "conditions": { "Mix": "b.promenade" } }] }]}"#;
    Search { name: "study", cases: 1500, most_bytes: 16 << 20 }.run(vec![Input::new("study.json", study)], |_, path| {
        let study = Study::read(path).map_err(|error| error.to_string())?;
        assert!(!study.study.is_empty() && !study.parts.is_empty());
        Ok(())
    });
}

/// Files of some megabytes whose answers have little in common, and tables that each take as long as one may.
#[test]
fn many_answers_are_told_apart_in_no_time() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("many.csv");
    let lines = |count: usize, line: &dyn Fn(usize) -> String| HEAD.to_owned() + &(0..count).map(line).collect::<String>();
    let two = "Mix,Sal";
    let table = |n: usize| format!("item {n},a,b,c\na,*,{n},{n}\nb,{n},*,{n}\nc,{n},{n},*\n");
    let pairs = |n: usize| format!("{},{}", n % 64, (n + 1 + n / 64 % 63) % 64);
    let cases: [(&str, String, bool); 7] = [
        ("persons", lines(100_000, &|n| format!("s,v,p{n},t,1,1,paired,room,{two},,Mix,,,1,passed\n")), true),
        ("raters", lines(100_000, &|n| format!("s,v,p{n},t,1,1,rating,room,c{},,,,50,,1,passed\n", n % 500)), true),
        (
            "ranks",
            lines(100_000, &|n| format!("s,v,p{},t,1,1,rating,room,c{},,,,{},,1,failed\n", n / 20, n % 20, n * 7 % 101)),
            true,
        ),
        ("guesses", lines(100_000, &|n| format!("s,v,p{n},t,1,1,abx,i{},{two},Mix,Mix,,,1,passed\n", n % 1000)), true),
        ("items", lines(50_000, &|n| format!("s,v,p,t,{n},1,paired,i{n},{two},,Mix,,,1,passed\n")), false),
        ("conditions", lines(50_000, &|n| format!("s,v,p{n},t,1,1,paired,room,{},,{},,,1,passed\n", pairs(n), n % 64)), false),
        ("tables", (90..1090).map(table).collect(), true),
    ];
    for (name, text, fits) in cases {
        std::fs::write(&path, &text).unwrap();
        let began = ThreadTime::now();
        let found = report(&[&path]);
        let (took_s, bytes) = (began.elapsed().as_secs_f64(), text.len());
        println!("{name}: {bytes} bytes in {took_s:.2} s: {}", found.as_ref().map_or_else(Clone::clone, ToString::to_string));
        assert_eq!(found.is_ok(), fits, "{name}: {found:?}");
        assert!(took_s < 10.0, "{name}: {took_s:.1} s");
    }
}
