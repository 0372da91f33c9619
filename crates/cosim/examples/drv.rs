use hpu_cosim::scene::Scene;
use hpu_cosim::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&a[1]).unwrap();
    let dir = std::path::Path::new(&a[1]).parent().unwrap().to_path_buf();
    let ov: Vec<(String, String)> = a[3..]
        .iter()
        .map(|s| {
            let (k, v) = s.split_once('=').unwrap();
            (k.into(), v.into())
        })
        .collect();
    let scene = Scene::parse(&a[1], &text, &ov, &mut |f| std::fs::read(dir.join(f))).unwrap_or_else(|e| panic!("{e}"));
    let s = Session::new(&scene).unwrap_or_else(|e| panic!("{e}"));
    if a[2] == "compare" {
        let n: u64 = std::env::var("EDGES").unwrap().parse().unwrap();
        let t = std::time::Instant::now();
        let c = s.compare(n);
        println!("{c:?} {:?}", t.elapsed());
        return;
    }
    let d = if a[2] == "clock" { Driver::Clock } else { Driver::Events };
    let mut trace = s.trace(&["command", "position"]);
    let sum = s.run(d, &mut trace, &mut (), &Control::default());
    println!(
        "{:?} edges {} ticks {} enc {} gates {} modes {} wall {:.3} ms  {:.3e} edges/s",
        sum.verdict,
        sum.edges,
        sum.ticks,
        sum.encoder_edges,
        sum.gate_changes,
        sum.mode_changes,
        sum.wall_s * 1e3,
        sum.edges as f64 / sum.wall_s
    );
    println!("{:?} rel {:e}", sum.energy, sum.energy.residual_j / sum.energy.exchanged_j);
    for n in &sum.nets {
        println!("{:12} {} {:?}", n.signal.name, n.signal.format, n.usage);
    }
    let st = (trace.times_s().len() / 40).max(1);
    for i in (0..trace.times_s().len()).step_by(st) {
        println!(
            "{:.4} th {:.5} w {:.3} i {:.4} cmd {}",
            trace.times_s()[i],
            trace.angles_rad()[i],
            trace.real(1)[i],
            trace.real(0)[i],
            trace.words(0)[i]
        );
    }
}
