"""Neural posterior estimation by sbi alone, on this project's simulator and a shipped recording.

    python docs/examples/npe_with_sbi.py

It needs nothing of this project but the simulator, the prior and the recording. The exact posterior, which
``swesbi.infer`` gives in seconds, stands beside it.
"""

import sys

import numpy as np
import torch
from sbi.inference import NPE

import swesbi

SIMULATIONS = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000

torch.manual_seed(1)
recording = swesbi.read_recording("data/virtual_volunteers/swe/G.csv", from_prior=True)
prior = swesbi.torch_prior(recording.prior)

phi = prior.sample((SIMULATIONS,))
x = torch.as_tensor(np.log(recording.draw_speeds(phi.double().numpy(), seed=1)), dtype=torch.float32)
works = torch.isfinite(x).all(dim=1)

trainer = NPE(prior=prior)
trainer.append_simulations(phi[works], x[works])
trainer.train(max_num_epochs=50)
observed = torch.as_tensor(np.log(recording.speeds.speed_m_s), dtype=torch.float32)
by_network = trainer.build_posterior().sample((2000,), x=observed).numpy()

exact = swesbi.infer(recording).posterior
for column, name in enumerate(recording.names[:3]):
    rows = (by_network[:, column], exact[name].values.ravel())
    shown = ["{1:.1f} ({0:.1f} to {2:.1f})".format(*np.quantile(row, [0.05, 0.5, 0.95])) for row in rows]
    print(f"{name:12} by sbi {shown[0]:24} exact {shown[1]}")
