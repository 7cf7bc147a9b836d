mod oracle;
use promenade_core::cloud::*; use promenade_core::glam::*;
#[test] fn big(){
 for (n,kind) in [(65_536,CloudKind::Full),(65_536,CloudKind::SimpleSh)] {
 let m = oracle::Case{anchors:n,bands:257,width:128,heads:4,layers:3,kind,physical:false}.model();
 let t=std::time::Instant::now(); let mut d=CloudDecoder::new(&m); println!("new {:?}",t.elapsed());
 let mut k=Masks::new(&m.sizes()); let t=std::time::Instant::now();
 let l=Listener{centre:Vec3::new(0.1,0.2,0.3),camera_to_world:Mat3::IDENTITY};
 d.decode(&l,&mut k); println!("{:?} {:?}",t.elapsed(), &k.mixture[..4]);
 let mut a=vec![0.0;n]; d.decode_with_attention(&l,&mut k,&mut a); println!("sum {}", a.iter().sum::<f32>());
 println!("{}", std::fs::read_to_string("/proc/self/status").unwrap().lines().filter(|l|l.starts_with("VmRSS")||l.starts_with("VmHWM")).collect::<String>()); }
 for l in [257usize] { let m = oracle::Case{anchors:256,bands:l,width:128,heads:4,layers:3,kind:CloudKind::Full,physical:false}.model(); let t=std::time::Instant::now(); let _d=CloudDecoder::new(&m); println!("new usual {:?}",t.elapsed()); }
}
