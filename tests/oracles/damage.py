"""Small valid files of every kind that is read, and damaged copies of them: cut short, flipped, spliced, lying."""

import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

NORTH, EAST = 6.0 * np.arange(12.0), 5.0 * np.arange(9.0)
DEPTH = 20 + 0.1 * np.arange(12.0)[:, None] + 0.05 * np.arange(9.0) ** 2
NUMBERS = (b"0", b"-1", b"1", b"255", b"65536", b"4294967295", b"99999999999999999999", b"1e308", b"nan", b"inf", b"")
"""What a number in a text is replaced by."""
LIES = (0, 1, 255, 256, 65535, 2**31 - 1, 2**32 - 1, 2**31, 10**9)
"""What four bytes of a header are replaced by."""


def npz(path: Path) -> None:
    """A grid in a NumPy archive."""
    np.savez_compressed(path, depth=DEPTH, north=NORTH, east=EAST)


def plain_npz(path: Path) -> None:
    """A grid in a NumPy archive whose members are not compressed."""
    np.savez(path, depth=DEPTH.astype("f4"), north=NORTH, east=EAST)


def tif(path: Path) -> None:
    """A grid in a GeoTIFF."""
    import rasterio
    from rasterio.transform import from_origin

    about = {"driver": "GTiff", "height": 12, "width": 9, "count": 1, "dtype": "float32", "nodata": -9999.0}
    about |= {"crs": "EPSG:32632", "transform": from_origin(5e5, 6e6, 5.0, 6.0), "compress": "deflate"}
    with rasterio.open(path, "w", **about) as file:
        file.write(-DEPTH[::-1].astype("f4"), 1)


def bag(path: Path) -> None:
    """A grid in a Bathymetric Attributed Grid."""
    import rasterio
    from rasterio.transform import from_origin

    about = {"driver": "BAG", "height": 12, "width": 9, "count": 2, "dtype": "float32"}
    about |= {"crs": "EPSG:32632", "transform": from_origin(5e5, 6e6, 5.0, 6.0)}
    with rasterio.open(path, "w", **about) as file:
        file.write(np.stack([-DEPTH[::-1], 0 * DEPTH]).astype("f4"))


def _netcdf(path: Path, layout: str) -> None:
    import netCDF4

    with netCDF4.Dataset(path, "w", format=layout) as file:
        for name, values in (("north", NORTH), ("east", EAST)):
            file.createDimension(name, values.size)
            file.createVariable(name, "f8", (name,))[:] = values
            file[name].units = "m"
        file.createVariable("depth", "f4", ("north", "east"))[:] = DEPTH
        file["depth"].positive = "down"


def nc(path: Path) -> None:
    """A grid in a netCDF file of version 4, which is HDF5."""
    _netcdf(path, "NETCDF4")


def nc3(path: Path) -> None:
    """A grid in a classic netCDF file."""
    _netcdf(path, "NETCDF3_CLASSIC")


def _mesh(path: Path, kind: str, **more: object) -> None:
    import trimesh

    path.write_bytes(_bytes(trimesh.creation.icosphere(subdivisions=1, radius=0.5).export(file_type=kind, **more)))


def _bytes(written: bytes | str) -> bytes:
    return written.encode() if isinstance(written, str) else written


def stl(path: Path) -> None:
    """A mesh as binary STL."""
    _mesh(path, "stl")


def text_stl(path: Path) -> None:
    """A mesh as STL in text."""
    _mesh(path, "stl_ascii")


def obj(path: Path) -> None:
    """A mesh as OBJ."""
    _mesh(path, "obj")


def ply(path: Path) -> None:
    """A mesh as binary PLY."""
    _mesh(path, "ply")


def text_ply(path: Path) -> None:
    """A mesh as PLY in text."""
    _mesh(path, "ply", encoding="ascii")


def glb(path: Path) -> None:
    """A mesh as binary glTF."""
    _mesh(path, "glb")


def cast(path: Path) -> None:
    """A sound-speed profile."""
    path.write_text("# a cast\ndepth [m], temperature, salinity\nm, degC, psu\n" + "".join(
        f"{d},{12 - 0.1 * d:.2f},{34 + 0.01 * d:.2f}\n" for d in range(0, 30, 2)))  # fmt: skip


def log(path: Path) -> None:
    """A navigation log."""
    rows = [f"2026-05-04T12:30:{s:02d}.25,{54 + 1e-5 * s:.6f},10.1,{5 + 0.1 * s:.1f},{s},0.5" for s in range(20)]
    path.write_text("\n".join(["time,latitude,longitude,depth,heading [deg],roll [deg]", *rows, ""]))


def strengths(path: Path) -> None:
    """A measured scattering law."""
    path.write_text("grazing_deg, strength_db\n" + "".join(f"{d},{-40 + d / 4}\n" for d in range(2, 90, 6)))


GRIDS: dict[str, Callable[[Path], None]] = {"a.npz": npz, "b.npz": plain_npz, "c.tif": tif, "d.bag": bag, "e.nc": nc,
                                            "f.nc": nc3}  # fmt: skip
MESHES: dict[str, Callable[[Path], None]] = {"a.stl": stl, "b.stl": text_stl, "c.obj": obj, "d.ply": ply,
                                             "e.ply": text_ply, "f.glb": glb}  # fmt: skip
TABLES: dict[str, Callable[[Path], None]] = {"cast.csv": cast, "log.csv": log, "strengths.csv": strengths}


def damaged(good: bytes, other: bytes, random: np.random.Generator) -> tuple[str, bytes]:
    """A damaged copy of a file, and how it was damaged.

    Args:
        good: The file.
        other: Another file, of which parts are spliced in.
        random: Draws the damage.
    """
    way = ("cut", "flip", "splice", "lie", "number", "zeros", "double")[random.integers(7)]
    data = bytearray(good)
    place, length = int(random.integers(len(data))), int(2 ** random.uniform(0, 7))
    if way == "cut":
        del data[place:]
    elif way == "flip":
        for spot in random.integers(0, len(data), random.integers(1, 20)):
            data[spot] ^= 1 << int(random.integers(8))
    elif way == "splice":
        start = int(random.integers(len(other)))
        data[place : place + length] = other[start : start + length]
    elif way == "lie":
        head = min(len(data) - 4, int(2 ** random.uniform(2, 12)))
        spot = int(random.integers(max(head, 1)))
        data[spot : spot + 4] = struct.pack(random.choice(["<I", ">I"]), int(random.choice(LIES)))
    elif way == "number":
        digits = [i for i in range(len(data)) if chr(data[i]).isdigit()]
        spot = int(random.choice(digits)) if digits else place
        data[spot : spot + 1] = NUMBERS[random.integers(len(NUMBERS))]
    elif way == "zeros":
        data[place : place + length] = bytes(len(data[place : place + length]))
    else:
        data[place:place] = data[place : place + length] * 3
    return way, bytes(data)


def lying_npz(path: Path, shape: tuple[int, ...], *, dtype: str = "<f8") -> None:
    """A NumPy archive of a few bytes whose header claims a shape."""
    about = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    about += b" " * (63 - (len(about) + 10) % 64) + b"\n"
    head = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(about)) + about
    axis = np.lib.format
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("depth.npy", head + bytes(64))
        for name, values in (("north", NORTH), ("east", EAST)):
            with file.open(f"{name}.npy", "w") as member:
                axis.write_array(member, values)


def npz_bomb(path: Path, side: int) -> None:
    """A small NumPy archive that unpacks to a square of zeros, `side` cells a side."""
    about = f"{{'descr': '|u1', 'fortran_order': False, 'shape': ({side}, {side}), }}".encode()
    about += b" " * (63 - (len(about) + 10) % 64) + b"\n"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        with file.open("depth.npy", "w", force_zip64=True) as member:
            member.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(about)) + about)
            for _ in range(side):
                member.write(bytes(side))
        for name in ("north", "east"):
            with file.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.arange(float(side)))


def huge_nc(path: Path, side: int) -> None:
    """A netCDF file of a few kilobytes that claims a grid with `side` cells a side."""
    import netCDF4

    with netCDF4.Dataset(path, "w") as file:
        for name in ("north", "east"):
            file.createDimension(name, side)
            file.createVariable(name, "f8", (name,), zlib=True, chunksizes=(1024,))
        file.createVariable("depth", "f4", ("north", "east"), zlib=True, chunksizes=(256, 256))


def huge_tif(path: Path, side: int) -> None:
    """A GeoTIFF of a few kilobytes that claims a raster with `side` cells a side."""
    import rasterio
    from rasterio.transform import from_origin

    about = {"driver": "GTiff", "height": side, "width": side, "count": 1, "dtype": "float32", "SPARSE_OK": True}
    about |= {"crs": "EPSG:32632", "transform": from_origin(5e5, 6e6, 5.0, 6.0), "tiled": True, "bigtiff": "yes"}
    with rasterio.open(path, "w", **about, blockxsize=4096, blockysize=4096):
        pass


def lying_glb(path: Path, count: int) -> None:
    """A glTF file of some hundred bytes that claims a number of vertices which it does not hold."""
    import json

    tree = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "accessors": [{"componentType": 5126, "count": count, "type": "VEC3"},
                          {"componentType": 5125, "count": 3 * (count // 3), "type": "SCALAR"}]}  # fmt: skip
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text))
    path.write_bytes(head + struct.pack("<I4s", len(text), b"JSON") + text)


def lying_ply(path: Path, count: int, *, text: bool) -> None:
    """A PLY file of some hundred bytes whose header claims a number of vertices and faces."""
    head = f"ply\nformat {'ascii' if text else 'binary_little_endian'} 1.0\nelement vertex {count}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + (b"0 0 0\n" * 3 if text else bytes(40)))
