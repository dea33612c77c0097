"""Two kinds of fingerprint of a scene's output: exact on one kind of processor, and close on any.

Compiled arithmetic may contract and reassociate differently from processor to processor, so a digest of the bits holds
only where the compiler receives the same instruction set and versions. A few projections of the numbers hold
everywhere.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path

import llvmlite
import llvmlite.binding as llvm
import numba
import numpy as np
import scipy

STORE = Path(__file__).with_name("golden.json")
PROJECTIONS = 4


def processor() -> str:
    """Name of what decides the bits: processor, its features, versions and settings of the numerical libraries."""
    features = hashlib.sha256(llvm.get_host_cpu_features().flatten().encode()).hexdigest()[:8]
    versions = " ".join(f"{one.__name__} {one.__version__}" for one in (llvmlite, numba, np, scipy))
    core = os.environ.get("OPENBLAS_CORETYPE")  # which decides the order of sums in products of matrices
    return f"{llvm.get_host_cpu_name()} {features}; {versions}" + (f"; {core} products" if core else "")


def digest(output: Mapping[str, np.ndarray]) -> str:
    """SHA-256 of names, shapes, types and bits of some arrays."""
    whole = hashlib.sha256()
    for name, array in sorted(output.items()):
        whole.update(f"{name} {array.shape} {array.dtype}".encode())
        whole.update(np.ascontiguousarray(array).tobytes())
    return whole.hexdigest()


def projections(output: Mapping[str, np.ndarray]) -> dict[str, list[float]]:
    """Size, finite count, root mean square and a few random projections of each array over its root mean square."""
    found: dict[str, list[float]] = {}
    for name, array in sorted(output.items()):
        flat = np.ravel(array)
        values = np.concatenate([flat.real, flat.imag]) if np.iscomplexobj(flat) else flat
        finite = np.isfinite(values)
        values = np.where(finite, values, 0).astype(float)
        rms = float(np.sqrt(np.mean(values**2))) if values.size else 0.0
        weights = np.random.default_rng(1).standard_normal((PROJECTIONS, values.size)) / np.sqrt(max(values.size, 1))
        found[name] = [float(values.size), float(finite.sum()), rms, *(weights @ values / (rms or 1.0)).tolist()]
    return found


def stored() -> dict[str, dict]:
    """Fingerprints on file: by scene `projections`, and `digests` by processor."""
    return json.loads(STORE.read_text()) if STORE.is_file() else {}
