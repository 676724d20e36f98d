"""A model of a recording that keeps its last prediction, so that no draw is simulated twice."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from swesbi.speed_model.likelihood import log_likelihood
from swesbi.speed_model.model import SpeedModel, SpeedModelSettings
from swesbi.speed_model.prediction import PredictedSpeeds

FloatArray = NDArray[np.float64]


@dataclass
class RememberingModel:
    """The model of a recording, with the prediction for the array of draws that it saw last."""

    model: SpeedModel
    _last: tuple[FloatArray, PredictedSpeeds] | None = field(default=None, init=False)

    @property
    def settings(self) -> SpeedModelSettings:
        """The settings of the model, its prior among them."""
        return self.model.settings

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(speeds | phi) of shape (n,); -inf where the simulation failed."""
        predicted = self.model.predict(phi)
        self._last = (phi, predicted)
        return log_likelihood(predicted, self.model.recording, self.model.settings.discrepancy)

    def predict(self, phi: FloatArray) -> PredictedSpeeds:
        """Return the noiseless log speeds of phi (n, 4), remembered if it is the very array seen last."""
        if self._last is not None and self._last[0] is phi:
            return self._last[1]
        return self.model.predict(phi)
