use dermis_golden::{fixed::Model, frame::Frame, reconstruct::Golden, scene::Scene};
fn main() {
    for name in ["sensor-1", "sensor-2", "sensor-3", "eight-by-eight"] {
        let scene = Scene::builtin(name).unwrap();
        let t = std::time::Instant::now();
        let model = Model::new(&scene).unwrap();
        println!("{:?} {:?}", t.elapsed(), model.formats);
        let golden = Golden::new(&scene).unwrap();
        let mut d = vec![];
        for f in Frame::shipped(&scene) {
            let a = golden.run(&f).unwrap();
            let b = model.reconstruct(&f).unwrap();
            let (ea, eb) = (a.error.clone().unwrap(), b.error.clone().unwrap());
            println!(
                "{:20} gold et {:?} en {:?} mu {:?} | fixed et {:?} en {:?} mu {:?} {:?}",
                f.id, ea.tangential, ea.normal, a.subarrays[0].mu, eb.tangential, eb.normal, b.subarrays[0].mu, b.flags
            );
            d.push((ea.tangential.unwrap_or(0.), eb.tangential.unwrap_or(0.)));
        }
        let med = |mut v: Vec<f64>| {
            v.sort_by(f64::total_cmp);
            v[v.len() / 2]
        };
        println!("median {} {}", med(d.iter().map(|x| x.0).collect()), med(d.iter().map(|x| x.1).collect()));
    }
}
