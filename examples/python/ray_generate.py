#!/usr/bin/env python3
"""Generate a dataset on a cluster, each shard as a Ray task. One worker is killed on the way; the bytes stay the same.

    ray_generate.py RECIPE COUNT FOLDER

Without Ray the script does nothing.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

import petcomp

SHARDS = 4


def main():
    try:
        import ray
    except ImportError:
        print("Ray is not installed: nothing is generated")
        return
    recipe, count, folder = str(Path(sys.argv[1]).resolve()), int(sys.argv[2]), Path(sys.argv[3]).resolve()
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)

    @ray.remote(max_retries=3)
    def make(i):
        """Generate shard i, or what is still missing from it."""
        struck = folder / f"struck-{i}"

        def strike(progress):
            # Simulate the loss of a machine, once, in the middle of the second shard.
            if i == 2 and progress.made == 1 and not struck.exists():
                struck.touch()
                os.kill(os.getpid(), signal.SIGKILL)

        return petcomp.generate(recipe, count, folder / "shards", seed=1, shard=(i, SHARDS), progress=strike).made

    folder.mkdir(parents=True, exist_ok=True)
    made = ray.get([make.remote(i) for i in range(1, SHARDS + 1)])
    ray.shutdown()
    shards = sorted((folder / "shards").iterdir())
    program = [sys.executable, "-m", "petcomp"]
    subprocess.run([*program, "dataset", "merge", *shards, "-o", folder / "dataset", "-q"], check=True)
    print(
        f"{folder / 'dataset'}: {count} images by {SHARDS} tasks, one of which was killed; the last runs made {made}"
    )


if __name__ == "__main__":
    main()
