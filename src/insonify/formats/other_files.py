"""Files of other programs, by suffix: their kind, and programs that read them."""

from pathlib import Path

PROGRAMS = {
    (".nc", ".nc4"): ("a netCDF file", "insonify.read_netcdf, xarray or ncdump -h"),
    (".h5", ".hdf5"): ("an HDF5 file", "h5py, h5dump or HDFView"),
    (".mcap",): ("a bag of ROS 2", "ros2 bag info, Foxglove or the Python package rosbags"),
    (".tif", ".tiff"): ("a GeoTIFF", "QGIS, gdalinfo or rasterio"),
    (".geojson", ".json"): ("a GeoJSON or JSON file", "QGIS or geopandas"),
    (".csv",): ("a table", "a spreadsheet, pandas or QGIS"),
    (".png", ".pdf", ".svg"): ("a picture", "an image viewer"),
}
"""Kind of the files of some suffixes, and programs that read them."""


def programs_advice(path: str | Path) -> str | None:
    """Message for a file that a program other than insonify reads; None for other suffixes."""
    suffix = Path(path).suffix.lower()
    for suffixes, (kind, programs) in PROGRAMS.items():
        if suffix in suffixes:
            return (f"{path} is {kind}, which is not read as a recording. Read it with {programs}; give insonify "
                    "the folder of the run, such as harbour.zarr")  # fmt: skip
    return None
