from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from pydantic import ValidationError

from swesbi.heart.model import activation_duration_s
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import NUISANCES, OF_THETA, PHI_NAMES, NuisanceSettings
from swesbi.prior import PriorSettings, draw_prior, quantile

KNOWN = tuple(parameter.name for parameter in NUISANCES)


def model_with(*names: str) -> SpeedModel:
    """Return the shipped model with these nuisance parameters alone free."""
    made = speed_case.model(prior="calibrated")
    theta = made.settings.prior.theta
    fixed = {name: None for name in KNOWN if name not in names}
    nuisances = theta.nuisances.model_copy(update=fixed)
    prior = made.settings.prior.model_copy(
        update={"theta": theta.model_copy(update={"nuisances": nuisances})}
    )
    forward_model = made.settings.forward_model.model_copy(
        update={"atrial_kick_pa": 600.0 if "atrial_delay_s" in names else 0.0}
    )
    settings = made.settings.model_copy(update={"prior": prior, "forward_model": forward_model})
    return replace(made, settings=settings)


def test_the_shipped_table_frees_all_and_the_prior_of_the_paper_none() -> None:
    prior = speed_case.settings("calibrated").prior
    assert prior.names == (*PHI_NAMES, *KNOWN)
    assert prior.nuisance_names == KNOWN
    assert speed_case.settings().prior.nuisance_names == ()


def test_at_the_settings_own_values_nothing_changes() -> None:
    fixed, free = speed_case.model(), speed_case.model(prior="calibrated")
    phi = draw_prior(fixed.settings.prior, 20, np.random.default_rng(2))
    forward = fixed.settings.forward_model
    own = {
        "arterial_time_constant_s": forward.distal_resistance_pa_s_m3 * forward.systemic_capacitance_m3_pa,
        "passive_wall_factor": 1.0,
        "stressed_volume_factor": 1.0,
        "passive_ratio": 1.0,
        "passive_middle_factor": 1.0,
        "speed_scale": 1.0,
    }
    values = [own[name] if name in own else getattr(forward, name) for name in KNOWN]
    joined = np.hstack([phi, np.tile(values, (len(phi), 1))])
    expected, found = fixed.predict(phi), free.predict(joined)
    np.testing.assert_allclose(found.log_speed, expected.log_speed, atol=1e-9)
    np.testing.assert_allclose(found.slope, expected.slope, atol=1e-7)


@pytest.mark.parametrize("name", KNOWN)
def test_each_moves_the_predicted_speeds(name: str) -> None:
    made = model_with(name)
    prior = made.settings.prior
    phi = np.repeat(speed_case.PHI[None], 2, axis=0)
    ends = quantile(np.array([[0.5] * 4 + [0.1], [0.5] * 4 + [0.9]]), prior)[:, 4:]
    predicted = made.predict(np.hstack([phi, ends]))
    # the arterial time constant acts on the speeds through afterload alone, and by little
    least = 1e-5 if name == "arterial_time_constant_s" else 2e-3
    assert np.abs(np.diff(predicted.log_speed, axis=0)).max() > least


def test_the_scale_of_the_speeds_is_a_scale() -> None:
    made = model_with("speed_scale")
    phi = np.hstack([np.tile(speed_case.PHI, (2, 1)), [[1.0], [1.1]]])
    predicted = made.predict(phi)
    np.testing.assert_allclose(np.diff(predicted.log_speed, axis=0), np.log(1.1), rtol=1e-12)
    np.testing.assert_array_equal(predicted.slope[0], predicted.slope[1])
    beats = made.simulate(phi)
    cycles = made.stiffness(phi, beats)
    np.testing.assert_allclose(cycles[1] / cycles[0], 1.21, rtol=1e-9)


def test_capacitance_follows_from_time_constant_and_resistance() -> None:
    made = model_with("distal_resistance_pa_s_m3", "arterial_time_constant_s")
    phi = np.hstack([np.tile(speed_case.PHI, (1, 1)), [[2.0e8, 1.4]]])
    physiology = made.settings.physiology(phi)
    assert physiology is not None
    np.testing.assert_allclose(physiology.systemic_capacitance_m3_pa, 0.7e-8)
    fixed = simulate(
        phi[:, OF_THETA],
        speed_case.CONTEXT,
        made.settings.forward_model.model_copy(
            update={"distal_resistance_pa_s_m3": 2.0e8, "systemic_capacitance_m3_pa": 0.7e-8}
        ),
    )
    np.testing.assert_allclose(made.simulate(phi).volume_ml, fixed.volume_ml, rtol=1e-6)


def test_the_drawn_duration_follows_heart_rate() -> None:
    made = model_with("activation_duration_s")
    phi = np.hstack([speed_case.PHI, 0.35])[None]
    forward = made.settings.forward_model.model_copy(update={"activation_duration_s": 0.35})
    expected = activation_duration_s(speed_case.CONTEXT.period_s, forward)
    np.testing.assert_allclose(made.activation_duration_s(phi), expected)


def test_a_value_in_another_unit_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"activation_onset_s: bounds 20 to 80 leave \[0, 0.3\].*unit"):
        NuisanceSettings.from_plain(
            {"activation_onset_s": {"centre": 40, "log_sd": 0.2, "low": 20, "high": 80}}
        )


def test_an_unknown_nuisance_parameter_is_refused() -> None:
    plain = speed_case.shipped().priors["paper"].to_plain()
    line = {"centre": 1.0, "log_sd": 0.1, "low": 0.5, "high": 2.0}
    with pytest.raises(ValidationError, match="viscosity"):
        PriorSettings.from_plain(plain | {"nuisances": {"viscosity": line}})
