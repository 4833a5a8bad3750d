#!/usr/bin/env python3
"""A training loop that generates its images on the fly, without a dataset on disk.

    train_loop.py RECIPE [STEPS]

The network only counts objects: the point is the loop. Without PyTorch the script does nothing.
"""

import sys


def main():
    try:
        import torch
    except ImportError:
        print("PyTorch is not installed: nothing is trained")
        return
    from petcomp.torch import Dataset, collate

    recipe, steps = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 4
    torch.manual_seed(0)
    data = Dataset(recipe, count=4 * steps, seed=1)
    loader = torch.utils.data.DataLoader(data, batch_size=4, num_workers=2, collate_fn=collate)
    net = torch.nn.Sequential(
        torch.nn.Conv2d(3, 8, 5, stride=4), torch.nn.ReLU(), torch.nn.AdaptiveAvgPool2d(4),
        torch.nn.Flatten(), torch.nn.Linear(128, 1),
    )  # fmt: skip
    optimizer = torch.optim.Adam(net.parameters(), lr=0.01)
    for step, (pictures, targets) in enumerate(loader):
        counts = torch.tensor([[float(len(target["labels"]))] for target in targets])
        loss = torch.nn.functional.mse_loss(net(torch.stack(pictures)), counts)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        print(f"step {step}: loss {loss.item():.3f}")


if __name__ == "__main__":
    main()
