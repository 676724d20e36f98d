"""What other programs use of this project: a beat, a recording, its likelihood, a prior, a posterior.

``import swesbi`` offers these names. Each is loaded when it is first asked for, so that a job without torch
loads none. Arrays of parameters have a row a draw, in the order of ``Recording.names``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from pydantic import ValidationError
from threadpoolctl import threadpool_limits

from swesbi.answers.answer import answered
from swesbi.answers.files import RecordingRequest
from swesbi.answers.recording import Folder, observe
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.base.environment import missing
from swesbi.config.cohort import Cohort
from swesbi.config.read import found_configuration, parse_config, read_merged
from swesbi.config.study import Study, load_study
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import simulate
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording
from swesbi.parameters import PHI, REPORTED, ParameterPrior
from swesbi.persons.cohort.model import PriorAlone
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.settings import asking
from swesbi.prior import BoxPrior, SomeParameters
from swesbi.recording.cohort.recording_file import IN_MEMORY, described_in_memory
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.settings import ContextRow
from swesbi.recording.tables.files import table_of_arrays, table_of_frame
from swesbi.recording.tables.layout import SPEED
from swesbi.recording.tables.table import Table
from swesbi.seeds import generator
from swesbi.study.answerer import Answerer, experiments_to_ask
from swesbi.study.infer import folder_of, subjects_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from swesbi.networks.torch_prior import TruncatedLogNormal

EXPERIMENT: Final = "calibrated"
"""Whose heart and criteria are meant where no recording says otherwise."""
SAMPLING: Final = ("converged", "sampler", "k_hat", "efficiency")
"""What is said of the draws of every posterior."""
UNITS: Final = {parameter.name: parameter.cf_unit for parameter in (*PHI, *REPORTED)}
BEAT_UNITS: Final = {
    "active_stiffness_kpa": "kPa",
    "stretch": "1",
    "volume_ml": "mL",
    "ventricular_pressure_mmhg": "mmHg",
    "arterial_pressure_mmhg": "mmHg",
    "aortic_flow_ml_s": "mL s-1",
    "mitral_flow_ml_s": "mL s-1",
}


def simulate_beat(theta: FloatArray, context: Context) -> xr.Dataset:
    """Simulate the periodic beat of a heart, all but theta as ``forward_model`` of the configuration has it.

    :meth:`Recording.predict` takes all parameters that are inferred, and returns the speeds of a recording.

    >>> import swesbi
    >>> heart = swesbi.Context("X", "F", 30.0, 1.7, 64.0, 90.0, 34.0, 0.8)
    >>> beat = swesbi.simulate_beat([[55.0, 6.0, 28.0]], heart)
    >>> float(beat.active_stiffness_kpa.max()) > 5.0
    True

    Args:
        theta: k_0 in kPa, k_ATP and k_SR in 1/s; shape (n, 3).
        context: Whose heart it is.

    Returns:
        Curves with the dimensions draw and phase, from the R peak on; NaN where no beat becomes periodic.

    Raises:
        ValueError: A value lies outside the range in which the model is declared.
    """
    import xarray as xr

    config = parse_config(read_merged(found_configuration(None)))
    rows = np.atleast_2d(np.asarray(theta, dtype=np.float64))
    beats = simulate(rows, context, config.forward_model)
    curves = {
        name: (("draw", "phase"), getattr(beats, name), {"units": unit}) for name, unit in BEAT_UNITS.items()
    }
    periodic = ("draw", beats.status == Status.PERIODIC)
    phase = ("phase", beats.cycle_phase, {"units": "1"})
    return xr.Dataset({**curves, "periodic": periodic}, {"phase": phase}, {"period_s": context.period_s})


@dataclass(frozen=True)
class Recording:
    """A recording under the model, with all that an inference needs; :func:`read_recording` makes one.

    Attributes:
        request: The recording, what answers it, and its settings.
    """

    request: RecordingRequest

    @property
    def names(self) -> tuple[str, ...]:
        """Of the d parameters: those that are reported, nuisance parameters behind them."""
        return self.request.recording.model.settings.prior.names

    @property
    def prior(self) -> BoxPrior:
        """The prior of the parameters."""
        return self.request.recording.model.settings.prior

    @property
    def speeds(self) -> SpeedRecording:
        """The heart's context, and p phases with their speeds in m/s and relative errors; (p,) each."""
        return self.request.recording.model.recording

    def predict(self, phi: FloatArray) -> PredictedSpeeds:
        """Return noiseless log speeds of phi (n, d) and their slopes over the cycle; (n, p) each."""
        return self.request.recording.model.predict(phi)

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(speeds | phi) of phi (n, d); -inf where a simulation fails; shape (n,)."""
        return self.request.recording.model.log_likelihood(phi)

    def log_density(self, log_speed: FloatArray, slope: FloatArray) -> FloatArray:
        """Return log p(speeds) where another model predicts log speeds and their slopes (n, p); (n,)."""
        return self.request.recording.model.log_likelihood_of(PredictedSpeeds(log_speed, slope))

    def draw_speeds(self, phi: FloatArray, seed: int) -> FloatArray:
        """Draw the speeds in m/s of a new recording of each phi (n, d); NaN where it fails; (n, p)."""
        rng = generator(seed, "new speeds", self.speeds.context.subject)
        return self.request.recording.model.draw_speeds(self.predict(phi), rng)


def read_recording(path: str | Path, subject: str = "", *, from_prior: bool = False) -> Recording:
    """Read a recording with the noise of its folder, as ``swesbi infer`` does.

    >>> import swesbi
    >>> recording = swesbi.read_recording("data/virtual_volunteers/swe/G.csv", from_prior=True)
    >>> recording.speeds.speed_m_s.shape
    (20,)

    Args:
        path: ``FOLDER/swe/SUBJECT.csv``, or FOLDER with ``subjects.csv`` and ``recording.yaml``.
        subject: One of the folder, or of its table of several; empty where the path says which.
        from_prior: Whether no network is asked, though a study of this folder has one.

    Raises:
        ConfigError: The folder does not have the subject, the file is another's, or the configuration is
            wrong.
        ValueError: The recording cannot be used; the message says where, and what to do.
    """
    paths = [Path(path)]
    study = load_study(read_merged(found_configuration(None)), new_cohort=folder_of(paths))
    named = subjects_of(study, paths, subject or None)
    answerer = Answerer(study, experiments_to_ask(study, None), "", from_prior)
    return Recording(answerer.request(named[0] if len(named) == 1 else ""))


def recording_from_table(
    table: pd.DataFrame, context: Context, *, from_prior: bool = False, **described: object
) -> Recording:
    """Take a recording from a table in memory, as strictly as from a file: one row a sample or a push.

    >>> import pandas, swesbi
    >>> table = pandas.read_csv("data/virtual_push_trains/swe/G.csv")
    >>> heart = swesbi.Context("G", "F", 25.0, 1.7, 61.0, 90.0, 34.0, 0.76)
    >>> noise = {"cv_fraction": 0.1, "cv_log_sd": 0.3}
    >>> swesbi.recording_from_table(table, heart, noise=noise).speeds.speed_m_s.shape
    (34,)

    Args:
        table: In the columns of ``docs/own-data.md``, or others that ``columns`` names.
        context: Whose heart it is.
        from_prior: Whether no network is asked.
        described: Keys of ``recording.yaml``: ``columns``, ``units``, ``table``, ``protocol``, ``noise``.

    Raises:
        ValueError: The table or what is said of it cannot be used; the message says where, and what to do.
    """
    return _in_memory(table_of_frame(table, IN_MEMORY), context, described, from_prior)


def recording_from_arrays(
    time_ms: FloatArray,
    speed_m_s: FloatArray,
    *,
    rr_ms: FloatArray,
    context: Context,
    beat: IntArray | None = None,
    se_m_s: FloatArray | None = None,
    fit_r2: FloatArray | None = None,
    from_prior: bool = False,
    **described: object,
) -> Recording:
    """Take a free-running recording from arrays in memory: p pushes, NaN where a speed could not be told.

    >>> import numpy as np, swesbi
    >>> heart = swesbi.Context("X", "F", 30.0, 1.7, 64.0, 90.0, 34.0, 0.8)
    >>> time = np.linspace(120.0, 900.0, 9)
    >>> speed = np.array([1.9, 3.1, 3.8, 3.6, 2.4, 1.6, 1.4, 1.3, 1.5])
    >>> given = {"rr_ms": np.full(9, 940.0), "se_m_s": 0.1 * speed, "context": heart}
    >>> swesbi.recording_from_arrays(time, speed, **given).speeds.phase.round(2)[:3]
    array([0.13, 0.23, 0.34])

    Args:
        time_ms: Times since the R peak of each push's own beat; shape (p,).
        speed_m_s: Shear-wave speeds; shape (p,).
        rr_ms: RR intervals of the beats; shape (p,).
        context: Whose heart it is.
        beat: Number of the beat; shape (p,).
        se_m_s: Standard errors of the speeds; shape (p,). Without them ``noise`` says how large they are.
        fit_r2: R2 of the wave fits; shape (p,).
        from_prior: Whether no network is asked.
        described: Keys of ``recording.yaml``, as of :func:`recording_from_table`.

    Raises:
        ValueError: As of :func:`recording_from_table`, or arrays differ in length.
    """
    arrays = {
        "time_ms": time_ms,
        "rr_ms": rr_ms,
        "beat": beat,
        SPEED: speed_m_s,
        "se_m_s": se_m_s,
        "fit_r2": fit_r2,
    }
    return _in_memory(table_of_arrays(arrays, IN_MEMORY), context, described, from_prior)


def _in_memory(
    table: Table, context: Context, described: Mapping[str, object], from_prior: bool
) -> Recording:
    config = parse_config(read_merged(found_configuration(None)))
    name = context.subject
    try:
        row = ContextRow.from_plain(asdict(context))
    except ValidationError as error:
        wrong = error.errors()[0]
        reason = ": ".join([*map(str, wrong["loc"]), wrong["msg"].removeprefix("Value error, ")])
        raise RecordingError(Problem(f"the context of {name}", reason, "check its unit")) from None
    said = described_in_memory(described, config.recording)
    study = Study(config, outside=Cohort(rows={name: row}, described={name: said}))
    folder = Folder(study, {name: observe(study, name, table)})
    answerer = Answerer(study, experiments_to_ask(study, None), "", from_prior, in_memory=folder)
    return Recording(answerer.request(name))


def infer(
    recording: Recording | str | Path, seed: int | None = None, out: str | Path | None = None
) -> xr.DataTree:
    """Return the exact posterior of a recording, with its verdict.

    >>> import swesbi
    >>> found = swesbi.infer("data/virtual_volunteers/swe/G.csv")
    >>> found.attrs["status"]
    'not contradicted'
    >>> 40.0 < float(found.posterior.k0_kpa.median()) < 80.0
    True

    Args:
        recording: The path of one, as :func:`read_recording` takes it, or a recording of that function,
            of :func:`recording_from_table` or :func:`recording_from_arrays`.
        seed: Of all draws; None: that of the configuration.
        out: Folder for what the command ``swesbi infer`` writes, the sheet among it; None: writes nothing.

    Returns:
        Groups ``posterior`` and ``prior``, with all that an answer reports beside the parameters, and
        ``observed_data``. ``attrs`` has ``status`` and ``sentence`` of the verdict, and the sampling check of
        the draws: ``converged``, ``sampler``, ``k_hat``, ``efficiency``.

    Raises:
        NoLikelihoodError: Every simulation of the first round fails.
        TypeError: It is neither a path nor a recording.
        ValueError: The recording cannot be used, the network takes no such one, or ``out`` holds the answer
            to another.
    """
    if isinstance(recording, str | Path):
        recording = read_recording(recording)
    if not isinstance(recording, Recording):
        raise TypeError(f"infer takes a path or a recording, not {type(recording).__name__}")
    request, speeds = recording.request, recording.speeds
    if seed is not None:
        request = replace(request, made=replace(request.made, seed=seed))
    with threadpool_limits(limits=1, user_api="blas"):  # sums split over threads differ in the last bits
        if out is None:
            answer = answered(request.recording, request.knowledge, request.settings, request.made.seed)
        else:
            answer, _ = request.answer_into(Path(out))
    exact, verdict = answer.posterior, answer.verdict
    return _answer_tree(
        {
            "posterior": {**answer.reported, **dict(zip(recording.names, exact.phi.T, strict=True))},
            "prior": {**answer.prior.reported, **dict(zip(recording.names, answer.prior.phi.T, strict=True))},
        },
        {"speed_m_s": ("phase", speeds.speed_m_s), "relative_se": ("phase", speeds.relative_se)},
        {"phase": speeds.phase},
        {"subject": speeds.context.subject, "status": str(verdict.status), "sentence": verdict.sentence}
        | {name: getattr(exact, name) for name in SAMPLING},
    )


def torch_prior(prior: BoxPrior, device: str = "cpu") -> TruncatedLogNormal:
    """Return a prior as a torch distribution on ``device``, as sbi expects one.

    >>> import swesbi
    >>> recording = swesbi.read_recording("data/virtual_volunteers/swe/G.csv", from_prior=True)
    >>> swesbi.torch_prior(recording.prior).sample((5,)).shape == (5, len(recording.names))
    True

    Raises:
        ModuleNotFoundError: torch is not installed; the message names the extra that brings it.
    """
    try:
        from swesbi.networks.torch_prior import torch_prior as of_torch
    except ModuleNotFoundError as error:
        raise missing(error) from None
    return of_torch(prior, device)


def sample_posterior(
    log_likelihood: Callable[[FloatArray], FloatArray],
    prior: Mapping[str, ParameterPrior],
    seed: int,
    effective_draws: int = 2000,
) -> xr.DataTree:
    """Sample the posterior of any model by adaptive importance sampling, and by MCMC where weights fail.

    >>> import numpy as np, swesbi
    >>> rate = {"rate": swesbi.ParameterPrior(centre=5.0, log_sd=1.0, low=0.1, high=100.0)}
    >>> found = swesbi.sample_posterior(lambda phi: -0.5 * ((phi[:, 0] - 7.0) / 0.1) ** 2, rate, seed=1)
    >>> abs(float(found.posterior.rate.mean()) - 7.0) < 0.02
    True

    Args:
        log_likelihood: Of parameters (n, d), each within its bounds; shape (n,), -inf where a model fails.
        prior: Of each parameter, by name, in order.
        seed: Of all draws.
        effective_draws: That are asked for.

    Returns:
        The group ``posterior``, and ``attrs`` with the check of the draws. No verdict comes with it:
        whether the model could have made the data is not tested.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of the first round.
    """
    config = parse_config(read_merged(found_configuration(None)))
    settings = asking(config.speed_experiments[EXPERIMENT].exact, effective_draws)
    model = _OwnModel(PriorAlone(SomeParameters(tuple(prior.values()))), log_likelihood)
    exact, _ = exact_posterior(model, None, settings, seed, "own model")
    drawn = dict(zip(prior, exact.phi.T, strict=True))
    return _answer_tree({"posterior": drawn}, {}, {}, {name: getattr(exact, name) for name in SAMPLING})


@dataclass(frozen=True)
class _OwnModel:
    settings: PriorAlone
    log_likelihood: Callable[[FloatArray], FloatArray]


def _answer_tree(
    drawn: Mapping[str, Mapping[str, FloatArray]],
    observed: Mapping[str, tuple[str, FloatArray]],
    coordinates: Mapping[str, FloatArray],
    attributes: Mapping[str, object],
) -> xr.DataTree:
    """Return groups of draws, in one chain, and what was observed, with units."""
    import xarray as xr

    groups = {
        group: xr.Dataset(
            {
                name: (("chain", "draw"), values[None], {"units": UNITS.get(name, "")})
                for name, values in columns.items()
            }
        )
        for group, columns in drawn.items()
    }
    if observed:
        groups["observed_data"] = xr.Dataset(dict(observed), dict(coordinates))
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=dict(attributes)), **groups})
