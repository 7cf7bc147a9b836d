//! Echoes of a real room: image sources against what was measured in a cuboid room of known size (dEchorate; Di Carlo et al.,
//! EURASIP J. Audio Speech Music Process. 2021). Its files are MIT.

/// Files that the repository does not hold.
mod needs_shared {
    use glam::DVec3;
    use promenade_acoustics::{Air, ImageOptions, Images, Material, Reflected, Room, Shoebox};
    use std::collections::HashMap;
    use std::path::PathBuf;

    /// As its authors state it, metres.
    const SIZE: [f64; 3] = [5.705, 5.965, 2.355];
    /// Columns of the measured times by wall: x = 0, x = X, y = 0, y = Y, floor, ceiling. The names of the walls in this file
    /// are those of other walls: each column fits one wall within centimetres and all others only within a metre.
    const COLUMNS: [&str; 6] = ["ceiling", "floor", "west", "south", "east", "north"];

    /// Rows of a table by the names of its columns.
    fn table(name: &str) -> Vec<HashMap<String, String>> {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/dechorate"));
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let row = |line: &str| names.iter().zip(line.split(',')).map(|(n, v)| ((*n).to_owned(), v.to_owned())).collect();
        text.lines().skip(1).map(row).collect()
    }

    fn number(row: &HashMap<String, String>, column: &str) -> Option<f64> {
        row[column].parse().ok()
    }

    fn place(row: &HashMap<String, String>, of: &str) -> Option<DVec3> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| number(row, &format!("{of}_pos_{axis}")));
        Some(DVec3::new(x?, y?, z?))
    }

    fn median(mut values: Vec<f64>) -> f64 {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    }

    /// Of each pair of microphone and loudspeaker, the microphone's number and how much longer than computed the measured ways
    /// to the six images are, and the direct one, metres; the room is moved by `shift` from where it is stated to be.
    fn differences(shift: DVec3) -> Vec<(usize, [f64; 6], f64)> {
        let database = table("dEchorate_database.csv");
        let by_number = |id: &str, of: &str, kind: &str| -> HashMap<usize, DVec3> {
            let rows = database.iter().filter(|row| row["src_type"] == kind);
            rows.filter_map(|row| Some((number(row, id)? as usize, place(row, of)? - shift))).collect()
        };
        let (microphones, sources) = (by_number("mic_id", "mic", "directional"), by_number("src_id", "src", "directional"));
        assert_eq!((microphones.len(), sources.len()), (30, 4));
        let walls = Shoebox { size: SIZE, materials: std::array::from_fn(|_| Material::even("wall", 0.1, 0.0)) };
        let mesh = walls.mesh().unwrap();
        let room = Room::new(&mesh, &vec![Material::even("wall", 0.1, 0.0); 6]).unwrap();
        let options = ImageOptions { order: 1, ..ImageOptions::default() };
        let images: HashMap<usize, Images> =
            sources.iter().map(|(id, at)| (*id, Images::new(&room, at.to_array(), &options).unwrap())).collect();
        // 24 degrees Celsius, as the recordings say; sound is as fast as the root of the absolute temperature.
        let speed = promenade_acoustics::SPEED_OF_SOUND_M_S * (297.15_f64 / (273.15 + Air::default().temperature_c)).sqrt();
        let of_pair = |row: &HashMap<String, String>| {
            // Numbers are from 0 here and from 1 there.
            let [microphone, source] = ["mic", "src"].map(|column| number(row, column).unwrap() as usize + 1);
            let at = microphones[&microphone];
            let seen = images[&source].seen_from(&room, at.to_array(), Reflected::Whole).unwrap();
            assert_eq!(seen.len(), 7);
            let (mut echoes, mut direct) = ([f64::NAN; 6], f64::NAN);
            for image in seen {
                let way = DVec3::from_array(image.position).distance(at);
                let longer = |column: &str| number(row, column).unwrap() * speed - way;
                match image.faces.first() {
                    Some(face) => {
                        let wall = mesh.triangles[*face as usize].group as usize;
                        echoes[wall] = longer(COLUMNS[wall]);
                    }
                    None => direct = longer("direct"),
                }
            }
            (microphone, echoes, direct)
        };
        table("echo_pickpeaking.csv").iter().map(of_pair).collect()
    }

    #[test]
    #[ignore = "reads ../shared/data"]
    fn first_echoes_arrive_when_they_were_measured() {
        let as_stated = differences(DVec3::ZERO);
        assert_eq!(as_stated.len(), 120);
        let all = |rows: &[(usize, [f64; 6], f64)]| median(rows.iter().flat_map(|r| r.1.map(f64::abs)).collect());
        let stated = all(&as_stated);
        let direct = median(as_stated.iter().map(|r| r.2.abs()).collect());
        for (wall, column) in COLUMNS.iter().enumerate() {
            let signed = median(as_stated.iter().map(|r| r.1[wall]).collect());
            let absolute = median(as_stated.iter().map(|r| r.1[wall].abs()).collect());
            println!("{column}: median {:.1} cm, of the absolute difference {:.1} cm", 100.0 * signed, 100.0 * absolute);
        }
        println!("as stated: direct {:.2} cm, echoes {:.2} cm", 100.0 * direct, 100.0 * stated);
        assert!(direct < 0.02, "{direct} m");
        assert!(stated < 0.065, "{stated} m");

        // Where positions are counted from is known less well than they are to each other: a room that lies elsewhere makes the
        // ways by way of opposite walls longer and shorter. Found from every other microphone, judged on the rest.
        let (found_from, judged): (Vec<_>, Vec<_>) = as_stated.into_iter().partition(|r| r.0 % 2 == 0);
        let of_wall = |wall: usize| median(found_from.iter().map(|r| r.1[wall]).collect());
        let shift = DVec3::from_array(std::array::from_fn(|axis| 0.25 * (of_wall(2 * axis + 1) - of_wall(2 * axis))));
        let shifted: Vec<_> = differences(shift).into_iter().filter(|r| r.0 % 2 == 1).collect();
        println!("room at {shift} m: {:.2} cm, before {:.2} cm", 100.0 * all(&shifted), 100.0 * all(&judged));
        assert!(shift.length() < 0.06 && all(&shifted) < 0.05, "{shift}: {} m", all(&shifted));
    }
}
