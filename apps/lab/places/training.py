"""What the trainings of both networks have in common."""
import pathlib

import numpy as np
import torch


def define_options(parser, steps):
    parser.add_argument("--output", type=pathlib.Path, required=True, help="the ONNX file")
    parser.add_argument("--cache", type=pathlib.Path, required=True, help="folder of what is computed once")
    parser.add_argument("--steps", type=int, default=steps)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)


def prepare(options):
    """The random numbers of numpy; those of torch have the same seed."""
    torch.set_num_threads(options.threads)
    torch.manual_seed(options.seed)
    options.cache.mkdir(parents=True, exist_ok=True)
    return np.random.default_rng(options.seed)


def optimized(network, options, peak, loss_of_batch):
    """Trains the network and yields, after each step, its number from 1 and the running mean of the loss. The learning rate
    warms up to `peak`, then falls along a cosine."""
    optimizer = torch.optim.AdamW(network.parameters(), lr=peak, weight_decay=1e-3)
    mean = None
    for step in range(options.steps):
        for group in optimizer.param_groups:
            group["lr"] = peak * min(1, (step + 1) / 50) * 0.5 * (1 + np.cos(np.pi * step / options.steps))
        loss = loss_of_batch()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        mean = loss.item() if mean is None else 0.98 * mean + 0.02 * loss.item()
        yield step + 1, mean
