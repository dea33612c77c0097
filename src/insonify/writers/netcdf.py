"""NetCDF of the project's own schema, written ping by ping; `insonify.read_netcdf` reads it back bit by bit."""

from importlib.util import find_spec
from pathlib import Path

from insonify.formats.netcdf_file import write_netcdf as write_whole
from insonify.records.netcdf_recording import split_complex
from insonify.records.recording import FIELDS
from insonify.surveys.survey import Survey


def write_netcdf(survey: Survey, path: Path) -> None:
    """Write a recording as `insonify.write_netcdf` does, with one ping in memory where netCDF4 is installed.

    Args:
        survey: The recording; its unrecorded pings are left out.
        path: File to write.
    """
    recording = survey.recording.isel(ping=survey.rows)
    field = next((name for name in FIELDS if name in recording), None)
    if find_spec("netCDF4") is None or field is None:
        write_whole(recording, path)
        return
    import netCDF4

    write_whole(recording.drop_vars(field), path)
    first = split_complex(recording[[field]].isel(ping=[0]))
    with netCDF4.Dataset(path, "a") as file:
        for name, part in first.data_vars.items():
            stored = file.createVariable(
                str(name), part.dtype.newbyteorder("="), tuple(map(str, part.dims)), fill_value=float("nan"),
                compression="zlib", complevel=1, shuffle=True, chunksizes=part.shape,
            )  # fmt: skip
            stored.setncatts({str(key): value for key, value in part.attrs.items()})
        for row in range(recording.sizes["ping"]):
            for name, part in split_complex(recording[[field]].isel(ping=[row])).data_vars.items():
                file[str(name)][row] = part.values[0]


def netcdf_size(survey: Survey) -> tuple[float, str]:
    """Largest size of a netCDF file [bytes], and the reason for it."""
    recording = survey.recording
    sizes = [recording[name].nbytes / max(recording.sizes["ping"], 1) for name in FIELDS if name in recording]
    return survey.rows.size * sum(sizes), "it holds every sample in full precision"
