use muslin::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    if args[1] == "mannequin" { let m = mesh::mannequin(); std::fs::write("meshes/mannequin.obj", mesh::write_obj(&m, "A mannequin")).unwrap(); println!("{} {} open {:?} {:?}", m.positions.len(), m.triangles.len(), mesh::open_edge(&m), m.bounds()); return; }
    let loaded = scene::load(&args[1], &args[2..]).unwrap_or_else(|e| panic!("{e}"));
    let built = scene::build(&loaded).unwrap_or_else(|e| panic!("{e}"));
    for n in &built.notes { println!("{n}"); }
    println!("{}", scene::model_list(&loaded.scene, &built.model));
    let s = &loaded.scene.solver;
    let integrator = match s.integrator { scene::IntegratorName::SymplecticEuler => integrator::Integrator::SymplecticEuler, _ => integrator::Integrator::ImplicitEuler { linear_tolerance: s.linear_tolerance } };
    let st = simulation::stable_step(&built.model, &built.state); println!("{st:?}");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(std::env::var("T").map_or(2, |t| t.parse().unwrap())).build().unwrap();
    pool.install(|| {
    let dt = s.dt;
    let mut sim = simulation::Simulation::new(built.model, built.state, integrator, dt);
    let n = (loaded.scene.duration / dt - 1e-9).ceil() as u64;
    let t0 = std::time::Instant::now();
    for k in 0..n { 
        let c0 = sim.stats().strain_ever;
        if let Err(e) = sim.step() { println!("{e}"); break; }
        if sim.stats().strain > 0.101 && (sim.stats().strain > c0*1.0 || k % 100 == 0) || sim.stats().depth > 1e-3 && k % 20 == 0 { for c in &sim.contacts().list { if c.distance < 0.0 { println!("k {k} particle {} at {:.3} dist {:.5} n {:.3} v {:.3}", c.particle, sim.state().positions[c.particle], c.distance, c.normal, sim.state().velocities[c.particle]); } }
          for b in sim.model().weave() { for sp in &b.springs { let st = sp.strain(&sim.state().positions); if st > 0.101 { println!("k {k} {} {:?} strain {st:.3} at {:.3} {:.3}", b.family, sp.ends, sim.state().positions[sp.ends[0] as usize], sim.state().positions[sp.ends[1] as usize]); } } } }
        if (k+1) % (n/20).max(1) == 0 { let e = energy::Energies::of(sim.model(), sim.state()); let st = sim.stats();
          let miny = sim.state().positions.iter().map(|p| p.y).fold(9.0, f64::min);
          println!("t {:.3} ke {:.5} pe {:.4} el {:.4?} strain {:.4} ever {:.4} depth {:.2e} ever {:.2e} it/step {:.1} unsolved {} passes {} contacts {} miny {:.5}", sim.state().time, e.kinetic, e.gravitational, e.elastic.iter().map(|x| x.1).sum::<f64>(), st.strain, st.strain_ever, st.depth, st.depth_ever, st.iterations as f64/st.steps as f64, st.unsolved, st.limit_passes, sim.contacts().list.len(), miny); }
    }
    let wall = t0.elapsed().as_secs_f64();
    println!("wall {wall:.3} ms/frame {:.2}", wall*1000.0/(sim.state().time*60.0));
    for (stage,name) in simulation::Stage::ALL { println!("{name} {:.3} ms/step", sim.stats().times.of(stage).as_secs_f64()*1000.0/sim.stats().steps as f64); }
    if let Ok(f) = std::env::var("OBJ") { let m = mesh::TriMesh { positions: sim.state().positions.clone(), triangles: sim.model().cloths[0].triangles.clone() }; std::fs::write(f, mesh::write_obj(&m, "")).unwrap(); }
    if let Ok(f) = std::env::var("POS") { std::fs::write(f, sim.state().positions.iter().map(|p| format!("{} {} {}\n", p.x,p.y,p.z)).collect::<String>()).unwrap(); }
    });
}
