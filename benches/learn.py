"""Compares training speed with PyTorch, alternating on one machine: images per second of each, and their ratio.

    cargo bench --features train --bench learn --no-run
    VENV/bin/python benches/learn.py --set DIR          # a venv with torch==2.11.0

Both train the same networks with Adam and the same batch size, precision and number of threads. The networks are defined
here, with the encoder blocks of torchvision and EfficientNet-Lite0. PyTorch gets random input that is already in memory;
Furrow also reads, augments and normalizes images.
"""
import argparse
import os
import statistics
import subprocess
import time

import torch
import torch.nn as nn
import torch.nn.functional as F


class Unit(nn.Sequential):
    def __init__(self, a, b, k, stride=1, relu=True, bias=True):
        layers = [nn.Conv2d(a, b, k, stride, k // 2, bias=bias), nn.BatchNorm2d(b)]
        super().__init__(*layers, *([nn.ReLU()] if relu else []))


class SegNet(nn.Module):
    def __init__(self, encoder, decoder, kernel, head, relu):
        super().__init__()
        make = lambda blocks, relu: nn.ModuleList(nn.Sequential(*[Unit(a, b, kernel, relu=relu) for a, b in block]) for block in blocks)
        self.encoder, self.decoder = make(encoder, True), make(decoder, relu)
        self.head = nn.Conv2d(64, 3, head, padding=head // 2)

    def forward(self, x):
        stack = []
        for block in self.encoder:
            x = block(x)
            size = x.shape[-2:]
            x, places = F.max_pool2d(x, 2, 2, return_indices=True)
            stack.append((places, size))
        for block in self.decoder:
            places, size = stack.pop()
            x = block(F.max_unpool2d(x, places, 2, 2, output_size=size))
        return self.head(x)


class Residual(nn.Module):
    def __init__(self, a, b, stride):
        super().__init__()
        self.first, self.second = Unit(a, b, 3, stride, bias=False), Unit(b, b, 3, relu=False, bias=False)
        self.past = nn.Identity() if a == b and stride == 1 else Unit(a, b, 1, stride, relu=False, bias=False)

    def forward(self, x):
        return F.relu(self.second(self.first(x)) + self.past(x))


class Light(nn.Sequential):
    """Convolution, batch norm and ReLU6 of EfficientNet-Lite. With stride 2 the padding before the first pixel is one less than after the last."""

    def __init__(self, a, b, k=1, stride=1, groups=1, relu=True):
        before, after = (k - stride) // 2, (k - stride + 1) // 2
        layers = [] if before == after else [nn.ZeroPad2d((before, after, before, after))]
        layers += [nn.Conv2d(a, b, k, stride, before if before == after else 0, groups=groups, bias=False), nn.BatchNorm2d(b, eps=1e-3)]
        super().__init__(*layers, *([nn.ReLU6()] if relu else []))


class Inverted(nn.Module):
    def __init__(self, a, b, k, stride, expansion):
        super().__init__()
        wide = a * expansion
        self.halves, self.past = stride == 2, stride == 1 and a == b
        layers = [Light(a, wide)] if expansion > 1 else []
        self.layers = nn.Sequential(*layers, Light(wide, wide, k, stride, groups=wide), Light(wide, b, relu=False))

    def forward(self, x):
        y = self.layers(x)
        return x + y if self.past else y


def decoder(inputs, widths):
    blocks = [nn.Sequential(Unit(a, b, 3, bias=False), Unit(b, b, 3, bias=False)) for a, b in zip(inputs, widths)]
    return nn.ModuleList(blocks), nn.Conv2d(widths[-1], 3, 3, padding=1)


def decode(blocks, head, y, skips, size):
    for block in blocks:
        like = skips.pop() if skips else None
        y = F.interpolate(y, size=size if like is None else like.shape[-2:])
        y = block(y if like is None else torch.cat([y, like], 1))
    return head(y)


class LiteUNet(nn.Module):
    # Stages of EfficientNet-Lite0: number of blocks, kernel size, stride, expansion, output channels.
    STAGES = [(1, 3, 1, 1, 16), (2, 3, 2, 6, 24), (2, 5, 2, 6, 40), (3, 3, 2, 6, 80), (3, 5, 1, 6, 112), (4, 5, 2, 6, 192), (1, 3, 1, 6, 320)]

    def __init__(self):
        super().__init__()
        self.stem, blocks, channels = Light(3, 32, 3, 2), [], 32
        for count, kernel, stride, expansion, outputs in self.STAGES:
            for k in range(count):
                blocks.append(Inverted(channels, outputs, kernel, stride if k == 0 else 1, expansion))
                channels = outputs
        self.blocks = nn.ModuleList(blocks)
        self.decoder, self.head = decoder([320 + 112, 128 + 40, 64 + 24, 48 + 16, 32], [128, 64, 48, 32, 16])

    def forward(self, x):
        y, skips = self.stem(x), []
        for block in self.blocks:
            if block.halves:
                skips.append(y)
            y = block(y)
        return decode(self.decoder, self.head, y, skips, x.shape[-2:])


class UNet(nn.Module):
    def __init__(self):
        super().__init__()
        self.stem = Unit(3, 64, 7, 2, bias=False)
        stages = [(64, 64, 1), (64, 128, 2), (128, 256, 2), (256, 512, 2)]
        self.stages = nn.ModuleList(nn.Sequential(Residual(a, b, s), Residual(b, b, 1)) for a, b, s in stages)
        self.decoder, self.head = decoder([512 + 256, 256 + 128, 128 + 64, 64 + 64, 32], [256, 128, 64, 32, 16])

    def forward(self, x):
        size, stem = x.shape[-2:], self.stem(x)
        skips, y = [stem], F.max_pool2d(stem, 3, 2, 1)
        for stage in self.stages:
            y = stage(y)
            skips.append(y)
        skips.pop()
        return decode(self.decoder, self.head, y, skips, size)


def network(name):
    if name == "unet":
        return UNet()
    if name == "lite-unet":
        return LiteUNet()
    if name == "basic-segnet":
        return SegNet([[(3, 64)]] + [[(64, 64)]] * 3, [[(64, 64)]] * 4, 7, 1, False)
    encoder = [[(3, 64), (64, 64)], [(64, 128), (128, 128)], [(128, 256), (256, 256), (256, 256)], [(256, 512), (512, 512), (512, 512)], [(512, 512)] * 3]
    decoder = [[(512, 512)] * 3, [(512, 512), (512, 512), (512, 256)], [(256, 256), (256, 256), (256, 128)], [(128, 128), (128, 64)], [(64, 64)]]
    return SegNet(encoder, decoder, 3, 3, True)


def theirs(name, a):
    torch.manual_seed(1)
    model = network(name).to(memory_format=torch.channels_last)
    x = torch.randn(a.batch, 3, a.height, a.width).contiguous(memory_format=torch.channels_last)
    y = torch.randint(0, 3, (a.batch, a.height, a.width))
    optimiser = torch.optim.AdamW(model.parameters(), 1e-3, weight_decay=5e-4)
    times = []
    for _ in range(a.steps):
        begun = time.perf_counter()
        with torch.autocast("cpu", torch.bfloat16, enabled=a.precision == "bf16"):
            scores = model(x)
        loss = F.cross_entropy(scores.float(), y)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        loss.item()
        times.append(time.perf_counter() - begun)
    return a.batch / statistics.median(times)


def ours(name, a):
    words = ["cargo", "bench", "-q", "--features", "train", "--bench", "learn", "--", "--set", a.set, "--network", name, "--precision", a.precision]
    words += ["--width", str(a.width), "--height", str(a.height), "--batch", str(a.batch), "--steps", str(a.steps)]
    out = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    return float(out.strip().splitlines()[-1].split("|")[4])


if __name__ == "__main__":
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--set", required=True)
    p.add_argument("--networks", default="basic-segnet,segnet,unet,lite-unet")
    p.add_argument("--width", type=int, default=480)
    p.add_argument("--height", type=int, default=360)
    p.add_argument("--batch", type=int, default=4)
    p.add_argument("--steps", type=int, default=9)
    p.add_argument("--rounds", type=int, default=3)
    p.add_argument("--precision", default="bf16", choices=["bf16", "f32"])
    a = p.parse_args()
    torch.set_num_threads(os.cpu_count())
    print("| network | Furrow, images a second | PyTorch | ratio |\n|---|---|---|---|")
    for name in a.networks.split(","):
        pairs = [(ours(name, a), theirs(name, a)) for _ in range(a.rounds)]
        mine, torchs = (statistics.median(v) for v in zip(*pairs))
        ratio = statistics.median(m / t for m, t in pairs)
        print(f"| {name} | {mine:.2f} | {torchs:.2f} | {ratio:.2f} |", flush=True)
