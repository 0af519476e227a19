"""Independent implementation of the networks, written from their papers: parameter counts and outputs must agree with `crates/train/src`.

    reference.py [--engine numpy|torch] [--encoder FILE] FOLDER...
    reference.py --write-vit FILE

Each folder holds `model.json` and `weights.safetensors`, written by `train fit`, and `io.safetensors`: `images` (images x bands x
height x width, normalised) and `scores`, the program's output for them. Two engines:

numpy   convolutions as sums over shifted images, everything in double precision.
torch   `torch.nn` modules named as in the papers' public implementations (SegNet's encoder as torchvision's `vgg16_bn`, the
        U-Net's as torchvision's `resnet18`, its decoder as segmentation_models_pytorch's `UnetDecoder`), in double precision; the
        encoder of `lite-unet` is that of PyPI's `efficientnet-lite-pytorch` and that of `vit-unet` timm's
        `vit_small_patch14_dinov2`, independent packages.

With `--encoder`, the transformer weights of `vit-unet` are read from a file under timm's names, from which `train` started; the
program's own weights are ignored. `--write-vit` writes such a file with random values.

Max unpooling is discontinuous: if the two largest of four values are nearly equal, rounding decides the position. Images with such
maxima (a gap below GAP of the layer's deviation, in double precision) are not compared and are counted separately; at least two
images must be decided.
"""

import json
import sys
from functools import partial

import numpy as np
from safetensors.numpy import load_file

TOLERANCE = 1e-4  # of the largest value, which is at least 1
GAP = 3e-6


# --- numpy -------------------------------------------------------------------------------------------------------------------


class Arrays:
    """The operations in numpy; `used` counts the parameters that were read, `doubt` marks the images with nearly equal maxima."""

    def __init__(self, weights):
        self.weights, self.used, self.doubt = weights, {}, None

    def get(self, name):
        self.used[name] = self.weights[name].size
        return self.weights[name].astype(np.float64)

    def conv(self, x, name, stride=1, bias=True, pad=None):
        w = self.get(name + ".weight")
        k = w.shape[2]
        pad = pad or (k // 2, k // 2)
        x = np.pad(x, [(0, 0), (0, 0), pad, pad])
        h, v = (x.shape[2] - k) // stride + 1, (x.shape[3] - k) // stride + 1
        y = np.zeros((x.shape[0], w.shape[0], h, v))
        for i in range(k):
            for j in range(k):
                part = x[:, :, i : i + stride * h : stride, j : j + stride * v : stride]
                if w.shape[1] == 1 and x.shape[1] > 1:
                    y += w[:, 0, i, j, None, None] * part
                else:
                    y += np.einsum("oc,nchw->nohw", w[:, :, i, j], part, optimize=True)
        return y + self.get(name + ".bias")[:, None, None] if bias else y

    def norm(self, x, name, epsilon=1e-5):
        gain, shift, mean, variance = (
            self.get(f"{name}.{part}")[:, None, None] for part in ("weight", "bias", "running_mean", "running_var")
        )
        return gain * (x - mean) / np.sqrt(variance + epsilon) + shift

    def unit(self, x, name, relu=True, **conv):
        y = self.norm(self.conv(x, name + ".conv", **conv), name + ".bn")
        return np.maximum(y, 0) if relu else y

    def pool(self, x):
        n, c, h, w = x.shape
        windows = x[:, :, : h // 2 * 2, : w // 2 * 2].reshape(n, c, h // 2, 2, w // 2, 2)
        windows = windows.transpose(0, 1, 2, 4, 3, 5).reshape(n, c, h // 2, w // 2, 4)
        ordered = np.sort(windows, axis=-1)
        gap = ordered[..., 3] - ordered[..., 2]
        # Only positive values count: zeros of a ReLU are equal wherever they are.
        close = ((gap < GAP * x.std()) & (ordered[..., 3] > 0)).any(axis=(1, 2, 3))
        self.doubt = close if self.doubt is None else self.doubt | close
        return ordered[..., 3], (windows.argmax(axis=-1), h, w)

    def unpool(self, x, places):
        at, h, w = places
        n, c, a, b = x.shape
        out = np.zeros((n, c, h, w))
        i, j = np.arange(a)[:, None] * 2 + at // 2, np.arange(b)[None, :] * 2 + at % 2
        out[np.arange(n)[:, None, None, None], np.arange(c)[None, :, None, None], i, j] = x
        return out

    def pool3(self, x):
        n, c, h, w = x.shape
        x = np.pad(x, [(0, 0), (0, 0), (1, 1), (1, 1)], constant_values=-np.inf)
        a, b = (h - 1) // 2 + 1, (w - 1) // 2 + 1
        shifted = [x[:, :, i : i + 2 * a - 1 : 2, j : j + 2 * b - 1 : 2] for i in range(3) for j in range(3)]
        return np.max(shifted, axis=0)

    def nearest(self, x, h, w):
        rows, columns = np.arange(h) * x.shape[2] // h, np.arange(w) * x.shape[3] // w
        return x[:, :, rows][:, :, :, columns]


    def layer_norm(self, x, name, epsilon=1e-6):
        centred = x - x.mean(axis=-1, keepdims=True)
        y = centred / np.sqrt((centred**2).mean(axis=-1, keepdims=True) + epsilon)
        return y * self.get(name + ".weight") + self.get(name + ".bias")

    def linear(self, x, name):
        return x @ self.get(name + ".weight")[:, :, 0, 0].T + self.get(name + ".bias")


def kernel_linear(t):
    return np.maximum(0, 1 - np.abs(t))


def kernel_cubic(t, a=-0.75):
    t = np.abs(t)
    near = (a + 2) * t**3 - (a + 3) * t**2 + 1
    return np.where(t <= 1, near, np.where(t < 2, a * t**3 - 5 * a * t**2 + 8 * a * t - 4 * a, 0))


def resized(x, height, width, kernel):
    """Resizes with sample points at pixel centres, edge values beyond the border, and no averaging when shrinking."""
    for axis, to in ((2, height), (3, width)):
        size = x.shape[axis]
        at = (np.arange(to) + 0.5) * size / to - 0.5
        matrix = np.zeros((to, size))
        for k in range(-3, 4):
            source = np.floor(at).astype(int) + k
            np.add.at(matrix, (np.arange(to), np.clip(source, 0, size - 1)), kernel(at - source))
        x = np.moveaxis(np.tensordot(matrix, x, (1, axis)), 0, axis)
    return x


def numpy_segnet(o, x):
    stack = []
    for block, convolutions in enumerate([2, 2, 3, 3, 3]):
        for i in range(convolutions):
            x = o.unit(x, f"enc{block}_{i}")
        x, places = o.pool(x)
        stack.append(places)
    for block, convolutions in enumerate([3, 3, 3, 2, 1]):
        x = o.unpool(x, stack.pop())
        for i in range(convolutions):
            x = o.unit(x, f"dec{block}_{i}")
    return o.conv(x, "head.conv")


def numpy_basic_segnet(o, x):
    stack = []
    for block in range(4):
        x, places = o.pool(o.unit(x, f"enc{block}_0"))
        stack.append(places)
    for block in range(4):
        x = o.unit(o.unpool(x, stack.pop()), f"dec{block}_0", relu=False)
    return o.conv(x, "head.conv")


def numpy_decoder(o, x, skips, size, levels=5):
    for level in range(levels):
        skip = skips.pop() if skips else None
        x = o.nearest(x, *(size if skip is None else skip.shape[2:]))
        if skip is not None:
            x = np.concatenate([x, skip], axis=1)
        for i in range(2):
            x = o.unit(x, f"dec{level}_{i}", bias=False)
    return o.conv(x, "head.conv")


def numpy_tiny_unet(o, x):
    size, skips = x.shape[2:], []
    for level in range(2):
        x = o.unit(x, f"enc{level}", bias=False)
        skips.append(x)
        x, _ = o.pool(x)
    return numpy_decoder(o, x, skips, size, levels=2)


def numpy_unet(o, x):
    size = x.shape[2:]
    x = o.unit(x, "stem", stride=2, bias=False)
    skips = [x]
    x = o.pool3(x)
    for stage in range(4):
        for block in range(2):
            name, stride = f"enc{stage}_{block}", 2 if stage > 0 and block == 0 else 1
            y = o.unit(x, name + ".0", stride=stride, bias=False)
            y = o.unit(y, name + ".1", relu=False, bias=False)
            past = o.unit(x, name + ".past", relu=False, stride=stride, bias=False) if stride == 2 else x
            x = np.maximum(y + past, 0)
        skips.append(x)
    skips.pop()
    return numpy_decoder(o, x, skips, size)


# EfficientNet-B0, table 1, with the changes of Lite: blocks, kernel, stride, expansion.
LITE = [(1, 3, 1, 1), (2, 3, 2, 6), (2, 5, 2, 6), (3, 3, 2, 6), (3, 5, 1, 6), (4, 5, 2, 6), (1, 3, 1, 6)]


def numpy_lite_unet(o, x):
    size = x.shape[2:]

    def unit(x, name, relu=True, stride=1, kernel=1):
        before = (kernel - stride) // 2
        y = o.conv(x, name + ".conv", stride=stride, bias=False, pad=(before, kernel - stride - before))
        y = o.norm(y, name + ".bn", epsilon=1e-3)
        return np.clip(y, 0, 6) if relu else y

    x = unit(x, "stem", stride=2, kernel=3)
    skips = []
    for stage, (blocks, kernel, stride, expansion) in enumerate(LITE):
        for block in range(blocks):
            name, step = f"enc{stage}_{block}", stride if block == 0 else 1
            if step == 2:
                skips.append(x)
            y = x if expansion == 1 else unit(x, name + ".expand")
            y = unit(y, name + ".depthwise", stride=step, kernel=kernel)
            y = unit(y, name + ".project", relu=False)
            x = x + y if block > 0 else y
    return numpy_decoder(o, x, skips, size)


def numpy_vit_unet(o, x):
    import math

    n, _, *size = x.shape
    h, w = (-(-side // 14) for side in size)
    patches = resized(x, 14 * h, 14 * w, kernel_linear).reshape(n, -1, h, 14, w, 14)
    patches = np.einsum("ncyixj,ocij->nyxo", patches, o.get("stem.weight"), optimize=True) + o.get("stem.bias")
    patches = patches + resized(o.get("enc.position"), h, w, kernel_cubic).transpose(0, 2, 3, 1)
    tokens = patches.reshape(n, h * w, 384)
    tokens = np.concatenate([np.broadcast_to(o.get("enc.class")[:, :, 0, 0], (n, 1, 384)), tokens], axis=1)
    gelu = np.vectorize(lambda t: t * (1 + math.erf(t / math.sqrt(2))) / 2)
    seen = []
    for block in range(12):
        name = f"enc{block}"
        qkv = o.linear(o.layer_norm(tokens, name + ".norm1"), name + ".qkv")
        q, k, v = qkv.reshape(n, -1, 3, 6, 64).transpose(2, 0, 3, 1, 4)
        products = q @ k.transpose(0, 1, 3, 2) / 8
        shares = np.exp(products - products.max(axis=-1, keepdims=True))
        shares /= shares.sum(axis=-1, keepdims=True)
        y = o.linear((shares @ v).transpose(0, 2, 1, 3).reshape(tokens.shape), name + ".proj")
        tokens = tokens + y * o.get(name + ".scale1.gamma")
        y = gelu(o.linear(o.layer_norm(tokens, name + ".norm2"), name + ".fc1"))
        tokens = tokens + o.linear(y, name + ".fc2") * o.get(name + ".scale2.gamma")
        if block in (5, 11):
            y = o.layer_norm(tokens, name + ".norm")[:, 1:]
            seen.append(y.reshape(n, h, w, 384).transpose(0, 3, 1, 2))
    fine = [x]
    for level in range(3):
        fine.append(o.unit(fine[-1], f"fine{level}", stride=2, bias=False))
    x = np.concatenate(seen, axis=1)
    for level in range(4):
        skip = fine.pop()
        x = o.nearest(x, *skip.shape[2:])
        if level < 3:
            x = np.concatenate([x, skip], axis=1)
        for i in range(2):
            x = o.unit(x, f"dec{level}_{i}", bias=False)
    return o.conv(x, "head.conv")


def run_numpy(network, weights, images, classes):
    o = Arrays(weights)
    walk = {"segnet": numpy_segnet, "basic-segnet": numpy_basic_segnet, "unet": numpy_unet, "tiny-unet": numpy_tiny_unet}
    walk = (walk | {"lite-unet": numpy_lite_unet, "vit-unet": numpy_vit_unet})[network]
    scores = walk(o, images.astype(np.float64))
    learnt = sum(size for name, size in o.used.items() if "running" not in name)
    return scores, learnt, o.doubt, set(o.used)


# --- torch -------------------------------------------------------------------------------------------------------------------


def torch_networks():
    import torch
    from torch import nn
    from torch.nn import functional as F

    class Base(nn.Module):
        doubt, twice = None, 0

        def pool(self, x):
            n, c, h, w = x.shape
            top = F.unfold(x[:, :, : h // 2 * 2, : w // 2 * 2].reshape(n * c, 1, h // 2 * 2, w // 2 * 2), 2, stride=2)
            top = top.topk(2, dim=1).values
            close = ((top[:, 0] - top[:, 1] < GAP * x.std()) & (top[:, 0] > 0)).any(dim=1).view(n, c).any(dim=1)
            self.doubt = close if self.doubt is None else self.doubt | close
            return F.max_pool2d(x, 2, 2, return_indices=True)

    class SegNet(Base):
        def __init__(self, bands, classes):
            super().__init__()
            # torchvision.models.vgg: cfgs["D"].
            cfg = [[64, 64], [128, 128], [256, 256, 256], [512, 512, 512], [512, 512, 512]]
            self.down, inputs = nn.ModuleList(), bands
            for block in cfg:
                layers = []
                for outputs in block:
                    layers += [nn.Conv2d(inputs, outputs, 3, padding=1), nn.BatchNorm2d(outputs), nn.ReLU()]
                    inputs = outputs
                self.down.append(nn.Sequential(*layers))
            # The decoder mirrors the encoder: each block ends with the width of the previous encoder block.
            self.up = nn.ModuleList()
            for i, block in reversed(list(enumerate(cfg))):
                last = cfg[i - 1][-1] if i else classes
                layers = []
                for outputs in block[1:] + [last]:
                    layers += [nn.Conv2d(inputs, outputs, 3, padding=1), nn.BatchNorm2d(outputs), nn.ReLU()]
                    inputs = outputs
                self.up.append(nn.Sequential(*(layers if i else layers[:-2])))

        def forward(self, x):
            stack = []
            for block in self.down:
                x = block(x)
                size = x.shape[2:]
                x, places = self.pool(x)
                stack.append((places, size))
            for block in self.up:
                places, size = stack.pop()
                x = block(F.max_unpool2d(x, places, 2, 2, output_size=size))
            return x

        def names(self):
            """Our names of the modules with parameters, in order."""
            convolutions = [f"enc{b}_{i}" for b, n in enumerate([2, 2, 3, 3, 3]) for i in range(n)]
            convolutions += [f"dec{b}_{i}" for b, n in enumerate([3, 3, 3, 2, 1]) for i in range(n)]
            return [f"{c}.{part}" for c in convolutions for part in ("conv", "bn")] + ["head.conv"]

    class BasicSegNet(Base):
        def __init__(self, bands, classes):
            super().__init__()
            def layer(inputs, relu):
                layers = [nn.Conv2d(inputs, 64, 7, padding=3), nn.BatchNorm2d(64)]
                return nn.Sequential(*layers, *([nn.ReLU()] if relu else []))

            self.down = nn.ModuleList([layer(bands if i == 0 else 64, True) for i in range(4)])
            self.up = nn.ModuleList([layer(64, False) for _ in range(4)])
            self.classifier = nn.Conv2d(64, classes, 1)

        def forward(self, x):
            stack = []
            for block in self.down:
                x = block(x)
                size = x.shape[2:]
                x, places = self.pool(x)
                stack.append((places, size))
            for block in self.up:
                places, size = stack.pop()
                x = block(F.max_unpool2d(x, places, 2, 2, output_size=size))
            return self.classifier(x)

        def names(self):
            blocks = [f"enc{i}_0" for i in range(4)] + [f"dec{i}_0" for i in range(4)]
            return [f"{b}.{part}" for b in blocks for part in ("conv", "bn")] + ["head.conv"]

    class BasicBlock(nn.Module):
        """torchvision.models.resnet.BasicBlock."""

        def __init__(self, inplanes, planes, stride):
            super().__init__()
            self.conv1 = nn.Conv2d(inplanes, planes, 3, stride, 1, bias=False)
            self.bn1 = nn.BatchNorm2d(planes)
            self.conv2 = nn.Conv2d(planes, planes, 3, 1, 1, bias=False)
            self.bn2 = nn.BatchNorm2d(planes)
            self.downsample = None
            if stride != 1 or inplanes != planes:
                self.downsample = nn.Sequential(
                    nn.Conv2d(inplanes, planes, 1, stride, bias=False), nn.BatchNorm2d(planes)
                )

        def forward(self, x):
            out = F.relu(self.bn1(self.conv1(x)))
            out = self.bn2(self.conv2(out))
            return F.relu(out + (x if self.downsample is None else self.downsample(x)))

    class DecoderBlock(nn.Module):
        """segmentation_models_pytorch.decoders.unet: UnetDecoderBlock without attention, at any size."""

        def __init__(self, inputs, skip, outputs):
            super().__init__()
            def unit(n):
                return nn.Sequential(nn.Conv2d(n, outputs, 3, padding=1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU())

            self.conv1, self.conv2 = unit(inputs + skip), unit(outputs)

        def forward(self, x, skip, size):
            x = F.interpolate(x, size=size, mode="nearest")
            return self.conv2(self.conv1(x if skip is None else torch.cat([x, skip], dim=1)))

    class UNet(Base):
        def __init__(self, bands, classes):
            super().__init__()
            self.conv1, self.bn1 = nn.Conv2d(bands, 64, 7, 2, 3, bias=False), nn.BatchNorm2d(64)
            widths = [64, 64, 128, 256, 512]
            self.stages = nn.ModuleList(
                nn.Sequential(BasicBlock(widths[i], widths[i + 1], 2 if i else 1), BasicBlock(widths[i + 1], widths[i + 1], 1))
                for i in range(4)
            )
            decoder, skips, inputs = [256, 128, 64, 32, 16], [256, 128, 64, 64, 0], [512, 256, 128, 64, 32]
            self.decoder = nn.ModuleList(DecoderBlock(*sizes) for sizes in zip(inputs, skips, decoder))
            self.segmentation_head = nn.Conv2d(16, classes, 3, padding=1)

        def forward(self, x):
            size = x.shape[2:]
            x = F.relu(self.bn1(self.conv1(x)))
            features = [x]
            x = F.max_pool2d(x, 3, 2, 1)
            for stage in self.stages:
                x = stage(x)
                features.append(x)
            features = features[:-1][::-1] + [None]
            for block, skip in zip(self.decoder, features):
                x = block(x, skip, size if skip is None else skip.shape[2:])
            return self.segmentation_head(x)

        def names(self):
            names = ["stem.conv", "stem.bn"]
            for s in range(4):
                for b in range(2):
                    parts = ["0", "1"] + (["past"] if s > 0 and b == 0 else [])
                    names += [f"enc{s}_{b}.{part}.{what}" for part in parts for what in ("conv", "bn")]
            names += [f"dec{d}_{i}.{what}" for d in range(5) for i in range(2) for what in ("conv", "bn")]
            return names + ["head.conv"]

    class TinyUNet(Base):
        def __init__(self, bands, classes):
            super().__init__()
            def unit(inputs, outputs):
                return nn.Sequential(nn.Conv2d(inputs, outputs, 3, padding=1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU())

            self.encoder = nn.ModuleList([unit(bands, 8), unit(8, 16)])
            self.decoder = nn.ModuleList([DecoderBlock(16, 16, 16), DecoderBlock(16, 8, 8)])
            self.segmentation_head = nn.Conv2d(8, classes, 3, padding=1)

        def forward(self, x):
            skips = []
            for stage in self.encoder:
                x = stage(x)
                skips.append(x)
                x = F.max_pool2d(x, 2)
            for block in self.decoder:
                skip = skips.pop()
                x = block(x, skip, skip.shape[2:])
            return self.segmentation_head(x)

        def names(self):
            names = [f"enc{level}.{what}" for level in range(2) for what in ("conv", "bn")]
            names += [f"dec{level}_{i}.{what}" for level in range(2) for i in range(2) for what in ("conv", "bn")]
            return names + ["head.conv"]

    class LiteUNet(Base):
        """The encoder is that of the package that publishes its initial weights."""

        def __init__(self, bands, classes):
            super().__init__()
            from efficientnet_lite_pytorch import EfficientNet

            self.encoder = EfficientNet.from_name("efficientnet-lite0", in_channels=bands)
            del self.encoder._conv_head, self.encoder._bn1, self.encoder._fc
            decoder, skips, inputs = [128, 64, 48, 32, 16], [112, 40, 24, 16, 0], [320, 128, 64, 48, 32]
            self.decoder = nn.ModuleList(DecoderBlock(*sizes) for sizes in zip(inputs, skips, decoder))
            self.segmentation_head = nn.Conv2d(16, classes, 3, padding=1)

        def forward(self, x):
            size = x.shape[2:]
            x = self.encoder._swish(self.encoder._bn0(self.encoder._conv_stem(x)))
            features = []
            for block in self.encoder._blocks:
                if block._depthwise_conv.stride[0] == 2:
                    features.append(x)
                x = block(x)
            features = features[::-1] + [None]
            for block, skip in zip(self.decoder, features):
                x = block(x, skip, size if skip is None else skip.shape[2:])
            return self.segmentation_head(x)

        def names(self):
            names = ["stem.conv", "stem.bn"]
            for s, (blocks, _, _, expansion) in enumerate(LITE):
                for b in range(blocks):
                    parts = (["expand"] if expansion > 1 else []) + ["depthwise", "project"]
                    names += [f"enc{s}_{b}.{part}.{what}" for part in parts for what in ("conv", "bn")]
            names += [f"dec{d}_{i}.{what}" for d in range(5) for i in range(2) for what in ("conv", "bn")]
            return names + ["head.conv"]

    class VitUNet(Base):
        """The encoder is timm's; the layout of the position embedding and the duplicated last norm are defined here."""

        twice = 384  # timm has a position embedding of the class token; our weights have it added to the token, so it is not counted.

        def __init__(self, bands, classes):
            super().__init__()
            import timm

            self.vit = timm.create_model("vit_small_patch14_dinov2", pretrained=False, in_chans=bands, num_classes=0)
            self.vit.norm, self.norms = nn.Identity(), nn.ModuleList(nn.LayerNorm(384, eps=1e-6) for _ in range(2))
            def unit(inputs, outputs):
                return nn.Sequential(nn.Conv2d(inputs, outputs, 3, 2, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU())

            self.fine = nn.ModuleList(unit(*sizes) for sizes in zip([bands, 16, 32], [16, 32, 64]))
            decoder, skips, inputs = [128, 64, 32, 16], [64, 32, 16, 0], [768, 128, 64, 32]
            self.decoder = nn.ModuleList(DecoderBlock(*sizes) for sizes in zip(inputs, skips, decoder))
            self.segmentation_head = nn.Conv2d(16, classes, 3, padding=1)

        def forward(self, x):
            size = x.shape[2:]
            h, w = (-(-side // 14) for side in size)
            fine = [x]
            for unit in self.fine:
                fine.append(unit(fine[-1]))
            y = F.interpolate(x, size=(14 * h, 14 * w), mode="bilinear", align_corners=False)
            y = self.vit.patch_embed.proj(y).flatten(2).transpose(1, 2)
            grid = self.vit.pos_embed[:, 1:].transpose(1, 2).reshape(1, 384, 37, 37)
            grid = F.interpolate(grid, size=(h, w), mode="bicubic", align_corners=False)
            token = self.vit.cls_token + self.vit.pos_embed[:, :1]
            y = torch.cat([token.expand(len(y), -1, -1), y + grid.flatten(2).transpose(1, 2)], dim=1)
            seen = []
            for i, block in enumerate(self.vit.blocks):
                y = block(y)
                if i in (5, 11):
                    seen.append(self.norms[i // 6](y)[:, 1:].transpose(1, 2).reshape(-1, 384, h, w))
            x, skips = torch.cat(seen, dim=1), fine[:0:-1] + [None]
            for block, skip in zip(self.decoder, skips):
                x = block(x, skip, size if skip is None else skip.shape[2:])
            return self.segmentation_head(x)

        def names(self):
            names = [f"fine{i}.{what}" for i in range(3) for what in ("conv", "bn")]
            names += [f"dec{d}_{i}.{what}" for d in range(4) for i in range(2) for what in ("conv", "bn")]
            return names + ["head.conv"]

        def load_encoder(self, weights):
            """Loads weights under timm's names, like `train`; returns our names of the loaded weights."""
            ours = {n: torch.tensor(a) for n, a in weights.items() if n.startswith(("stem", "enc"))}
            state = {"patch_embed.proj." + n[5:]: a for n, a in ours.items() if n.startswith("stem.")}
            # In our files the class token includes its position embedding.
            position = ours["enc.position"].flatten(2).transpose(1, 2)
            state["cls_token"] = ours["enc.class"].reshape(1, 1, 384)
            state["pos_embed"] = torch.cat([torch.zeros(1, 1, 384), position], dim=1)
            parts = {"qkv": "attn.qkv", "proj": "attn.proj", "fc1": "mlp.fc1", "fc2": "mlp.fc2", "scale1": "ls1", "scale2": "ls2"}
            for name, array in ours.items():
                place, part, what = (name.split(".") + [""])[:3]
                if not what:
                    continue
                if part == "norm":
                    getattr(self.norms[0 if place == "enc5" else 1], what).data = array
                else:
                    state[f"blocks.{place[3:]}.{parts.get(part, part)}.{what}"] = array.squeeze()
            self.vit.load_state_dict(state)
            return set(ours)

        def load_published(self, state):
            for norm in self.norms:
                norm.load_state_dict({what: state["norm." + what] for what in ("weight", "bias")})
            self.vit.load_state_dict({name: array for name, array in state.items() if not name.startswith("norm.")})

    return {"segnet": SegNet, "basic-segnet": BasicSegNet, "unet": UNet, "tiny-unet": TinyUNet, "lite-unet": LiteUNet, "vit-unet": VitUNet}


def write_vit(path):
    import timm
    import torch
    from safetensors.torch import save_file

    torch.manual_seed(1)
    vit = timm.create_model("vit_small_patch14_dinov2", pretrained=False, num_classes=0)
    # Random offsets, about as far from zero and one as in trained weights.
    save_file({name: array + 0.05 * torch.randn(array.shape) for name, array in vit.state_dict().items()}, path)


def run_torch(network, weights, images, classes, encoder=None):
    import torch

    net = torch_networks()[network](images.shape[1], classes)
    used = net.load_encoder(weights) if hasattr(net, "load_encoder") else set()
    apart = set(net.vit.modules()) if used else set()
    holders = [m for m in net.modules() if isinstance(m, (torch.nn.Conv2d, torch.nn.BatchNorm2d)) and m not in apart]
    names = net.names()
    assert len(holders) == len(names), f"{len(holders)} modules, {len(names)} names"
    for holder, name in zip(holders, names):
        state = {k: torch.tensor(weights[f"{name}.{k}"]) for k in holder.state_dict() if k != "num_batches_tracked"}
        used |= {f"{name}.{k}" for k in state}
        holder.load_state_dict(state, strict=False)
    if encoder:
        net.load_published({name: torch.tensor(array) for name, array in load_file(encoder).items()})
    net = net.double().eval()
    with torch.no_grad():
        scores = net(torch.tensor(images, dtype=torch.float64)).numpy()
    learnt = sum(p.numel() for p in net.parameters()) - net.twice
    doubt = None if net.doubt is None else net.doubt.numpy()
    return scores, learnt, doubt, used


# --- comparison --------------------------------------------------------------------------------------------------------------


def check(folder, engine, encoder):
    card = json.load(open(f"{folder}/model.json"))
    weights = load_file(f"{folder}/weights.safetensors")
    io = load_file(f"{folder}/io.safetensors")
    run = {"numpy": run_numpy, "torch": partial(run_torch, encoder=encoder)}[engine]
    scores, learnt, doubt, used = run(card["network"], weights, io["images"], len(card["classes"]))
    assert used == set(weights), f"{folder}: not used {set(weights) - used}, not there {used - set(weights)}"
    assert learnt == card["parameters"], f"{folder}: {learnt} parameters, the program says {card['parameters']}"
    assert scores.shape == io["scores"].shape, f"{folder}: {scores.shape} values, the program gives {io['scores'].shape}"
    apart = np.abs(scores - io["scores"]).max(axis=(1, 2, 3))
    largest = max(1.0, np.abs(scores).max())
    decided = np.ones(len(apart), bool) if doubt is None else ~doubt
    assert decided.sum() >= 2, f"{folder}: only {decided.sum()} of {len(decided)} images have clearly separated maxima"
    worst = apart[decided].max() / largest
    print(
        f"{engine} {card['network']} {len(card['input']['bands'])} bands: {learnt} parameters, "
        f"{decided.sum()} of {len(decided)} images, apart by {worst:.1e} of {largest:.2f} (all images {apart.max() / largest:.1e})"
    )
    assert np.abs(scores).std() > 1e-3, f"{folder}: the outputs are nearly constant"
    assert worst < TOLERANCE, f"{folder}: values differ by {worst} of the largest"


if __name__ == "__main__":
    arguments = sys.argv[1:]
    options = {"--engine": "numpy", "--encoder": None, "--write-vit": None}
    while arguments and arguments[0] in options:
        options[arguments[0]], arguments = arguments[1], arguments[2:]
    if options["--write-vit"]:
        write_vit(options["--write-vit"])
    for folder in arguments:
        check(folder, options["--engine"], options["--encoder"])
