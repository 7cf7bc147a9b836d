//! The protocol of RWAVS-Gen (pi-AVAS, section 4.1) on made rooms: `cargo bench -p promenade-trainer --bench rwavs_gen -- OUT
//! --head FILE.sofa`. Without arguments it says what they are.
//!
//! In each room a walk is recorded with four emitters. One of them is learnt from, and the others are judged, on recordings
//! without noise. What is known of a room is a scan with noise, and no material. Each of the runs leaves a file; a run that was
//! stopped goes on from its checkpoint. Machines that share a folder take a share each (`--part`).

mod baselines;
mod house;
mod methods;
mod options;
mod place;
mod runs;

use options::Options;
use place::{Place, Tool};
use promenade_baker::BakeError;
use runs::{Run, share, table};
use std::process::ExitCode;

fn main() -> ExitCode {
    match benchmark() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}", promenade_fault::with_causes(&error));
            ExitCode::FAILURE
        }
    }
}

fn benchmark() -> Result<(), BakeError> {
    let options = Options::of(std::env::args().skip(1))?;
    options.claim()?;
    let runs = Run::all(&options.rooms, options.splits, options.seeds as u64, &options.methods);
    if !options.only_table {
        let tool = Tool::of(&options)?;
        let [part, of] = options.part;
        for room in &options.rooms {
            let expected = || BakeError::argument("room", "a made one", room);
            let place = Place::of(house::Room::named(room).ok_or_else(expected)?, &options, &tool)?;
            for run in share(&runs, part, of).filter(|run| run.room == *room) {
                run.once(&options.out, || methods::run(run, &place, &options, &tool))?;
                eprintln!("{}", run.name());
            }
        }
    }
    let [figures, times] = table(&runs, &options.out)?;
    println!("{figures}\n{times}");
    Ok(())
}
