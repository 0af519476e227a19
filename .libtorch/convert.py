"""Tensors of single precision from torch's format before 1.6, in a zip archive, as safetensors: convert.py ARCHIVE MEMBER OUT.

Needs no torch, and executes nothing of the file: whatever a pickle asks for beside dictionaries and tensors is an error. The result is
equal, byte for byte, wherever it is made; its SHA-256 is checked where the weights are known.
"""

import array
import collections
import hashlib
import io
import json
import pickle
import sys
import zipfile

KNOWN = {
    # What the file must be, and what must come of it.
    "efficientnet-lite0-57934424.pth": (
        "579344248a93e23026e6b78f1f6faf0bc1d282386f6c881cdbaacd49cabf77db",
        "0c677c314df2a69239bef9609a095a957201d5092462c5ace5d8bf3e0201bbd7",
    ),
}
MAGIC, PROTOCOL = 0x1950A86A20F9469CFC6C, 1001


class Storage:
    """Numbers of a tensor, found behind the pickles."""

    def __init__(self, kind, key, numel):
        self.kind, self.key, self.numel, self.data = kind, key, numel, None


def tensor(storage, offset, size, stride, *_):
    return storage, offset, tuple(size), tuple(stride)


def rows(data, kind, offset, size, stride):
    """The bytes of a tensor's numbers, row by row, wherever its storage has them."""
    numbers = array.array({"F32": "f", "I64": "q"}[kind], data)
    places = [offset]
    for n, step in zip(size, stride):
        places = [place + i * step for place in places for i in range(n)]
    if min(places, default=0) < 0 or max(places, default=0) >= len(numbers):
        raise ValueError("a tensor that is larger than its storage")
    return array.array(numbers.typecode, [numbers[place] for place in places]).tobytes()


class Reader(pickle.Unpickler):
    def find_class(self, module, name):
        allowed = {
            ("collections", "OrderedDict"): collections.OrderedDict,
            ("torch._utils", "_rebuild_tensor_v2"): tensor,
            ("torch", "FloatStorage"): "F32",
            ("torch", "LongStorage"): "I64",
        }
        try:
            return allowed[module, name]
        except KeyError:
            raise ValueError(f"the file asks for {module}.{name}") from None

    def persistent_load(self, words):
        what, kind, key, _, numel, _ = words
        if what != "storage" or kind not in ("F32", "I64"):
            raise ValueError(f"the file asks for {words}")
        return self.storages.setdefault(key, Storage(kind, key, numel))

    storages: dict


def read(file):
    storages = {}

    def load():
        reader = Reader(file)
        reader.storages = storages
        return reader.load()

    if load() != MAGIC or load() != PROTOCOL:
        raise ValueError("not a file of torch's old format")
    load()  # byte order and sizes of the machine that wrote it
    tensors = load()
    for key in load():
        storage = storages[key]
        width = {"F32": 4, "I64": 8}[storage.kind]
        if int.from_bytes(file.read(8), "little") != storage.numel:
            raise ValueError(f"storage {key} has another size")
        storage.data = file.read(width * storage.numel)
        if len(storage.data) != width * storage.numel:
            raise ValueError("the file ends too early")
    single = {name: found for name, found in tensors.items() if found[0].kind == "F32"}
    return {name: (rows(at.data, at.kind, *view), view[1]) for name, (at, *view) in single.items()}


def safetensors(tensors):
    header, at = {}, 0
    for name in sorted(tensors):
        data, size = tensors[name]
        header[name] = {"dtype": "F32", "shape": list(size), "data_offsets": [at, at + len(data)]}
        at += len(data)
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return len(text).to_bytes(8, "little") + text + b"".join(tensors[name][0] for name in sorted(tensors))


def main(archive, member, out):
    data = zipfile.ZipFile(archive).read(member)
    before, after = KNOWN.get(member.rsplit("/", 1)[-1], (None, None))
    if before and hashlib.sha256(data).hexdigest() != before:
        sys.exit(f"{member} is not the file that is known")
    made = safetensors(read(io.BytesIO(data)))
    if after and hashlib.sha256(made).hexdigest() != after:
        sys.exit(f"{member} was converted to something else: {hashlib.sha256(made).hexdigest()}")
    with open(out, "wb") as file:
        file.write(made)


if __name__ == "__main__":
    main(*sys.argv[1:])
