"""A simulator written in Python, and what it leaves out: a heater that also radiates.

python python/examples/diagnose_a_simulator.py
"""

from __future__ import annotations

import numpy as np

import trueup


def heater(parameters, time, inputs):
    """Temperature [K above the room] of a heated block, over lanes: C dT/dt = P u - a T - r |T| T, from row to row by Euler's method."""
    now = parameters["initial temperature"].copy()
    extra = parameters.get("quadratic_drag.coefficient", np.zeros(len(now)))
    temperatures = np.empty((len(now), len(time)))
    steps = np.diff(time, append=time[-1])
    for row, (step, power) in enumerate(zip(steps, inputs["u"], strict=True)):
        temperatures[:, row] = now
        net = parameters["power"] * power - parameters["loss"] * now - extra * np.abs(now) * now
        now = now + step * net / parameters["capacity"]
    return {"temperature": temperatures}


def recorded(seed: int) -> trueup.Recording:
    """What the real block did: it loses heat by more than conduction."""
    rng = np.random.default_rng(seed)
    time = 0.5 * np.arange(1_000)
    power = rng.choice([0.0, 0.5, 1.0], size=40).repeat(25)
    truth = {"capacity": 46.0, "loss": 0.9, "power": 20.0, "initial temperature": 0.0, "quadratic_drag.coefficient": 0.03}
    lanes = {name: np.array([value]) for name, value in truth.items()}
    temperature = heater(lanes, time, {"u": power})["temperature"][0] + 0.02 * rng.normal(size=len(time))
    return trueup.Recording({"t": time, "u": power, "temperature": temperature}, name=f"block {seed}")


simulator = trueup.Simulator(
    heater,
    parameters={
        "capacity": trueup.Parameter(50.0, "J/K", uncertainty=0.2, lower=1.0),
        "loss": trueup.Parameter(1.0, "W/K", uncertainty=0.2, lower=0.0),
        "power": trueup.Parameter(20.0, "W", uncertainty=0.0),
    },
    channels={"temperature": "K"},
    inputs={"u": ""},
    initial={"initial temperature": trueup.Initial("temperature", unit="K")},
    # What the callable can do beyond what the simulator does today; nothing at 0.
    mechanisms={"quadratic_drag": {"coefficient": trueup.Parameter(0.0, "W/K^2", lower=0.0, upper=1.0, starts=[0.02])}},
    vectorized=True,
    name="heater",
)

if __name__ == "__main__":
    diagnosis = simulator.diagnose(recorded(1), recorded(2))
    print(diagnosis.summary)
    for name, value in diagnosis.trued.items():
        print(f"  {name:28} {value:8.4f} +- {diagnosis.trued_std[name]:.4f}")
