"""insonify: what would this sonar record, in this water, over this seabed, with these targets, and why?"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from insonify.kernel_cache import delete_stale_kernels

if TYPE_CHECKING:
    from insonify.comparison.compare import compare as compare
    from insonify.datasets.dataset import dataset as dataset
    from insonify.formats.instruments.open_instrument import open_instrument as open_instrument
    from insonify.formats.netcdf_file import read_netcdf as read_netcdf
    from insonify.formats.netcdf_file import write_netcdf as write_netcdf
    from insonify.formats.zarr_store import open_recording as open_recording
    from insonify.parameter_sweep import sweep as sweep
    from insonify.part import Part as Part
    from insonify.propagation.path_settings import PathSettings as PathSettings
    from insonify.real_time.live_sonar import live as live
    from insonify.recording_run import record as record
    from insonify.scenario.load import load_scenario as load_scenario
    from insonify.scenario.scenario import Scenario as Scenario
    from insonify.scenario.template import load_template as load_template
    from insonify.simulator import arrivals as arrivals
    from insonify.simulator import labels as labels
    from insonify.simulator import levels as levels
    from insonify.simulator import simulate as simulate
    from insonify.writers.export import export as export

delete_stale_kernels(Path(__file__).parent)  # before any of them can be loaded

# Numba and friends take a second to import: nothing is loaded before it is used.
_HOMES = {
    "compare": "insonify.comparison.compare",
    "dataset": "insonify.datasets.dataset",
    "load_scenario": "insonify.scenario.load",
    "load_template": "insonify.scenario.template",
    "Scenario": "insonify.scenario.scenario",
    "simulate": "insonify.simulator",
    "arrivals": "insonify.simulator",
    "labels": "insonify.simulator",
    "levels": "insonify.simulator",
    "record": "insonify.recording_run",
    "Part": "insonify.part",
    "sweep": "insonify.parameter_sweep",
    "PathSettings": "insonify.propagation.path_settings",
    "live": "insonify.real_time.live_sonar",
    "open_recording": "insonify.formats.zarr_store",
    "open_instrument": "insonify.formats.instruments.open_instrument",
    "read_netcdf": "insonify.formats.netcdf_file",
    "write_netcdf": "insonify.formats.netcdf_file",
    "export": "insonify.writers.export",
}
_PACKAGES = (
    "ocean", "scattering", "scene", "sonar", "records", "propagation", "processing", "formats", "plotting", "paper",
    "demos", "explanation", "estimates", "comparison", "surveys", "annotations", "datasets",
    "writers", "real_time",
)  # fmt: skip

__all__ = [
    "Part", "PathSettings", "Scenario", "arrivals", "compare", "dataset", "export", "labels", "levels", "live",
    "load_scenario", "load_template", "open_instrument", "open_recording", "read_netcdf", "record", "simulate", "sweep",
    "write_netcdf",
]  # fmt: skip


def __getattr__(name: str) -> object:
    """Load a public name, or a package, when it is first used."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name in _PACKAGES:
        return import_module(f"insonify.{name}")
    if name == "__version__":
        from importlib.metadata import version

        return version("insonify")
    raise AttributeError(f"module 'insonify' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Every public name, loaded or not."""
    return sorted([*__all__, *_PACKAGES, "__version__"])
