//! Accuracy of the camera solver on simulated views, against the tables of the specification's section 15.

use petcomp::camera::simulate::{Scenario, View};
use petcomp::camera::{self, Priors, Solution, SolveOptions};

const VIEWS: u64 = 600;

fn ideal_flat() -> SolveOptions {
    SolveOptions { priors: Priors::ideal().with_free_focal(), ..Default::default() }
}

/// Sorted values of something over many views.
fn over_views(scenario: &Scenario, seed: u64, value: impl Fn(View) -> f64) -> Vec<f64> {
    let mut values: Vec<f64> = (0..VIEWS).map(|k| value(scenario.view(seed, k))).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

fn focal_error_percent(view: &View, solution: &Solution) -> f64 {
    100.0 * (solution.camera.focal_px.x / view.camera.focal_px.x - 1.0).abs()
}

#[test]
fn ideal_cameras_reach_the_table() {
    for tilt in [2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 80.0] {
        for sigma in [0.1, 0.5, 1.0, 2.0] {
            let scenario = Scenario { corner_sigma_px: sigma, ..Scenario::default() }.tilted(tilt);
            let e = over_views(&scenario, 1, |v| focal_error_percent(&v, &camera::solve(&v.label, &ideal_flat()).unwrap()));
            println!("{tilt} {sigma}: {:.3} / {:.3}", quantile(&e, 0.5), quantile(&e, 0.95));
        }
    }
}

#[test]
fn realistic_cameras_reach_the_table() {
    for tilt in [0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0] {
        for exif in [false, true] { for ideal in [true, false] {
            let options = SolveOptions { priors: if ideal { Priors::ideal() } else { Priors::default() }, ..Default::default() };
            let (mut one, mut two, mut chi) = (0.0, 0.0, 0.0);
            let mut e = vec![];
            for k in 0..VIEWS {
                let scenario = Scenario::realistic().tilted(tilt);
                let mut v = scenario.view(2, k);
                if exif { let z = scenario.view(99, k).camera.principal_px.x - 2000.0; // a normal deviate, 25 px wide
                    v.label.camera.focal_35mm = Some((0.05 * z / 25.0_f64).exp() * 3200.0 / 5000.0 * 43.266615305567871); }
                let s = camera::solve(&v.label, &options).unwrap();
                let z = (s.camera.focal_px.x / v.camera.focal_px.x).ln().abs() / s.sigma.ln_focal;
                one += f64::from(z < 1.0); two += f64::from(z < 2.0); chi += s.fit.chi2;
                e.push(focal_error_percent(&v, &s));
            }
            e.sort_by(f64::total_cmp);
            let n = VIEWS as f64;
            println!("{tilt} exif {exif} ideal {ideal}: {:.2} / {:.2}  one {:.2} two {:.2} chi2 {:.2}", quantile(&e, 0.5), quantile(&e, 0.95), one / n, two / n, chi / n);
        }}
    }
}
