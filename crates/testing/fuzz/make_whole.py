"""Makes the whole files that searches begin with: `python make_whole.py`. FLAC files need the package pedalboard."""

import base64
import json
import math
import random
import struct
from pathlib import Path

HERE = Path(__file__).parent
TRIANGLES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
VERTICES = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.5, 0.0), (0.0, 0.0, 1.5)]


def put(target, name, content):
    path = HERE / target / "whole" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def chunk(name, content):
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def wave(chunks, kind=b"RIFF"):
    body = b"WAVE" + b"".join(chunk(*c) for c in chunks)
    return kind + struct.pack("<I", len(body)) + body


def sounds():
    random.seed(1)
    form = lambda tag, channels, bits: struct.pack("<HHIIHH", tag, channels, 48000, 48000 * channels * bits // 8, channels * bits // 8, bits)
    int16 = struct.pack("<40h", *(random.randrange(-32768, 32768) for _ in range(40)))
    put("sound", "int16.wav", wave([(b"fmt ", form(1, 2, 16)), (b"LIST", b"INFOISFT\4\0\0\0x\0\0\0"), (b"data", int16)]))
    put("sound", "int24.wav", wave([(b"fmt ", form(1, 1, 24)), (b"data", bytes(random.randrange(256) for _ in range(60)))]))
    put("sound", "float.wav", wave([(b"fmt ", form(3, 1, 32)), (b"fact", struct.pack("<I", 20)), (b"data", struct.pack("<20f", *(random.random() for _ in range(20))))]))
    guid = bytes.fromhex("0100000000001000800000aa00389b71")
    extensible = form(0xFFFE, 2, 16) + struct.pack("<HHI", 22, 16, 3) + guid
    put("sound", "extensible.wav", wave([(b"fmt ", extensible), (b"data", int16)]))
    data64 = struct.pack("<QQQI", 200, 80, 20, 0)
    long = wave([(b"ds64", data64), (b"fmt ", form(1, 2, 16)), (b"data", int16)], b"RF64")
    put("sound", "long.wav", long.replace(b"data" + struct.pack("<I", 80), b"data" + b"\xff" * 4))
    try:
        import numpy
        from pedalboard.io import AudioFile
    except ImportError:
        print("without pedalboard there are no new FLAC files")
        return
    t = numpy.arange(900) / 44100
    tone = 0.4 * numpy.sin(2 * math.pi * 440 * t)
    noise = numpy.random.default_rng(1).uniform(-0.5, 0.5, 300)
    for name, sound, depth in [("tone.flac", numpy.stack([tone, 0.9 * tone]), 16), ("noise.flac", noise[None], 24)]:
        path = HERE / "sound" / "whole" / name
        with AudioFile(str(path), "w", 44100, sound.shape[0], bit_depth=depth) as file:
            file.write(sound.astype("float32"))


def images_text():
    rows = [
        "1 1 0 0 0 0.5 -1 2 1 a_01.jpg\n1.5 2.5 -1 3 4 7\n",
        "2 0.9848078 0 0.1736482 0 0.5 -1 2.5 1 a_02.jpg\n\n",
        "3 0.9659258 0 0.2588190 0 0 -1 3 1 a_03.jpg\n1 2 -1\n",
    ]
    return "# Image list\n" + "".join(rows)


def images_binary():
    out = struct.pack("<Q", 2)
    for number in range(2):
        out += struct.pack("<I7dI", number, 1, 0, 0, 0, number, 1, 2, 1) + b"a_%02d.jpg\0" % number
        out += struct.pack("<Q", 1) + bytes([7] * 24)
    return out


def ply(form, elements, body):
    return f"ply\nformat {form} 1.0\ncomment made for tests\n{elements}end_header\n".encode() + body


def meshes(target):
    faces = "".join("f " + " ".join(str(i + 1) for i in t) + "\n" for t in TRIANGLES)
    vertices = "".join("v %g %g %g\n" % v for v in VERTICES)
    put(target, "mesh.obj", f"# a corner\no corner\nusemtl brick\n{vertices}vn 0 0 1\nvt 0 0\n{faces}f -1 -2 -3\nf 1/1/1 2/1/1 3/1/1 4//1\n")
    element = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\n"
    text = "".join("%g %g %g\n" % v for v in VERTICES) + "".join("3 %d %d %d\n" % t for t in TRIANGLES)
    binary = b"".join(struct.pack("<3f", *v) for v in VERTICES) + b"".join(struct.pack("<B3i", 3, *t) for t in TRIANGLES)
    put(target, "text.ply", ply("ascii", element, text.encode()))
    put(target, "binary.ply", ply("binary_little_endian", element, binary))


def places():
    put("place", "images.txt", images_text())
    put("place", "images.bin", images_binary())
    put("place", "points3D.txt", "# 3D point list\n0 1 -2 3.5 255 0 0 0.5 1 10 2 11\n\n1 0 4 0.25 255 0 51 1.5 3 12\n")
    points = struct.pack("<Q", 2)
    for number, place, error, track in [(0, (1.0, -2.0, 3.5), 0.5, 2), (1, (0.0, 4.0, 0.25), 1.5, 1)]:
        points += struct.pack("<Q3d3BdQ", number, *place, 255, 0, 51, error, track) + bytes([7] * 8 * track)
    put("place", "points3D.bin", points)
    meshes("place")
    colours = "element vertex 2\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    put("place", "points.ply", ply("binary_big_endian", colours, struct.pack(">3d3B3d3B", 1, 2, 3, 255, 0, 9, -1, 0.5, 2, 0, 80, 7)))
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "rot_0"]
    splat = "element vertex 3\n" + "".join(f"property float {name}\n" for name in names)
    put("place", "splat.ply", ply("binary_little_endian", splat, struct.pack("<27f", *(0.1 * i for i in range(27)))))


def solids():
    meshes("mesh")
    stl = b"made for tests".ljust(80) + struct.pack("<I", len(TRIANGLES))
    text = "solid corner\n"
    for triangle in TRIANGLES:
        corners = [VERTICES[i] for i in triangle]
        stl += struct.pack("<12fH", 0, 0, 1, *(c for corner in corners for c in corner), 0)
        text += "facet normal 0 0 1\nouter loop\n" + "".join("vertex %g %g %g\n" % c for c in corners) + "endloop\nendfacet\n"
    put("mesh", "binary.stl", stl)
    put("mesh", "text.stl", text + "endsolid corner\n")
    places_, indices = b"".join(struct.pack("<3f", *v) for v in VERTICES), b"".join(struct.pack("<3H", *t) for t in TRIANGLES)
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "corner", "children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [1, 0, 0]}],
        "materials": [{"name": "brick"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0, "mode": 4}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4, "min": [0, 0, 0], "max": [2, 2.5, 1.5]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 12},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
    }
    binary("mesh", "mesh", gltf, places_ + indices)


def text(target, name, gltf, data):
    """A glTF file with its buffer in the text."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    put(target, name + ".gltf", json.dumps(dict(gltf, buffers=[{"byteLength": len(data), "uri": uri}])))


def binary(target, name, gltf, data):
    """A binary glTF file."""
    text = json.dumps(dict(gltf, buffers=[{"byteLength": len(data)}])).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    put(target, name + ".glb", b"glTF" + struct.pack("<III", 2, size, len(text)) + b"JSON" + text + struct.pack("<I", len(data)) + b"BIN\0" + data)


ADM = """<?xml version="1.0" encoding="UTF-8"?><ebuCoreMain xmlns="urn:ebu:metadata-schema:ebuCore_2015"><coreMetadata><format>
<audioFormatExtended><audioObject audioObjectID="AO_1001" audioObjectName="Voice" start="00:00:01.00000">
<audioPackFormatIDRef>AP_00031001</audioPackFormatIDRef></audioObject>
<audioPackFormat audioPackFormatID="AP_00031001" audioPackFormatName="Voice"><absoluteDistance>3.0</absoluteDistance>
<audioChannelFormatIDRef>AC_00031001</audioChannelFormatIDRef></audioPackFormat>
<audioChannelFormat audioChannelFormatID="AC_00031001" audioChannelFormatName="c">
<audioBlockFormat rtime="00:00:00.00000" duration="00:00:01.00000"><position coordinate="azimuth">0</position>
<position coordinate="elevation">0</position><position coordinate="distance">1</position></audioBlockFormat>
<audioBlockFormat rtime="00:00:01.00000" duration="00:00:02.00000"><position coordinate="azimuth">90</position>
<position coordinate="elevation">10</position><position coordinate="distance">0.5</position><jumpPosition interpolationLength="0.1">1</jumpPosition></audioBlockFormat>
<audioBlockFormat rtime="00:00:03.24000S48000"><cartesian>1</cartesian><position coordinate="X">1</position>
<position coordinate="Y">-0.5</position><position coordinate="Z">0.25</position></audioBlockFormat>
</audioChannelFormat></audioFormatExtended></format></coreMetadata></ebuCoreMain>"""


def paths():
    keyframes = [
        {"t": 0, "position": [0, 1.5, -2], "ypr": [30, 0, 0]},
        {"t": 1.25, "position": [1, 1.5, -2], "quat": [1, 0, 0, 0]},
        {"t": 2, "position": [1, 1, 1e-3], "ypr": [0, 0, 5]},
    ]
    put("path", "p.json", json.dumps(keyframes))
    rows = "0;0;1.5;-2;30;0;0;1\n\n1.25;1;1.5;-2;0;0;0;1\n2;1;1;1e-3;0;0;5;1\n"
    put("path", "p.csv", '# a walk\nt;x;y;z;yaw;pitch;roll;"fov"\n' + rows)
    put("path", "images.txt", images_text())
    put("path", "images.bin", images_binary())
    frame = lambda name, x: {"file_path": name, "transform_matrix": [[1, 0, 0, x], [0, 0, -1, 2], [0, 1, 0, 3], [0, 0, 0, 1]]}
    put("path", "transforms.json", json.dumps({"fl_x": 500, "frames": [frame("1.png", 1), frame("2.png", 1.5)]}))
    put("path", "film.wav", wave([(b"fmt ", bytes(16)), (b"chna", bytes(8)), (b"axml", ADM.encode()), (b"data", bytes(64))], b"BW64"))
    half = math.sqrt(0.5)
    times = struct.pack("<2f", 0.5, 2.5)
    moves, turns = struct.pack("<6f", 0, 0, 0, 0, 0, -2), struct.pack("<8f", 0, 0, 0, 1, 0, half, 0, half)
    gltf = {
        "asset": {"version": "2.0"},
        "nodes": [{"name": "cart", "children": [1], "scale": [2, 2, 2]}, {"name": "eye", "camera": 0, "translation": [0, 0.5, 0]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "animations": [
            {
                "name": "ride",
                "samplers": [{"input": 0, "output": 1, "interpolation": "LINEAR"}, {"input": 0, "output": 2, "interpolation": "STEP"}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}, {"sampler": 1, "target": {"node": 0, "path": "rotation"}}],
            }
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": 2, "min": [0.5], "max": [2.5]},
            {"bufferView": 1, "componentType": 5126, "type": "VEC3", "count": 2},
            {"bufferView": 2, "componentType": 5126, "type": "VEC4", "count": 2},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 8},
            {"buffer": 0, "byteOffset": 8, "byteLength": 24},
            {"buffer": 0, "byteOffset": 32, "byteLength": 32},
        ],
    }
    text("path", "p", gltf, times + moves + turns)
    binary("path", "p", gltf, times + moves + turns)


if __name__ == "__main__":
    sounds()
    places()
    solids()
    paths()
