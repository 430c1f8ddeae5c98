"""Malformed surfaces and heights: one sentence with the file, what was expected and what came."""

import io
import struct
import warnings
import zlib
from functools import partial

import numpy as np
import pytest
from PIL import Image

from fingerpad import InputError, read_height_map, read_surface

TRIANGLE = "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n{body}"
)
FOLDED = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 10 10 0\n"
CORNERS = "0 0 0\n10 0 0\n0 10 0\n"


def binary_stl(triangles, count=None, cut=0):
    content = bytes(80) + struct.pack("<I", len(triangles) if count is None else count)
    for triangle in triangles:
        content += struct.pack("<12f", 0.0, 0.0, 1.0, *np.ravel(triangle)) + bytes(2)
    return content[: len(content) - cut]


def ascii_stl(*corners):
    lines = "\n".join(f"vertex {corner}" for corner in corners)
    return f"solid a\nfacet normal 0 0 1\nouter loop\n{lines}\nendloop\nendfacet\nendsolid a\n"


def ply(vertices=3, faces=1, body=CORNERS + "3 0 1 2\n"):
    return PLY.format(vertices=vertices, faces=faces, body=body)


def binary_ply(vertices=3, faces=1, tail=b""):
    head = ply(vertices, faces, "").replace("ascii", "binary_big_endian").encode()
    return head + struct.pack(">9f", *np.ravel(ONE)) + struct.pack(">B3i", 3, 0, 1, 2) + tail


ONE = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]]

SAID = {
    "solid.stl": "234 bytes for 3 triangles: got 214 bytes; it is cut off",
    "cut-text.stl": "cut off after 1 facets",
    "zero.obj": "line 4: a face must name three vertices or more, the first vertex as 1",
    "utf-16.obj": "zero bytes, as in UTF-16",
    "fewer.ply": "must hold 3 of vertex and 1 of face, as its header says",
    "fewer-binary.ply": "must hold 2 of vertex and 1 of face",
    "more-binary.ply": "its counts are wrong",
    "longer-binary.ply": "its counts are wrong",
    "corners.ply": "its counts are wrong",
    "concave.obj": "divide them into triangles",
    "too-few.stl": "434 bytes for 7 triangles: got 134 bytes",
    "header.stl": "header.stl: it is no STL file: one of text begins with 'solid'",
    "words.stl": "words.stl: it is no STL file: one of text begins with 'solid'",
    "beyond.ply": "0 to 2: got numbers 0 to 7",
    "three.obj": "two triangles at most along each edge",
    "ragged.csv": "line 2 has 2 of them instead of 3",
    "points.csv": "9 times 3 numbers look like points x, y, z",
    "flat.csv": "must have heights that differ",
    "words.csv": "got 'three' in line 2 and column 1",
    "hole.csv": "got '' in line 2 and column 2",
    "semicolon.csv": "got '1;2' in line 1",
    "nan.csv": "first in row 2 and column 1",
    "text.npy": "numpy.save",
    "text.png": "cannot be read as a PNG or TIFF image",
}

SURFACES = {
    "solid.stl": b"solid" + binary_stl([ONE] * 3, cut=20)[5:],
    "cut-text.stl": ascii_stl("0 0 0", "10 0 0", "0 10 0")[:-11] + "facet normal 0 0 1\nouter loop\n",
    "utf-16.obj": TRIANGLE.encode("utf-16"),
    "fewer.ply": ply(body=CORNERS + "9 9 9\n3 0 1 2\n"),
    "fewer-binary.ply": binary_ply(vertices=2),
    "more-binary.ply": binary_ply(faces=2),
    "longer-binary.ply": binary_ply(tail=b"\1"),
    "corners.ply": ply(body=CORNERS + "3 0 1 2 3\n"),
    "concave.obj": "v 0 0 0\nv 9 1 0\nv 9 9 0\nv 8 2 0\nv 1 2 0\nv 0 9 0\nf 1 2 3 4 5 6\n",
    "empty.stl": "",
    "header.stl": bytes(80),
    "words.stl": "a dot\n",
    "no-triangle.stl": binary_stl([]),
    "too-few.stl": binary_stl([ONE], count=7),
    "nan.stl": binary_stl([[[0.0, 0.0, np.nan], *ONE[1:]]]),
    "huge.stl": binary_stl([np.multiply(ONE, 3e37)]),
    "line.stl": binary_stl([[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [10.0, 0.0, 0.0]]]),
    "metres.stl": binary_stl([np.multiply(ONE, 1e-3)]),
    "down.stl": binary_stl([ONE[::-1]]),
    "wall.stl": binary_stl([[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, 10.0]]]),
    "two-numbers.stl": ascii_stl("0 0 0", "10 0", "0 10 0"),
    "image.stl": b"\x89PNG\r\n\x1a\n" + bytes(200),
    "vertices.obj": "v 0 0 0\nv 10 0 0\nv 0 10 0\n",
    "letters.obj": "v 0 0 0\nv x 0 0\nv 0 10 0\nf 1 2 3\n",
    "infinite.obj": "v 0 0 0\nv inf 0 0\nv 0 10 0\nf 1 2 3\n",
    "beyond.obj": "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 9\n",
    "zero.obj": "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 0 1 2\n",
    "edge.obj": "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2\n",
    "flat.obj": "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 1 2\n",
    "bytes.obj": bytes(range(256)),
    "magic.ply": "plywood\n",
    "format.ply": ply().replace("ascii 1.0", "roman 2.0"),
    "no-faces.ply": ply(faces=0, body=CORNERS),
    "beyond.ply": ply(body=CORNERS + "3 0 1 7\n"),
    "cut.ply": ply().replace("ascii", "binary_little_endian"),
    "three.obj": FOLDED + "v 5 5 9\nf 1 2 3\nf 3 2 4\nf 3 2 5\n",
    "solid.step": "ISO-10303-21;",
    "noending": TRIANGLE,
}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"unit": "furlong"}, "unit must be one of"),
        ({"unit": 3}, "unit must be one of"),
        ({"unit": "m"}, "check the unit"),
        ({"scale": 0.0}, "scale must be greater than 0"),
        ({"scale": "twice"}, "scale must be a finite number"),
        ({"up": "z"}, "up must be one of"),
        ({"up": "-z"}, "outer side"),
        ({"at_mm": ("left", 0.0)}, "at_mm"),
        ({"at_mm": (1.0, 2.0, 3.0)}, "at_mm must be a pair"),
        ({"at_mm": 3.0}, "at_mm"),
        ({"pitch_mm": 0.0}, "pitch_mm must be greater than 0"),
        ({"pitch_mm": "fine"}, "pitch_mm must be a finite number"),
        ({"pitch_mm": 1e-5}, "0.1 to 1000 mm"),
        ({"pitch_mm": 1e3}, "0.1 to 1000 mm"),
        ({"pitch_mm": 0.1, "height_mm": 0.0}, "height_mm must be greater than 0"),
        ({"pitch_mm": 0.1, "height_mm": 1e6}, "heights within 1000 mm"),
        ({"pitch_mm": 0.1, "height_mm": "1 mm"}, "height_mm must be a finite number"),
    ],
    ids=str,
)
def test_a_wrong_placement_pitch_or_height_is_refused_in_one_sentence(tmp_path, options, said):
    (tmp_path / "good.obj").write_text(TRIANGLE.replace("10", "20"))
    np.save(tmp_path / "map.npy", np.outer(np.hanning(20), np.hanning(20)))
    read, name = (read_height_map, "map.npy") if "pitch_mm" in options else (read_surface, "good.obj")
    assert said in _refused(None, lambda: read(tmp_path / name, **options))


@pytest.mark.parametrize(
    "reader", [read_surface, lambda path: read_height_map(path, 0.1)], ids=["stl", "map"]
)
def test_a_folder_and_a_missing_file_are_told(tmp_path, reader):
    for name in ("folder.stl", "folder.png"):
        (tmp_path / name).mkdir()
    for name in ("folder.stl", "folder.png", "missing.stl", "missing.png"):
        _refused(name, lambda name=name: reader(tmp_path / name))


MAPS = {
    "points.csv": "".join(f"{x},{y},{x * y}\n" for x in range(3) for y in range(3)),
    "flat.csv": "2,2,2\n2,2,2\n",
    "empty.csv": "",
    "ragged.csv": "1,2,3\n4,5\n6,7,8\n",
    "words.csv": "1,2\nthree,4\n",
    "semicolon.csv": "1;2\n3;4\n",
    "comma.csv": '"1,5","2,5"\n"3,5","4,5"\n',
    "hole.csv": "1,2\n3,\n",
    "nan.csv": "1,2\nnan,4\n",
    "column.csv": "1\n2\n3\n",
    "bytes.csv": bytes(range(256)),
    "mountain.csv": "0,1e9\n0,0\n",
    "text.npy": "1 2 3",
    "text.png": "a picture of a dot",
    "cut.tif": b"II*\x00\x08\x00\x00\x00",
    "photo.jpg": b"\xff\xd8\xff",
    "map.txt": "1 2\n3 4\n",
}


@pytest.mark.parametrize("name", [*SURFACES, *MAPS])
def test_a_malformed_file_is_refused_in_one_sentence(tmp_path, name):
    content = (SURFACES | MAPS)[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    read = read_surface if name in SURFACES else partial(read_height_map, pitch_mm=0.1)
    assert SAID.get(name, "") in _refused(name, lambda: read(tmp_path / name))


ARRAYS = {
    "complex": np.ones((4, 4), dtype=complex),
    "text": np.array([["a", "b"], ["c", "d"]]),
    "line": np.ones(9),
    "cube": np.ones((3, 3, 3)),
    "nan": np.full((4, 4), np.nan),
    "points": np.stack(np.meshgrid(range(4), range(5), [0.0]), axis=-1).reshape(-1, 3).T,
    "times": np.zeros((3, 3), dtype="datetime64[s]"),
    "fields": np.zeros((3, 3), dtype=[("height", float)]),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_an_array_that_is_no_map_is_refused_in_one_sentence(tmp_path, name):
    np.save(tmp_path / f"{name}.npy", ARRAYS[name], allow_pickle=True)
    _refused(f"{name}.npy", lambda: read_height_map(tmp_path / f"{name}.npy", 0.1))


def deep_png(kind, samples):
    """A PNG image of 2 by 2 pixels of 16 bits, all of which Pillow cannot write."""

    def chunk(name, content):
        check = struct.pack(">I", zlib.crc32(name + content))
        return struct.pack(">I", len(content)) + name + content + check

    rows = zlib.compress((b"\0" + bytes(range(4 * samples))) * 2)
    head = struct.pack(">2I5B", 2, 2, 16, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def test_images_that_do_not_hold_heights_are_refused(tmp_path):
    grey, cut = Image.new("L", (20, 20)), io.BytesIO()
    grey.putpixel((10, 10), 255)
    Image.effect_noise((200, 200), 80).save(cut, "PNG")
    translucent = grey.convert("RGBA")
    translucent.putpixel((3, 3), (0, 0, 0, 0))
    pages = Image.fromarray(np.zeros((20, 20, 3), np.uint8))
    pages.save(tmp_path / "page.tif", save_all=True, append_images=[grey])
    said = {"page.tif": "one page: got 2"}
    for name, image, words in (
        ("large.png", Image.new("1", (9000, 9000)), ""),
        ("row.png", Image.new("L", (20, 1)), ""),
        ("colour.png", Image.new("RGB", (20, 20), (200, 40, 10)), ""),
        ("alpha.png", translucent, ""),
        ("black.png", Image.new("L", (20, 20)), "all are equal"),
        ("uniform.tif", Image.new("I;16", (20, 20), 9000), "all are equal"),
    ):
        image.save(tmp_path / name)
        said[name] = words
    for name, content, words in (
        ("cut.png", cut.getvalue()[:900], ""),
        ("end.png", cut.getvalue()[:-5], "cut off"),
        ("deep.png", deep_png(2, 3), "of which 8 bits would be lost"),
        ("grey-and-alpha.png", deep_png(4, 2), "of which 8 bits would be lost"),
    ):
        (tmp_path / name).write_bytes(content)
        said[name] = words
    for name, words in said.items():
        assert words in _refused(name, lambda name=name: read_height_map(tmp_path / name, 0.1))


def _refused(name, read):
    """Sentence of the refusal: one line, an end, the file's name, and no warning beside it."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputError) as raised:
            read()
    said = str(raised.value)
    assert "\n" not in said
    assert said.endswith(".")
    assert name is None or name in said
    return said
