//! The Python part of the training kit, run by Python where PyTorch is there.

#![cfg(feature = "pipeline")]

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output};

/// Python to try: `PETCOMP_PYTHON`, else the system's.
fn python(script: &str) -> Option<Output> {
    let kit = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/train/kit");
    let program = std::env::var("PETCOMP_PYTHON").unwrap_or_else(|_| "python3".into());
    let run = |text: &str| {
        Command::new(&program)
            .arg("-c")
            .arg(text)
            .env("PYTHONPATH", &kit)
            .output()
    };
    let there = run("import torch").is_ok_and(|out| out.status.success());
    if !there {
        let _ = writeln!(
            std::io::stderr(),
            "skipped: {program} has no PyTorch (set PETCOMP_PYTHON to one that has)"
        );
        return None;
    }
    run(script).ok()
}

#[test]
fn the_python_part_follows_equation_2() {
    let script = "
import torch, balanced
real, synthetic = balanced.weights(1624, 4000)
assert abs(real - 0.8658) < 5e-5 and abs(synthetic - 0.3515) < 5e-5, (real, synthetic)
assert balanced.weights(1624, 4000, 1624 / 5624, True) == (1.0, 1.0)
sampler = balanced.SingleSource(50, 70, 8, seed=3)
first, second = list(sampler), list(sampler)
assert first != second and len(first) == len(sampler) == 7 + 9
assert sorted(i for batch in first for i in batch) == list(range(120))
assert all(len({i < 50 for i in batch}) == 1 for batch in first)
assert list(balanced.SingleSource(50, 70, 8, seed=3)) == first
data = torch.utils.data.TensorDataset(torch.arange(120.0))
loader = torch.utils.data.DataLoader(data, batch_sampler=balanced.SingleSource(50, 70, 8))
scale = torch.ones(1, requires_grad=True)
for (batch,) in loader:
    factor = balanced.weights(50, 70)[balanced.REAL if batch[0] < 50 else balanced.SYNTHETIC]
    scale.grad = None
    (factor * (scale * batch).mean()).backward()
    assert torch.allclose(scale.grad, factor * batch.mean())
";
    assert_runs(script);
}

#[test]
fn each_batch_has_its_share_of_real_images() {
    let script = "
import balanced
sampler = balanced.Shares(5, 70, 8, 0.25, seed=3)
first, second = list(sampler), list(sampler)
assert first != second and len(first) == len(sampler) == 12
assert all(sum(i < 5 for i in batch) == 2 for batch in first)
assert sorted(i for batch in first for i in batch if i >= 5) == list(range(5, 75))
real = [i for batch in first + second for i in batch if i < 5]
assert all(sorted(real[k : k + 5]) == list(range(5)) for k in range(0, 45, 5))
assert list(balanced.Shares(5, 70, 8, 0.25, seed=3)) == first
asked = balanced.Shares(5, 70, 8, 0.25, seed=3, epoch=lambda: 1)
assert list(asked) == list(asked) == second
for share in (0, 0.01, 0.99):
    try:
        balanced.Shares(5, 70, 8, share)
    except ValueError as error:
        assert 'expected some of both' in str(error)
    else:
        raise AssertionError(share)
";
    assert_runs(script);
}

fn assert_runs(script: &str) {
    let Some(out) = python(script) else { return };
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
}
