"""Networks whose numbers do not make up the net that their file declares are refused when they are read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from swesbi.artefacts import DamagedArtefactError, Provenance
from swesbi.artefacts.files import LENGTH, append_checksum
from swesbi.networks.affine_maf import SingleArray
from swesbi.networks.files import NetworkFile
from swesbi.networks.flow.trained import SHIPPED_NETWORK, TrainedFlow
from swesbi.networks.paper.estimator import Checkpoints, SbiFlow, TrainedEstimator

Values = NDArray[Any]
Change = Callable[[Values], Values]
TRANSFORMS, UNITS, PARAMETERS, COMPONENTS = 2, 4, 3, 5


def estimator(epoch: int = 1) -> TrainedEstimator:
    """Return a net of ones."""

    def ones(*shape: int) -> SingleArray:
        return np.ones(shape, dtype=np.float32)

    net = SbiFlow(
        context=ones(TRANSFORMS, UNITS, COMPONENTS + 1),
        first=ones(TRANSFORMS, UNITS, PARAMETERS + 1),
        hidden=ones(TRANSFORMS, 1, UNITS, UNITS + 1),
        last=ones(TRANSFORMS, 2 * PARAMETERS, UNITS + 1),
        order=np.tile(np.arange(PARAMETERS), (TRANSFORMS, 1)),
        base=np.arange(PARAMETERS),
        theta_mean=np.zeros(PARAMETERS),
        theta_scale=np.ones(PARAMETERS),
        z_mean=np.zeros(COMPONENTS),
        z_scale=np.ones(COMPONENTS),
    )
    # a loss need not be finite
    return TrainedEstimator(net, tuple("abcde"), epoch, np.inf if epoch == 1 else 0.5, epoch > 1)


NETWORKS: dict[str, Callable[[], NetworkFile]] = {
    "estimator": estimator,
    "checkpoints": lambda: Checkpoints((estimator(1), estimator(2))),
    "flow": lambda: TrainedFlow.read(SHIPPED_NETWORK),
}


def first_is(value: float | str) -> Change:
    """Return what puts a value in the first place of an array."""

    def changed(values: Values) -> Values:
        values[(0,) * values.ndim] = value
        return values

    return changed


def without_last(values: Values) -> Values:
    return values[..., :-1]


def with_transforms(number: int) -> Change:
    """Return what declares so many transforms in the settings of a flow."""
    return lambda settings: np.array(
        json.dumps({**json.loads(settings.item()), "transforms": number}), dtype=object
    )


@pytest.mark.parametrize(
    ("kind", "name", "change", "message"),
    [
        ("estimator", "last", first_is(np.nan), "'last' holds numbers that are not finite"),
        ("estimator", "z_scale", first_is(np.inf), "'z_scale' holds numbers that are not finite"),
        (
            "estimator",
            "context",
            without_last,
            r"'context' has the shape \(2, 4, 5\), its net takes \(2, 4, 6",
        ),
        ("estimator", "theta_mean", without_last, "values along 'parameter', others have"),
        ("estimator", "order", first_is(2), "'order' does not name each of 3 parameters once"),
        ("checkpoints", "hidden", first_is(np.nan), "'hidden' holds numbers that are not finite"),
        ("checkpoints", "first", without_last, "'first' has the shape"),
        ("checkpoints", "base", first_is(1), "'base' does not name each of 3 parameters once"),
        ("flow", "weight", first_is(np.inf), "'weight' holds numbers that are not finite"),
        ("flow", "eta_scale", first_is(np.nan), "'eta_scale' holds numbers that are not finite"),
        ("flow", "weight", without_last, r"describe a net of \d+ weights, it holds \d+"),
        ("flow", "architecture", with_transforms(9), r"describe a net of \d+ weights, it holds \d+"),
        (
            "flow",
            "architecture",
            with_transforms(10**12),
            r"describe a net of \d+ layers, it holds \d+ weights",
        ),
        ("flow", "component", first_is("other"), "'component' names .'other'"),
    ],
)
def test_a_network_that_is_not_what_its_file_declares_is_refused(
    tmp_path: Path, kind: str, name: str, change: Change, message: str
) -> None:
    """Changed as other software would, with a right checksum again."""
    path, network = tmp_path / f"{kind}.h5", NETWORKS[kind]()
    network.write(path, Provenance(""))
    type(network).read(path)
    path.write_bytes(path.read_bytes()[:-LENGTH])
    with h5py.File(path, "a") as file:
        replace(file, name, change(np.asarray(file[name][()])))
    append_checksum(path)
    with pytest.raises(DamagedArtefactError, match=rf"{kind}\.h5: .*{message}.*; delete it and rerun: rm -f"):
        type(network).read(path)


def replace(file: h5py.File, name: str, values: Values) -> None:
    """Put other values in the place of a dataset, along the same dimensions."""
    if values.shape == file[name].shape:
        file[name][...] = values
        return
    scales = [dimension[0] for dimension in file[name].dims]
    units = file[name].attrs["units"]
    del file[name]
    made = file.create_dataset(name, data=values)
    made.attrs["units"] = units
    for dimension, scale in zip(made.dims, scales, strict=True):
        dimension.attach_scale(scale)
