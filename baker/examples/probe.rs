use promenade_baker::measure::*; use promenade_baker::*;
use std::sync::Arc; use std::path::Path;
fn main() {
    for (room, len) in [("a",0.3912),("b",1.0)] {
        let root = "/work/shared/data/iosr_brir";
        let r = Responses::load(Path::new(&format!("presets/recipes/iosr-room-{room}.json")), &LoadOptions{root: Some(root.into()), ..Default::default()}).unwrap();
        let t=std::time::Instant::now();
        let early: f64 = std::env::args().nth(1).map_or(0.16, |v| v.parse().unwrap());
        let scene = bake_responses(&r, |x,_| { let a = x.direction_deg().0.round() as i32; a % 10 != 0 }, &BakeOptions{ early_s: early, ..Default::default() }).unwrap();
        let scene = Arc::new(scene);
        println!("room {room}: baked in {:.1?}, {} rows x {} , {} bytes, t60 {:?}", t.elapsed(), scene.field().grid().nodes(), scene.field().shape().row_len(), scene.to_bytes().unwrap().len(), scene.tail().t60_s);
        println!("coh {:?}", scene.tail().coherence);
        let c = compare_held_out(&scene, len).unwrap();
        if std::env::args().nth(2).is_some() { for x in &c { println!("{} m itd {:.1} ild {:.2} t20 {:.3} edt {:.3} c50 {:.2} | err itd {:.1} ild {:.2} t20 {:.2}% edt {:.1}% c50 {:.2}", x.name, x.measured.itd_s*1e6, x.measured.ild_db, x.measured.t20_s, x.measured.edt_s, x.measured.c50_db, (x.rendered.itd_s-x.measured.itd_s)*1e6, x.rendered.ild_db-x.measured.ild_db, 100.*(x.rendered.t20_s/x.measured.t20_s-1.), 100.*(x.rendered.edt_s/x.measured.edt_s-1.), x.rendered.c50_db-x.measured.c50_db); } }
        let b: Vec<Comparison> = r.responses.iter().filter(|x| (x.direction_deg().0.round() as i32) % 10 == 0).map(|x| { let az = x.direction_deg().0.to_radians();
            let pose = promenade_core::Pose::from_ypr(promenade_core::glam::Vec3::ZERO, -az, 0.0, 0.0);
            let [l, rr] = render_response(&scene, pose, 320, 320 + (len*16000.0) as usize);
            if x.direction_deg().0.round() as i32 == 30 { let dump = |n: &str, a: &[f32], b: &[f32]| { let mut s = String::new(); for (p,q) in a.iter().zip(b) { s += &format!("{p} {q}\n"); } std::fs::write(format!("/tmp/{n}_{room}.txt"), s).unwrap(); }; dump("ren", &l, &rr); dump("mea", &x.left, &x.right); }
            use promenade_core::metrics::Binaural;
            Comparison { name: x.name.clone(), measured: Binaural::of_response(&x.left,&x.right,16000.0).unwrap(), rendered: Binaural::of_response(&l,&rr,16000.0).unwrap() } }).collect();
        let bias = |f: fn(&Comparison)->f64| b.iter().map(f).sum::<f64>()/b.len() as f64;
        println!("baked bias: itd {:.1} ild {:.3} t20 {:.2}% c50 {:.3}", 1e6*bias(|c| c.rendered.itd_s-c.measured.itd_s), bias(|c| c.rendered.ild_db-c.measured.ild_db), 100.0*bias(|c| c.rendered.t20_s/c.measured.t20_s-1.0), bias(|c| c.rendered.c50_db-c.measured.c50_db));
        let e = MeanErrors::of(&b).unwrap();
        println!("baked: ITD {:.1} us, ILD {:.3} dB, T20 {:.2} %, EDT {:.2} %, C50 {:.3} dB", e.itd_s*1e6, e.ild_db, e.t20*100., e.edt*100., e.c50_db);
        let e = MeanErrors::of(&c).unwrap();
        println!("n={} ITD {:.1} us, ILD {:.3} dB, T20 {:.2} %, EDT {:.2} %, C50 {:.3} dB", c.len(), e.itd_s*1e6, e.ild_db, e.t20*100., e.edt*100., e.c50_db);
    }
}
