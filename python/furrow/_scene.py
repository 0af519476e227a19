"""Scene files as nested dicts, and images of them."""

from __future__ import annotations

import difflib
import importlib
import json
import os
import subprocess
import sys
import tarfile
import tempfile
import warnings
from contextlib import closing, contextmanager
from pathlib import Path
from typing import (
    IO,
    TYPE_CHECKING,
    Any,
    Callable,
    Dict,
    Generator,
    Iterator,
    List,
    Mapping,
    Optional,
    Sequence,
    Tuple,
    TypedDict,
    Union,
)

from ._errors import FurrowError, FurrowWarning, ended, messages
from ._image import Image, from_files
from ._program import ask, plain, program

if TYPE_CHECKING:
    from typing_extensions import Unpack

PathLike = Union[str, "os.PathLike[str]"]


class _Shared(TypedDict, total=False):
    """Options of `render` and `stream`."""

    seed: int
    width: int
    height: int
    denoise: bool
    engine: str
    without: Sequence[str]
    quality: str
    max_depth: int
    clamp: float
    edit: str
    threads: int
    memory: float


class RenderOptions(_Shared, total=False):
    """Options of `render`: those of `trace --scene`, with `_` for `-`. `None` stands for the default."""

    index: int
    spp: Optional[int]
    day: int
    light: int
    frame: int
    camera: str
    target_error: float
    time: str
    max_spp: int
    integrator: str
    crop: Tuple[int, int, int, int]


class StreamOptions(_Shared, total=False):
    """Options of `stream`: those of `trace stream`, with `_` for `-`."""

    spp: Optional[int]
    first: int
    count: Optional[int]
    relight: int
    shard: Optional[Tuple[int, int]]
    labels_only: bool
    keep: Union[str, Sequence[str]]
    classes: str
    image_format: str
    photo: str  # the former name of image_format
    split: Sequence[int]
    at_once: int


def _flags(function: str, options: Mapping[str, Any], known: Any) -> List[str]:
    """Convert keywords such as `target_error=0.02, without=["mis"], denoise=True` to command-line arguments."""
    words = []
    names = list(known.__annotations__)
    for name, value in options.items():
        if name not in names:
            near = difflib.get_close_matches(name, names, 1)
            help = f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(names)}"
            raise TypeError(f"{function}() got an unexpected keyword argument {name!r}{help}")
        if value is None or value is False:
            continue
        words.append("--" + name.replace("_", "-"))
        if isinstance(value, (list, tuple)):
            words.append(("/" if name == "shard" else ",").join(map(str, value)))
        elif value is not True:
            words.append(str(value))
    return words


@contextmanager
def _bar(wanted: bool) -> Iterator[Optional[Callable[[float], None]]]:
    """Provide a function that shows a fraction as a bar, with the package tqdm; `None` without it."""
    try:
        tqdm = importlib.import_module("tqdm.auto").tqdm if wanted else None
    except ImportError:
        tqdm = None
    if tqdm is None:
        yield None
        return
    with tqdm(total=100, unit="%", bar_format="{desc}{percentage:3.0f} %|{bar}| {elapsed}") as bar:
        yield lambda done: bar.update(100 * done - bar.n)
        bar.update(100 - bar.n)


def _warn(words: Sequence[str]) -> None:
    """Issue warnings at the code outside of this package that called it."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(os.path.dirname(__file__)):
        level, frame = level + 1, frame.f_back
    for warning in words:
        warnings.warn(warning, FurrowWarning, stacklevel=level)


class Scene(Dict[str, Any]):
    """A scene file as nested dicts and lists, to be edited and rendered.

        scene = furrow.load("field")
        scene["camera"]["height_m"] = 1.2
        scene["crops"][0]["species"] = "maize"
        image = scene.render(seed=7, spp=32)

    The name in front of fields is the value "type": `Pinhole(size: (96, 72))` is `{"type": "Pinhole", "size": [96, 72]}`, and
    `{"Pinhole": {"size": [96, 72]}}` means the same. A name with other values is the only key: `Uniform(1, 2)` is
    `{"Uniform": [1, 2]}`, and the string "Uniform(1, 2)" means the same.
    `trace explain` documents all fields. Values are checked when the scene is used. Paths are relative to `folder`.
    """

    def __init__(self, values: Mapping[str, Any], folder: Optional[PathLike] = None) -> None:
        if isinstance(values, (str, os.PathLike)):
            raise TypeError(f"a Scene is made of a dict; furrow.load({os.fspath(values)!r}) reads a file or a bundled scene")
        super().__init__(values)
        self.folder = Path(os.path.abspath(folder or "."))
        self.path: Optional[Path] = None
        self._loaded = ""

    def render(self, *, progress: bool = False, **options: Unpack[RenderOptions]) -> Image:
        """Render field `index` (0 by default) with `spp` samples per pixel (16 by default).

        The keywords are the options of the program: `seed=7`, `width=648`, `crop=(0, 0, 200, 100)`, `denoise=True`;
        `target_error=0.05` or `time="30s"` replace `spp`. `progress` shows a bar with the package tqdm. Warnings of the program are
        issued as `FurrowWarning`. With `crop`, the record has no plants.
        """
        return _render(self._source(), options, progress)

    def stream(self, *, progress: bool = False, **options: Unpack[StreamOptions]) -> Generator[Image, None, None]:
        """Yield the fields of the scene like `furrow.stream`."""
        arguments = _stream_flags(options)
        if (file := self._source().get("file")) is not None:
            return _counted(_stream(file, arguments), options.get("count"), progress)
        return _counted(self._streamed(arguments), options.get("count"), progress)

    def _streamed(self, arguments: List[str]) -> Generator[Image, None, None]:
        with tempfile.TemporaryDirectory(prefix="furrow-") as folder:
            name = self.path.name if self.path is not None else "scene.ron"
            yield from _stream(str(self.save(Path(folder) / name)), arguments)

    def text(self) -> str:
        """Return the text of a scene file, with absolute paths of the files that it names."""
        found: str = ask({"write": self._source()})[0]["text"]
        return found

    def save(self, path: PathLike) -> Path:
        """Write a scene file, with absolute paths of the files that it names. Return its path."""
        path = Path(path)
        path.write_text(self.text(), encoding="utf-8")
        return path

    def _source(self) -> Dict[str, Any]:
        """Return the scene for a request: its file, if the values are those of the file."""
        if self.path is not None and json.dumps(self, default=plain) == self._loaded:
            return {"file": str(self.path)}
        return {"scene": dict(self), "folder": str(self.folder)}

    def __repr__(self) -> str:
        camera = self.get("camera")
        parts = [str(camera.get("type"))] if isinstance(camera, Mapping) else []
        for name in ("crops", "weeds", "plants", "models"):
            if isinstance(self.get(name), (list, tuple)):
                parts.append(f"{name} {len(self[name])}")
        return f"furrow.Scene({self.path.name if self.path is not None else 'dict'}: {', '.join(parts)})"


def _named(scene: PathLike) -> str:
    """Return the absolute path of a file, since the program may have started in another folder; a bundled name as it is."""
    name = os.fspath(scene)
    return os.path.abspath(name) if os.path.exists(name) else name


def load(scene: PathLike) -> Scene:
    """Read a scene file, or a bundled one by its name, such as "field"."""
    answer, _ = ask({"open": _named(scene)})
    found = Scene(answer["scene"], Path(answer["file"]).parent)
    found.path = Path(os.path.abspath(answer["file"]))
    found._loaded = json.dumps(found)
    return found


def _render(source: Dict[str, Any], options: RenderOptions, progress: bool) -> Image:
    enough = all(options.get(name) is None for name in ("target_error", "time", "quality"))
    arguments = _flags("render", {"spp": 16 if enough else None, **options}, RenderOptions)
    with _bar(progress) as show:
        request = {**source, "arguments": arguments, "progress": show is not None}
        answer, arrays = ask({"render": request}, show)
    image = Image({"image" if of["name"] == "rgb" else of["name"]: array for of, array in zip(answer["maps"], arrays)})
    image["record"] = answer["record"]
    image["provenance"] = dict(line.split(": ", 1) for line in answer["provenance"].splitlines() if ": " in line)
    _warn(answer["warnings"])
    return image


def render(scene: Union[PathLike, Scene], *, progress: bool = False, **options: Unpack[RenderOptions]) -> Image:
    """Render a field of a scene file, of a bundled one by its name, or of a `Scene`; see `Scene.render`."""
    return _render(scene._source() if isinstance(scene, Scene) else {"file": _named(scene)}, options, progress)


def _entries(archive: IO[bytes]) -> Iterator[Tuple[str, bytes]]:
    """Yield names and contents of the files in a tar stream, until it ends or is truncated."""
    # Not `tarfile.open`, which keeps a list of all files: a stream may last for days.
    while header := archive.read(tarfile.BLOCKSIZE):
        try:
            entry = tarfile.TarInfo.frombuf(header, "utf-8", "strict")
        except tarfile.HeaderError:  # Zeros at the end, or an incomplete header.
            return
        content = archive.read(entry.size)
        if len(content) < entry.size:
            return
        archive.read(-entry.size % tarfile.BLOCKSIZE)
        yield entry.name, content


def _images(archive: IO[bytes]) -> Iterator[Image]:
    """Yield the images of a tar stream; the record is the last file of each image."""
    files: Dict[str, bytes] = {}
    for path, content in _entries(archive):
        key, name = path.split(".", 1)
        files[name] = content
        if name == "record.json":
            yield from_files(files, key)
            files = {}


def _stream_flags(options: StreamOptions) -> List[str]:
    # Encode only the maps that become arrays. With labels only, neither bands nor samples per pixel apply.
    usual: Dict[str, Any] = {} if options.get("labels_only") else {"keep": "nir", "spp": 16}
    chosen = {**usual, **options}
    if options.get("labels_only") or (options.get("quality") and "spp" not in options):
        chosen.pop("spp", None)
    return _flags("stream", chosen, StreamOptions)


def _stream(scene: str, arguments: List[str]) -> Generator[Image, None, None]:
    command = [program(), "stream", "--quiet", "--scene", scene, *arguments]
    # A file, because unlike a pipe it accepts any number of warnings without being read.
    with tempfile.TemporaryFile(prefix="furrow-") as said:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=said)
        except OSError as error:
            raise FurrowError(f"{command[0]}: {error}", "missing") from error

        def text() -> str:
            """Return what the program printed, without moving its own position in the file."""
            return os.pread(said.fileno(), os.fstat(said.fileno()).st_size, 0).decode(errors="replace")

        shown = 0
        with process:
            assert process.stdout is not None
            try:
                for image in _images(process.stdout):
                    yield image
                    shown = _warn_new(text(), shown)
                code = process.wait()
            finally:
                # Has no effect if the program has already ended.
                process.terminate()
        _warn_new(text(), shown)
        if code != 0:
            raise ended(command[0], code, text())


def _counted(
    images: Generator[Image, None, None], count: Optional[int], wanted: bool
) -> Generator[Image, None, None]:
    """Yield images while a bar of the package tqdm counts them, if it is installed."""
    try:
        tqdm = importlib.import_module("tqdm.auto").tqdm if wanted else None
    except ImportError:
        tqdm = None
    if tqdm is None:
        return images
    return _shown(images, tqdm(total=count, unit="image"))


def _shown(images: Generator[Image, None, None], bar: Any) -> Generator[Image, None, None]:
    with closing(images), bar:
        for image in images:
            bar.update(1)
            yield image


def _warn_new(text: str, shown: int) -> int:
    """Issue the warnings after the first `shown`. Return the number of warnings."""
    found = messages(text)[0]
    _warn(found[shown:])
    return len(found)


def stream(
    scene: Union[PathLike, Scene], *, progress: bool = False, **options: Unpack[StreamOptions]
) -> Generator[Image, None, None]:
    """Yield the fields of a scene from index `first` on, each rendered shortly before use; endless without `count`.

    Image k, including its record, is the same as in a dataset with the same scene file, size and samples. With several readers,
    `shard=(k, n)` selects the images of reader k of n. Other keywords are the options of `trace stream` with `_` for `-`:
    `width=324`, `seed=3`, `denoise=True`, `threads=2`; `labels_only=True` ignores `spp`. `progress` counts the images with the package
    tqdm. The program runs until the generator is closed or deleted. Raises `FurrowError` with the program's error message.
    """
    if isinstance(scene, Scene):
        return scene.stream(progress=progress, **options)
    return _counted(_stream(os.fspath(scene), _stream_flags(options)), options.get("count"), progress)
